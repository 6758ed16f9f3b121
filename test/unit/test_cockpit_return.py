"""Tabs that reconnect after a restart of the cockpit on the same port, and the heartbeat of the simulator."""

import hashlib
import hmac
import http.client
import json
import os
import socket
import stat
import xmlrpc.server
from threading import Thread
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from websockets.sync.client import connect

from drone_sim.ros.cockpit.panel import panel
from drone_sim.ros.cockpit.panel.panel import Pulse, has_ended
from drone_sim.ros.cockpit.server import access_control, page_server
from drone_sim.ros.cockpit.server import return_pass as return_pass_module
from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL
from drone_sim.ros.cockpit.server.address import free_place
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.cockpit.server.return_pass import ReturnPass, is_local, new_pass


@pytest.fixture(name="home")
def _home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    return tmp_path / "drone_sim"


def get(port, path):
    connection = http.client.HTTPConnection(f"127.0.0.1:{port}", timeout=60)
    connection.request("GET", path)
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers.get("Set-Cookie", "")


def signed(key, challenge):
    return hmac.new(bytes.fromhex(key), challenge.encode(), hashlib.sha256).hexdigest()


def first_message(server):
    """Return the first message that a tab with the token gets."""
    token = server.address.partition("?token=")[2]
    cookie = {"Cookie": f"drone_sim_{server.port}={token}"}
    address = f"ws://127.0.0.1:{server.port}/socket"
    with connect(address, subprotocols=[SUBPROTOCOL], additional_headers=cookie) as tab:
        return json.loads(tab.recv(timeout=60))


def key_of_a_tab(server):
    return first_message(server)["pass"]


def status_of_answer(key, port):
    """Return the HTTP status that a tab gets after it has signed a challenge with `key`."""
    challenge = get(port, "/return")[1]
    return get(port, f"/return?challenge={challenge}&signature={signed(key, challenge)}")[0]


async def greet(connection):
    """Serve a tab with one message, which the server sends after the key."""
    await connection.send("{}")
    await connection.wait_closed()


@pytest.fixture(name="start")
def _start(home):
    """Return a function that stops the running cockpit and starts the next one on the same port."""
    _, port = free_place("127.0.0.1", 20_000 + os.getpid() % 10_000)
    running = []

    def start():
        while running:
            running.pop().stop()
        running.append(PageServer("127.0.0.1", port))
        running[0].begin(greet, lambda _: None)
        assert running[0].port == port
        return running[0]

    yield start
    while running:
        running.pop().stop()


def test_a_tab_returns_to_the_next_cockpit_on_the_port_by_a_signed_challenge(start):
    first = start()
    key, token = key_of_a_tab(first), first.address.partition("?token=")[2]
    second = start()
    port = second.port
    assert second.address.partition("?token=")[2] != token
    status, challenge, cookie = get(port, "/return")
    assert status == 200 and not cookie
    wrong = f"/return?challenge={challenge}&signature={signed('00' * 32, challenge)}"
    assert get(port, wrong)[0] == 403
    right = f"/return?challenge={challenge}&signature={signed(key, challenge)}"
    status, _, cookie = get(port, right)
    assert status == 200 and second.address.partition("?token=")[2] in cookie and "HttpOnly" in cookie
    assert get(port, right)[0] == 403, "a challenge is good for one return"
    for invalid_query in ("?signature=%ff&challenge=%00", f"?challenge={challenge}&signature=x&signature=y"):
        assert get(port, f"/return{invalid_query}")[0] == 403


def test_a_key_is_valid_for_one_restart_only(start):
    old = key_of_a_tab(start())
    second = key_of_a_tab(start())
    assert second != old
    port = start().port
    assert status_of_answer(old, port) == 403, "a new start revokes access"
    assert status_of_answer(second, port) == 200


def test_a_key_is_not_valid_before_the_next_start(start):
    server = start()
    assert status_of_answer(key_of_a_tab(server), server.port) == 403


def test_a_challenge_stays_valid_after_many_other_challenges():
    return_pass = ReturnPass(bytes(32), bytes(32))
    challenge = return_pass.challenge()
    for _ in range(1000):
        return_pass.challenge()
    assert return_pass.is_signed(challenge, signed("00" * 32, challenge))


