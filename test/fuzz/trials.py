"""Trials of the cases of each kind, with the same calls as the node and `fly` make. They raise the same errors.

A user's mistake must be refused with one of REFUSALS, in one line; every other exception is a fault.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import itertools
import logging
import math
import os
import shutil
import socket
import stat
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import cbor2
import zmq
from case import Case

from drone_sim.config.types import ParameterError
from drone_sim.grading.submissions.folders import submissions_of
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.mechanics.urdf import UrdfError
from drone_sim.offline import fly
from drone_sim.offline.timeline import TimelineError
from drone_sim.remote.legacy.server import LegacyServer
from drone_sim.remote.server import RemoteApiServer
from drone_sim.render.renderer import Renderer
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError
from drone_sim.sensors import camera as vision
from drone_sim.vehicles import checks

REFUSALS = (ParameterError, ScriptError, UrdfError, TimelineError, checks.Refused)
LONGEST = 1200  # characters of a refusal, without the path of the case's folder
_SCRIPT_LIMIT = 0.2  # s
_SMALL = {"width": 32, "height": 24}  # px: the content of images does not matter here


_RENDERERS: dict[int, Renderer] = {}


def _renderer(samples: int = 0) -> Renderer:
    """Return a cached renderer: compiling its shaders takes longer than most cases."""
    if samples not in _RENDERERS:
        renderer = _RENDERERS[samples] = Renderer(samples=samples)
        renderer.close = lambda: renderer.set_visuals(())  # type: ignore[method-assign]
    return _RENDERERS[samples]


vision.Renderer = _renderer  # type: ignore


class Fault(Exception):
    """Wrong behaviour of the tested code; the message begins with its kind."""


def run(case: Case, folder: Path) -> str:
    """Write the case's files into the folder and try it; return the refusal, '' if the input was accepted.

    Raises Fault, or the exception of the tested code.
    """
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    try:
        return _TRIALS[case.kind](case, folder) or ""
    except REFUSALS as refusal:
        return one_line(str(refusal), folder)


def one_line(text: str, folder: Path) -> str:
    """Return a refusal without the folder; raises Fault if it is not one line, or longer than LONGEST."""
    text = text.replace(str(folder), "")
    if "\n" in text or "\r" in text or not text.strip():
        raise Fault(f"a refusal of more lines than one, or none: {text[:300]!r}")
    if len(text) > LONGEST:
        raise Fault(f"a refusal of {len(text)} characters: {text[:300]!r}...")
    return text


# ---- content of a scene


def _fly_a_little(simulation: Simulation, steps: int = 3) -> None:
    """Step, snapshot, restore, and take images; raises Fault if the drone's state is not finite."""
    simulation.drone.commands.receive(Twist(Vector3(0.5, 0.0, 0.1), Vector3(0.0, 0.0, 0.3)))
    simulation.step()
    snapshot = simulation.snapshot()
    for _ in range(steps):
        simulation.step()
    simulation.restore(snapshot)
    for camera in simulation.drone.cameras.values():
        camera.take()
    simulation.step()
    state = simulation.drone.body.state
    if not all(map(math.isfinite, (*state.position, *state.orientation, *state.linear_velocity))):
        raise Fault(f"the drone is at {state.position}")


def _simulate(settings: dict[str, Any], folder: Path) -> None:
    simulation = Simulation(parameters.load(settings))
    try:
        _fly_a_little(simulation)
        saved = folder / "saved.yaml"
        simulation.save_scene(saved)
        if simulation.parameters.time_step < 1.0:  # with a long step, objects may move anywhere
            _load_again(simulation, saved)
        simulation.stop()
    finally:
        simulation.close()


def _load_again(simulation: Simulation, saved: Path) -> None:
    try:
        simulation.start(str(saved))
    except REFUSALS as refusal:
        raise Fault(f"what was saved is refused: {refusal}") from None


def _parameters(case: Case, folder: Path) -> None:
    _simulate(_with_small_pictures(case.data), folder)


def _with_small_pictures(settings: dict[str, Any]) -> dict[str, Any]:
    small: dict[str, Any] = {"cameras": {name: dict(_SMALL) for name in ("front", "depth", "track", "floor")}}
    return dict(parameters.merged(small, settings))


def _scene(case: Case, folder: Path) -> None:
    _simulate(_with_small_pictures({"scene_file": str(folder / "scene.yaml")}), folder)


