"""Simulators of a course report to a folder in which students can put whatever they like."""

import json
import os
import pwd

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


def test_the_last_report_of_a_user_counts(room):
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


def test_texts_and_pictures_of_strangers_are_limited(room, reports):
    strange = {"status": ["x"], "script": "s" * 1000, "scene": "\ud800", "picture": '" onerror="alert(1)', "more": 1}
    (reports / "a.json").write_text(json.dumps(strange))
    (found,) = classroom.reports(room).values()
    assert found == {"status": "['x']", "script": "s" * 200, "scene": "?", "grades": "", "picture": ""}


TOO_LARGE = b'{"status": "' + b"x" * (1 << 18) + b'"}'


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"\xff", b"[" * 200_000, TOO_LARGE])
def test_what_is_no_report_is_ignored(room, reports, content):
    (reports / "a.json").write_bytes(content)
    assert classroom.reports(room) == {}


def test_links_and_special_files_are_not_read(room, reports, tmp_path):
    classroom.report(tmp_path / "elsewhere", TEXTS, "")
    (reports / "a.json").symlink_to(tmp_path / "elsewhere")
    os.link(tmp_path / "elsewhere", reports / "b.json")
    os.mkfifo(reports / "c.json")
    (reports / "d.json").mkdir()
    assert classroom.reports(room) == {}


def test_a_message_reaches_all_and_ends(room):
    classroom.tell_all(room, "Now hover.", "hover")
    message = classroom.message_to_all(room)
    assert (message.text, message.task) == ("Now hover.", "hover")
    assert classroom.reports(room) == {}
    classroom.tell_all(room, "", "")
    assert classroom.message_to_all(room) is None


@pytest.mark.parametrize("content", ["", "[1]", '{"text": "x"}'])
def test_a_broken_message_is_none(room, content):
    (room / "to_all.json").write_text(content)
    assert classroom.message_to_all(room) is None


def test_without_the_variable_there_is_no_course(monkeypatch):
    monkeypatch.delenv(classroom.VARIABLE, raising=False)
    assert classroom.folder() is None
