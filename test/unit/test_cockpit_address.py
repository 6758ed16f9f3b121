"""Where the cockpit listens, the addresses that it prints, which can be opened, and what else may be set."""

import socket
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.ros.cockpit.main import read_parameters
from drone_sim.ros.cockpit.server import address


@pytest.fixture
def taken():
    """A port that somebody else listens on."""
    with socket.create_server(("127.0.0.1", 0)) as one:
        yield one.getsockname()[1]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0"])
def test_a_port_that_is_taken_is_left_out(taken, host):
    found, port = address.free_place(host, taken)
    assert found == ("0.0.0.0" if host == "0.0.0.0" else "127.0.0.1")
    assert taken < port < taken + 100


def test_a_port_that_has_just_been_left_is_free():
    """As when the cockpit is started again: connections that are closing there do not count."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)):
            server.accept()[0].close()  # which was the first to go
    assert address.free_place("127.0.0.1", port) == ("127.0.0.1", port)


@pytest.mark.parametrize("port", [-1, 65536, 99999, "abc", 80.5, True, None])
def test_what_is_no_port_is_told(port):
    with pytest.raises(address.AddressError, match=rf"^port = {port}: must be a whole number from 0 to 65535"):
        address.free_place("127.0.0.1", port)


@pytest.mark.parametrize("given", ["192.0.2.77", "", "8080", 5, None, "\0", "x" * 300])
def test_what_is_no_address_of_this_machine_is_told(given):
    with pytest.raises(address.AddressError, match=r"^address = .*: is not an address of this machine; ") as raised:
        address.free_place(given, 8080)
    assert len(str(raised.value)) < 250


def test_ports_for_root_are_told(monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket.socket, "listen", refuse)
    with pytest.raises(address.AddressError, match=r"^port = 80: only root may use it"):
        address._is_free(socket.AF_INET, "127.0.0.1", 80)


def test_where_no_port_is_free_it_is_told(monkeypatch):
    monkeypatch.setattr(address, "_is_free", lambda family, host, port: port == 0)
    with pytest.raises(address.AddressError, match=r"^port = 65500: all ports from 65500 to 65535"):
        address.free_place("127.0.0.1", 65500)


def test_printed_addresses_can_be_opened():
    assert address.urls("127.0.0.1", 8080, "T") == ("http://127.0.0.1:8080/?token=T", "")
    assert address.urls("::1", 8080, "T") == ("http://[::1]:8080/?token=T", "")
    here, elsewhere = address.urls("0.0.0.0", 8080, "T")
    assert here == "http://127.0.0.1:8080/?token=T"
    assert elsewhere.endswith(":8080/?token=T") and "0.0.0.0" not in elsewhere


def test_without_a_network_the_machine_goes_by_its_name(monkeypatch):
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
def test_wrong_settings_are_told_in_a_line(given, words):
    with pytest.raises((ValueError, OSError)) as raised:
        read_parameters(given)
    assert str(raised.value) == words