def _mesh(case: Case, folder: Path) -> None:
    (name,) = set(case.files) - {"one.mtl", "one.png"}
    one: dict[str, Any] = {
        "shape": "mesh",
        "file": str(folder / name),
        "position": [2, 0, 1],
        "mass": case.data["mass"],
    }
    if case.data["in_urdf"]:
        inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        look = "".join(
            f'<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>' for tag in ("collision", "visual")
        )
        (folder / "one.urdf").write_text(f'<robot name="one"><link name="a">{inertia}{look}</link></robot>')
        one = {"shape": "urdf", "file": str(folder / "one.urdf"), "position": [2, 0, 1], "mass": case.data["mass"]}
    _simulate(_with_small_pictures({"scene": {"objects": [one]}}), folder)


def _urdf(case: Case, folder: Path) -> None:
    file = str(folder / "robot.urdf")
    settings: dict[str, Any] = {"drone": {"urdf": file}}
    if case.data != "drone":
        mass = 1.0 if case.data == "heavy object" else 0.0
        settings = {"scene": {"objects": [{"shape": "urdf", "file": file, "position": [2, 0, 1], "mass": mass}]}}
    _simulate(_with_small_pictures(settings), folder)


# ---- scripts


def _script(case: Case, folder: Path) -> str:
    """Fly a script, stop, start it again, and close: each call may raise ScriptError."""
    (name,) = case.files
    simulation = Simulation(
        parameters.load({"script_time_limit": _SCRIPT_LIMIT, "cameras": {"front": dict(_SMALL)}}), started=False
    )
    simulation.script = str(folder / name)
    messages: list[str] = []

    def attempt(action: Callable[[], None]) -> None:
        try:
            action()
        except ScriptError as error:
            messages.append(one_line(str(error), folder))

    def fly_once() -> None:
        simulation.start()
        simulation.drone.commands.receive(Twist(Vector3(0.5, 0.0, 0.1), Vector3(0.0, 0.0, 0.3)))
        simulation.step()
        snapshot = simulation.snapshot()
        simulation.step()
        simulation.restore(snapshot)
        simulation.step()

    attempt(fly_once)
    attempt(simulation.stop)
    if not messages:
        attempt(fly_once)
    attempt(simulation.close)
    return messages[0] if messages else ""


# ---- fly


def _fly(case: Case, folder: Path) -> str:
    return _status(["--commands", str(folder / "flight.yaml"), *case.data], folder)


def _status(arguments: list[str], folder: Path) -> str:
    errors = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        try:
            status = fly.main(arguments)
        except SystemExit as ending:  # raised by argparse
            status = ending.code if isinstance(ending.code, int) else 1
    messages = errors.getvalue().rstrip("\n")
    if (status == 0) != (messages == ""):
        raise Fault(f"fly: status {status}, and it said: {messages[:300]!r}")
    return one_line(messages, folder) if messages else ""


def _assignments(case: Case, folder: Path) -> str:
    return _status([*(word for text in case.data for word in ("--set", text)), "--duration=0.1"], folder)


# ---- bags


def prepare(case: Case) -> None:
    """Import a case's modules before its time is measured: matplotlib takes longer than most cases."""
    if case.kind == "bags":
        importlib.import_module(f"drone_sim.ros.tools.{case.data}")
        importlib.import_module("drone_sim.offline.plot")


def _bags(case: Case, folder: Path) -> str:
    """Read a bag with one of the bag programs, which must end with either one line or an output file."""
    program = importlib.import_module(f"drone_sim.ros.tools.{case.data}")  # only bags need ROS here
    out = folder / {"bag_commands": "out.yaml", "plot_flight": "out.png", "bag_video": "out.mp4"}[case.data]
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings of libraries about this machine
        status = program.main([str(folder / "flight.bag"), str(out)])
    messages = errors.getvalue().rstrip("\n")
    if (status == 0) != (messages == "") or (status == 0) != out.exists():
        raise Fault(f"{case.data}: status {status}, and it said: {messages[:300]!r}")
    return one_line(messages, folder) if messages else ""


# ---- zips of a class


