"""WebSocket clients that do not behave like the cockpit's page."""

import json
import logging
import queue
import resource
import socket
import struct

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL
from drone_sim.ros.cockpit.server.page_server import PageServer
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import HeldCommands

GIGABYTE = 1 << 30


class CockpitServer:
    def __init__(self):
        self.server = PageServer("127.0.0.1", 0)
        self.token = self.server.address.partition("?token=")[2]
        held_commands = HeldCommands(lambda _: None, lambda: 0.0)
        answers = {"twice": _twice, "open": lambda _: {"text": "a script"}}
        self.server.begin(PageSocket(held_commands, answers, {"fail": _fail}).serve, lambda _path: None)

    def connect(self, protocol=SUBPROTOCOL, query=""):
        cookie = {"Cookie": f"drone_sim_{self.server.port}={self.token}"}
        address = f"ws://127.0.0.1:{self.server.port}/{query}"
        return connect(address, subprotocols=[protocol], additional_headers=cookie, max_size=None)


def _twice(message):
    return {"twice": 2 * message["number"]}


def _fail(_browser, _message):
    raise RuntimeError("of two\nlines")


@pytest.fixture(name="served", scope="module")
def _served():
    served = CockpitServer()
    yield served
    served.server.stop()


@pytest.fixture(name="said")
def _said():
    """Return a function that waits for the next line of the log."""
    lines = queue.Queue()
    handler = logging.Handler()
    handler.emit = lambda record: lines.put(record.getMessage())
    logging.getLogger("rosout").addHandler(handler)
    yield lambda: lines.get(timeout=60)
    logging.getLogger("rosout").removeHandler(handler)
    assert lines.empty(), "one line is enough"


def close_code_and_reason(websocket):
    """Return the code and the reason with which the server closed a websocket."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            websocket.recv(timeout=60)
    return closed.value.rcvd.code, closed.value.rcvd.reason


def test_another_subprotocol_is_refused(served):
    with pytest.raises(InvalidStatus, match="400"):
        served.connect("viewer-1")


def test_an_exception_in_a_handler_closes_the_socket_and_logs_one_line(served, said):
    with served.connect() as websocket:
        websocket.send('{"fail": 1}')
        assert close_code_and_reason(websocket)[0] == 1011
    assert said() == "a browser's socket: RuntimeError: of two lines"


@pytest.mark.parametrize("parts", [1, 1000])
def test_a_message_of_a_gigabyte_is_refused_before_it_is_received(served, said, parts):
    """In one frame, which is refused by its header, or in many frames."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with served.connect() as websocket, socket.socket(fileno=websocket.socket.fileno()) as plain:
        size = GIGABYTE // parts
        try:
            for part in range(parts):  # binary, not the last frame; masked
                plain.sendall(bytes([0 if part else 2, 0x80 | 127]) + struct.pack(">Q", size) + bytes(4))
                plain.sendall(bytes(size if parts > 1 else 0))
        except OSError:  # the server has closed the connection
            pass
        code, close_reason = close_code_and_reason(websocket)
        plain.detach()
    assert code == 1009 and "8388608" in close_reason
    assert said().startswith("a browser at 127.0.0.1 is refused: frame")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100 << 10  # KiB


def test_a_watching_page_may_read(served):
    with served.connect(query="socket?watch") as page:
        page.send(json.dumps({"id": 1, "ask": "open"}))
        assert json.loads(page.recv(timeout=60)) == {"id": 1, "text": "a script"}


@pytest.mark.parametrize(
    "message", [{"ask": "twice", "number": 1}, {"hold": {}}, {"fail": 1}, {"fail": 1, "hold": {}}, {"ask": []}]
)
def test_a_watching_page_may_not_change_anything(served, message):
    with served.connect(query="socket?watch") as page:
        page.send(json.dumps({"id": 1, **message}))
        assert "error" in json.loads(page.recv(timeout=60))


def test_a_request_of_a_watching_page_reaches_no_other_handler(served):
    with served.connect(query="socket?watch") as page:
        page.send(json.dumps({"id": 1, "ask": "open", "fail": 1, "hold": {}}))
        assert json.loads(page.recv(timeout=60)) == {"id": 1, "text": "a script"}
