"""The cockpit behind a proxy of the same user, on a UNIX socket that checks the user instead of a token."""

import http.client
import os
import shutil
import socket
import subprocess
import tempfile

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect, unix_connect

from drone_sim.ros.cockpit.main import read_parameters
from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL
from drone_sim.ros.cockpit.server.address import AddressError
from drone_sim.ros.cockpit.server.page_server import PageServer

HUB = "hub.example"
STATUS_FOR = """
import http.client, socket, sys
connection = http.client.HTTPConnection("hub.example", timeout=60)
connection.sock = socket.socket(socket.AF_UNIX)
connection.sock.connect(sys.argv[1])
connection.request("GET", sys.argv[2], headers={"X-Forwarded-User": "root", "Cookie": sys.argv[3]})
print(connection.getresponse().status)
"""


async def serve(page):
    await page.send("{}")
    await page.wait_closed()


@pytest.fixture(name="path", scope="module")
def _path():
    """The path of a cockpit's UNIX socket; its file permissions let every user write to it."""
    folder = tempfile.mkdtemp()
    os.chmod(folder, 0o755)
    path = f"{folder}/socket"
    server = PageServer("127.0.0.1", 8080, path)
    server.begin(serve, lambda _: None)
    assert server.port == 0 and server.address == server.addresses == ""
    os.chmod(path, 0o777)
    yield path
    server.stop()
    shutil.rmtree(folder)


@pytest.fixture(name="direct", scope="module")
def _direct():
    """Two cockpits on TCP ports, each with its own token, as of two users of one machine."""
    servers = [PageServer("127.0.0.1", 0) for _ in range(2)]
    for server in servers:
        server.begin(serve, lambda _: None)
    yield servers
    for server in servers:
        server.stop()


def answer_of(connection, path="/", **headers):
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer, answer.read()


def connect_to_socket(path):
    connection = http.client.HTTPConnection(HUB, timeout=60)
    connection.sock = socket.socket(socket.AF_UNIX)
    connection.sock.connect(path)
    return connection


def can_open_socket(path, origin, host=HUB):
    try:
        with unix_connect(path, f"ws://{host}/socket", subprotocols=[SUBPROTOCOL], origin=origin) as websocket:
            return websocket.recv(timeout=60) == "{}"
    except InvalidStatus as refused:
        assert refused.response.status_code == 403
        return False


def test_the_proxy_of_the_same_user_needs_no_token(path):
    answer, page = answer_of(connect_to_socket(path))
    assert answer.status == 200 and b"cockpit.js" in page and "Set-Cookie" not in answer.headers
    policy = answer.headers["Content-Security-Policy"]
    assert f"wss://{HUB}" in policy and "frame-ancestors 'self'" in policy
    assert answer_of(connect_to_socket(path), "/return")[0].status == 404, "a UNIX socket has no return pass"


@pytest.mark.parametrize("origin", [f"http://{HUB}", f"https://{HUB}"])
def test_the_page_opens_its_socket_through_the_proxy(path, origin):
    assert can_open_socket(path, origin)


@pytest.mark.parametrize("origin", ["http://evil.example", "null", f"http://{HUB}.evil.example", f"http://{HUB}:81"])
def test_a_page_of_another_origin_opens_no_socket_through_the_proxy(path, origin):
    assert not can_open_socket(path, origin)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_another_user_is_refused_although_the_socket_file_is_writable(path, direct):
    """Neither the cookie of its own cockpit nor the headers of a proxy give access."""
    neighbours_cookie = f"drone_sim_{direct[0].port}={direct[0].address.partition('=')[2]}"
    for cookie in ("", neighbours_cookie):
        command = ["/usr/bin/python3", "-S", "-c", STATUS_FOR, path, "/", cookie]  # every user may run it
        child = subprocess.run(command, user="nobody", cwd="/", capture_output=True, text=True, check=False, timeout=60)
        assert child.stdout.strip() == "403", child.stderr


def test_another_users_cookie_and_proxy_headers_are_refused_on_the_tcp_port(direct):
    ours, neighbours = direct
    token = neighbours.address.partition("=")[2]
    for port in (ours.port, neighbours.port):
        headers = {
            "Cookie": f"drone_sim_{port}={token}",
            "X-Forwarded-Host": f"127.0.0.1:{neighbours.port}",
            "X-Forwarded-User": "root",
            "X-Forwarded-Prefix": "/user/a",
        }
        answer, body = answer_of(http.client.HTTPConnection(f"127.0.0.1:{ours.port}", timeout=60), **headers)
        assert answer.status == 403 and b"token" in body


def test_a_forwarded_host_does_not_allow_another_origin(direct):
    server = direct[0]
    cookie = f"drone_sim_{server.port}={server.address.partition('=')[2]}"
    headers = {"Cookie": cookie, "X-Forwarded-Host": "evil.example", "Forwarded": "host=evil.example"}
    address = f"ws://127.0.0.1:{server.port}/socket"
    with pytest.raises(InvalidStatus, match="403"):
        connect(address, subprotocols=[SUBPROTOCOL], additional_headers=headers, origin="http://evil.example")


def test_the_cookie_is_limited_to_the_folder_of_the_page(direct):
    """Behind a URL prefix, which the server does not know, browsers do not send it to the prefixes of other users."""
    server = direct[0]
    query = server.address.partition("/?")[2]
    answer, _ = answer_of(http.client.HTTPConnection(f"127.0.0.1:{server.port}", timeout=60), f"/?{query}")
    assert answer.status == 303 and answer.headers["Location"] == "./"
    assert "path" not in answer.headers["Set-Cookie"].lower()
    answer, _ = answer_of(http.client.HTTPConnection(f"127.0.0.1:{server.port}", timeout=60), f"/mesh/a?{query}")
    assert answer.status == 403 and "Set-Cookie" not in answer.headers, "the cookie would belong to another folder"


def test_a_socket_that_cannot_be_created_is_reported():
    with pytest.raises(AddressError, match=r"^socket = /nowhere/socket: No such file"):
        PageServer("127.0.0.1", 8080, "/nowhere/socket")
    with pytest.raises(ValueError, match=r"^socket = 5: must be the name of a UNIX socket"):
        read_parameters({"socket": 5})
    assert read_parameters({"socket": "none"}).socket == ""
