"""Doctor: it reports faults with advice, and no check hangs or shows a traceback."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest

from drone_sim.files.resources import package_path
from drone_sim.ros.core import network
from drone_sim.ros.doctor import HINT, OK, WRONG, Line, environment, packages
from drone_sim.ros.doctor import master as master_checks
from drone_sim.ros.doctor.doctor import run_check
from drone_sim.ros.doctor.master import Master

HANGS = 90.0  # s; no check takes nearly as long unless it hangs


@pytest.fixture(name="port")
def _port():
    """Return the port of a server that accepts connections and never answers."""
    with socket.create_server(("localhost", 0)) as mute:
        yield mute.getsockname()[1]


@pytest.fixture(name="closed")
def _closed():
    with socket.create_server(("localhost", 0)) as server:
        number = server.getsockname()[1]
    return number


def serve_in_thread(server):
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    return f"http://localhost:{server.server_address[1]}"


class MasterStub:
    """ROS master with a fixed graph."""

    def __init__(self, published=(), subscribed=(), services=(), use_sim_time=None):
        self.graph = [[[name, list(nodes)] for name, nodes in one] for one in (published, subscribed, services)]
        self.use_sim_time = use_sim_time
        self.node = ""  # address of all nodes

    def getSystemState(self, _me):
        return [1, "", self.graph]

    def getParam(self, _me, _name):
        return [-1, "not set", 0] if self.use_sim_time is None else [1, "", self.use_sim_time]

    def lookupNode(self, _me, _name):
        return [1, "", self.node]


@pytest.fixture(name="known")
def _known(monkeypatch):
    """Return a function that starts a master with a graph, sets ROS_MASTER_URI, and connects to it."""
    servers = []

    def make(**graph):
        server = SimpleXMLRPCServer(("localhost", 0), requestHandler=SimpleXMLRPCRequestHandler, logRequests=False)
        servers.append(server)
        answers = MasterStub(**graph)
        server.register_instance(answers)
        monkeypatch.setenv("ROS_MASTER_URI", serve_in_thread(server))
        found = Master()
        assert [line.mark for line in found.connection()] == [OK]
        return found, answers

    yield make
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.mark.ros
def test_without_a_master_every_check_prints_a_line(closed):
    ros_variables = {"ROS_MASTER_URI": f"http://localhost:{closed}", "ROS_HOSTNAME": "localhost"}
    process = subprocess.run(
        [sys.executable, package_path() / "scripts/doctor"],
        env={**os.environ, **ros_variables},
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    marks = [line.split()[:2] for line in process.stdout.splitlines()]
    assert process.stderr == ""
    assert process.returncode == int(any(mark == WRONG for mark, *_ in marks))
    for what in ("packages", "pictures", "flight"):
        assert [OK, what] in marks, process.stdout
    assert f"hint   master          no master runs at http://localhost:{closed}" in process.stdout


@pytest.mark.parametrize("uri", ["garbage", "http://localhost:99999", "https://localhost:11311", ""])
def test_an_invalid_master_uri_is_reported(monkeypatch, uri):
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    (line,) = Master().connection()
    assert line == Line(WRONG, "master", f"ROS_MASTER_URI = '{uri}': must be like http://localhost:11311")


def test_a_master_port_that_does_not_answer_is_reported(monkeypatch, port):
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{port}")
    monkeypatch.setattr(network, "TIMEOUT", 0.1)
    (line,) = Master().connection()
    assert line.mark == WRONG
    assert f"port {port} of http://localhost:{port} does not answer as a master (timed out)" in line.text


class WebServer(BaseHTTPRequestHandler):
    """Web server that is no ROS master."""

    def do_POST(self):
        self.send_error(404)

    def log_message(self, *_):
        pass


def test_a_web_server_on_the_master_port_is_reported(monkeypatch):
    server = HTTPServer(("localhost", 0), WebServer)
    monkeypatch.setenv("ROS_MASTER_URI", serve_in_thread(server))
    (line,) = Master().connection()
    assert line.mark == WRONG
    assert "does not answer as a master (HTTP 404)" in line.text
    server.shutdown()
    server.server_close()


@pytest.mark.parametrize(
    "graph, mark, said",
    [
        ({}, OK, "real time"),
        ({"use_sim_time": False}, OK, "real time"),
        ({"use_sim_time": True}, WRONG, "no node publishes /clock"),
        ({"use_sim_time": True, "published": [("/clock", ["/a"])]}, OK, "by /a"),
        ({"use_sim_time": True, "published": [("/clock", ["/a", "/b"])]}, WRONG, "/a, /b all publish /clock"),
        ({"published": [("/clock", ["/a"])]}, HINT, "/use_sim_time is not true"),
    ],
)
def test_inconsistent_use_sim_time_and_clock_publishers_are_reported(known, graph, mark, said):
    master, _ = known(**graph)
    (line,) = master.clocks()
    assert line.mark == mark
    assert said in line.text


def test_commands_on_a_topic_without_subscribers_are_reported(known):
    published = [("/cmd_vel", ["/teleop"]), ("/drone/cmd_vel", ["/other"])]
    master, _ = known(published=published, subscribed=[("/drone/cmd_vel", ["/drone_sim"])])
    (line,) = master.commands()
    assert line.mark == HINT
    assert line.text.startswith("/teleop publishes /cmd_vel,") and "cmd_vel:=/drone/cmd_vel" in line.text


def test_dead_nodes_are_reported(known, closed):
    master, answers = known(published=[("/rosout", ["/gone"])])
    answers.node = f"http://localhost:{closed}"
    (line,) = master.dead_nodes()
    assert line.mark == HINT
    assert line.text.startswith("/gone ") and "`rosnode cleanup`" in line.text


def test_all_nodes_are_pinged_concurrently(known, monkeypatch):
    master, _ = known(published=[("/rosout", ["/first", "/second", "/third"])])
    all_nodes_are_pinged = threading.Barrier(3)  # it breaks and raises if the pings run one after another

    def answer(_master, node):
        all_nodes_are_pinged.wait(timeout=60)
        return node == "/second"

    monkeypatch.setattr(master_checks, "is_alive", answer)
    (line,) = master.dead_nodes()
    assert line.mark == HINT
    assert "/first, /third are" in line.text and "/second" not in line.text


def test_nodes_that_never_answer_are_reported_after_one_time_limit(known, monkeypatch):
    master, _ = known(published=[("/rosout", ["/first", "/second"])])
    end = threading.Event()
    monkeypatch.setattr(master_checks, "is_alive", lambda *_: end.wait(HANGS))
    monkeypatch.setattr(master_checks, "_NODES_TIMEOUT", 0.05)
    (line,) = run_check("nodes", master.dead_nodes, HANGS / 10)
    end.set()
    assert line.mark == HINT
    assert "/first, /second" in line.text


def test_diagnostics_of_all_simulators_are_awaited_once(known, monkeypatch):
    services = [("/red/save_scene", ["/red"]), ("/blue/save_scene", ["/blue"])]
    master, _ = known(services=services)
    waits = []
    monkeypatch.setattr(master_checks, "_wait_for_diagnostics", lambda nodes: waits.append(nodes) or {})
    lines = list(master_checks.simulator(master))
    assert waits == [["/blue", "/red"]]
    assert [(line.mark, line.text.split()[0]) for line in lines] == [(WRONG, "/blue"), (WRONG, "/red")]


def test_an_unresolvable_ros_hostname_is_reported(monkeypatch):
    monkeypatch.delenv("ROS_IP", raising=False)
    monkeypatch.setenv("ROS_HOSTNAME", "localhost")
    assert [line.mark for line in environment.host_names()] == [OK]
    monkeypatch.setenv("ROS_HOSTNAME", "no.such.host.invalid")
    (line,) = environment.host_names()
    assert line.mark == WRONG
    assert "ROS_HOSTNAME = 'no.such.host.invalid'" in line.text


def test_a_shell_without_ros_is_reported(monkeypatch):
    monkeypatch.setenv("PATH", "")
    (line,) = environment.ros()
    assert line.mark == WRONG
    assert line.text.startswith("no roslaunch, rosrun, rosmaster on the PATH: `source ")
    monkeypatch.setenv("ROS_VERSION", "2")
    (line,) = environment.ros()
    assert "ROS 2 is sourced" in line.text


@pytest.mark.ros
def test_a_missing_rviz_gives_a_hint(monkeypatch):
    monkeypatch.setattr("drone_sim.ros.tools.show._RVIZ", "no_such_package")
    (line,) = (one for one in environment.ros() if one.what == "rviz")
    assert line.mark == HINT
    assert "is not installed" in line.text and "web:=true" in line.text


def test_missing_failing_and_crashing_modules_are_reported(tmp_path, monkeypatch):
    (tmp_path / "kills.py").write_text("import os\nprint('loud')\nos.abort()\n")
    (tmp_path / "fails.py").write_text("raise RuntimeError('compiled for\\nanother numpy')\n")
    (tmp_path / "versioned.py").write_text("__version__ = '1.2'\nprint('ok')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    names = ["versioned", "kills", "no_such_module", "fails", "json"]
    found = packages.probe_all(names)
    assert found["versioned"] == ("ok", "1.2")
    assert found["json"][0] == "ok"
    assert found["fails"] == ("failed", "RuntimeError: compiled for another numpy")
    assert found["no_such_module"][1] == "ModuleNotFoundError: No module named 'no_such_module'"
    assert found["kills"][0] == "failed"
    assert found["kills"][1].startswith("ended with -6")


def test_a_check_that_hangs_or_raises_becomes_one_line():
    (line,) = run_check("slow", lambda: time.sleep(HANGS), 0.05)
    assert line == Line(WRONG, "slow", "no answer within 0.05 s")
    (line,) = run_check("broken", lambda: 1 / 0, 1.0)
    assert line == Line(WRONG, "broken", "cannot be checked: ZeroDivisionError: division by zero")
    assert "\n" not in str(Line(OK, "x", "two\nlines"))


def test_a_check_restores_the_previous_alarm_timer():
    alarms = []
    before = signal.signal(signal.SIGALRM, lambda *_: alarms.append(True))
    timer = signal.setitimer(signal.ITIMER_REAL, 0.05, 0.02)
    try:
        assert run_check("nothing", lambda: [], 10.0) == []
        assert signal.getitimer(signal.ITIMER_REAL)[1] == pytest.approx(0.02, abs=0.005)
        while not alarms:
            signal.pause()
    finally:
        signal.signal(signal.SIGALRM, before)
        signal.setitimer(signal.ITIMER_REAL, *timer)
