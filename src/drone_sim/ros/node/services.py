"""V-REP's toolbar and file menu as services: `rosservice call /drone_sim/start`, and so on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from typing import Any

import rospy
from std_srvs.srv import SetBool, Trigger

from drone_sim.grading.permissions import CHANGE
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.intervention import intervention
from drone_sim.ros.core.startup import MASTER_GONE, from_shell, script_from_shell
from drone_sim.run.parameters import ParameterError, Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Snapshot
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_VEHICLES = "~vehicles"


class Services:
    """~start, ~stop, ~restart, ~step, ~pause; ~load_scene; ~set_vehicles; ~snapshot, ~restore.

    Each answers when it is done, with one line. The scene's file is the private parameter `scene_file`, the script
    that of `script`, the vehicles are those of the private parameter `vehicles`.
    """

    def __init__(self, player: Player, inbox: Inbox, follow: Callable[[], None]):
        """Advertise what is done with `player` by the thread that empties `inbox`.

        `follow` lets the topics follow vehicles that have come or gone.
        """
        self._player = player
        self._inbox = inbox
        self._follow = follow
        self._vehicles = VehiclesParameter()
        self._vehicles.tell(player.simulation.parameters)
        self._snapshot: Snapshot | None = None
        # The scene of the config, if the parameter scene_file did not replace it.
        self._config_scene = "" if scene_parameter() else player.simulation.parameters.scene_file
        jobs = ("start", "stop", "restart", "step", "load_scene", "set_vehicles", "snapshot", "restore")
        for name in jobs:
            rospy.Service(f"~{name}", Trigger, partial(self._answer, name, getattr(self, name)))
        rospy.Service(
            "~pause", SetBool, lambda request: self._answer("pause", lambda: self.pause(request.data), request)
        )

    def close(self) -> None:
        """Leave the parameters as they were given."""
        self._vehicles.close()

    def tell_vehicles(self) -> None:
        """Write into the parameter which vehicles fly, and update their topics: the scene may have other vehicles."""
        self._vehicles.tell(self._player.simulation.parameters)
        self._follow()

    def _answer(self, name: str, job: Callable[[], str], request: Any) -> tuple[bool, str]:
        done = intervention(CHANGE, "the scene", f"~{name}", request) if name != "snapshot" else None
        try:
            answer = self._inbox.ask(job, done)
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

    def pause(self, on: bool) -> str:
        """Pause, or resume, if not `on`. `rosservice call ... pause "{}"` means False, so a flight is not paused."""
        if not on and self._player.playing:
            said = f"not paused: `rosservice call {rospy.resolve_name('~pause')} true` pauses, false resumes"
            rospy.logwarn(f"pause: no effect: {said}")
            return said
        return self._player.pause(on)

    def step(self) -> str:
        """Run one step while paused."""
        return self._player.one_step()

    def load_scene(self) -> str:
        """Start anew in the scene of `scene_file`."""
        file = scene_parameter(self._config_scene)
        self._take_script()
        return f"{self._begun(self._player.start(file))} in {file or 'the scene of the parameters'}"

    def _begun(self, said: str) -> str:
        self._vehicles.tell(self._player.simulation.parameters)  # the scene, read anew, may have other ones
        return said

    def _take_script(self) -> None:
        """Let the script fly that the parameter `script` names now. Raises ScriptError where it is not there."""
        script = script_from_shell(str(rospy.get_param("~script", "")))
        script_path(script)
        self._player.simulation.script = script

    def set_vehicles(self) -> str:
        """Fly the vehicles in the parameter `vehicles`; those that fly already simply fly on."""
        added, removed = self._player.simulation.set_vehicles(self._vehicles.read())
        self._follow()
        told = [f"{', '.join(names)} {verb}" for names, verb in ((added, "added"), (removed, "removed")) if names]
        return "; ".join(told) or "no vehicle was added or removed"

    def snapshot(self) -> str:
        """Remember the exact dynamic state."""
        simulation = self._player.simulation
        if self._snapshot is not None:
            simulation.forget(self._snapshot)
        self._snapshot = simulation.snapshot()
        return f"snapshot at t = {self._player.simulation.time:.2f} s"

    def restore(self) -> str:
        """Restore the state of the last snapshot."""
        if self._snapshot is None:
            raise ValueError("no snapshot has been taken")
        self._player.simulation.restore(self._snapshot)
        return f"restored t = {self._player.simulation.time:.2f} s"


def scene_parameter(otherwise: str = "") -> str:
    """Return the file that the private parameter `scene_file` names; `otherwise` if it is not set, or is `none`."""
    given = str(rospy.get_param("~scene_file", "none"))
    return otherwise if given == "none" else from_shell(given)


class VehiclesParameter:
    """The private parameter `vehicles`, for people to change.

    It holds an entry for each vehicle that flies, as long as nobody else has written it. rosparam, like roslaunch,
    leaves out empty entries and merges the others into the present value: an entry merged into a number, or into
    nothing, would be the only one.
    """

    def __init__(self) -> None:
        """Take what was given."""
        self._given = self._written = rospy.get_param(_VEHICLES, None)

    def tell(self, parameters: Parameters) -> None:
        """Write which vehicles fly, unless the scene file says it: that takes precedence over the parameter."""
        try:
            self._write(_sendable(parameters.vehicle_entries) or self._given)
        except (TypeError, OverflowError) as error:  # of XML-RPC: such as a seed of more than 32 bits
            rospy.logwarn(
                f"the parameter {rospy.resolve_name(_VEHICLES)} cannot be set to the vehicles of the scene: {error}"
            )

    def read(self) -> Any:
        """Return what it holds."""
        return rospy.get_param(_VEHICLES, {})

    def close(self) -> None:
        """Put back what was given: the next simulator of this name may be given another drone."""
        with contextlib.suppress(*MASTER_GONE, OSError):
            self._write(self._given)

    def _write(self, value: Any) -> None:
        if value == self._written or rospy.get_param(_VEHICLES, None) != self._written:
            return
        if value is None:
            rospy.delete_param(_VEHICLES)
        else:
            rospy.set_param(_VEHICLES, value)
        self._written = value


def _sendable(value: Any) -> Any:
    """Return a value of YAML without null, which parameters cannot hold."""
    if isinstance(value, dict):
        return {str(key): _sendable(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_sendable(one) for one in value]
    return "none" if value is None else value
