"""The commands of README.md and docs/*.md, and the reasons why some of them are not run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))

_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_PROMPT = "$ "

KEYBOARD = "needs a keyboard: test/ros/key_teleop.test"
GAMEPAD = "needs a gamepad: test/unit/test_joy.py"
DISPLAY = "needs a display, and a package that only setup --all installs"
PACKAGE = "needs a package of PyPI, or one that only setup --all installs"
WORKSPACE = "needs a catkin workspace and the network"
INSTALLS = "installs packages"
ANOTHER = "needs another package, or another machine"
RECORDED = "needs the network, and nothing of that repository is kept here"
CONTAINER = "needs Docker, Kubernetes or WSL 2"
COURSE = "needs students: ./dev.sh jupyterhub runs it"
EXTENDING = "test/unit/test_docs_extending.py follows the page"

NOT_RUN = {  # with the reason
    "rosrun drone_sim key_teleop": KEYBOARD,
    "rosrun demo_teleop key_teleop.py cmd_vel:=/drone/cmd_vel": ANOTHER,
    "rosrun demo_teleop key_teleop.py cmd_vel:=/drone1/cmd_vel": ANOTHER,
    "rosrun image_view image_view image:=/drone/front": DISPLAY,
    "rosrun image_view image_view image:=/drone/floor/image __name:=view2": DISPLAY,
    "rosrun image_view image_saver image:=/drone/front _filename_format:=front%04d.png": PACKAGE,
    "rosrun image_view video_recorder image:=/drone/front _filename:=front.avi _fps:=20": PACKAGE,
    "rosrun image_transport republish raw in:=/drone/front raw out:=/camera/image_raw": PACKAGE,
    "cd my_ros_ws/src": WORKSPACE,
    "vcs import < drone_sim/drone_sim.rosinstall": WORKSPACE,
    "drone_sim/dev.sh setup --all": WORKSPACE,
    "cd ..": WORKSPACE,
    "catkin_make": WORKSPACE,
    "rosrun drone_sim grade hover /srv/drone_sim/handed_in/hover --html report --marks marks.csv": COURSE,
    "./dev.sh setup --all": "done: these commands run after it",
    "./dev.sh test": "takes minutes: .ci/run runs it",
    "./dev.sh wheel": "takes minutes: test/unit/test_dev_sh.py takes such a wheel",
    "./dev.sh deb": "takes minutes: packaging is tried in bare chroots",
    "sudo apt install ./build/deb/ros-drone-sim_*.deb": INSTALLS,
    "sudo cp -rT build/deb /srv/drone_sim": INSTALLS,
    'echo "deb [trusted=yes] file:/srv/drone_sim ./" | sudo tee /etc/apt/sources.list.d/drone_sim.list': INSTALLS,
    "sudo apt update && sudo apt install ros-drone-sim": INSTALLS,
    "python3 -m venv venv": INSTALLS,
    "venv/bin/pip install path/to/drone_sim": "test/unit/test_packaging.py installs it so",
    "venv/bin/pip install setuptools wheel numpy": INSTALLS,
    "mkdir wheels": INSTALLS,
    "packaging/pybullet.sh venv/bin/python pybullet==3.2.7 $PWD/wheels": "takes minutes",
    "venv/bin/pip install --find-links wheels .": INSTALLS,
    ".venv/bin/pip install 'jupyterlab>=4,<5' 'jupyter-server-proxy>=4.4,<5'": INSTALLS,
    ".venv/bin/jupyter lab": "test/web/test_jupyter.py starts such a server",
    "client/bin/pip install coppeliasim-zmqremoteapi-client": INSTALLS,
    "readers/bin/pip install rosbags": INSTALLS,
    "readers/bin/python read_bag.py flight.bag": PACKAGE,
    "readers/bin/rosbags-convert --src flight.bag --dst flight_mcap --dst-storage mcap": PACKAGE,
    "readers/bin/python read_bag.py flight_mcap": PACKAGE,
    "client/bin/python": "test/unit/test_docs_remote.py types what comes after it",
    "sudo apt update && sudo apt install -y git": CONTAINER,
    "git clone URL-OF-DRONE_SIM drone_sim": CONTAINER,
    "cd drone_sim": CONTAINER,
    "docker build -f packaging/Dockerfile -t drone_sim .": CONTAINER,
    "docker run --rm -p 127.0.0.1:8080:8080"
    " -v drone_scripts:/home/pilot/drone_scripts --name drone_sim drone_sim": CONTAINER,
    "systemctl --user enable --now drone_sim": "needs the Debian package and systemd",
    "cat ~/.ros/drone_sim/cockpit_8080.txt": "needs the Debian package and systemd",
    "docker exec -it drone_sim bash": CONTAINER,
    "docker build -f packaging/jupyterhub/Dockerfile -t drone_sim_jupyter .": CONTAINER,
    "docker compose -f packaging/jupyterhub/compose.yaml up -d --build": CONTAINER,
    "helm upgrade --install drone-sim jupyterhub/jupyterhub --values packaging/jupyterhub/values.yaml": CONTAINER,
    "mkdir -p handed_in": CONTAINER,
    "for home in $(docker volume ls -q --filter name=drone_sim_home_); do docker run --rm --network none"
    " --entrypoint timeout -v $home:/home/pilot:ro drone_sim 10 head -c 1000000 drone_scripts/hover.py"
    " > handed_in/${home#drone_sim_home_}.py; done": CONTAINER,
    "rosrun drone_sim grade hover handed_in --marks marks.csv": CONTAINER,
    "git clone https://github.com/OBulun/Coppelia-Quad": RECORDED,
    "./dev.sh recordings Coppelia-Quad": RECORDED,
    "ssh -L 8080:localhost:8080 you@the-machine": ANOTHER,
    "rosrun my_package flyer.py": ANOTHER,
    "rosrun drone_sim grade_live course.yaml --node flyer": "test/ros/grade_live.test grades that node",
    "rosrun drone_sim joy_teleop": GAMEPAD,
    "rosrun drone_sim joy_teleop _device:=/dev/input/js1 _drone:=drone2 _axes/vx/scale:=2": GAMEPAD,
    "rosrun drone_sim joy_teleop _config:=$PWD/my_pad.yaml": GAMEPAD,
    """rosservice call /drone_sim/edit_scene "'{\\"edit\\": [{\\"do\\": \\"add_model\\", \\"model\\": \\"gate\\", """
    """\\"position\\": [3, 0, 0]}]}'\"""": "test/ros/toolbar.test edits so; the numbers depend on what was done",
    "ROS_NAMESPACE=/drone/stereo rosrun stereo_image_proc stereo_image_proc": ANOTHER,
    "rostopic hz /drone/stereo/points2": ANOTHER,
    "python3 try_cone.py": EXTENDING,
    "python3 try_temperature.py": EXTENDING,
    "python3 try_leash.py": EXTENDING,
}
SLOW = {  # run with --all only
    "rosrun drone_sim doctor",
    "rosrun drone_sim sweep steps.yaml --param Kzref=1:10:10 --param Dyaw=0.1,0.5,1 --smallest rise_time"
    " --plot heat.png --csv all.csv",
    "rosrun drone_sim sweep steps.yaml --param Kzref=1:10:2 --param Dyaw=0.1:2:2 --smallest rise_time --optimize",
}
SHOWN_OTHERWISE = {  # with the reason
    "rosrun drone_sim import_scene Drone.ttt": "the page's is V-REP's own file, of which there is no copy",
    "cat flight.yaml": "the file is made of what the page shows",
}


