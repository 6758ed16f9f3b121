"""The shared folder of a course: simulators write reports to it, and students may put any file into it."""

import json
import os
import pwd
from itertools import pairwise

import pytest

from drone_sim.grading import classroom

ME = pwd.getpwuid(os.getuid()).pw_name
TEXTS = {"status": "hovering", "script": "mine/hover.py", "scene": "gates", "grades": "hover 5 of 6"}


@pytest.fixture(name="room")
def _room(tmp_path, monkeypatch):
    monkeypatch.setenv(classroom.VARIABLE, str(tmp_path))
    assert classroom.folder() is None
    (tmp_path / "reports").mkdir()
    return classroom.folder()


@pytest.fixture(name="reports")
def _reports(room):
    return room / "reports"


def test_only_the_last_report_of_a_user_counts(room):
    first, second = classroom.report_path(room), classroom.report_path(room)
    classroom.report(first, {"status": "paused"}, "")
    os.utime(first, (os.stat(first).st_mtime - 5,) * 2)
    classroom.report(second, TEXTS, "QUJD")
    assert classroom.reports(room) == {ME: {**TEXTS, "picture": "QUJD"}}
    assert second.stat().st_mode & 0o777 == 0o640


def test_a_report_of_an_ended_simulator_does_not_count(room, reports):
    classroom.report(reports / "a.json", TEXTS, "")
    os.utime(reports / "a.json", (1, 1))
    assert classroom.reports(room) == {}


def test_texts_and_pictures_of_a_report_are_sanitised(room, reports):
    strange = {"status": ["x"], "script": "s" * 1000, "scene": "\ud800", "picture": '" onerror="alert(1)', "more": 1}
    (reports / "a.json").write_text(json.dumps(strange))
    (user_report,) = classroom.reports(room).values()
    assert user_report == {"status": "['x']", "script": "s" * 200, "scene": "?", "grades": "", "picture": ""}


TOO_LARGE = b'{"status": "' + b"x" * (1 << 18) + b'"}'


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"\xff", b"[" * 200_000, TOO_LARGE])
def test_an_invalid_report_is_ignored(room, reports, content):
    (reports / "a.json").write_bytes(content)
    assert classroom.reports(room) == {}


def test_links_and_special_files_are_not_read(room, reports, tmp_path):
    classroom.report(tmp_path / "elsewhere", TEXTS, "")
    (reports / "a.json").symlink_to(tmp_path / "elsewhere")
    os.link(tmp_path / "elsewhere", reports / "b.json")
    os.mkfifo(reports / "c.json")
    (reports / "d.json").mkdir()
    assert classroom.reports(room) == {}


def test_a_message_to_all_can_be_sent_and_cleared(room):
    classroom.tell_all(room, "Now hover.", "hover")
    message = classroom.message_to_all(room)
    assert (message.text, message.task) == ("Now hover.", "hover")
    assert classroom.reports(room) == {}
    classroom.tell_all(room, "", "")
    assert classroom.message_to_all(room) is None


SCENE = b"floor: {size: 7}\nobjects:\n- {shape: box, size: [1, 1, 1], position: [2, 0, 0.5]}\n"


def test_a_scene_can_be_sent_to_all(room):
    classroom.keep_scene(room, "my gates.yaml", SCENE)
    classroom.tell_all(room, "", "", "my gates.yaml")
    message = classroom.message_to_all(room)
    assert (message.text, message.task, message.scene) == ("", "", "my gates.yaml")
    file = classroom.scenes_folder(room) / message.scene
    assert (file.read_bytes(), file.stat().st_mode & 0o777) == (SCENE, 0o644)


@pytest.mark.parametrize(
    "name", ["", "a", "a.ttt", "../a.yaml", "/etc/a.yaml", ".a.yaml", "a\n.yaml", "x" * 99 + ".yaml", "a\0.yaml"]
)
def test_an_invalid_name_of_a_scene_is_refused(room, name):
    with pytest.raises(ValueError, match="ends in"):
        classroom.keep_scene(room, name, SCENE)
    assert not classroom.scenes_folder(room).exists()


BOMB = "a: &a [1, 1]\n" + "".join(f"{new}: &{new} [*{old}, *{old}]\n" for old, new in pairwise("abcdefghijklmnopqrst"))
HOSTILE = {
    "larger than 1 MiB": b"#" * (1 << 20) + b"\n",
    "values": BOMB.encode(),
    "deep": b"[" * 5000,
    "UTF-8": b"\xff",
    "tag": b"!!python/object/apply:os.system [id]",
    "no such file": b"objects: [{shape: mesh, file: ../../../nowhere.obj, position: [0, 0, 0]}]",
    "regular file": b"objects: [{shape: mesh, file: /dev/zero, position: [0, 0, 0]}]",
    "unknown key": b"sript: x.py",
}


@pytest.mark.parametrize("words", HOSTILE)
def test_an_invalid_scene_is_refused_and_the_last_one_is_kept(room, words):
    classroom.keep_scene(room, "gates.yaml", SCENE)
    with pytest.raises(ValueError, match=words):
        classroom.keep_scene(room, "gates.yaml", HOSTILE[words])
    (stored_file,) = classroom.scenes_folder(room).iterdir()
    assert stored_file.read_bytes() == SCENE


@pytest.mark.parametrize("content", ["", "[1]", '{"text": "x"}'])
def test_a_malformed_message_is_ignored(room, content):
    (room / "to_all.json").write_text(content)
    assert classroom.message_to_all(room) is None


def test_without_the_variable_there_is_no_course(monkeypatch):
    monkeypatch.delenv(classroom.VARIABLE, raising=False)
    assert classroom.folder() is None
