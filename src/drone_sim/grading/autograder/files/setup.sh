#!/usr/bin/env bash
# Gradescope runs this once as root, when it builds the autograder's image.
set -e
cd "$(dirname "${BASH_SOURCE[0]}")/.." # /autograder: the zip is unpacked in source/
if command -v apt-get >/dev/null; then
  apt-get update -q
  DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends \
    python3-venv python3-dev build-essential libegl1 libgl1 libgl1-mesa-dri bubblewrap
fi
python3 -m venv venv
venv/bin/python -m pip install -q --disable-pip-version-check -r source/requirements.txt
# The user who flies must not be able to write here.
id grader >/dev/null 2>&1 || useradd --system --shell /usr/sbin/nologin grader
chmod -R a+rX venv source
