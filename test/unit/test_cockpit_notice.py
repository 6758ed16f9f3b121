"""Who hears of the cockpit's token: the terminal, and a file for its user alone; no log does."""

import logging
import os
import re
import stat

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit import cockpit, main
from drone_sim.ros.cockpit.server.address import address_file, print_to_terminal

ADDRESS = "http://127.0.0.1:8080/?token=secret"


@pytest.fixture(name="home")
def _home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    monkeypatch.delenv("ROS_LOG_DIR", raising=False)
    return tmp_path / "ros"


@pytest.fixture(name="logged")
def _logged(caplog):
    """What rospy sends to its log, to the terminal and to /rosout."""
    lines = []
    heard = logging.Handler()
    heard.emit = lambda record: lines.append(record.getMessage())
    caplog.set_level(logging.DEBUG, "rosout")
    logging.getLogger("rosout").addHandler(heard)
    yield lines
    logging.getLogger("rosout").removeHandler(heard)


def test_the_token_is_on_the_terminal_and_in_a_file_and_in_no_log(home, logged, monkeypatch, capfd):
    seen = []

    class Looked:
        def __init__(self, served, *_):
            self.served = served

        def run(self):
            file = home / "drone_sim" / f"cockpit_{self.served.port}.txt"
            seen.append((file, file.read_text(), stat.S_IMODE(file.stat().st_mode)))
            self.served.stop()

    monkeypatch.setattr(cockpit, "Cockpit", Looked)
    monkeypatch.setattr(rospy, "get_param", lambda *_: {"port": 0})
    before = os.umask(0)
    try:
        main._serve()
    finally:
        os.umask(before)
    ((file, address, mode),) = seen
    printed = re.search(r"the cockpit is at (\S+)", capfd.readouterr().out)[1]
    assert address == f"{printed}\n" and mode == 0o600 and not file.exists()
    base, _, token = printed.partition("?token=")
    assert len(token) > 20 and logged and base in logged[0] and str(file) in logged[0]
    assert not [line for line in logged if token in line]


def test_the_file_of_one_that_was_killed_is_made_anew_and_another_ones_is_left(home):
    file = home / "drone_sim" / "cockpit_8080.txt"
    with address_file(ADDRESS, 8080):
        file.unlink()
        file.symlink_to(home / "elsewhere")
        with address_file(f"{ADDRESS}2", 8080):
            assert file.read_text() == f"{ADDRESS}2\n" and not file.is_symlink()
        file.write_text("of another one")
    assert file.read_text() == "of another one" and not (home / "elsewhere").exists()


def test_a_home_that_holds_no_file_is_told_in_one_line(home):
    home.write_text("no folder")
    with address_file(ADDRESS, 8080) as where:
        assert re.fullmatch(r"the address with the token is only in the terminal, .*cockpit_8080.txt .+", where)


@pytest.mark.parametrize("inside", [True, False])
def test_the_log_that_roslaunch_makes_of_a_node_is_left_without(home, monkeypatch, inside):
    log = (home / "log" / "run" if inside else home / "mine") / "cockpit-3-stdout.log"
    log.parent.mkdir(parents=True)
    with log.open("w") as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        print_to_terminal(f"the cockpit is at {ADDRESS}")
    assert ("secret" in log.read_text()) is not inside


def test_a_terminal_that_is_gone_ends_nothing(home, monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w", closefd=False) as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        print_to_terminal("a line")
        os.dup2(os.open(os.devnull, os.O_WRONLY), writing)  # or to close it would fail, too
    os.close(writing)
