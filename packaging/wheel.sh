#!/usr/bin/env bash
# packaging/wheel.sh PYTHON WHEEL FOLDER: puts what we need of PyBullet's wheel into FOLDER, and its checksum into SHA256SUMS there.
# The python has the package wheel. ./dev.sh wheel calls it.
set -eo pipefail
python=$1 wheel=$2 folder=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$python" -m wheel unpack -d "$scratch" "$wheel" >&2
packaging/slim_pybullet.sh "$scratch"/pybullet-*
mkdir -p "$folder"
"$python" -m wheel pack -d "$folder" "$scratch"/pybullet-* >&2
cd "$folder"
sha256sum -- *.whl >SHA256SUMS
cat SHA256SUMS
