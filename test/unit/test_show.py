"""`rosrun drone_sim show`: rviz configurations with the vehicles' names, and restarts of rviz after a crash."""

import re
import signal
import subprocess
import sys

import pytest
import yaml

from drone_sim.files.resources import package_path

show = pytest.importorskip("drone_sim.ros.tools.show")
rospkg = pytest.importorskip("rospkg")
pytestmark = pytest.mark.ros

FOLDER = package_path() / "rviz"


def docks(view):
    """Return the dock titles in Qt's binary window state, where each is a length followed by UTF-16 text."""
    state = bytes.fromhex(view["Window Geometry"]["QMainWindow State"])
    titles = re.findall(rb"\xfb(....)((?:\x00[ -~])+)", state, re.DOTALL)
    assert all(int.from_bytes(length, "big") == len(title) for length, title in titles)
    return {title.decode("utf-16-be") for _, title in titles}


def texts(value):
    """Yield every text of a value, keys included."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from (key, *texts(inner))
    elif isinstance(value, list):
        for inner in value:
            yield from texts(inner)
    elif isinstance(value, str):
        yield value


def test_renamed_fleet_has_its_topics_frames_and_docks():
    text = show.rename((FOLDER / "fleet.rviz").read_text(), {"drone1": "alpha", "drone_sim": "sim2"})
    view = yaml.safe_load(text)
    topics = {entry for entry in texts(view) if entry.startswith("/")}
    assert {"/sim2/view/forces", "/sim2/markers/update", "/alpha/front", "/alpha/initialpose"} <= topics
    assert not any(entry.startswith(("/drone1/", "/drone_sim/")) for entry in topics)
    assert view["Visualization Manager"]["Views"]["Current"]["Target Frame"] == "sim2/first"
    assert {"Front camera of alpha", "Track camera of alpha"} <= docks(view)
    assert docks(view) - {"Displays"} <= set(texts(view))
    assert not re.search(r"\bdrone1\b", text) and "alpha/base_link" in set(texts(view))


def test_renamed_drone_has_its_topics():
    text = show.rename((FOLDER / "drone.rviz").read_text(), {"drone": "hawk"})
    before, after = (yaml.safe_load(entry) for entry in ((FOLDER / "drone.rviz").read_text(), text))
    changed = {(entry, other) for entry, other in zip(texts(before), texts(after)) if entry != other}
    assert ("/drone/view/forces", "/hawk/view/forces") in changed
    assert all(entry.replace("/drone/", "/hawk/") == other for entry, other in changed)
    assert docks(before) == docks(after)


def test_topics_and_frames_are_below_the_namespace():
    names = {"drone": "a/drone", "drone_sim": "a/drone_sim"}
    view = yaml.safe_load(show.rename((FOLDER / "drone.rviz").read_text(), names))
    assert {entry for entry in texts(view) if entry.startswith("/")} == {
        entry.replace("/drone/", "/a/drone/")
        for entry in texts(yaml.safe_load((FOLDER / "drone.rviz").read_text()))
        if entry.startswith("/")
    }
    assert view["Visualization Manager"]["Views"]["Current"]["Target Frame"] == "a/drone_sim/first"


@pytest.mark.parametrize(("launched", "status"), [((), 1), (("__name:=rviz", "__log:=/tmp/rviz.log"), 0)])
def test_missing_rviz_is_reported_in_one_line_and_does_not_end_a_launch(monkeypatch, capsys, launched, status):
    monkeypatch.setattr(show, "_RVIZ", "no_such_package")
    monkeypatch.setattr(show.sys, "argv", ["show", "--config", "none", *launched])
    monkeypatch.setattr(show.signal, "signal", lambda *_: None)
    assert show.main() == status
    assert capsys.readouterr() == ("", f"show: rviz is not installed: {show.INSTEAD}\n")


def test_only_rviz_finds_the_media_export_package():
    own = str(package_path())
    environment = show.with_media_export({"ROS_PACKAGE_PATH": own, "HOME": "/home/me"})
    assert environment["HOME"] == "/home/me" and environment["ROS_PACKAGE_PATH"].startswith(f"{own}:")
    ros_pack = rospkg.RosPack(environment["ROS_PACKAGE_PATH"].split(":"))
    assert {"drone_sim", "media_export"} <= set(ros_pack.list())
    assert "media_export" not in rospkg.RosPack([own]).list()
    assert show.with_media_export({})["ROS_PACKAGE_PATH"] == f"{own}/rviz/packages"


# ---- rviz itself


def run_show(tmp_path, rviz, sent_signal=None):
    """Run a shell script in place of rviz; send a signal when it prints `up`; return status, stderr and starts."""
    script = tmp_path / "rviz"
    script.write_text(f'#!/bin/bash\necho start >>"{tmp_path}/starts"\n{rviz}\n')
    script.chmod(0o755)
    program = f"import os, sys; from drone_sim.ros.tools import show; sys.exit(show.run([{str(script)!r}], os.environ))"
    command = [sys.executable, "-c", program]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if sent_signal is not None:
        assert running.stdout.readline() == "up\n"
        running.send_signal(sent_signal)
    _, errors = running.communicate(timeout=60)
    return running.returncode, errors, len((tmp_path / "starts").read_text().splitlines())


def test_an_rviz_that_crashes_at_its_start_is_started_again(tmp_path):
    status, errors, starts = run_show(tmp_path, f'[ $(wc -l <"{tmp_path}/starts") = 2 ] && exit 0; kill -SEGV $$')
    assert (status, starts) == (0, 2)
    assert errors == "show: rviz crashed (Segmentation fault): starting it again\n"


def test_show_gives_up_after_three_crashes_of_rviz(tmp_path):
    status, errors, starts = run_show(tmp_path, "kill -ABRT $$")
    assert (status, starts) == (128 + signal.SIGABRT, 3) and len(errors.splitlines()) == 2


def test_an_rviz_that_fails_is_not_started_again(tmp_path):
    assert run_show(tmp_path, "exit 3") == (3, "", 1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ending_show_ends_rviz_even_if_rviz_crashes_then(tmp_path, number):
    crashing = 'trap "kill -SEGV \\$\\$" INT TERM\necho up\nwhile true; do sleep 0.01; done'
    assert run_show(tmp_path, crashing, number) == (128 + signal.SIGSEGV, "", 1)
