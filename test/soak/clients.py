"""Clients that disturb the node during a soak: processes `clients.py ROLE SEED FOLDER`, until they are killed.

A role logs to FOLDER/ROLE-SEED.jsonl, one line for each call: name, duration (s), success, reply.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerUpdate, MarkerArray

HUNG = 10.0  # s that a service may take
PACKAGE = Path(__file__).resolve().parents[2]

SCRIPTS: dict[str, str] = {
    "broken.py": "def sysCall_init(:\n",
    "broken.lua": "function sysCall_init(\n",
    "raises.py": "def sysCall_actuation():\n    1 / 0\n",
    "raises.lua": "function sysCall_sensing()\n  error({})\nend\n",
    "hangs.py": "def sysCall_actuation():\n    while True:\n        pass\n",
    "hangs.lua": "function sysCall_actuation()\n  while true do pcall(error) end\nend\n",
    "hangs_in_c.lua": "function sysCall_init()\n  x = ('x'):rep(250000):find('.-.-.-.-.-y')\nend\n",
    "eats.lua": "function sysCall_init()\n  x = {}\n  while true do x[#x + 1] = ('x'):rep(1e6) .. #x end\nend\n",
    "cleanup.py": "def sysCall_cleanup():\n    raise ValueError('x')\n",
    "draws.lua": (
        "function sysCall_init()\n  d = sim.addDrawingObject(2, 2, 0, -1, 100, {1, 0, 0})\nend\n"
        "function sysCall_sensing()\n  sim.addDrawingObjectItem(d, {math.random(), 0, 1})\nend\n"
    ),
    "talks.py": (
        "def sysCall_init():\n    self.out = simROS.advertise('/soak/talk', 'std_msgs/Float64')\n"
        "    simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'on_twist')\n"
        "def on_twist(m):\n    simROS.publish(self.out, {'data': m.linear.x})\n"
    ),
}
GOOD_SCRIPTS = (
    *sorted((PACKAGE / "src" / "drone_sim" / "child_scripts").glob("t*.py")),
    *sorted((PACKAGE / "test" / "unit" / "scripts").glob("*.lua")),
)
SCENES: dict[str, str] = {
    "bad_key.yaml": "object: []\n",
    "bad_yaml.yaml": "objects: [{\n",
    "bad_size.yaml": "objects: [{shape: box, size: [1, -1, 1], position: [0, 0, 1]}]\n",
    "no_mesh.yaml": "objects: [{shape: mesh, file: none.obj, position: [0, 0, 1]}]\n",
    "two_roots.yaml": "objects: [{shape: urdf, file: two_roots.urdf, position: [0, 0, 1]}]\n",
    "mtllib.yaml": "objects: [{shape: mesh, file: mtllib.obj, position: [0, 0, 1]}]\n",
    "two_roots.urdf": '<robot name="r"><link name="a"/><link name="b"/></robot>',
    "mtllib.obj": "mtllib ..\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "boxes.yaml": "objects:\n" + "- {shape: box, size: [0.2, 0.2, 0.2], position: [2, 0, 1], mass: 1}\n" * 60,
}
GUESTS = {"drone": {}, "guest": {"position": [2.0, 2.0, 1.0]}, "other": {"position": [2.0, -2.0, 1.0]}}
_ODD = (math.nan, math.inf, -math.inf, 1e300, -1e9, 5e-324, 1e4)


class Diary:
    """Log file of a role."""

    def __init__(self, path: Path):
        self._file = path.open("a", encoding="utf-8", buffering=1)

    def add(self, what: str, seconds: float, succeeded: bool, reply: str) -> None:
        self._file.write(json.dumps([what, round(seconds, 3), succeeded, reply]) + "\n")


def within(seconds: float, action: Callable[[], Any]) -> tuple[bool, Any]:
    """Return whether the action ended within `seconds`, and its result or exception."""
    result: list[Any] = []

    def run() -> None:
        try:
            result.append(action())
        except Exception as error:
            result.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    return bool(result), result[0] if result else None


# ---- services


def call_services(rng: random.Random, folder: Path, diary: Diary) -> None:
    """Call all services in random order, like an impatient user."""
    names = ["start"] * 3 + ["pause"] * 3 + ["snapshot", "restore", "step"] * 2 + ["stop", "load_scene", "save_scene"]
    names += ["set_vehicles"] * 2
    while True:
        name = rng.choice(names)
        if rng.random() < 0.2:
            _choose_script(rng, folder)
        if name in ("load_scene", "save_scene"):
            rospy.set_param("/drone_sim/scene_file", _scene(rng, folder, saving=name == "save_scene"))
        if name == "set_vehicles":
            rospy.set_param("/drone_sim/vehicles", rng.choice([0, 0, GUESTS]))
        _call(name, rng.random() < 0.3, diary)
        time.sleep(rng.choice([0.0, 0.05, 0.5, 2.0]))


def _call(name: str, on: bool, diary: Diary) -> None:
    start_time = time.monotonic()

    def call() -> Any:
        if name == "pause":
            return rospy.ServiceProxy("/drone_sim/pause", SetBool)(on)
        return rospy.ServiceProxy(f"/drone_sim/{name}", Trigger)()

    ended, answer = within(HUNG, call)
    duration = time.monotonic() - start_time
    if not ended:
        diary.add(name, duration, False, "HUNG")
    elif isinstance(answer, Exception):
        diary.add(name, duration, False, f"NO ANSWER {type(answer).__name__}: {answer}")
    else:
        diary.add(name, duration, answer.success, answer.message)


def _choose_script(rng: random.Random, folder: Path) -> None:
    """Replace the node's script by a random one: via a link, so that it may be in either language."""
    good = rng.random() < 0.8
    target = rng.choice(GOOD_SCRIPTS) if good else folder / rng.choice(sorted(SCRIPTS))
    link = folder / f"link-{os.getpid()}"
    link.symlink_to(target)
    link.replace(folder / "flown.py")


