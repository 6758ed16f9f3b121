#!/usr/bin/env bash
# packaging/slim_pybullet.sh FOLDER...: of PyBullet's 300 MB in a folder nothing here reads its robots and learning
# environments, nor the symbols for its debugger.
set -eo pipefail
for folder in "$@"; do
  rm -rf "$folder"/pybullet_{data,envs,examples,robots,utils}
  for library in "$folder"/pybullet.*.so; do
    if [ -f "$library" ] && command -v strip >/dev/null; then strip --strip-unneeded "$library"; fi
  done
done