class Command(NamedTuple):
    """A command without its comment, and the lines that the page shows after it."""

    page: Path
    line: int
    text: str
    shown: tuple[str, ...]

    @property
    def starts_simulator(self) -> bool:
        """Whether this command starts a simulator, which the commands after it use."""
        return self.text.startswith(("roslaunch ", "./dev.sh run"))


def commands(page: Path) -> list[Command]:
    """Return the commands of a page, from its code blocks with `$ `."""
    text = page.read_text(encoding="utf-8")
    page_commands = []
    for block in _BLOCK.finditer(text):
        first = text.count("\n", 0, block.start(2)) + 1
        lines = block[2].splitlines() if block[1] in ("", "console") else []
        starts = [number for number, line in enumerate(lines) if line.startswith(_PROMPT)]
        for start, end in zip(starts, [*starts[1:], len(lines)]):
            last = start
            while lines[last].endswith("\\"):
                last += 1
            command = "\n".join((lines[start].removeprefix(_PROMPT), *lines[start + 1 : last + 1]))
            page_commands.append(Command(page, first + start, _remove_comment(command), tuple(lines[last + 1 : end])))
    return page_commands


def _remove_comment(text: str) -> str:
    return re.sub(r"\s+# .*$", "", text).rstrip()


def everything() -> list[Command]:
    return [one for page in PAGES for one in commands(page)]
