#!/usr/bin/env bash
# Everything a newcomer needs: ./dev.sh setup | run [roslaunch args] | test | lint | bench [NAME...]
#
# Installs what is missing (Debian 12: its own ROS 1; Ubuntu 20.04: /opt/ros/noetic), keeps the pip packages
# in .venv, and builds into build/ and devel/. What is there already is left alone, so a second run takes seconds.
set -eo pipefail
here=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
root=$PWD

say() { printf '\033[1m[dev.sh]\033[0m %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

packages() {
  local common="python3-venv build-essential cmake python3-pytest libegl1 libgl1 libgl1-mesa-dri"
  if [ -f /opt/ros/noetic/setup.bash ]; then
    echo "$common $(printf 'ros-noetic-%s ' catkin rospy roslaunch rostest rosbash cv-bridge tf2-ros robot-state-publisher \
      rviz dynamic-reconfigure interactive-markers std-srvs geometry-msgs nav-msgs sensor-msgs std-msgs)"
  else
    echo "$common catkin librostest-dev python3-rospy python3-roslaunch python3-rostest rosbash python3-rostopic \
      python3-rosnode python3-rosmsg python3-rosservice python3-cv-bridge python3-tf2-ros ros-robot-state-publisher rviz python3-dynamic-reconfigure python3-geometry-msgs python3-nav-msgs \
      python3-sensor-msgs python3-std-msgs python3-std-srvs python3-interactive-markers \
      python3-visualization-msgs python3-yaml"
  fi
}

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

install_packages() {
  local wanted missing=() package
  read -ra wanted <<<"$(packages | tr '\n' ' ')"
  for package in "${wanted[@]}"; do
    dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
  done
  if [ ${#missing[@]} = 0 ]; then return; fi
  [ "$(id -u)" = 0 ] || command -v sudo >/dev/null || fail "needs root or sudo to install: ${missing[*]}"
  say "installing ${#missing[@]} packages (a minute or two, once): ${missing[*]}"
  as_root apt-get update -q >&2
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends -o DPkg::Lock::Timeout=600 \
    "${missing[@]}" >&2
}

# .venv and build/ hold absolute paths: a moved checkout, or other requirements, makes them anew.
fresh() { [ "$(cat "$1" 2>/dev/null)" = "$2" ]; }

make_venv() { # make_venv REQUIREMENTS...
  local stamp=.venv/.made-from-$1 wanted
  wanted="$root $(/usr/bin/python3 --version) $(cksum <"$1")"
  if fresh "$stamp" "$wanted"; then return; fi
  if ! .venv/bin/python -c "import sys; sys.exit(sys.prefix != '$root/.venv')" 2>/dev/null; then
    say "making .venv beside the system's python packages"
    rm -rf .venv
    /usr/bin/python3 -m venv --system-site-packages .venv
  fi
  say "installing the python packages of $1 (a minute, once)"
  .venv/bin/python -m pip install -q --disable-pip-version-check -r "$1" >&2
  echo "$wanted" >"$stamp"
}

build() {
  local wanted
  wanted="$root $(cat CMakeLists.txt setup.py package.xml cmake/* | cksum) $(ls test/ros)"
  if fresh build/.made-from "$wanted"; then return; fi
  say "building into build/ and devel/"
  rm -rf build devel
  # The venv's python by name: another python3 first on PATH has neither catkin_pkg nor rospy.
  mkdir build
  if ! { cmake -S . -B build -DCATKIN_DEVEL_PREFIX="$root/devel" -DPYTHON_EXECUTABLE="$root/.venv/bin/python" &&
    make -C build; } >build/build.log 2>&1; then
    cat build/build.log >&2
    fail "the build failed"
  fi
  echo "$wanted" >build/.made-from
}

setup() {
  if [ -f /opt/ros/noetic/setup.bash ]; then source /opt/ros/noetic/setup.bash; fi
  install_packages
  grep -qw localhost /etc/hosts || fail "ROS needs the line '127.0.0.1 localhost' in /etc/hosts"
  make_venv requirements.txt
  build
  source devel/setup.bash
}

lint_catkin() {
  # catkin_lint wants the folder to be named like the package, and knows nothing of build/, .venv/ and dev.sh.
  local copy
  copy=$(mktemp -d)
  mkdir "$copy/drone_sim"
  git ls-files -co --exclude-standard | grep -v '^dev.sh$' | tar -cT - | tar -xC "$copy/drone_sim"
  "$1" -q -W2 --strict --ignore uninstalled_script "$copy/drone_sim"
  rm -r "$copy"
}

lint() {
  make_venv requirements-dev.txt
  local bin=$root/.venv/bin
  "$bin/ruff" check .
  "$bin/ruff" format --check .
  "$bin/mypy"
  PYTHONPATH=src:$PYTHONPATH "$bin/lint-imports"
  lint_catkin "$bin/catkin_lint"
}

# ROS knows no passwords: without a word from the user, nobody outside this machine is let in.
stay_on_this_machine() {
  local default=http://localhost:11311 # which a sourced setup.bash sets, too
  if [ "${ROS_MASTER_URI-$default}" != $default ] || [ -n "${ROS_IP+set}${ROS_HOSTNAME+set}" ]; then return; fi
  export ROS_MASTER_URI=$default ROS_HOSTNAME=localhost
}

run_tests() {
  make_venv requirements-dev.txt
  # Every core tests; the tests with a master run one after another.
  PYTEST_ADDOPTS="-n auto" CTEST_OUTPUT_ON_FAILURE=1 make --no-print-directory -C build test
}

command=${1:-help}
shift || true
case "$command" in
  setup) setup; say "ready: source $root/devel/setup.bash" ;;
  run) stay_on_this_machine; setup; cd "$here"; exec roslaunch drone_sim drone.launch "$@" ;;
  test) setup; run_tests ;;
  lint) setup; lint ;;
  bench) setup; PYTHONPATH=$root:$PYTHONPATH exec .venv/bin/python -m benchmarks "$@" ;;
  *) sed -n '2,5s/^# \{0,1\}//p' "$0" ;;
esac
