"""`rosrun drone_sim show`: the files of rviz with the names of what flies."""

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
    """Return the titles of the docks in Qt's own record of the window, as Qt reads them: a length, then UTF-16."""
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


def test_a_fleet_with_other_names_has_its_topics_frames_and_docks():
    text = show.rename((FOLDER / "fleet.rviz").read_text(), {"drone1": "alpha", "drone_sim": "sim2"})
    view = yaml.safe_load(text)
    topics = {one for one in texts(view) if one.startswith("/")}
    assert {"/sim2/view/forces", "/sim2/markers/update", "/alpha/front", "/alpha/initialpose"} <= topics
    assert not any(one.startswith(("/drone1/", "/drone_sim/")) for one in topics)
    assert view["Visualization Manager"]["Views"]["Current"]["Target Frame"] == "sim2/first"
    assert {"Front camera of alpha", "Track camera of alpha"} <= docks(view)
    assert docks(view) - {"Displays"} <= set(texts(view))
    assert not re.search(r"\bdrone1\b", text) and "alpha/base_link" in set(texts(view))


def test_one_with_another_name_has_its_topics():
    text = show.rename((FOLDER / "drone.rviz").read_text(), {"drone": "hawk"})
    before, after = (yaml.safe_load(one) for one in ((FOLDER / "drone.rviz").read_text(), text))
    changed = {(one, other) for one, other in zip(texts(before), texts(after)) if one != other}
    assert ("/drone/view/forces", "/hawk/view/forces") in changed
    assert all(one.replace("/drone/", "/hawk/") == other for one, other in changed)
    assert docks(before) == docks(after)


def test_in_a_namespace_everything_of_it_is_below():
    names = {"drone": "a/drone", "drone_sim": "a/drone_sim"}
    view = yaml.safe_load(show.rename((FOLDER / "drone.rviz").read_text(), names))
    assert {one for one in texts(view) if one.startswith("/")} == {
        one.replace("/drone/", "/a/drone/")
        for one in texts(yaml.safe_load((FOLDER / "drone.rviz").read_text()))
        if one.startswith("/")
    }
    assert view["Visualization Manager"]["Views"]["Current"]["Target Frame"] == "a/drone_sim/first"


@pytest.mark.parametrize(("launched", "status"), [((), 1), (("__name:=rviz", "__log:=/tmp/rviz.log"), 0)])
def test_without_rviz_one_line_says_what_to_do_and_a_launch_goes_on(monkeypatch, capsys, launched, status):
    monkeypatch.setattr(show, "_RVIZ", "no_such_package")
    monkeypatch.setattr(show.sys, "argv", ["show", "--config", "none", *launched])
    monkeypatch.setattr(show.signal, "signal", lambda *_: None)
    assert show.main() == status
    assert capsys.readouterr() == ("", f"show: rviz is not installed: {show.INSTEAD}\n")


def test_rviz_finds_the_package_that_it_asks_for_and_nothing_else_does():
    own = str(package_path())
    environment = show.with_media_export({"ROS_PACKAGE_PATH": own, "HOME": "/home/me"})
    assert environment["HOME"] == "/home/me" and environment["ROS_PACKAGE_PATH"].startswith(f"{own}:")
    found = rospkg.RosPack(environment["ROS_PACKAGE_PATH"].split(":"))
    assert {"drone_sim", "media_export"} <= set(found.list())
    assert "media_export" not in rospkg.RosPack([own]).list()
    assert show.with_media_export({})["ROS_PACKAGE_PATH"] == f"{own}/rviz/packages"


# ---- rviz itself


def shown(tmp_path, rviz, sent=None):
    """Run a shell script in the place of rviz, send a signal when it says `up`; return status, stderr, its starts."""
    script = tmp_path / "rviz"
    script.write_text(f'#!/bin/bash\necho start >>"{tmp_path}/starts"\n{rviz}\n')
    script.chmod(0o755)
    program = f"import os, sys; from drone_sim.ros.tools import show; sys.exit(show.run([{str(script)!r}], os.environ))"
    command = [sys.executable, "-c", program]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if sent is not None:
        assert running.stdout.readline() == "up\n"
        running.send_signal(sent)
    _, said = running.communicate(timeout=60)
    return running.returncode, said, len((tmp_path / "starts").read_text().splitlines())


def test_an_rviz_that_crashes_at_its_start_is_started_again(tmp_path):
    status, said, starts = shown(tmp_path, f'[ $(wc -l <"{tmp_path}/starts") = 2 ] && exit 0; kill -SEGV $$')
    assert (status, starts) == (0, 2)
    assert said == "show: rviz crashed (Segmentation fault): starting it again\n"


def test_an_rviz_that_always_crashes_is_given_up(tmp_path):
    status, said, starts = shown(tmp_path, "kill -ABRT $$")
    assert (status, starts) == (128 + signal.SIGABRT, 3) and len(said.splitlines()) == 2


def test_an_rviz_that_fails_is_not_started_again(tmp_path):
    assert shown(tmp_path, "exit 3") == (3, "", 1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_ends_show_ends_rviz_even_if_that_crashes_then(tmp_path, number):
    crashing = 'trap "kill -SEGV \\$\\$" INT TERM\necho up\nwhile true; do sleep 0.01; done'
    assert shown(tmp_path, crashing, number) == (128 + signal.SIGSEGV, "", 1)
