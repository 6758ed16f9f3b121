#!/usr/bin/env bash
# packaging/pybullet.sh PYTHON VERSION WHEELS: compiles PyBullet, of which there is no wheel for Python 3.12 and later,
# into a wheel in the folder WHEELS. ./dev.sh calls it, one at a time.
set -eo pipefail
python=$1 version=$2 wheels=$3
MINUTES=5 # on one idle core
FILES=267
ENOUGH=5 # files, to estimate how long the others take
MEGABYTES=500 # of memory for each compiler

# One compiler for each core, as far as there is memory for them, here and in a container's limit.
memory=$({ cat /proc/meminfo /sys/fs/cgroup/memory.max 2>/dev/null || true; } |
  awk '/^MemAvailable/ { most = $2 / 1024 } /^[0-9]+$/ && $1 / 2 ^ 20 < most { most = $1 / 2 ^ 20 } END { print int(most) }')
jobs=$((memory / MEGABYTES))
if [ "$jobs" -gt "$(nproc)" ]; then jobs=$(nproc); fi
if [ "$jobs" -lt 1 ]; then jobs=1; fi
printf '\033[1m[dev.sh]\033[0m compiling PyBullet once, since PyPI has no wheel for %s: about %d minutes on an idle machine\n' \
  "$("$python" --version)" $((MINUTES / jobs + 1)) >&2

# 735 MB, which a /tmp in memory may not have. Interrupted, it leaves nothing; killed, nothing after the next one.
scratch=$wheels/compiling
log=$wheels/pybullet.log
rm -rf "$scratch"
mkdir "$scratch"
trap '{ kill -KILL -- -$! && wait; } 2>/dev/null || true; rm -rf "$scratch"' EXIT
trap 'exit 130' HUP INT TERM # also while a command that has just ended is waited for
# PyBullet's setup.py would start two compilers for each core.
cat >"$scratch/sitecustomize.py" <<LIMIT
from multiprocessing import pool
threads = pool.ThreadPool
pool.ThreadPool = lambda _: threads($jobs)
LIMIT
set -m # in a group of its own, which ends as a whole
# As python's own flags, which newer setuptools drop; without debug information, and with numpy's arrays as the wheels have
# them, for which gcc 14 has to be lenient. For arm64, gcc would round a product and a sum only once: a flight would not be
# that of amd64.
flags="-O2 -DNDEBUG -fno-strict-overflow -g0 -w -ffp-contract=off"
PYTHONPATH=$scratch TMPDIR=$scratch CFLAGS="$flags -Wno-incompatible-pointer-types" CXXFLAGS=$flags \
  "$python" -m pip wheel -v --disable-pip-version-check --no-deps --no-build-isolation --no-binary :all: \
  -w "$scratch" "$version" >"$log" 2>&1 &
compiling=$!
set +m
began=$(date +%s)
while kill -0 "$compiling" 2>/dev/null; do
  files=$({ find "$scratch" -name '*.o' 2>/dev/null || true; } | wc -l) # it fails where pip removes a folder meanwhile
  left=
  if [ "$files" -ge $ENOUGH ]; then
    left=", about $(((($(date +%s) - began) * (FILES - files) / files + 59) / 60)) minutes left"
  fi
  printf '\r  %d of %d files%s \033[K' "$files" $FILES "$left" >&2
  sleep 2
done
printf '\n' >&2
if ! wait "$compiling"; then
  tail -n 20 "$log" >&2
  echo "PyBullet cannot be compiled: the whole story is in $log" >&2
  exit 1
fi
mv "$scratch"/*.whl "$wheels" # whole, or not at all
