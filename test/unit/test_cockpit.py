"""The parts of the cockpit that need no browser: who comes in, who flies, which files may be written, what is shown."""

import http.client
import json
import socket
import threading
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")
pytest.importorskip("viser")

import rospy
import trimesh
import viser
from browser_scene import Scene, marker
from geometry_msgs.msg import Point, TransformStamped
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from drone_sim.ros.cockpit.cockpit import Cockpit
from drone_sim.ros.cockpit.scene import looks
from drone_sim.ros.cockpit.scene.frames import FrameTree
from drone_sim.ros.cockpit.scene.markers import MarkerNodes
from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL, AccessControl
from drone_sim.ros.cockpit.server.page_server import PageServer, page_files
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import HeldCommands, read_command
from drone_sim.ros.cockpit.topics import FoundTopics, ImageTopic, find_topics
from drone_sim.ros.core.simulator import script_failure
from drone_sim.ros.tools.commands import Command

TOKEN = "secret-token"


# ---- who comes in


class Served:
    def __init__(self):
        self.sent = []
        self.flying = HeldCommands(self.sent.append, lambda: 0.0)
        self.socket = PageSocket(self.flying, {"double": lambda message: {"twice": 2 * message["number"]}})
        with AccessControl(TOKEN, page_files().get, self.socket.serve).before_viser():
            self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        self.host = f"127.0.0.1:{self.server.get_port()}"

    def get(self, path, **headers):
        connection = http.client.HTTPConnection(self.host, timeout=5)
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer, answer.read()

    @property
    def cookie(self):
        return f"drone_sim_{self.host.rpartition(':')[2]}={TOKEN}"

    def connect(self, cookie=None, origin=None, path="/socket"):
        headers = {"Cookie": self.cookie if cookie is None else cookie}
        return connect(f"ws://{self.host}{path}", subprotocols=[SUBPROTOCOL], additional_headers=headers, origin=origin)


@pytest.fixture(name="served", scope="module")
def _served():
    served = Served()
    yield served
    served.server.stop()


@pytest.mark.parametrize(
    "path", ["/", "/scene/", "/cockpit.js", "/?token=", "/?token=wrong", "/../../etc/passwd", "/socket"]
)
def test_without_the_token_nothing_is_served(served, path):
    status, _, body = served.get(path)
    assert status == 403 and b"?token=" in body
    assert served.get(path, Cookie="drone_sim_1=x; =;;")[0] == 403


def test_the_token_lets_in_and_leaves_the_address(served):
    status, answer, _ = served.get(f"/?token={TOKEN}")
    assert status == 303 and answer.headers["Location"] == "/"
    cookie = answer.headers["Set-Cookie"]
    assert cookie.startswith(served.cookie) and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    for path, word in (("/", b"cockpit.js"), ("/cockpit.js", b"cm-editor"), ("/scene/", b"<html")):
        status, _, body = served.get(path, Cookie=served.cookie)
        assert status == 200 and word in body.lower()
    assert served.get("/nothing.html", Cookie=served.cookie)[0] == 404
    assert served.get("/__init__.py", Cookie=served.cookie)[0] == 404