def _archives(case: Case, folder: Path) -> str:
    """Find a class's submissions: nothing may change outside `store`, and the good student's script must be found."""
    store, canary = folder / "results" / "store", folder / "canary"
    store.parent.mkdir()
    canary.write_text("here")
    before = _list_files(folder)
    removed: list[Path] = []
    with _record_removals(removed):
        try:
            found = submissions_of(str(folder / "class.zip"), store)
        except ValueError as refusal:
            if case.data == "whole":
                raise Fault(f"a good student is refused with the others: {refusal!r:.300}") from None
            return one_line(str(refusal), folder)
        finally:
            outside = [one for one in removed if one == store or not one.is_relative_to(store)]
            if outside:
                raise Fault(f"these would have been removed: {outside!r:.300}")
            if {path: kind for path, kind in _list_files(folder).items() if not path.is_relative_to(store)} != before:
                raise Fault("something was written out of the store")
            if any(kind not in (stat.S_IFREG, stat.S_IFDIR) for kind in _list_files(store).values()):
                raise Fault("something that is neither a file nor a folder was made")
    good = [one for one in found if one.name == "Good"]
    is_found = len(good) == 1 and not good[0].error and Path(good[0].script).is_file()
    if case.data == "whole" and not is_found:
        raise Fault(f"the good student: {good!r:.500}")
    return next((one_line(one.error, folder) for one in found if one.error), "")


def _list_files(folder: Path) -> dict[Path, int]:
    """Return the paths in a folder, with their file types."""
    names = (os.path.join(here, name) for here, *several in os.walk(folder) for name in itertools.chain(*several))
    return {Path(name): stat.S_IFMT(os.lstat(name).st_mode) for name in names}


@contextlib.contextmanager
def _record_removals(paths: list[Path]) -> Iterator[None]:
    """Append the paths that would be removed to `paths`, and remove nothing."""

    def record(path: Any, *_: Any, dir_fd: int | None = None, **__: Any) -> None:
        folder = os.getcwd() if dir_fd is None else os.readlink(f"/proc/self/fd/{dir_fd}")
        named = os.path.join(folder, path)
        paths.append(Path(os.path.realpath(os.path.dirname(named)), os.path.basename(named)))

    with contextlib.ExitStack() as patched:
        for owner, name in ((shutil, "rmtree"), (os, "unlink"), (os, "remove"), (os, "rmdir")):
            patched.enter_context(mock.patch.object(owner, name, record))
        yield


# ---- messages


def _messages(case: Case, folder: Path) -> str:
    import commands  # only messages need ROS here

    log = _Log()
    logging.getLogger("rosout").addHandler(log)
    simulation = Simulation(parameters.load(_with_small_pictures({})))
    try:
        commands.send(simulation, case.data)
        _fly_a_little(simulation)
    finally:
        simulation.close()
        logging.getLogger("rosout").removeHandler(log)
    return "; ".join(one_line(line, folder) for line in log.lines)


# ---- requests


def _requests(case: Case, folder: Path) -> str:
    """Send a client's messages one after another while the simulation steps; return the first error."""
    simulation = Simulation(parameters.load(_with_small_pictures({"script_time_limit": _SCRIPT_LIMIT})), started=False)
    player = Player(simulation, lambda _state: None, simulated_time=False)
    server = RemoteApiServer(player, "127.0.0.1", 0)
    with zmq.Context() as context, context.socket(zmq.DEALER) as client:
        client.setsockopt(zmq.LINGER, 0)
        client.connect(f"tcp://127.0.0.1:{server.port}")
        try:
            messages = [_answer_of(client, message, player, server) for message in case.data]
        finally:
            server.close()
            simulation.close()
    return next((one_line(one, folder) for one in messages if one), "")


def _answer_of(client: zmq.Socket[bytes], message: bytes, player: Player, server: RemoteApiServer) -> str:
    """Send a message; return the error in the answer, '' for none, or if no answer comes, as in an endless wait."""
    client.send_multipart([b"", message])
    for _ in range(20):
        server.wait(0.005)
        if client.poll(0):
            return str(cbor2.loads(client.recv_multipart()[-1]).get("err", ""))
        if player.playing and not server.holds:
            player.step()
    return ""


# ---- connections


