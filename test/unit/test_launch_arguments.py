"""roslaunch's command line: a wrong argument of drone.launch is told, and nothing else is touched."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.files.resources import package_path
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.node.start_checks import check
from drone_sim.run.parameters import ParameterError

LAUNCH = package_path() / "launch"
ROSLAUNCH = ["/usr/bin/python3", "/usr/bin/roslaunch"]


@pytest.mark.parametrize(
    "command",
    [
        [*ROSLAUNCH, "drone_sim", "drone.launch", "scrpt:=x.py"],
        [*ROSLAUNCH, "-p", "11841", "drone_sim", "drone.launch", "rviz:=false", "scrpt:=x.py"],
        [*ROSLAUNCH, "drone.launch", "scrpt:=x.py", "--screen"],
        [*ROSLAUNCH, str(LAUNCH / "drone.launch"), "scrpt:=x.py"],
        ["roslaunch", "../launch/drone.launch", "scrpt:=x.py"],
    ],
)
def test_a_wrong_argument_is_told_with_near_names(command):
    with pytest.raises(ParameterError, match=r"scrpt:=x.py: drone.launch has no argument scrpt; near names are script"):
        check(command, LAUNCH)


@pytest.mark.parametrize(
    "command",
    [
        [*ROSLAUNCH, "drone_sim", "drone.launch"],
        [*ROSLAUNCH, "drone_sim", "drone.launch", "script:=x.py", "scene:=a.launch", "__name:=y", ""],
        [*ROSLAUNCH, "other", "drone.launch", "scrpt:=x.py"],
        [*ROSLAUNCH, "my.launch", "scrpt:=x.py"],
        [*ROSLAUNCH, "drone_sim", "drone.launch", "my.launch", "scrpt:=x.py"],
        [*ROSLAUNCH, "-c", "client-1", "-u", "http://localhost:4321", "--run_id", "1"],
        ["/usr/bin/python3", "/usr/bin/rostest", "drone_sim", "drone.launch", "scrpt:=x.py"],
        ["bash"],
        [""],
    ],
)
def test_everything_else_is_left_alone(command, tmp_path):
    check(command, tmp_path)


# ---- files are found from the user's folder


@pytest.mark.parametrize("name", ["", "target", "/a/b.py", "~/a.py", "package://drone_sim/a.yaml"])
def test_what_is_not_relative_stays(name, monkeypatch):
    monkeypatch.setenv("PWD", "/home/somebody")
    assert from_shell(name) == name


@pytest.mark.parametrize("name", ["a.lua", "./a.lua", "folder/a.yaml", "../a.yaml"])
def test_relative_to_the_shell_and_not_to_the_process(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PWD", "/home/somebody")
    assert from_shell(name) == f"/home/somebody/{name.replace('./', '') if name.startswith('./') else name}"
    monkeypatch.delenv("PWD")
    assert from_shell(name).startswith(str(tmp_path))