@pytest.mark.parametrize("path", ["/", "/cockpit.js", "/scene/", "/scene/nothing", "/nothing", "/?token=wrong"])
def test_every_answer_says_what_a_browser_may_do_with_it(served, path):
    cookie = {} if "wrong" in path else {"Cookie": served.cookie}
    _, answer, _ = served.get(path, **cookie)
    assert answer.headers.get_all("X-Frame-Options") == ["SAMEORIGIN"]
    assert answer.headers["Referrer-Policy"] == "no-referrer" and answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    policy = dict(one.strip().partition(" ")[::2] for one in answer.headers["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == policy["base-uri"] == policy["form-action"] == "'none'"
    assert policy["frame-ancestors"] == "'self'"
    here = ("'self'", "data:", "blob:", f"ws://{served.host}", f"wss://{served.host}")
    assert set(policy.get("connect-src", "").split()) <= set(here)
    assert "unsafe" not in policy.get("script-src", "") or path.startswith("/scene/")


def raw(served, *lines):
    """Return the status and the text that such lines get for an answer."""
    with socket.create_connection(("127.0.0.1", served.server.get_port()), timeout=5) as one:
        one.sendall(b"\r\n".join((*lines, b"", b"")))
        said = b"".join(iter(lambda: one.recv(4096), b""))
    head, _, body = said.partition(b"\r\n\r\n")
    return int(head.split()[1]), body.decode()


@pytest.mark.parametrize(
    "path, headers, status, words",
    [
        ("/", ["Host: a", "Cookie: a=b", "Cookie: c=d"], 400, "Cookie: must not be given twice"),
        ("/", ["Host: a", "Host: b"], 400, "Host: must not be given twice"),
        ("/", ["Host: a", "Origin: a", "Origin: b"], 400, "Origin: must not be given twice"),
        ("/", ["Host: a", "Upgrade: websocket", "Upgrade: websocket"], 400, "Upgrade: must not be given twice"),
        ("/scene/", ["Host: a", "Accept-Encoding: gzip", "Accept-Encoding: br"], 400, "Accept-Encoding: must not be"),
        ("/", ["Host: a; script-src *"], 400, "Host: must be a name or an address"),
        ("/?token=\xff\xe9", ["Host: a"], 403, "?token="),
        ("/?token=%ff%ed%a0%80", ["Host: a"], 403, "?token="),
        ("/", ["Host: a", "Cookie: drone_sim_a=\xe9\xff"], 403, "?token="),
        ("/", ["Host: a", 'Cookie: "; =[; drone_sim_a'], 403, "?token="),
        ("//[", ["Host: a"], 403, "?token="),
        ("http://[/?token=x", ["Host: a"], 403, "?token="),
        ("/socket", ["Host: a", "Upgrade: websocket", "Origin: http://["], 403, "?token="),
        ("/", [], 403, "?token="),
    ],
)
def test_odd_headers_get_an_answer_and_leave_no_traceback(served, caplog, path, headers, status, words):
    lines = [f"GET {path} HTTP/1.1", *headers, "Connection: close"]
    answer, body = raw(served, *(one.encode("latin-1") for one in lines))
    assert answer == status and words in body and "\n" not in body
    assert not caplog.records


@pytest.mark.parametrize(
    "junk", [b"\x01\x00\x02\x00x", b"POST / HTTP/1.1", b"GET / HTTP/1.1\r\nno header", b"\x16\x03\x01"]
)
def test_what_is_no_browser_is_hung_up_on(served, caplog, junk):
    with socket.create_connection(("127.0.0.1", served.server.get_port()), timeout=5) as one:
        one.sendall(junk + b"\r\n\r\n")
        said = b"".join(iter(lambda: one.recv(4096), b""))
    assert b"Traceback" not in said and b"200 OK" not in said and not caplog.records


def test_the_page_that_is_served_is_the_one_in_the_source():
    source = Path(__file__).parents[2] / "web" / "src"
    for name in ("index.html", "cockpit.css"):  # the script is built of it: web/package.json
        assert page_files().get(f"/{name}")[1] == (source / name).read_bytes(), "cd web && npm ci && npm run build"


@pytest.mark.parametrize("path", ["/socket", "/scene"])
def test_sockets_want_the_token_and_our_origin(served, path):
    for cookie, origin in (("", None), ("drone_sim=1", None), (None, "http://evil.example"), (None, "null")):
        with pytest.raises(InvalidStatus, match="403"):
            served.connect(cookie, origin, path)
    served.connect(origin=f"http://{served.host}").close()


def test_a_browser_that_vanishes_leaves_a_stopped_drone(served):
    served.sent.clear()
    with served.connect() as socket:
        socket.send(json.dumps({"hold": {"vx": 1.5}}))
        socket.send(json.dumps({"id": 7, "ask": "double", "number": 21}))
        assert json.loads(socket.recv(timeout=5)) == {"id": 7, "twice": 42}
        assert served.sent == [Command(vx=1.5)]
    gone = threading.Event()
    while len(served.sent) < 2:
        gone.wait(0.01)
    assert served.sent[-1] == Command()


@pytest.mark.parametrize(
    "text, words",
    [
        ("nonsense", "Expecting value"),
        ("[1]", "must be a mapping"),
        ('{"ask": "format"}', "must be one of double, or hold"),
        ('{"hold": {"vx": "fast"}}', "hold/vx: must be a number"),
        ('{"hold": {"vx": 1e9}}', "hold/vx: must be a number"),
        ('{"hold": {"ax": 1}}', "must be a mapping of vx, vy, vz, wz"),
        ('{"hold": {"vx": NaN}}', "NaN: is no number"),
        ('{"hold": [{}]}', "must be a mapping of vx, vy, vz, wz"),
        ('{"ask": {}}', "must be one of double, or hold"),
        ('{"ask": ["double"]}', "must be one of double, or hold"),
        ('{"ask": null}', "must be one of double, or hold"),
        ('{"shown": {}}', "must be one of double, or hold"),
        ('{"id": 1e999, "ask": "double"}', "1e999: is no number"),
        ('{"id": {}, "ask": "double"}', "id: must be a whole number"),
        ('{"id": ' + "1" * 5000 + "}", "integer"),
        (b"\xff\xfe", "Expecting value"),
        ("[" * 100_000, ""),
    ],
)
def test_what_a_browser_says_is_checked(served, text, words):
    with served.connect() as socket:
        socket.send(text)
        answer = json.loads(socket.recv(timeout=5))
        assert answer["id"] is None and words in answer["error"]
        socket.send(json.dumps({"id": 1, "ask": "double", "number": 1}))
        assert json.loads(socket.recv(timeout=5))["twice"] == 2


# ---- who flies


def test_held_keys_fly_while_they_are_held_and_said():
    sent, now = [], [0.0]
    flying = HeldCommands(sent.append, lambda: now[0])
    ahead, left = Command(vx=1.0), Command(vy=1.0)
    flying.hold(1, ahead)
    flying.repeat()
    assert sent == [ahead, ahead], "repeated"
    flying.hold(2, left)
    flying.hold(1, ahead)
    assert sent[2:] == [left], "the one that changed last counts, and is not thrown over by a repetition"
    flying.release(2)
    assert sent[-1] == ahead
    now[0] = 10.0
    flying.repeat()
    assert sent[-1] == Command(), "silence"
    count = len(sent)
    flying.repeat()
    flying.release(1)
    assert len(sent) == count, "nobody flies, and nobody is disturbed"


def test_nan_is_no_speed():
    with pytest.raises(ValueError, match="hold/wz"):
        read_command({"wz": float("nan")})
    assert read_command({"vz": -2}) == Command(vz=-2.0)


def test_a_failure_is_read_from_a_line():
    failure = script_failure("script error: [actuation] /home/a b/x.py:12: NameError: y: z")
    assert failure == ("actuation", "/home/a b/x.py", 12, "NameError: y: z")
    assert script_failure("started") is None


def test_what_the_master_knows():
    topics = [
        ("/drone/view/bodies", "visualization_msgs/MarkerArray"),
        ("/drone/odom", "nav_msgs/Odometry"),
        ("/drone/propellers", "std_msgs/Float32MultiArray"),
        ("/other/odom", "nav_msgs/Odometry"),
        ("/drone/front/compressed", "sensor_msgs/CompressedImage"),
        ("/drone/imu/data", "sensor_msgs/Imu"),
        ("/drone/push", "geometry_msgs/WrenchStamped"),
        ("/other/range", "sensor_msgs/Range"),
    ]
    cameras = (ImageTopic("/drone/front", "/drone/front/compressed"),)
    assert find_topics(topics) == FoundTopics("/drone", ("drone",), cameras, {"/drone/imu/data": "sensor_msgs/Imu"})
    assert find_topics(topics[1:]) == FoundTopics()


# ---- what is shown


LINE = [Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)]


def test_markers_come_move_and_go():
    scene = Scene()
    markers = MarkerNodes(scene, "scene", FrameTree(scene))
    markers.on_markers(MarkerArray([marker(0), marker(1)]))
    markers.show()
    assert sorted(scene.nodes) == ["/scene/a/0", "/scene/a/1"]
    moved = marker(0)
    moved.pose.position.x = 3.0
    markers.on_markers(MarkerArray([moved, Marker(ns="a", id=1, action=Marker.DELETE)]))
    markers.show()
    assert list(scene.nodes) == ["/scene/a/0"] and scene.nodes["/scene/a/0"].position == (3.0, 0.0, 0.0)
    assert scene.added.count("/scene/a/0") == 1, "moved, not made anew"
    hanging = marker(5)
    hanging.header.frame_id = "nowhere"
    markers.on_markers(MarkerArray([hanging]))
    markers.show()
    assert list(scene.nodes) == ["/scene/a/0"], "it waits for its frame"
    markers.on_markers(MarkerArray([Marker(action=Marker.DELETEALL)]))
    markers.show()
    assert not scene.nodes


@pytest.mark.parametrize(
    "before, after, seen",
    [
        ({"type": Marker.TEXT_VIEW_FACING, "text": "one"}, {"text": "three"}, lambda node: node.text == "three"),
        ({"type": Marker.LINE_STRIP, "points": LINE[:2]}, {"points": LINE}, lambda node: len(node.points) == 2),
        ({"type": Marker.LINE_LIST, "points": LINE[:2]}, {"points": LINE[1:]}, lambda node: node.points[0][0][0] == 1),
    ],
)
def test_words_and_lines_change_in_place(before, after, seen):
    scene = Scene()
    markers = MarkerNodes(scene, "scene", FrameTree(scene))
    for number, values in enumerate((before, {**before, **after})):
        message = Marker(ns="a", **values)
        message.header.frame_id, message.pose.position.x = "world", number
        markers.on_markers(MarkerArray([message]))
        markers.show()
    (node,) = scene.nodes.values()
    assert scene.added == ["/scene/a/0"] and seen(node) and node.position[0] == 1.0
    markers.on_markers(MarkerArray([Marker(ns="a", type=before["type"], header=message.header)]))
    markers.show()
    assert len(scene.nodes) == (before["type"] == Marker.TEXT_VIEW_FACING), "lines of no points are nothing"


def transform(parent, child, x=0.0):
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.transform.translation.x, made.transform.rotation.w = parent, x, 1.0
    return made


def test_a_frame_waits_for_its_parents():
    scene = Scene()
    frames = FrameTree(scene)
    loop = [transform("a", "b"), transform("b", "a"), transform("c", "c")]
    for message, shown in (
        ([transform("propeller", "blades"), *loop], []),
        ([transform("body", "propeller", 0.1)], []),
        ([transform("world", "body")], ["/body", "/body/propeller", "/body/propeller/blades"]),
    ):
        frames.on_transforms(TFMessage(message))
        frames.show()
        assert sorted(scene.nodes) == [f"/frames{name}" for name in shown]
    frames.on_transforms(TFMessage([transform("world", "body", 2.0)]))
    frames.show()
    assert scene.nodes["/frames/body"].position == (2.0, 0.0, 0.0) and len(scene.added) == 3
    frames.forget()
    assert not scene.nodes


def test_lines_of_another_colour_are_made_anew():
    scene = Scene()
    markers = MarkerNodes(scene, "scene", FrameTree(scene))
    painted = marker(0, Marker.LINE_STRIP, points=LINE)
    painted.color = ColorRGBA(0, 1, 0, 1)
    for message in (marker(0, Marker.LINE_STRIP, points=LINE[:2]), painted):
        markers.on_markers(MarkerArray([message]))
        markers.show()
    assert scene.added == ["/scene/a/0"] * 2


@pytest.mark.parametrize(
    "kind, added",
    [
        (Marker.CUBE, "add_box"),
        (Marker.SPHERE, "add_icosphere"),
        (Marker.CYLINDER, "add_cylinder"),
        (Marker.ARROW, "add_arrows"),
        (Marker.LINE_STRIP, "add_line_segments"),
        (Marker.LINE_LIST, "add_line_segments"),
        (Marker.POINTS, "add_point_cloud"),
        (Marker.TEXT_VIEW_FACING, "add_label"),
        (Marker.TRIANGLE_LIST, "add_glb"),
    ],
)
def test_every_kind_of_marker_is_shown(kind, added):
    points = [Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)]
    shape = [] if kind == Marker.ARROW else points
    node = looks.show(Scene(), "/x", marker(0, kind, points=shape, text="<b>words</b>"))
    assert node.kind == added and node.wxyz == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("kind", [Marker.LINE_STRIP, Marker.LINE_LIST, Marker.POINTS, Marker.TRIANGLE_LIST, 99])
