"""Host, port and other parameters of the cockpit, the URLs that it prints, and where its token is written."""

import logging
import os
import re
import socket
import stat
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.ros.cockpit import cockpit, main
from drone_sim.ros.cockpit.main import read_parameters
from drone_sim.ros.cockpit.server import address
from drone_sim.ros.cockpit.server.address import address_file, print_to_terminal


@pytest.fixture
def taken():
    """A port on which another socket listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener.getsockname()[1]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0"])
def test_a_port_in_use_is_skipped(taken, host):
    bound_host, port = address.free_place(host, taken)
    assert bound_host == ("0.0.0.0" if host == "0.0.0.0" else "127.0.0.1")
    assert taken < port < taken + 100


def test_a_port_with_closing_connections_counts_as_free():
    """As after a restart of the cockpit: connections in TIME_WAIT do not count."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)):
            server.accept()[0].close()  # the server closes first, so that its side is left in TIME_WAIT
    assert address.free_place("127.0.0.1", port) == ("127.0.0.1", port)


@pytest.mark.parametrize("port", [-1, 65536, 99999, "abc", 80.5, True, None])
def test_an_invalid_port_is_refused(port):
    with pytest.raises(address.AddressError, match=rf"^port = {port}: must be a whole number from 0 to 65535"):
        address.free_place("127.0.0.1", port)


@pytest.mark.parametrize("given", ["192.0.2.77", "", "8080", 5, None, "\0", "x" * 300])
def test_an_address_of_another_machine_is_refused(given):
    with pytest.raises(address.AddressError, match=r"^address = .*: is not an address of this machine; ") as raised:
        address.free_place(given, 8080)
    assert len(str(raised.value)) < 250


def test_a_privileged_port_is_refused(monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket.socket, "listen", refuse)
    with pytest.raises(address.AddressError, match=r"^port = 80: only root may use it"):
        address._is_free(socket.AF_INET, "127.0.0.1", 80)


def test_an_error_is_raised_if_no_port_is_free(monkeypatch):
    monkeypatch.setattr(address, "_is_free", lambda family, host, port: port == 0)
    with pytest.raises(address.AddressError, match=r"^port = 65500: all ports from 65500 to 65535"):
        address.free_place("127.0.0.1", 65500)


def test_printed_addresses_can_be_opened():
    assert address.urls("127.0.0.1", 8080, "T") == ("http://127.0.0.1:8080/?token=T", "")
    assert address.urls("::1", 8080, "T") == ("http://[::1]:8080/?token=T", "")
    here, elsewhere = address.urls("0.0.0.0", 8080, "T")
    assert here == "http://127.0.0.1:8080/?token=T"
    assert elsewhere.endswith(":8080/?token=T") and "0.0.0.0" not in elsewhere


def test_without_a_network_the_url_contains_the_host_name(monkeypatch):
    def refuse(*_):
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "gethostname", lambda: "lab7")
    assert address.urls("0.0.0.0", 8080, "T")[1] == "http://lab7:8080/?token=T"


def test_settings_have_defaults():
    assert read_parameters({}) == ("127.0.0.1", 8080, Path.home() / "drone_scripts", "drone_sim", "")
    assert read_parameters({"port": 8081, "scripts": "/a/b", "simulator": "/x"})[1:] == (8081, Path("/a/b"), "/x", "")


def test_scripts_are_relative_to_the_shell(monkeypatch):
    monkeypatch.setenv("PWD", "/somewhere")
    assert read_parameters({"scripts": "mine"}).scripts == Path("/somewhere/mine")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"prot": 8081}, "prot: is not a parameter of the cockpit; near names are port"),
        ({"scripts": 5}, "scripts = 5: must be the name of a folder"),
        ({"scripts": ""}, "scripts = '': must be the name of a folder"),
        ({"scripts": "~nobody_at_all/x"}, "'~nobody_at_all/x': this user's home folder does not exist"),
        ({"simulator": "bad name!"}, "simulator = 'bad name!': must be the name of a node, such as drone_sim"),
        ({"simulator": [1]}, "simulator = [1]: must be the name of a node, such as drone_sim"),
        (5, "the node's parameters: must be a mapping, not 5"),
    ],
)
def test_a_wrong_setting_gets_one_line(given, words):
    with pytest.raises((ValueError, OSError)) as raised:
        read_parameters(given)
    assert str(raised.value) == words


# ---- where the token is written


ADDRESS = "http://127.0.0.1:8080/?token=secret"


@pytest.fixture(name="home")
def _home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    monkeypatch.delenv("ROS_LOG_DIR", raising=False)
    return tmp_path / "ros"


@pytest.fixture(name="logged")
def _logged(caplog):
    """The lines that rospy sends to its log, to the terminal and to /rosout."""
    lines = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())
    caplog.set_level(logging.DEBUG, "rosout")
    logging.getLogger("rosout").addHandler(handler)
    yield lines
    logging.getLogger("rosout").removeHandler(handler)


def test_the_token_is_printed_and_written_to_a_private_file_but_never_logged(home, logged, monkeypatch, capfd):
    records = []

    class CockpitStub:
        def __init__(self, served, *_):
            self.served = served

        def run(self):
            file = home / "drone_sim" / f"cockpit_{self.served.port}.txt"
            records.append((file, file.read_text(), stat.S_IMODE(file.stat().st_mode)))
            self.served.stop()

    monkeypatch.setattr(cockpit, "Cockpit", CockpitStub)
    monkeypatch.setattr(rospy, "get_param", lambda *_: {"port": 0})
    before = os.umask(0)
    try:
        main._serve()
    finally:
        os.umask(before)
    ((file, address, mode),) = records
    printed = re.search(r"the cockpit is at (\S+)", capfd.readouterr().out)[1]
    assert address == f"{printed}\n" and mode == 0o600 and not file.exists()
    base, _, token = printed.partition("?token=")
    assert len(token) > 20 and logged and base in logged[0] and str(file) in logged[0]
    assert not [line for line in logged if token in line]


def test_a_leftover_address_file_is_replaced_and_a_foreign_file_is_kept(home):
    file = home / "drone_sim" / "cockpit_8080.txt"
    with address_file(ADDRESS, 8080):
        file.unlink()
        file.symlink_to(home / "elsewhere")
        with address_file(f"{ADDRESS}2", 8080):
            assert file.read_text() == f"{ADDRESS}2\n" and not file.is_symlink()
        file.write_text("of another one")
    assert file.read_text() == "of another one" and not (home / "elsewhere").exists()


def test_a_home_that_is_not_a_folder_gets_one_line(home):
    home.write_text("no folder")
    with address_file(ADDRESS, 8080) as message:
        assert re.fullmatch(r"the address with the token is only in the terminal, .*cockpit_8080.txt .+", message)


@pytest.mark.parametrize("inside", [True, False])
def test_the_token_is_not_printed_into_a_log_file_of_roslaunch(home, monkeypatch, inside):
    log = (home / "log" / "run" if inside else home / "mine") / "cockpit-3-stdout.log"
    log.parent.mkdir(parents=True)
    with log.open("w") as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        print_to_terminal(f"the cockpit is at {ADDRESS}")
    assert ("secret" in log.read_text()) is not inside


def test_printing_to_a_closed_terminal_raises_no_error(home, monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w", closefd=False) as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        print_to_terminal("a line")
        os.dup2(os.open(os.devnull, os.O_WRONLY), writing)  # otherwise closing it would fail, too
    os.close(writing)
