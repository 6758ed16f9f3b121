#!/usr/bin/env bash
# Functions of dev.sh, which sources this file: they fill .venv from requirements files, and provide PyBullet's wheel.
# shellcheck disable=SC2154 # dev.sh assigns the variables

# .venv holds absolute paths, and an interrupted pip leaves half a package. So the file .made-from is written last, and
# removed before any change. Without that file, .venv is created again.
make_venv() { # make_venv REQUIREMENTS...
  if ! made_from "$@"; then locked "$(dirname "$venv")" fill_venv "$@"; fi
}

stamp() { # stamp REQUIREMENTS...
  echo "$venv $("$python" --version)"
  if [ $# != 0 ]; then cksum "$@"; fi
}

made_from() { # made_from REQUIREMENTS...
  [ -f "$venv/.made-from" ] && ! grep -qvxFf "$venv/.made-from" <(stamp "$@")
}

fill_venv() { # fill_venv REQUIREMENTS...
  local list before=$venv/.made-before
  if made_from "$@"; then return; fi # by the one that was waited for
  if made_from; then
    mv "$venv/.made-from" "$before"
  else
    say "making $venv"
    rm -rf "$venv/.made-from" "$venv"
    # shellcheck disable=SC2086 # venv_options may be several words, or none
    "$python" -m venv $venv_options "$venv"
    stamp >"$before"
  fi
  for list in "$@"; do
    if grep -qxF "$(cksum "$list")" "$before"; then continue; fi
    if [ "$list" = requirements.txt ]; then make_pybullet; fi
    say "installing the python packages of $list (a minute, once)"
    pip install -q --find-links "$wheels" -c requirements.txt -r "$list" >&2 # no list may bring another numpy
    if [ "$list" = requirements.txt ]; then packaging/slim_pybullet.sh "$venv"/lib/python*/site-packages; fi
    sed -i "/ $list\$/d" "$before"
    cksum "$list" >>"$before"
  done
  mv "$before" "$venv/.made-from"
}

compiles_nothing() {
  local version tag
  if made_from requirements.txt; then return; fi
  [ "$(uname -m)" = x86_64 ] || return 1
  which_pybullet
  case $tag in cp310 | cp311) return ;; esac
  have_pybullet || take_pybullet
}

# Both wait for the network, and then dpkg has one core, and pip the other. Ctrl-C ends apt, and pip a little later.
fill_both() {
  { # who is nicer already, may not take that back
    renice -n 10 "$BASHPID" >/dev/null 2>&1 || true
    make_venv requirements.txt
  } &
  # shellcheck disable=SC2046 # each word is the name of a package
  install_packages $(packages)
  wait $!
}

# PyPI has no wheel of PyBullet for Python 3.12 and later. One in a folder or index that pip's settings name is taken, or
# one that `./dev.sh wheel` has made. Otherwise it is compiled once, for all checkouts of this user.
make_pybullet() {
  local version tag found
  which_pybullet
  if have_pybullet; then return; fi
  if found=$(pip install --dry-run --no-deps --only-binary :all: "$version" 2>/dev/null); then
    found=$(grep -om1 '[^ ]*pybullet[^ ]*\.whl' <<<"$found") && say "taking PyBullet from $found, which pip has found"
    return 0
  fi
  take_pybullet || locked "$wheels" compile_pybullet
}

which_pybullet() {
  version=$(grep '^pybullet==' requirements.txt)
  tag=$("$python" -c 'import sys; print("cp{}{}".format(*sys.version_info))')
  mkdir -p "$wheels"
}

# The checksum tells a whole copy from a damaged one: who makes the folder vouches for it.
take_pybullet() {
  local file folder=${DRONE_SIM_WHEELS:-$root/wheels}
  for file in "$folder/${version/==/-}-$tag-"*"_$(uname -m).whl"; do
    if [ ! -f "$file" ]; then continue; fi
    if (cd "$folder" && grep -sF "  ${file##*/}" SHA256SUMS | sha256sum -c --status 2>/dev/null); then
      say "taking PyBullet from $file, whose checksum is that of SHA256SUMS"
      cp "$file" "$wheels/copied" && mv "$wheels/copied" "$wheels/${file##*/}" # whole, or not at all
      return
    fi
    say "not taking $file: its checksum is not in $folder/SHA256SUMS"
  done
  return 1
}

make_wheel() {
  local version tag
  which_pybullet
  locked "$wheels" compile_pybullet
  pip install -q wheel >&2 # which is not there where the wheel was taken from a folder
  packaging/wheel.sh "$venv/bin/python" "$wheels/${version/==/-}-$tag-"*.whl "$root/wheels"
  say "copy $root/wheels into another checkout, or name it there as DRONE_SIM_WHEELS: its set-up takes PyBullet from it"
}

have_pybullet() { compgen -G "$wheels/${version/==/-}-$tag-*.whl" >/dev/null; }

compile_pybullet() {
  if have_pybullet; then return; fi # by the one that was waited for
  install_packages "${COMPILERS[@]}"
  pip install -q setuptools numpy wheel >&2 # where they are not the system's
  packaging/pybullet.sh "$venv/bin/python" "$version" "$wheels"
}

pip() { "$venv/bin/python" -m pip --disable-pip-version-check "$@"; }