def test_markers_of_nothing_are_nothing(kind):
    assert looks.show(Scene(), "/x", marker(0, kind)) is None


def test_a_mesh_that_cannot_be_read_is_told_and_left_out(tmp_path, caplog):
    file = tmp_path / "broken.stl"
    file.write_text("solid nothing", encoding="utf-8")
    scene = Scene()
    assert looks.show(scene, "/x", marker(0, Marker.MESH_RESOURCE, mesh_resource=f"file://{file}")) is None
    assert "broken.stl" in caplog.text


def test_a_mesh_has_no_metal(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    node = looks.show(Scene(), "/x", marker(0, Marker.MESH_RESOURCE, mesh_resource=f"file://{file}"))
    length = int.from_bytes(node.arguments[0][12:16], "little")
    tree = json.loads(node.arguments[0][20 : 20 + length])
    assert [one["pbrMetallicRoughness"]["metallicFactor"] for one in tree["materials"]] == [0.0]


def test_a_page_that_is_opened_early_is_answered_when_all_is_there():
    serving = PageServer("127.0.0.1", 0)
    host, token = serving.address.removeprefix("http://").split("/?token=")
    cookie = {"Cookie": f"drone_sim_{host.rpartition(':')[2]}={token}"}

    async def socket(connection):
        await connection.send(f"heard {await connection.recv()}")

    with connect(f"ws://{host}/socket", subprotocols=[SUBPROTOCOL], additional_headers=cookie) as early:
        early.send("this")
        with pytest.raises(TimeoutError):
            early.recv(timeout=0.1)
        serving.begin(socket, lambda path: ("image/png", path.encode()))
        assert early.recv(timeout=5) == "heard this"
    connection = http.client.HTTPConnection(host, timeout=5)
    connection.request("GET", "/a.png", headers=cookie)
    assert connection.getresponse().read() == b"/a.png"
    serving.server.stop()


def test_a_master_that_goes_is_waited_for(monkeypatch, tmp_path):
    """Whoever ends and starts a launch anew keeps the page, and what stands in the editor."""

    def refuse(*_):
        raise ConnectionRefusedError(111, "Connection refused")

    shown = Cockpit(PageServer("127.0.0.1", 0), "drone_sim", tmp_path)
    monkeypatch.setattr(
        rospy, "get_published_topics", lambda: [["/drone/view/bodies", "visualization_msgs/MarkerArray"]]
    )
    monkeypatch.setattr(rospy, "get_param", lambda name, default: default)
    shown._ask_master()
    assert shown._topics.namespace == "/drone"
    for gone in ("get_param", "get_published_topics"):  # it may go between the two
        monkeypatch.setattr(rospy, gone, refuse)
        shown._ask_master()
        assert shown._topics == FoundTopics()
        assert shown._panel._status.value == "no simulation"
        assert shown._panel._message.content.endswith(">no ROS master answers: waiting for one</div>")
    monkeypatch.setattr(
        rospy, "get_published_topics", lambda: [["/drone/view/bodies", "visualization_msgs/MarkerArray"]]
    )
    monkeypatch.setattr(rospy, "get_param", lambda name, default: default)
    shown._ask_master()
    assert shown._topics.namespace == "/drone"
    assert shown._panel._message.content.endswith(">the ROS master is there again</div>")
    shown._server.stop()