def _scene(rng: random.Random, folder: Path, saving: bool) -> str:
    if saving:
        return str(folder / "saved.yaml")
    own = [folder / name for name in SCENES if name.endswith(".yaml")]
    shipped = sorted((PACKAGE / "config" / "scenes").glob("*.yaml"))
    return str(rng.choice([*own, *shipped * 4, folder / "saved.yaml", folder / "none.yaml", ""]) or "")


# ---- topics


def send_commands(rng: random.Random, _folder: Path, _diary: Diary) -> None:
    """Publish commands, valid ones and nonsense, far more often than there are steps."""
    kinds: dict[str, Any] = {"cmd_vel": Twist, "set_pose": PoseStamped, "target_pose": PoseStamped}
    kinds.update({"initialpose": PoseWithCovarianceStamped, "push": WrenchStamped})
    kinds["markers/feedback"] = kinds["objects/feedback"] = InteractiveMarkerFeedback
    publishers = {topic: rospy.Publisher(f"/drone/{topic}", kind, queue_size=10) for topic, kind in kinds.items()}
    while True:
        topic = rng.choice(["cmd_vel"] * 20 + sorted(kinds))
        message = kinds[topic]()
        _fill(message, rng)
        publishers[topic].publish(message)
        time.sleep(rng.choice([0.0, 0.005, 0.005, 0.02]))


def _fill(message: Any, rng: random.Random) -> None:
    """Set the numbers of a message to random values, most of them sensible."""

    def number() -> float:
        return rng.choice(_ODD) if rng.random() < 0.01 else rng.uniform(-1, 1)

    def fill(part: Any) -> None:
        for axis in {"x", "y", "z", "w"} & set(part.__slots__):
            setattr(part, axis, number())

    if isinstance(message, Twist):
        fill(message.linear)
        fill(message.angular)
        return
    message.header.frame_id = rng.choice(["world"] * 9 + ["base_link"])
    if isinstance(message, WrenchStamped):
        fill(message.wrench.force)
        return
    if isinstance(message, InteractiveMarkerFeedback):
        message.client_id, message.marker_name = "soak", rng.choice(["Drone", "DronePosition", "odd"])
        message.event_type = rng.randint(0, 5)
    pose = message.pose.pose if isinstance(message, PoseWithCovarianceStamped) else message.pose
    fill(pose.position)
    pose.position.z += 1.5
    pose.orientation.w = 1.0


TOPICS: tuple[tuple[str, Any], ...] = (
    ("front", Image),
    ("front/compressed", CompressedImage),
    ("camera_info", CameraInfo),
    ("depth/image", Image),
    ("track/image", Image),
    ("floor/image", Image),
    ("odom", Odometry),
    ("scene", MarkerArray),
    ("drawing", MarkerArray),
    ("markers/update", InteractiveMarkerUpdate),
    ("objects/update", InteractiveMarkerUpdate),
)


def look(rng: random.Random, _folder: Path, _diary: Diary) -> None:
    subscribers: dict[str, rospy.Subscriber] = {}
    while True:
        topic, kind = rng.choice(TOPICS)
        if topic in subscribers:
            subscribers.pop(topic).unregister()
        elif len(subscribers) < 3:
            subscribers[topic] = rospy.Subscriber(f"/drone/{topic}", kind, lambda _message: None, queue_size=1)
        time.sleep(rng.uniform(0.1, 2.0))


def listen(_rng: random.Random, _folder: Path, diary: Diary) -> None:
    """Log the number of odometry messages every second, and every position that is not finite."""
    count = [0]

    def on_odometry(message: Odometry) -> None:
        count[0] += 1
        where = message.pose.pose.position
        if not all(map(math.isfinite, (where.x, where.y, where.z))):
            diary.add("odom", 0.0, False, f"NOT FINITE {where.x} {where.y} {where.z}")

    rospy.Subscriber("/drone/odom", Odometry, on_odometry, queue_size=100)
    while True:
        time.sleep(1.0)
        diary.add("odom", 1.0, True, str(count[0]))
        count[0] = 0


def sleep(_rng: random.Random, _folder: Path, _diary: Diary) -> None:
    """Subscribe to many topics; run.py stops this process with SIGSTOP at times, so that its sockets fill up."""
    for topic, kind in TOPICS[:7]:
        rospy.Subscriber(f"/drone/{topic}", kind, lambda _message: None)
    while True:
        time.sleep(1.0)


def be_silent(_rng: random.Random, _folder: Path, _diary: Diary) -> None:
    """Connect and send nothing, like a client that is stopped at that moment."""
    held: deque[socket.socket] = deque(maxlen=20)
    while True:
        with contextlib.suppress(OSError, rosgraph.MasterException):
            uri = rosgraph.Master("/silent").lookupNode("/drone_sim")
            _, _, (_, host, port) = ServerProxy(uri).requestTopic("/silent", "/rosout", [["TCPROS"]])  # type: ignore
            held.append(socket.create_connection((host, port)))
        time.sleep(0.5)


ROLES = {
    "services": call_services,
    "commands": send_commands,
    "looker": look,
    "odometry": listen,
    "sleeper": sleep,
    "silent": be_silent,
}


def main() -> None:
    role, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    rospy.init_node(f"soak_{role}_{seed}", disable_signals=True)
    ROLES[role](random.Random(f"{role} {seed}"), folder, Diary(folder / f"{role}-{seed}.jsonl"))


if __name__ == "__main__":
    main()
