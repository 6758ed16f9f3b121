"""Files named on the command line are found from the folder in which the user stands."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.ros.core.launch_parameters import from_shell


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
