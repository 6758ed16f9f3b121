"""Browsers' sockets that say something else than our page does."""

import logging
import queue
import resource
import socket
import struct

import pytest

pytest.importorskip("rospy", reason="needs ROS")
pytest.importorskip("viser")

import msgspec
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL, AccessControl
from drone_sim.ros.cockpit.server.page_server import page_files
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import HeldCommands

TOKEN = "secret-token"
VISER = f"viser-v{viser.__version__}"
GIGABYTE = 1 << 30


class Served:
    def __init__(self):
        socket = PageSocket(
            HeldCommands(lambda _: None, lambda: 0.0), {"twice": lambda message: {"twice": 2 * message["number"]}}
        )
        with AccessControl(TOKEN, page_files().get, socket.serve).before_viser():
            self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        self.port = self.server.get_port()
        self.asked = []
        self.server.request_share_url = lambda *_: self.asked.append("share")
        self.server.disconnect_share_url = lambda *_: self.asked.append("share no more")

    def connect(self, protocol):
        cookie = {"Cookie": f"drone_sim_{self.port}={TOKEN}"}
        address = f"ws://127.0.0.1:{self.port}/"
        return connect(address, subprotocols=[protocol], additional_headers=cookie, max_size=None)


@pytest.fixture(name="served", scope="module")
def _served():
    served = Served()
    yield served
    served.server.stop()


@pytest.fixture(name="said")
def _said():
    """The lines that the user is told, as they come."""
    lines = queue.Queue()
    heard = logging.Handler()
    heard.emit = lambda record: lines.put(record.getMessage())
    logging.getLogger("rosout").addHandler(heard)
    yield lambda: lines.get(timeout=10)
    logging.getLogger("rosout").removeHandler(heard)
    assert lines.empty(), "one line is enough"


def ended(one):
    """Return how the node closed a socket: the code, and why."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            one.recv(timeout=10)
    return closed.value.rcvd.code, closed.value.rcvd.reason


@pytest.mark.parametrize(
    "kind", ["ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload", "FileTransferPart"]
)
def test_what_would_open_the_cockpit_to_the_world_is_refused_in_the_server(served, said, kind):
    with served.connect(VISER) as one:
        one.send(msgspec.msgpack.encode({"type": kind}))
        assert ended(one) == (1008, f"{kind}: is not for this page")
    assert served.asked == [] and said() == f"a browser at 127.0.0.1 is sent away: {kind}: is not for this page"


@pytest.mark.parametrize(
    "message",
    [b"", b"\xc1", "text", b"\x81\xa4type\x01", msgspec.msgpack.encode([1]), b"\x91" * 5000, b"\xdf\xff\xff\xff\xff"],
)
def test_what_is_no_message_of_visers_ends_that_socket_with_one_line(served, said, message):
    with served.connect(VISER) as one:
        one.send(message)
        assert ended(one) == (1008, "no message of viser's")
    assert said() == "a browser at 127.0.0.1 is sent away: no message of viser's"


def test_a_message_of_visers_that_it_cannot_read_ends_that_socket_with_one_line(served, said):
    for message in ({"type": "NoSuchMessage"}, {"type": "ViewerCameraMessage", "fov": "wide"}):
        with served.connect(VISER) as one:
            one.send(msgspec.msgpack.encode(message))
            assert ended(one)[0] == 1011
        assert said().startswith("a browser's socket: ")


def test_what_viser_cannot_do_with_a_message_is_one_line_and_nothing_else(served, said):
    field = served.server.gui.add_slider("Speed", min=0.0, max=1.0, step=0.1, initial_value=0.5)
    with served.connect(VISER) as one:
        update = {"type": "GuiUpdateMessage", "uuid": field._impl.uuid, "updates": {"value": [1]}}
        one.send(msgspec.msgpack.encode(update))
        assert said().startswith("a browser's message: TypeError: ") and field.value == 0.5
        one.ping().wait(10)
    field.remove()


@pytest.mark.parametrize("protocol", [SUBPROTOCOL, VISER])
@pytest.mark.parametrize("parts", [1, 1000])
def test_a_gigabyte_is_refused_before_it_is_taken(served, said, protocol, parts):
    """In one frame, of which the head alone is believed, or in many."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with served.connect(protocol) as one, socket.socket(fileno=one.socket.fileno()) as plain:
        size = GIGABYTE // parts
        try:
            for part in range(parts):  # binary, more to come; masked
                plain.sendall(bytes([0 if part else 2, 0x80 | 127]) + struct.pack(">Q", size) + bytes(4))
                plain.sendall(bytes(size if parts > 1 else 0))
        except OSError:  # it has hung up
            pass
        code, why = ended(one)
        plain.detach()
    assert code == 1009 and "8388608" in why
    assert said().startswith("a browser at 127.0.0.1 is sent away: frame")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100 << 10  # KiB
