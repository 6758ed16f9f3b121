"""Check of roslaunch's command line for unknown arguments of drone.launch; relative file names of the shell."""

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
def test_the_error_for_an_unknown_argument_suggests_near_names(command):
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
def test_other_command_lines_pass_the_check(command, tmp_path):
    check(command, tmp_path)


# ---- relative file names start at the user's folder


@pytest.mark.parametrize("name", ["", "target", "/a/b.py", "~/a.py", "package://drone_sim/a.yaml"])
def test_names_that_are_not_relative_paths_stay_unchanged(name, monkeypatch):
    monkeypatch.setenv("PWD", "/home/somebody")
    assert from_shell(name) == name


@pytest.mark.parametrize("name", ["a.lua", "./a.lua", "folder/a.yaml", "../a.yaml"])
def test_relative_paths_start_at_the_folder_of_the_shell(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PWD", "/home/somebody")
    assert from_shell(name) == f"/home/somebody/{name.replace('./', '') if name.startswith('./') else name}"
    monkeypatch.delenv("PWD")
    assert from_shell(name).startswith(str(tmp_path))
