#!/usr/bin/env bash
# Takes the pictures of rviz and image_view: docs/take_window_pictures.sh FOLDER. `docs/make_pictures.sh windows` calls it.
#
# It works on a display and a ROS master of its own, both of which it ends. A minute.
set -eo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=$(realpath "$1")

missing=()
for needed in rviz:rviz Xvfb:xvfb import:imagemagick xdotool:xdotool; do
  command -v "${needed%:*}" >/dev/null || missing+=("${needed#*:}")
done
for package in ros-image-view libnodeletlib-tools libimage-view-dev; do
  dpkg-query -s "$package" >/dev/null 2>&1 || missing+=("$package")
done
if [ ${#missing[@]} != 0 ]; then
  echo "take_window_pictures.sh: needs apt-get install ${missing[*]}" >&2
  exit 1
fi
if [ ! -f devel/setup.bash ]; then
  echo "take_window_pictures.sh: needs ./dev.sh setup" >&2
  exit 1
fi
source devel/setup.bash

work=$(mktemp -d)
pids=()
end() { # end: stop what was started last, and so on back to the first
  local index
  for ((index = ${#pids[@]} - 1; index >= 0; index--)); do
    kill -INT "${pids[index]}" 2>/dev/null || true
    wait "${pids[index]}" 2>/dev/null || true
  done
  pids=()
}
trap 'end; if [ -n "$xvfb" ]; then kill "$xvfb"; fi; rm -rf "$work"' EXIT

Xvfb -displayfd 3 -screen 0 1280x800x24 3>"$work/display" 2>"$work/xvfb.log" &
xvfb=$!
until [ -s "$work/display" ]; do sleep 0.1; done
DISPLAY=:$(cat "$work/display")
export DISPLAY QT_X11_NO_MITSHM=1

file=drone.launch drone=drone # what `simulate` launches, and whose odometry it waits for

simulate() { # simulate [ROSLAUNCH ARGUMENT...]
  local port
  port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])')
  export ROS_MASTER_URI=http://localhost:$port
  roslaunch -p "$port" drone_sim "$file" rviz:=false "$@" >"$work/launch.log" 2>&1 &
  pids+=($!)
  until timeout 20 rostopic echo -n1 "/$drone/odom" >/dev/null 2>&1; do
    kill -0 "${pids[0]}" 2>/dev/null || { cat "$work/launch.log" >&2; exit 1; }
    sleep 0.5
  done
}

start() { # start CONFIG [ROSLAUNCH ARGUMENT...]: the simulation, then rviz with a view
  simulate "${@:2}"
  rosrun rviz rviz -d "$1" >"$work/rviz.log" 2>&1 &
  pids+=($!)
  xdotool search --sync --name RViz >/dev/null
  sleep 5 # rviz draws itself in its own time
}

# A busy computer is late with what rviz draws; what moves slowly is then still where it should be.
slow_motion=real_time_factor:=0.25

place() { timeout 30 rostopic echo -n1 -p /drone/odom/pose/pose/position | tail -n1 | cut -d, -f2-3; }

# The first picture: the view of drone.launch, while the drone flies towards a gate.
flight() {
  start rviz/drone.rviz scene:="$PWD/config/scenes/gates.yaml" $slow_motion
  python3 - <<'PYTHON'
import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry

rospy.init_node("pilot")
places = []
rospy.Subscriber("/drone/odom", Odometry, lambda odometry: places.append(odometry.pose.pose.position))
publisher = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1, latch=True)
for x, y, z, turn, there in (
    (0.3, 0.3, 0.04, 0.0, lambda place: place.y > 0.35),
    (0.6, -0.15, 0.0, 0.0, lambda place: place.x > 0.8),
):
    publisher.publish(Twist(Vector3(x, y, z), Vector3(0, 0, turn)))
    while not (places and there(places[-1])):
        rospy.sleep(0.02)
PYTHON
  import -window root "$folder/rviz.png"
  end
}

# The green sphere, dragged with the mouse; the drone follows it.
target() {
  # The view of drone.launch, but standing still, without the path, and with the tool that takes the handles.
  python3 - "$work/target.rviz" <<'PYTHON'
import sys, yaml
view = yaml.safe_load(open("rviz/drone.rviz"))
manager = view["Visualization Manager"]
for display in manager["Displays"]:
    if display["Name"] == "Path":
        display.update(Enabled=False, Value=False)
manager["Tools"].sort(key=lambda tool: tool["Class"] != "rviz/Interact")
manager["Views"]["Current"] = {
    **{"Class": "rviz/Orbit", "Name": "Standing still", "Target Frame": "world", "Value": "Orbit (rviz)"},
    **{"Distance": 2.4, "Pitch": 0.4, "Yaw": 3.14159, "Focal Point": {"X": 0, "Y": 0, "Z": 0.8}},
}
yaml.safe_dump(view, open(sys.argv[1], "w"))
PYTHON
  start "$work/target.rviz" script:=target $slow_motion
  # The sphere is in the middle of the view. Its upper half stands out of the drone's own handle, a disc.
  local before after pixel x=853 y=403
  before=$(place)
  xdotool mousemove $x $y sleep 0.5 mousedown 1 sleep 0.3
  for ((pixel = 10; pixel <= 200; pixel += 10)); do
    xdotool mousemove $((x - pixel)) $((y - pixel / 4)) sleep 0.02
  done
  sleep 0.5
  import -window root "$folder/rviz_target.png"
  xdotool mouseup 1
  sleep 15
  after=$(place)
  echo "rviz_target.png: dragged the sphere; the drone flew from x, y = $before to $after" >&2
  end
}

# Three drones: two follow the first one, on its wings, through a turn.
fleet() {
  local file=fleet.launch drone=drone1
  start rviz/fleet.rviz scene:="$PWD/config/scenes/formation.yaml" $slow_motion
  .venv/bin/python docs/fleet/follow.py &
  pids+=($!)
  python3 - <<'PYTHON'
import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry

rospy.init_node("pilot")
places = []
rospy.Subscriber("/drone1/odom", Odometry, lambda odometry: places.append(odometry.pose.pose.position))
publisher = rospy.Publisher("/drone1/cmd_vel", Twist, queue_size=1, latch=True)
publisher.publish(Twist(Vector3(0.4, 0, 0.03), Vector3(0, 0, 0.12)))
while not (places and places[-1].x > 3.2):
    rospy.sleep(0.02)
PYTHON
  import -window root "$folder/rviz_fleet.png"
  end
}

# The window of image_view, with what the front camera sees.
image_view() {
  simulate scene:="$PWD/config/scenes/gates.yaml"
  rosrun image_view image_view image:=/drone/front >"$work/image_view.log" 2>&1 &
  pids+=($!)
  local window
  window=$(xdotool search --sync --name /drone/front | head -n1)
  sleep 2 # it has a picture then
  import -window "$window" "$folder/image_view.png"
  end
}

flight
target
fleet
image_view
