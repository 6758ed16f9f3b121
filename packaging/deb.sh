#!/usr/bin/env bash
# ./dev.sh deb: builds ros-drone-sim_<version>_<architecture>.deb for the Debian that it runs on, in build/deb/, with what
# makes that folder a source for apt: Packages and Release.
#
# The package lies where Debian's own ROS packages lie, so that roslaunch finds it without a setup.bash. What
# Debian lacks (PyBullet, lupa, pydantic 2, ...) lies in a python environment of its own under /usr/lib/drone_sim.
set -eo pipefail
umask 022
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
out=$(mktemp -d) # not below this folder, where roslaunch would find a second drone.launch
trap 'rm -rf "$out"' EXIT
stage=$out/root
own=/usr/lib/drone_sim/python # the environment, as it will be installed
wheels=$1
LIMIT=30 # MB that the package may have
version=$(sed -n 's:.*<version>\(.*\)</version>.*:\1:p' package.xml)+deb$(cut -d. -f1 /etc/debian_version)
architecture=$(dpkg --print-architecture)
python=$(/usr/bin/python3 -c 'import sys; print("{}.{}".format(*sys.version_info))')

# What Debian has, the package depends on; the environment sees it.
DEPENDS="python3 (>= $python), python3 (<< ${python%.*}.$((${python#*.} + 1))), libegl1, libgl1, libgl1-mesa-dri,
 python3-cv-bridge, python3-diagnostic-msgs, python3-dynamic-reconfigure, python3-genpy, python3-geometry-msgs,
 python3-interactive-markers, python3-nav-msgs, python3-numpy, python3-opencv,
 python3-pil, python3-roslaunch, python3-rospy, python3-rosbag, python3-rosmsg, python3-rosnode, python3-rosservice,
 python3-rostopic, python3-sensor-msgs, python3-std-msgs,
 python3-std-srvs, python3-tqdm, python3-visualization-msgs, python3-yaml, ros-environment,
 python3-tf2-msgs, python3-zmq, rosbash, libdynamic-reconfigure-config-init-mutex-dev"

mkdir -p "$stage" "$out/deb" build
cmake -S . -B "$out/build" -DCMAKE_INSTALL_PREFIX=/usr -DCATKIN_BUILD_BINARY_PACKAGE=ON -DCATKIN_ENABLE_TESTING=OFF \
  -DCATKIN_DEVEL_PREFIX="$out/devel" >"$out/cmake.log" 2>&1
DESTDIR=$stage make -C "$out/build" install >"$out/install.log" 2>&1

/usr/bin/python3 -m venv --system-site-packages --without-pip "$stage$own"
printf 'home = /usr/bin\ninclude-system-site-packages = true\nversion = %s\n' "$python" >"$stage$own/pyvenv.cfg"
rm -f "$stage$own"/bin/[aA]ctivate*
grep -hEv '^(opencv|av|matplotlib|scipy)\b' requirements.txt requirements-all.txt >"$out/requirements.txt" # Debian's own will do
.venv/bin/python -m pip --python "$stage$own/bin/python" install -q --disable-pip-version-check \
  --find-links "$wheels" --no-compile -r "$out/requirements.txt"
site=$stage$own/lib/python$python/site-packages
packaging/slim_pybullet.sh "$site"
rm -rf "$site"/eglRenderer* "${site:?}"/{include,lib64,share} "$stage$own/include" # not used here
find "$site" -name '*.so' -exec strip --strip-unneeded {} +
find "$stage$own/bin" -type f -delete
find "$stage" -name __pycache__ -prune -exec rm -rf {} +
programs=(simulator key_teleop joy_teleop view show fly grade grade_live sweep record record_truth plot_flight bag_commands
  video import_scene doctor cockpit)
sed -i "1s:.*:#!$own/bin/python:" "${programs[@]/#/$stage/usr/lib/drone_sim/}"

install -Dm644 packaging/drone_sim.service "$stage/usr/lib/systemd/user/drone_sim.service"

chmod -R u=rwX,go=rX "$stage" # whatever the checkout's are

mkdir "$stage/DEBIAN"
cat >"$stage/DEBIAN/control" <<CONTROL
Package: ros-drone-sim
Version: $version
Architecture: $architecture
Maintainer: $(sed -n 's:.*email="\(.*\)">\(.*\)</maintainer>.*:\2 <\1>:p' package.xml)
Section: science
Priority: optional
Installed-Size: $(du -sk "$stage/usr" | cut -f1)
Depends: $DEPENDS
Recommends: bubblewrap, rviz, python3-tk
Suggests: python3-av, python3-matplotlib, python3-scipy
Description: drone of a V-REP tutorial, without V-REP
 PyBullet underneath, ROS 1 around it: roslaunch drone_sim drone.launch
CONTROL
cat >"$stage/DEBIAN/postinst" <<'POSTINST'
#!/bin/sh
set -e
if [ "$1" = configure ]; then py3compile -p ros-drone-sim /usr/lib/drone_sim || true; fi
POSTINST
cat >"$stage/DEBIAN/prerm" <<'PRERM'
#!/bin/sh
set -e
find /usr/lib/drone_sim /usr/lib/python3/dist-packages/drone_sim -name __pycache__ -prune -exec rm -rf {} +
PRERM
chmod 755 "$stage/DEBIAN/postinst" "$stage/DEBIAN/prerm"
cd "$out/deb"
dpkg-deb --root-owner-group --build "$stage" "ros-drone-sim_${version}_$architecture.deb" >&2
size=$(stat -c %s ./*.deb)
printf 'the package has %d.%d MB\n' $((size / 1000000)) $((size / 100000 % 10)) >&2
[ "$size" -le $((LIMIT * 1000000)) ] || { echo "it may have $LIMIT MB" >&2; exit 1; }
apt-ftparchive packages . >Packages
gzip -kn9 Packages
apt-ftparchive -o APT::FTPArchive::Release::Label=drone_sim release . >"$out/Release"
mv "$out/Release" .
rm -rf "$root/build/deb"
mv "$out/deb" "$root/build" # whole, or not at all
