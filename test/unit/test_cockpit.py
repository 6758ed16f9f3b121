"""The cockpit without a browser: access control, held keys, the scene that is shown, meshes, and served files."""

import asyncio
import errno
import gzip
import hashlib
import http.client
import json
import os
import runpy
import socket
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
import trimesh
from browser_scene import Browser, marker
from geometry_msgs.msg import Point, TransformStamped
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from drone_sim.ros.cockpit.cockpit import Cockpit
from drone_sim.ros.cockpit.editor.task_flights import Grader
from drone_sim.ros.cockpit.scene.markers import FrameTree, MarkerListener
from drone_sim.ros.cockpit.scene.meshes import MeshStore, as_glb
from drone_sim.ros.cockpit.server.access_control import SUBPROTOCOL, AccessControl
from drone_sim.ros.cockpit.server.page_server import PageServer, find_manual, page_files
from drone_sim.ros.cockpit.server.page_socket import PageSocket
from drone_sim.ros.cockpit.teleop import HeldCommands, read_command
from drone_sim.ros.cockpit.topics import FoundTopics, ImageTopic, find_topics
from drone_sim.ros.core.simulator import script_failure
from drone_sim.ros.tools.commands import Command

TOKEN = "secret-token"


# ---- access control


class CockpitServer:
    def __init__(self):
        self.sent = []
        self.may_answer = threading.Event()
        self.may_answer.set()
        self.flying = HeldCommands(self.sent.append, lambda: 0.0)
        self.socket = PageSocket(self.flying, {"double": self.double})
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        pages = {**page_files(), "/manual/search.html": ("text/html", b"")}
        serving = AccessControl(TOKEN, pages.get, self.socket.serve).serve("127.0.0.1", 0)
        self.server = asyncio.run_coroutine_threadsafe(serving, self.loop).result(10)
        self.port = next(iter(self.server.sockets)).getsockname()[1]
        self.host = f"127.0.0.1:{self.port}"

    def double(self, message):
        threading.Event().wait(message.get("seconds", 0))
        self.may_answer.wait()
        return {"twice": 2 * message["number"]}

    def stop(self):
        self.server.close()
        asyncio.run_coroutine_threadsafe(self.server.wait_closed(), self.loop).result(10)
        self.loop.call_soon_threadsafe(self.loop.stop)

    def get(self, path, **headers):
        connection = http.client.HTTPConnection(self.host, timeout=60)
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
    served = CockpitServer()
    yield served
    served.stop()


@pytest.mark.parametrize(
    "path", ["/", "/mesh/a.glb", "/cockpit.js", "/?token=", "/?token=wrong", "/../../etc/passwd", "/socket"]
)
def test_without_the_token_nothing_is_served(served, path):
    status, _, body = served.get(path)
    assert status == 403 and b"?token=" in body
    assert served.get(path, Cookie="drone_sim_1=x; =;;")[0] == 403


def test_the_token_sets_a_cookie_and_is_removed_from_the_address(served):
    status, answer, _ = served.get(f"/?token={TOKEN}")
    assert status == 303 and answer.headers["Location"] == "./"
    cookie = answer.headers["Set-Cookie"]
    assert cookie.startswith(served.cookie) and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    for path, word in (("/", b"cockpit.js"), ("/cockpit.js", b"cm-editor")):
        status, _, body = served.get(path, Cookie=served.cookie)
        assert status == 200 and word in body.lower()
    assert served.get("/nothing.html", Cookie=served.cookie)[0] == 404
    assert served.get("/__init__.py", Cookie=served.cookie)[0] == 404