def test_a_challenge_is_valid_once_for_half_a_minute_in_its_own_process(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(return_pass_module.time, "monotonic", lambda: now[0])
    return_pass, key = ReturnPass(bytes(32), b""), "00" * 32
    for forged in ("", "1.2.3", ReturnPass(bytes(32), b"").challenge()):
        assert not return_pass.is_signed(forged, signed(key, forged)), "not a challenge of this process"
    early, late = return_pass.challenge(), return_pass.challenge()
    now[0] += 29.0
    assert return_pass.is_signed(early, signed(key, early)) and not return_pass.is_signed(early, signed(key, early))
    now[0] += 2.0
    assert not return_pass.is_signed(late, signed(key, late))
    assert not return_pass.is_signed(early, signed(key, early))


@pytest.mark.parametrize(
    ("peer", "may"),
    [
        *((one, True) for one in ("127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1")),
        *((one, False) for one in ("192.0.2.1", "::ffff:192.0.2.1", "2001:db8::1", "fe80::1%lo")),
    ],
)
def test_clients_of_this_machine_are_recognised_by_their_address(peer, may):
    assert is_local(SimpleNamespace(remote_address=(peer, 1))) is may


def test_clients_of_other_machines_get_no_key_and_may_not_return(start, monkeypatch):
    key = key_of_a_tab(start())
    server = start()
    challenge = get(server.port, "/return")[1]
    right = f"/return?challenge={challenge}&signature={signed(key, challenge)}"
    with monkeypatch.context() as from_another_machine:
        for module in (access_control, page_server):
            from_another_machine.setattr(module, "is_local", lambda _: False)
        assert get(server.port, "/return")[0] == 403 and get(server.port, right)[0] == 403
        assert "pass" not in first_message(server)
    assert get(server.port, right)[0] == 200


def test_the_key_file_is_private_and_a_file_readable_by_others_is_ignored(home):
    stored_key = new_pass(8080).key
    file = home / "cockpit_8080.key"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600 and file.read_text() == stored_key != new_pass(8081).key
    assert is_accepted(stored_key, new_pass(8080))
    stored_key = file.read_text()
    file.chmod(0o640)
    assert not is_accepted(stored_key, new_pass(8080)) and stat.S_IMODE(file.stat().st_mode) == 0o600
    for damaged in ("", "00", "no digits", "0" * 1000):
        file.write_text(damaged)
        assert not is_accepted("00" * 32, new_pass(8080)) and len(file.read_text()) == 64
    file.unlink()
    file.symlink_to(home / "elsewhere")
    new_pass(8080)
    assert not file.is_symlink() and not (home / "elsewhere").exists()
    assert sorted(one.name for one in home.iterdir()) == ["cockpit_8080.key", "cockpit_8081.key"]


def is_accepted(key, return_pass):
    challenge = return_pass.challenge()
    return return_pass.is_signed(challenge, signed(key, challenge))


def test_port_0_and_a_home_that_is_not_a_folder_give_no_key(home):
    PageServer("127.0.0.1", 0).stop()
    assert not home.exists()
    home.parent.rmdir()
    home.parent.write_text("no folder")
    assert new_pass(8080) is None


def test_a_cockpit_that_cannot_bind_the_port_does_not_revoke_the_key(home, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        monkeypatch.setattr(page_server, "free_place", lambda *_: ("127.0.0.1", port))
        with pytest.raises(OSError):
            PageServer("127.0.0.1", port)
    assert not home.exists()


# ---- the heartbeat


def test_a_silent_simulator_is_reported_as_frozen(monkeypatch):
    now = [10.0]
    monkeypatch.setattr(panel.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(panel, "has_ended", lambda node: node == "/gone")
    beat = Pulse("/gone", lambda _: None)
    now[0] += 100.0
    beat.hear()
    assert beat.state() == {"silent": 0.0, "frozen": False, "ended": False}, "no message is expected yet"
    beat.expect(True)
    now[0] += 4.0
    assert beat.state() == {"silent": 4.0, "frozen": False, "ended": False}, "the simulator may be busy"
    now[0] += 2.0
    assert beat.state() == {"silent": 6.0, "frozen": True, "ended": True}
    beat.hear()
    assert beat.state() == {"silent": 0.0, "frozen": False, "ended": False}
    now[0] += 50.0
    beat.expect(False)
    assert beat.state() == {"silent": 0.0, "frozen": False, "ended": False}


@pytest.fixture(name="master")
def _master(monkeypatch):
    """A ROS master that knows nodes by their addresses."""
    nodes = {}
    server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    look_up = lambda _, node: (1, "", nodes[node]) if node in nodes else (-1, "unknown node", "")  # noqa: E731
    server.register_function(look_up, "lookupNode")
    server.register_function(lambda _: (1, "", 1), "getPid")
    Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{server.server_address[1]}")
    yield nodes
    server.shutdown()
    server.server_close()


def test_a_killed_node_has_ended_and_a_frozen_node_has_not(master, monkeypatch):
    monkeypatch.setattr(panel, "_TIMEOUT", 60)
    with socket.create_server(("127.0.0.1", 0)) as stopped:  # accepts, and does not answer
        master["/stopped"] = f"http://127.0.0.1:{stopped.getsockname()[1]}"
        with monkeypatch.context() as impatient:
            impatient.setattr(panel, "_TIMEOUT", 0.5)
            assert not has_ended("/stopped")
        master["/killed"] = master["/stopped"]
    assert has_ended("/killed") and has_ended("/unknown")
    master["/alive"] = os.environ["ROS_MASTER_URI"]
    assert not has_ended("/alive")


def test_without_a_master_no_node_counts_as_ended(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as one:
        port = one.getsockname()[1]
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
    assert not has_ended("/node")
