"""Tabs that come back after a new start of the cockpit on the same port, and the heartbeat that browsers hear."""

import hashlib
import hmac
import http.client
import os
import socket
import stat
import xmlrpc.server
from threading import Thread

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.ros.cockpit.panel import pulse
from drone_sim.ros.cockpit.panel.pulse import Pulse, has_ended
from drone_sim.ros.cockpit.server.address import free_place
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.cockpit.server.return_pass import key_of_port


@pytest.fixture(name="home")
def _home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    return tmp_path / "drone_sim"


def get(port, path):
    connection = http.client.HTTPConnection(f"127.0.0.1:{port}", timeout=5)
    connection.request("GET", path)
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers.get("Set-Cookie", "")


def signed(key, challenge):
    return hmac.new(bytes.fromhex(key), challenge.encode(), hashlib.sha256).hexdigest()


def test_a_tab_returns_to_the_next_cockpit_of_the_port_and_never_sends_the_key(home):
    _, port = free_place("127.0.0.1", 20_000 + os.getpid() % 10_000)
    first = PageServer("127.0.0.1", port)
    key, token = first.return_pass.key, first.address.partition("?token=")[2]
    first.stop()
    second = PageServer("127.0.0.1", port)
    try:
        assert second.address.partition("?token=")[2] != token
        status, challenge, cookie = get(port, "/return")
        assert status == 200 and not cookie
        wrong = f"/return?challenge={challenge}&signature={signed('00' * 32, challenge)}"
        assert get(port, wrong)[0] == 403
        right = f"/return?challenge={challenge}&signature={signed(key, challenge)}"
        assert get(port, right)[0] == 403, "a challenge is good for one try"
        challenge = get(port, "/return")[1]
        right = f"/return?challenge={challenge}&signature={signed(key, challenge)}"
        status, _, cookie = get(port, right)
        assert status == 200 and second.address.partition("?token=")[2] in cookie and "HttpOnly" in cookie
        assert get(port, right)[0] == 403
        for odd in ("?signature=%ff&challenge=%00", f"?challenge={challenge}&signature=x&signature=y"):
            assert get(port, f"/return{odd}")[0] == 403
    finally:
        second.stop()


def test_the_key_is_the_users_alone_and_a_file_that_others_can_read_is_replaced(home):
    key = key_of_port(8080)
    file = home / "cockpit_8080.key"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600 and key_of_port(8080) == key != key_of_port(8081)
    file.chmod(0o640)
    assert key_of_port(8080) != key and stat.S_IMODE(file.stat().st_mode) == 0o600
    for damaged in ("", "00", "no digits", "0" * 1000):
        file.write_text(damaged)
        assert len(key_of_port(8080)) == 32 and key_of_port(8080) == bytes.fromhex(file.read_text())
    file.unlink()
    file.symlink_to(home / "elsewhere")
    assert len(key_of_port(8080)) == 32 and not file.is_symlink() and not (home / "elsewhere").exists()


def test_a_home_that_cannot_be_written_and_a_port_of_any_number_keep_no_key(home):
    home.parent.rmdir()
    home.parent.write_text("no folder")
    assert key_of_port(8080) != key_of_port(8080)
    home.parent.unlink()
    assert key_of_port(0) != key_of_port(0) and not home.exists()


# ---- the heartbeat


def test_the_silence_of_the_simulator_is_told_while_there_is_one(monkeypatch):
    now = [10.0]
    monkeypatch.setattr(pulse.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(pulse, "has_ended", lambda node: node == "/gone")
    beat = Pulse("/gone", lambda _: None)
    now[0] += 100.0
    beat.hear()
    assert beat.state() == {"silent": 0.0, "ended": False}, "nothing is expected yet"
    beat.expect(True)
    now[0] += 2.0
    assert beat.state() == {"silent": 2.0, "ended": False}
    now[0] += 2.0
    assert beat.state() == {"silent": 4.0, "ended": True}
    beat.hear()
    assert beat.state() == {"silent": 0.0, "ended": False}
    now[0] += 50.0
    beat.expect(False)
    assert beat.state() == {"silent": 0.0, "ended": False}


@pytest.fixture(name="master")
def _master(monkeypatch):
    """A ROS master that knows nodes by their addresses."""
    nodes = {}
    server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    found = lambda _, node: (1, "", nodes[node]) if node in nodes else (-1, "unknown node", "")  # noqa: E731
    server.register_function(found, "lookupNode")
    server.register_function(lambda _: (1, "", 1), "getPid")
    Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{server.server_address[1]}")
    yield nodes
    server.shutdown()
    server.server_close()


def test_a_killed_node_has_ended_and_a_stopped_one_has_not(master):
    with socket.create_server(("127.0.0.1", 0)) as stopped:  # accepts, and does not answer
        master["/stopped"] = f"http://127.0.0.1:{stopped.getsockname()[1]}"
        assert not has_ended("/stopped")
        master["/killed"] = master["/stopped"]
    assert has_ended("/killed") and has_ended("/unknown")
    master["/alive"] = os.environ["ROS_MASTER_URI"]
    assert not has_ended("/alive")


def test_without_a_master_nothing_is_known(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as one:
        port = one.getsockname()[1]
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
    assert not has_ended("/node")