def _connections(case: Case, folder: Path) -> str:
    """Let peers send bytes: each must be disconnected, none may start the simulation, a client still gets an answer."""
    simulation = Simulation(parameters.load(_with_small_pictures({})), started=False)
    player = Player(simulation, lambda _state: None, simulated_time=False)
    server = RemoteApiServer(player, "127.0.0.1", 0)
    with zmq.Context() as context, context.socket(zmq.DEALER) as client:
        client.setsockopt(zmq.LINGER, 0)
        client.connect(f"tcp://127.0.0.1:{server.port}")
        try:
            for pieces in case.data:
                _send_all(server, pieces)
            if player.playing:
                raise Fault("a peer that was no client has started the simulation")
            client.send_multipart([b"", cbor2.dumps({"func": "sim.getSimulationState", "args": []})])
            end = time.monotonic() + 60
            while time.monotonic() < end:
                server.wait(0.005)
                if client.poll(0):
                    return ""
            raise Fault("a client has no answer any more")
        finally:
            server.close()
            simulation.close()


def _send_all(server: RemoteApiServer, pieces: list[bytes]) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as peer:
        try:
            for piece in pieces:
                peer.sendall(piece)
                server.wait(0.001)
            peer.shutdown(socket.SHUT_WR)
            peer.settimeout(0.001)
            end = time.monotonic() + 60
            while time.monotonic() < end:
                server.wait(0.001)
                with contextlib.suppress(TimeoutError):
                    if not peer.recv(65536):
                        return
        except OSError:  # it was disconnected before it had sent everything
            return
    raise Fault("a peer that has said all is not let go")


# ---- V-REP's legacy remote API


def _legacy_commands(case: Case, folder: Path) -> str:
    """Let clients send bytes: once they have left, the simulation must not wait, and a new client gets an answer."""
    simulation = Simulation(parameters.load(_with_small_pictures({"script_time_limit": _SCRIPT_LIMIT})), started=False)
    player = Player(simulation, lambda _state: None, simulated_time=False)
    server, log = LegacyServer(player, "127.0.0.1", 0), _Log()
    logging.getLogger("drone_sim.remote").addHandler(log)
    try:
        for pieces in case.data:
            _exchange(server, player, pieces)
        while server._guests:
            server.wait(0.001)
        if server.holds:
            raise Fault("nobody is there, and the simulation waits")
        _check_answer(server)
    finally:
        logging.getLogger("drone_sim.remote").removeHandler(log)
        server.close()
        simulation.close()
    return next((one_line(line, folder) for line in log.lines), "")


def _exchange(server: LegacyServer, player: Player, pieces: list[bytes]) -> None:
    """Send pieces, read, and step; the replies do not matter."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as peer:
        peer.setblocking(False)
        for piece in pieces:
            with contextlib.suppress(OSError):  # it was disconnected before it had sent everything
                peer.send(piece)
            for _ in range(5):
                server.wait(0.001)
                if player.playing and not server.holds:
                    player.step()
            with contextlib.suppress(OSError):
                peer.recv(65536)


def _check_answer(server: LegacyServer) -> None:
    """Raise Fault if a client that sends only a header gets no answer."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as peer:
        peer.setblocking(False)
        peer.send(b"\1\0" + b"\x12\0" + b"\0\0" + bytes(18))
        end = time.monotonic() + 60
        while time.monotonic() < end:
            server.wait(0.005)
            with contextlib.suppress(BlockingIOError):
                if len(peer.recv(65536)) == 24:
                    return
    raise Fault("a client has no answer any more")


# ---- browsers


def _browsers(case: Case, folder: Path) -> str:
    """Let browsers send requests and messages to the cockpit: each error is one line, and no socket may be lost."""
    import browsing

    global _COCKPIT
    _COCKPIT = _COCKPIT or browsing.Cockpit()
    try:
        return next((one_line(one, folder) for one in list(_COCKPIT.hear(case.data, folder)) if one), "")
    except browsing.Wrong as wrong:
        raise Fault(str(wrong)) from None


_COCKPIT: Any = None


class _Log(logging.Handler):
    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


_TRIALS: dict[str, Callable[[Case, Path], Any]] = {
    "parameters": _parameters,
    "assignments": _assignments,
    "scene": _scene,
    "mesh": _mesh,
    "urdf": _urdf,
    "script": _script,
    "fly": _fly,
    "messages": _messages,
    "requests": _requests,
    "connections": _connections,
    "legacy_commands": _legacy_commands,
    "bags": _bags,
    "archives": _archives,
    "browsers": _browsers,
}