@pytest.mark.parametrize("path", ["/", "/cockpit.js", "/nothing", "/?token=wrong", "/manual/search.html"])
def test_every_response_has_the_security_headers(served, path):
    cookie = {} if "wrong" in path else {"Cookie": served.cookie}
    _, answer, _ = served.get(path, **cookie)
    assert answer.headers.get_all("X-Frame-Options") == ["SAMEORIGIN"]
    assert answer.headers["Referrer-Policy"] == "no-referrer" and answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    policy = dict(one.strip().partition(" ")[::2] for one in answer.headers["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == policy["base-uri"] == "'none'"
    assert policy["form-action"] == ("'self'" if "manual" in path else "'none'"), "only the manual has a search"
    assert policy["frame-ancestors"] == "'self'"
    here = ("'self'", "blob:", f"ws://{served.host}", f"wss://{served.host}")
    assert set(policy.get("connect-src", "").split()) <= set(here)
    assert policy["script-src"] == "'self'", "inline scripts and eval are not allowed"


def test_the_page_is_compressed_for_browsers_that_accept_gzip(served):
    plain = served.get("/cockpit.js", Cookie=served.cookie)[2]
    for accepts in ("gzip, deflate", "br;q=1.0, gzip;q=0.8"):
        _, answer, body = served.get("/cockpit.js", **{"Cookie": served.cookie, "Accept-Encoding": accepts})
        assert answer.headers["Content-Encoding"] == "gzip" and int(answer.headers["Content-Length"]) == len(body)
        assert gzip.decompress(body) == plain and len(body) < len(plain) / 2
    assert "Content-Encoding" not in served.get("/cockpit.js", Cookie=served.cookie)[1].headers


def send_raw(served, *lines):
    """Return the status and the body of the response to a request of these raw lines."""
    with socket.create_connection(("127.0.0.1", served.port), timeout=60) as one:
        one.sendall(b"\r\n".join((*lines, b"", b"")))
        payload = b"".join(iter(lambda: one.recv(4096), b""))
    head, _, body = payload.partition(b"\r\n\r\n")
    return int(head.split()[1]), body.decode()


@pytest.mark.parametrize(
    "path, headers, status, words",
    [
        ("/", ["Host: a", "Cookie: a=b", "Cookie: c=d"], 400, "Cookie: must not be given twice"),
        ("/", ["Host: a", "Host: b"], 400, "Host: must not be given twice"),
        ("/", ["Host: a", "Origin: a", "Origin: b"], 400, "Origin: must not be given twice"),
        ("/", ["Host: a", "Upgrade: websocket", "Upgrade: websocket"], 400, "Upgrade: must not be given twice"),
        ("/", ["Host: a", "Accept-Encoding: gzip", "Accept-Encoding: br"], 400, "Accept-Encoding: must not be"),
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
def test_malformed_headers_get_a_response_and_log_no_traceback(served, caplog, path, headers, status, words):
    lines = [f"GET {path} HTTP/1.1", *headers, "Connection: close"]
    answer, body = send_raw(served, *(one.encode("latin-1") for one in lines))
    assert answer == status and words in body and "\n" not in body
    assert not caplog.records


@pytest.mark.parametrize(
    "junk", [b"\x01\x00\x02\x00x", b"POST / HTTP/1.1", b"GET / HTTP/1.1\r\nno header", b"\x16\x03\x01"]
)
def test_a_connection_with_an_invalid_request_is_closed(served, caplog, junk):
    with socket.create_connection(("127.0.0.1", served.port), timeout=60) as one:
        one.sendall(junk + b"\r\n\r\n")
        payload = b"".join(iter(lambda: one.recv(4096), b""))
    assert b"Traceback" not in payload and b"200 OK" not in payload and not caplog.records


def test_the_served_page_equals_its_source():
    source = Path(__file__).parents[2] / "web" / "src"
    for name in ("index.html", *(file.name for file in source.glob("*.css"))):  # `npm run build` copies these
        assert page_files().get(f"/{name}")[1] == (source / name).read_bytes(), "cd web && npm ci && npm run build"


def test_the_served_script_was_built_from_the_current_source():
    """`web/build.mjs` writes a digest of all sources into the first line of the script."""
    web = Path(__file__).parents[2] / "web"
    digest = hashlib.sha256()
    sources = sorted((web / "src").rglob("*.js"), key=lambda file: file.relative_to(web).as_posix())
    for file in [*sources, web / "package-lock.json"]:
        digest.update(f"{file.relative_to(web).as_posix()}\n".encode() + file.read_bytes())
    first_line = page_files()["/cockpit.js"][1].partition(b"\n")[0].decode()
    assert first_line.endswith(digest.hexdigest()), "cd web && npm ci && npm run build"


def test_the_generated_types_of_the_page_are_up_to_date():
    generator = runpy.run_path(str(Path(__file__).parents[2] / "web" / "make_types.py"))
    assert generator["FILE"].read_text() == generator["text"](), "PYTHONPATH=src python web/make_types.py"


@pytest.mark.parametrize("path", ["/socket", "/anything"])
def test_a_websocket_needs_the_token_and_the_same_origin(served, path):
    for cookie, origin in (("", None), ("drone_sim=1", None), (None, "http://evil.example"), (None, "null")):
        with pytest.raises(InvalidStatus, match="403"):
            served.connect(cookie, origin, path)
    served.connect(origin=f"http://{served.host}").close()


def test_the_drone_stops_when_a_browser_disconnects_while_a_key_is_held(served):
    served.sent.clear()
    with served.connect() as socket:
        socket.send(json.dumps({"hold": {"vx": 1.5}}))
        socket.send(json.dumps({"id": 7, "ask": "double", "number": 21}))
        assert json.loads(socket.recv(timeout=60)) == {"id": 7, "twice": 42}
        assert served.sent == [Command(vx=1.5)]
    pause = threading.Event()
    while len(served.sent) < 2:
        pause.wait(0.01)
    assert served.sent[-1] == Command()


def test_requests_of_a_browser_are_answered_in_order(served):
    with served.connect() as socket:
        for number, seconds in enumerate((0.2, 0.1, 0)):
            socket.send(json.dumps({"id": number, "ask": "double", "number": number, "seconds": seconds}))
        assert [json.loads(socket.recv(timeout=60))["id"] for _ in range(3)] == [0, 1, 2]


def test_held_keys_are_sent_while_a_slow_request_is_answered(served):
    served.sent.clear()
    served.may_answer.clear()
    try:
        with served.connect() as socket:
            socket.send(json.dumps({"id": 1, "ask": "double", "number": 1}))
            socket.send(json.dumps({"hold": {"vx": 1.0}}))
            moment = threading.Event()
            while not served.sent:
                moment.wait(0.01)
            served.may_answer.set()
            assert json.loads(socket.recv(timeout=60)) == {"id": 1, "twice": 2}
    finally:
        served.may_answer.set()


def test_tree_changes_are_sent_only_to_browsers_that_follow_the_tree(served):
    def told(socket, number):
        socket.send(json.dumps({"id": 1, "ask": "double", "number": 1}))
        assert json.loads(socket.recv(timeout=60))["twice"] == 2, "earlier messages are processed"
        served.socket.tell_tree({"tree": number})
        served.socket.tell({"end": number})
        return json.loads(socket.recv(timeout=60))

    with served.connect() as socket:
        assert told(socket, 0) == {"end": 0}
        socket.send(json.dumps({"follow_tree": True}))
        assert told(socket, 1) == {"tree": 1}
        assert json.loads(socket.recv(timeout=60)) == {"end": 1}
        socket.send(json.dumps({"follow_tree": False}))
        assert told(socket, 2) == {"end": 2}


@pytest.mark.parametrize(
    "text, words",
    [
        ("nonsense", "Expecting value"),
        ("[1]", "must be a mapping"),
        ('{"ask": "format"}', "must be one of double, or hold"),
        ('{"hold": {"vx": "fast"}}', "hold/vx: must be a number"),
        ('{"hold": {"vx": 1e9}}', "hold/vx: must be a number"),
        ('{"hold": {"ax": 1}}', "must be a mapping of vx, vy, vz, wz"),
        ('{"hold": {"vx": NaN}}', "NaN: is not a number"),
        ('{"hold": [{}]}', "must be a mapping of vx, vy, vz, wz"),
        ('{"ask": {}}', "must be one of double, or hold"),
        ('{"ask": ["double"]}', "must be one of double, or hold"),
        ('{"ask": null}', "must be one of double, or hold"),
        ('{"shown": {}}', "must be one of double, or hold"),
        ('{"id": 1e999, "ask": "double"}', "1e999: is not a number"),
        ('{"id": {}, "ask": "double"}', "id: must be a whole number"),
        ('{"id": ' + "1" * 5000 + "}", "integer"),
        (b"\xff\xfe", "Expecting value"),
        ("[" * 100_000, ""),
    ],
)
def test_an_invalid_message_gets_an_error_and_the_socket_stays_open(served, text, words):
    with served.connect() as socket:
        socket.send(text)
        answer = json.loads(socket.recv(timeout=60))
        assert answer["id"] is None and words in answer["error"]
        socket.send(json.dumps({"id": 1, "ask": "double", "number": 1}))
        assert json.loads(socket.recv(timeout=60))["twice"] == 2


def test_a_request_that_raises_gets_an_error_and_the_socket_stays_open(served, tmp_path, monkeypatch, caplog):
    def exists(message):
        return {"there": (tmp_path / message["name"]).exists() and 1 // 0}

    monkeypatch.setitem(served.socket._answers, "exists", exists)
    (tmp_path / "ours").touch()
    with served.connect() as socket:
        for name, words in (("x" * 300, os.strerror(errno.ENAMETOOLONG)), ("ours", "zero")):
            socket.send(json.dumps({"id": 1, "ask": "exists", "name": name}))
            assert words in json.loads(socket.recv(timeout=60))["error"]
    assert [one.exc_info[0] for one in caplog.records if one.exc_info] == [ZeroDivisionError]


# ---- teleoperation


def test_a_held_command_is_repeated_until_it_is_released_or_times_out():
    sent, now = [], [0.0]
    flying = HeldCommands(sent.append, lambda: now[0])
    ahead, left = Command(vx=1.0), Command(vy=1.0)
    flying.hold(1, ahead)
    flying.repeat()
    assert sent == [ahead, ahead], "repeated"
    flying.hold(2, left)
    flying.hold(1, ahead)
    assert sent[2:] == [left], "the command that changed last counts, although another one is repeated"
    flying.release(2)
    assert sent[-1] == ahead
    now[0] = 10.0
    flying.repeat()
    assert sent[-1] == Command(), "the command has timed out"
    count = len(sent)
    flying.repeat()
    flying.release(1)
    assert len(sent) == count, "nothing is sent while no key is held"


def test_a_nan_speed_is_refused():
    with pytest.raises(ValueError, match="hold/wz"):
        read_command({"wz": float("nan")})
    assert read_command({"vz": -2}) == Command(vz=-2.0)


def test_a_script_failure_is_parsed_from_a_log_line():
    failure = script_failure("script error: [actuation] /home/a b/x.py:12: NameError: y: z")
    assert failure == ("actuation", "/home/a b/x.py", 12, "NameError: y: z")
    assert script_failure("started") is None


def test_the_topics_of_the_simulator_are_found_in_the_masters_list():
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


# ---- frames and markers


LINE = [Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)]


class Topic(MarkerListener):
    """A marker topic that is shown in one browser."""

    def __init__(self, layer="drawing", **options):
        super().__init__(layer, **options)
        self.browser = Browser()

    def show(self, *markers):
        self.on_markers(MarkerArray(markers))
        self.browser.state.change({}, self.take())
        return self.browser.hear()

    @property
    def shown(self):
        return list(self.browser.markers.values())


def test_markers_are_added_moved_and_deleted():
    topic = Topic()
    topic.show(marker(0), marker(1))
    assert len(topic.shown) == 2 and topic.shown[0]["kind"] == "cube" and topic.shown[0]["color"] == [1, 0, 0, 1]
    moved = marker(0)
    moved.pose.position.x = 3.0
    payload = topic.show(moved, Marker(ns="a", id=1, action=Marker.DELETE))
    assert not payload["markers"] and len(payload["placed"]) == len(payload["gone"]) == 1, "only the pose is sent"
    assert [one["pose"] for one in topic.shown] == [(3, 0, 0, 0, 0, 0, 1)]
    assert topic.show(moved) is None, "nothing has changed"
    topic.show(Marker(action=Marker.DELETEALL))
    assert not topic.shown


def test_only_the_differences_of_a_complete_marker_list_are_sent():
    """Marker ids number the objects of the scene: removing an object changes the ids of all later objects."""
    topic, everything = Topic(), Marker(action=Marker.DELETEALL)
    made = [marker(number, ns=name) for number, name in enumerate(["Crate", "Pole", "Pole", "Wall"], 1)]
    topic.show(everything, *made)
    assert len(topic.shown) == 4
    for number, one in enumerate(made[1:], 1):
        one.id = number
    payload = topic.show(everything, *made[1:])
    assert (len(payload["gone"]), payload["markers"], payload["placed"]) == (1, [], [])
    assert [one["ns"] for one in topic.shown] == ["Pole", "Pole", "Wall"]


def test_a_late_browser_gets_the_whole_scene_and_a_slow_browser_the_changes():
    topic = Topic()
    for x in range(3):
        moved = marker(0)
        moved.pose.position.x = x
        topic.on_markers(MarkerArray([moved, marker(x + 1)]))
        topic.browser.state.change({}, topic.take())
        if x == 0:
            topic.browser.hear()
    late = Browser(topic.browser.state)
    assert late.hear()["whole"] and not topic.browser.hear()["whole"]
    assert late.markers == topic.browser.markers and len(late.markers) == 4
    topic.browser.state.clear()
    assert topic.browser.hear()["whole"] and not topic.shown


@pytest.mark.parametrize(
    "before, after, seen",
    [
        ({"type": Marker.TEXT_VIEW_FACING, "text": "one"}, {"text": "three"}, lambda told: told["text"] == "three"),
        ({"type": Marker.LINE_STRIP, "points": LINE[:2]}, {"points": LINE}, lambda told: len(told["points"]) == 9),
        ({"type": Marker.LINE_LIST, "points": LINE[:2]}, {"points": LINE[1:]}, lambda told: told["points"][0] == 1),
    ],
)
def test_texts_and_lines_of_a_marker_are_updated(before, after, seen):
    topic = Topic()
    for number, values in enumerate((before, {**before, **after})):
        message = Marker(ns="a", **values)
        message.header.frame_id, message.pose.position.x = "world", number
        topic.show(message)
    (told,) = topic.shown
    assert seen(told) and told["pose"][0] == 1.0
    topic.show(Marker(ns="a", type=before["type"], header=message.header))
    assert len(topic.shown) == (before["type"] == Marker.TEXT_VIEW_FACING), "lines without points are removed"


def transform(parent, child, x=0.0):
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.transform.translation.x, made.transform.rotation.w = parent, x, 1.0
    return made


def test_a_frame_is_sent_once_its_parents_are_known():
    browser, frames = Browser(), FrameTree()
    loop = [transform("a", "b"), transform("b", "a"), transform("c", "c")]
    for message, shown in (
        ([transform("propeller", "blades"), *loop], []),
        ([transform("body", "propeller", 0.1)], []),
        ([transform("world", "body")], [("body", -1), ("propeller", 0), ("blades", 1)]),
    ):
        frames.on_transforms(TFMessage(message))
        browser.state.change(frames.take(), {})
        browser.hear()
        assert list(browser.frames.values()) == shown
    frames.on_transforms(TFMessage([transform("world", "body", 2.0), transform("body", "blades", 1.0)]))
    browser.state.change(frames.take(), {})
    payload = browser.hear()
    assert payload["moved"] == [0, 2] and browser.poses["body"][0] == 2.0
    assert payload["frames"] == [[2, "blades", 0]], "its parent has changed"


def test_frames_and_markers_of_one_step_are_one_message():
    browser, frames, topic = Browser(), FrameTree(), MarkerListener("view/path")
    frames.on_transforms(TFMessage([transform("world", "a"), transform("world", "b")]))
    topic.on_markers(MarkerArray([marker(0)]))
    assert browser.state.change(frames.take(), topic.take())
    payload = browser.hear()
    assert payload["moved"] == [0, 1] and len(payload["markers"]) == 1 and browser.hear() is None


@pytest.mark.parametrize(
    "kind, name",
    [
        (Marker.CUBE, "cube"),
        (Marker.SPHERE, "sphere"),
        (Marker.CYLINDER, "cylinder"),
        (Marker.ARROW, "arrow"),
        (Marker.LINE_STRIP, "strip"),
        (Marker.LINE_LIST, "lines"),
        (Marker.CUBE_LIST, "cubes"),
        (Marker.SPHERE_LIST, "spheres"),
        (Marker.POINTS, "points"),
        (Marker.TEXT_VIEW_FACING, "text"),
        (Marker.TRIANGLE_LIST, "triangles"),
    ],
)
def test_every_marker_type_is_sent(kind, name):
    topic = Topic()
    topic.show(marker(0, kind, points=[] if kind == Marker.ARROW else LINE, text="<b>words</b>"))
    (told,) = topic.shown
    assert told["kind"] == name and told["pose"] == (0, 0, 0, 0, 0, 0, 1), "a zero quaternion means no rotation"
    assert told.get("text", "<b>words</b>") == "<b>words</b>"


@pytest.mark.parametrize("kind", [Marker.LINE_STRIP, Marker.LINE_LIST, Marker.POINTS, Marker.TRIANGLE_LIST, 99])
def test_markers_without_points_or_of_unknown_type_are_not_sent(kind):
    topic = Topic()
    topic.show(marker(0, kind))
    assert not topic.shown


def test_shading_painted_for_rviz_is_left_out_of_a_shaded_layer():
    painted = marker(0, Marker.TRIANGLE_LIST, points=LINE)
    painted.colors = [ColorRGBA(0, 0, 0.5, 0.25)] * 3
    for is_shaded in (True, False):
        topic = Topic(is_shaded=is_shaded)
        topic.show(painted)
        (told,) = topic.shown
        assert ("colors" in told, "lit" in told) == (not is_shaded, not is_shaded)


def test_the_sky_is_hidden_but_an_object_named_sky_is_shown():
    for layer, hidden in (("view/surroundings", ("sky",)), ("scene", ())):
        topic = Topic(layer, hidden=hidden)
        topic.show(marker(0, ns="sky"))
        assert bool(topic.shown) == (not hidden)


# ---- meshes


def test_a_mesh_is_served_under_a_url_made_from_its_content(tmp_path):
    meshes, file = MeshStore(), tmp_path / "a box.stl"
    trimesh.creation.box().export(file)
    topic = Topic(mesh_url=meshes.url)
    topic.show(marker(0, Marker.MESH_RESOURCE, mesh_resource=file.as_uri()))
    (told,) = topic.shown
    kind, content = meshes.find(told["mesh"])
    assert kind == "model/gltf-binary" and content == as_glb(file)
    assert meshes.find("/mesh/../a.glb") is None and meshes.find("/") is None
    trimesh.creation.icosphere().export(file)
    new_url = meshes.url(file.as_uri())
    assert new_url != told["mesh"] and meshes.find(new_url)[1] == as_glb(file), "the file has changed"


def test_an_unreadable_mesh_is_logged_and_not_shown(tmp_path, caplog):
    file = tmp_path / "broken.stl"
    file.write_text("solid nothing", encoding="utf-8")
    topic = Topic(mesh_url=MeshStore().url)
    for missing in (file, file, tmp_path / "none.stl"):
        topic.show(marker(0, Marker.MESH_RESOURCE, mesh_resource=f"file://{missing}"))
        assert not topic.shown
    assert "broken.stl" in caplog.messages[0] and "none.stl" in caplog.messages[1]
    assert len(caplog.messages) == 2, "each file is reported once"


def test_slow_imports_wait_until_a_page_needs_them():
    code = "import sys, drone_sim.ros.cockpit.cockpit; print({'cv_bridge', 'scipy', 'trimesh'} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "set()\n"


@pytest.mark.parametrize("kind", ["dae", "obj", "stl"])
def test_meshes_are_the_same_without_scipy_which_the_cockpit_does_not_import(tmp_path, kind):
    file = tmp_path / f"ball.{kind}"
    trimesh.creation.icosphere().export(file)
    code = f"import sys; sys.modules['scipy'] = None\nfrom {as_glb.__module__} import as_glb, Path\n"
    show = f"sys.stdout.buffer.write(as_glb(Path({str(file)!r})))"
    ran = subprocess.run([sys.executable, "-c", code + show], capture_output=True, check=True)
    assert ran.stdout == as_glb(file)


def test_a_mesh_has_a_metallic_factor_of_zero(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    content = as_glb(file)
    length = int.from_bytes(content[12:16], "little")
    tree = json.loads(content[20 : 20 + length])
    assert [one["pbrMetallicRoughness"]["metallicFactor"] for one in tree["materials"]] == [0.0]


def test_only_files_of_the_built_manual_are_served(tmp_path):
    (tmp_path / "html/_static").mkdir(parents=True)
    (tmp_path / "html/_static/furo.css").write_text("p {}")
    (tmp_path / "secret.css").write_text("p {}")
    folder = tmp_path / "html"
    assert find_manual("/manual/_static/furo.css", folder) == ("text/css; charset=utf-8", b"p {}")
    for path in (
        "/manual/../secret.css",
        "/manual/_static/../../secret.css",
        "/manual//etc/hosts",
        "/manual/",
        "/manual/\0",
    ):
        assert find_manual(path, folder) is None
    assert find_manual("/cockpit.js", folder) is None
    kind, content = find_manual("/manual/index.html", tmp_path / "not_built")
    assert kind.startswith("text/plain") and b"./dev.sh docs" in content


def test_only_the_report_of_a_grading_is_served(tmp_path, monkeypatch):
    grader = Grader()
    monkeypatch.setattr(grader, "_folder", SimpleNamespace(name=str(tmp_path)))
    (tmp_path / "report").mkdir()
    (tmp_path / "report/index.html").write_text("report")
    (tmp_path / "report/link.html").symlink_to("/etc/hosts")
    (tmp_path / "result.json").write_text("{}")
    assert grader.report_file("/graded/index.html") == ("text/html; charset=utf-8", b"report")
    for path in ("/graded/../result.json", "/graded//etc/hosts", "/graded/link.html", "/graded/", "/index.html"):
        assert grader.report_file(path) is None


def test_a_page_opened_before_the_server_begins_is_answered_later():
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
        assert early.recv(timeout=60) == "heard this"
    connection = http.client.HTTPConnection(host, timeout=60)
    connection.request("GET", "/a.png", headers=cookie)
    assert connection.getresponse().read() == b"/a.png"
    serving.stop()


def test_the_cockpit_reconnects_after_a_restart_of_the_master(monkeypatch, tmp_path):
    """The page and the text in its editor survive a restart of the launch file."""

    def refuse(*_):
        raise ConnectionRefusedError(111, "Connection refused")

    def answer():
        return [["/drone/view/bodies", "visualization_msgs/MarkerArray"]]

    shown = Cockpit(PageServer("127.0.0.1", 0), "drone_sim", tmp_path)
    monkeypatch.setattr(rospy, "get_param", lambda _name, default: default)
    for master, namespace in ((answer, "/drone"), (refuse, ""), (refuse, ""), (answer, "/drone")):
        monkeypatch.setattr(rospy, "get_published_topics", master)
        shown._ask_master()
        assert shown._topics.namespace == namespace
        assert shown._panel.board.get("master") is (master is answer)
    assert shown._panel.board.get("status") == "no simulation"
    shown._server.stop()


def test_the_master_is_queried_at_once_after_a_change_of_the_scene(tmp_path, monkeypatch):
    shown, queries = Cockpit(PageServer("127.0.0.1", 0), "drone_sim", tmp_path), []
    monkeypatch.setattr(shown, "_ask_master", lambda: queries.append(scene))
    monkeypatch.setattr(type(shown._editing), "scene", property(lambda _: scene))
    for one in (("", "drone"), ("", "drone"), ("a.yaml", "drone"), ("a.yaml", "drone"), ("a.yaml", "")):
        scene = one
        shown._update(10.0)
    assert queries == [("", "drone"), ("a.yaml", "drone"), ("a.yaml", "")]
    shown._server.stop()


@pytest.mark.parametrize(
    ("browsers", "namespace", "period"),
    [({1}, "", 0.3), ({1}, "/drone", 2.0), (set(), "", 10.0), (set(), "/drone", 10.0)],
)
def test_the_master_is_queried_often_while_a_page_waits_for_the_simulator(
    tmp_path, monkeypatch, browsers, namespace, period
):
    shown, queries = Cockpit(PageServer("127.0.0.1", 0), "drone_sim", tmp_path), []
    monkeypatch.setattr(shown, "_ask_master", lambda: queries.append(now))
    monkeypatch.setattr(shown, "_open", lambda _namespace: None)
    monkeypatch.setattr(type(shown._socket), "browsers", property(lambda _: browsers))
    shown._topics = FoundTopics(namespace)
    for tenth in range(1000, 1300):  # 30 s
        now = tenth / 10
        shown._update(now)
    assert 30.0 / (period + 0.2) <= len(queries) <= 30.0 / period + 1
    shown._server.stop()
