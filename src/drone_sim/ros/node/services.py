"""V-REP's toolbar and file menu as services: `rosservice call /drone_sim/start`, and so on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import rospy
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerRequest, TriggerResponse

from drone_sim.files.resources import locate, package_path
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.node.paths import from_shell
from drone_sim.ros.node.vehicles_parameter import VehiclesParameter
from drone_sim.run.parameters import ParameterError
from drone_sim.run.player import Player
from drone_sim.run.simulation import Snapshot
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_HOME = Path("~/.ros/drone_sim/scene.yaml")


class Services:
    """~start, ~stop, ~restart, ~step, ~pause; ~save_scene, ~load_scene; ~set_vehicles; ~snapshot, ~restore.

    Each answers when it is done, with one line. The scene's file is the private parameter `scene_file`, the script
    that of `script`, the vehicles are those of the private parameter `vehicles`.
    """

    def __init__(self, player: Player, inbox: Inbox, follow: Callable[[], None]):
        """Advertise. `follow` lets the topics follow vehicles that have come or gone."""
        self._player = player
        self._inbox = inbox
        self._follow = follow
        self._vehicles = VehiclesParameter()
        self._vehicles.tell(player.simulation.parameters)
        self._snapshot: Snapshot | None = None
        jobs = ("start", "stop", "restart", "step", "save_scene", "load_scene", "set_vehicles", "snapshot", "restore")
        for name in jobs:
            rospy.Service(f"~{name}", Trigger, self._trigger(getattr(self, name)))
        rospy.Service("~pause", SetBool, self._on_pause)

    def _trigger(self, job: Callable[[], str]) -> Callable[[TriggerRequest], TriggerResponse]:
        return lambda _request: TriggerResponse(*self._answer(job))

    def close(self) -> None:
        """Leave the parameters as they were given."""
        self._vehicles.close()

    def _on_pause(self, request: SetBoolRequest) -> SetBoolResponse:
        return SetBoolResponse(*self._answer(lambda: self._player.pause(request.data)))

    def _answer(self, job: Callable[[], str]) -> tuple[bool, str]:
        try:
            answer = self._inbox.ask(job)
            rospy.logdebug(answer)
            return True, answer
        except (ParameterError, ScriptError, ValueError, OSError, RuntimeError) as error:
            return False, " ".join(str(error).split())

    # ---- carried out in the simulation's thread

    def start(self) -> str:
        """Read scene and the script of `script` from disk, and begin at time 0."""
        self._take_script()
        return self._begun(self._player.start())

    def stop(self) -> str:
        """Run cleanup, and restore the initial scene."""
        return self._player.stop()

    def restart(self) -> str:
        """Stop, and start."""
        self._take_script()
        return self._begun(self._player.restart())

    def step(self) -> str:
        """Run one step while paused."""
        return self._player.one_step()

    def save_scene(self) -> str:
        """Write the scene as it stands now. A scene of the package itself is not overwritten."""
        simulation = self._player.simulation
        name = _scene_parameter()
        path = locate(name) if name else _HOME.expanduser()
        if package_path() in path.resolve().parents:
            path = _HOME.expanduser()
        simulation.save_scene(path)
        return f"saved {path}"

    def load_scene(self) -> str:
        """Start anew in the scene of `scene_file`."""
        file = _scene_parameter()
        self._take_script()
        return f"{self._begun(self._player.start(file))} in {file or 'the scene of the parameters'}"

    def _begun(self, said: str) -> str:
        self._vehicles.tell(self._player.simulation.parameters)  # the scene, read anew, may have other ones
        return said

    def _take_script(self) -> None:
        """Let the script fly that the parameter `script` names now. Raises ScriptError where it is not there."""
        script = from_shell(str(rospy.get_param("~script", "")))
        script_path(script)
        self._player.simulation.script = script

    def set_vehicles(self) -> str:
        """Let those fly that the parameter `vehicles` says; who was there and still is flies on."""
        came, went = self._player.simulation.set_vehicles(self._vehicles.read())
        self._follow()
        told = [f"{', '.join(names)} {verb}" for names, verb in ((came, "came"), (went, "went")) if names]
        return "; ".join(told) or "all are as they were"

    def snapshot(self) -> str:
        """Remember the exact dynamic state."""
        simulation = self._player.simulation
        if self._snapshot is not None:
            simulation.forget(self._snapshot)
        self._snapshot = simulation.snapshot()
        return f"remembered t = {self._player.simulation.time:.2f} s"

    def restore(self) -> str:
        """Bring it back."""
        if self._snapshot is None:
            raise ValueError("no snapshot has been taken")
        self._player.simulation.restore(self._snapshot)
        return f"back at t = {self._player.simulation.time:.2f} s"


def _scene_parameter() -> str:
    return from_shell(str(rospy.get_param("~scene_file", "")))
