"""V-REP's toolbar and file menu as services: `rosservice call /drone_sim/start`, and so on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from concurrent.futures import wait
from functools import partial
from typing import Any

import rospy
from std_srvs.srv import SetBool, Trigger

from drone_sim.grading.permissions import CHANGE
from drone_sim.message_text import shown
from drone_sim.ros.core.connections import wait_until_taken
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.shell_files import from_shell, script_from_shell
from drone_sim.ros.core.startup import MASTER_FAILURES
from drone_sim.ros.core.validation import intervention
from drone_sim.ros.node.run_timeline import RunTimeline
from drone_sim.run.parameters import MAX_STEP_COUNT, ParameterError, Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Snapshot
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_VEHICLES = "~vehicles"
_POLL_PERIOD = 0.2  # s
_SEND_TIMEOUT = 1.0  # s, for the messages of a step to be sent


class Services:
    """~start, ~stop, ~restart, ~step, ~pause; ~load_scene; ~set_vehicles; ~snapshot, ~restore.

    Each answers with one line when it is done. Private parameters set the scene's file (`scene_file`), the script
    (`script`), the vehicles (`vehicles`), and the number of steps of `step` (`step_count`).
    """

    def __init__(
        self,
        player: Player,
        timeline: RunTimeline,
        inbox: Inbox,
        follow: Callable[[], None],
        restored: Callable[[], None] = lambda: None,
    ):
        """Advertise the services of `player`; the simulation's thread runs the jobs in `inbox`.

        `player` reads `timeline` at each start. `follow` updates the topics after vehicles were added or removed;
        `restored` is called after a restore.
        """
        self._player, self._timeline, self._inbox = player, timeline, inbox
        self._follow, self._restored = follow, restored
        self._vehicles = VehiclesParameter()
        self._vehicles.write(player.simulation.parameters)
        self._snapshot: Snapshot | None = None
        self._launch_script = rospy.get_param("~script", "")
        # The scene of the config, if the parameter scene_file did not replace it.
        self._config_scene = "" if scene_parameter() else player.simulation.parameters.scene_file
        for name in ("start", "stop", "restart", "load_scene", "set_vehicles", "snapshot", "restore"):
            rospy.Service(f"~{name}", Trigger, partial(self._answer, name, getattr(self, name)))
        rospy.Service("~step", Trigger, self._answer_step)
        rospy.Service(
            "~pause", SetBool, lambda request: self._answer("pause", lambda: self.pause(request.data), request)
        )

    def close(self) -> None:
        """Restore the parameters of the launch."""
        self._vehicles.close()

    def update_vehicles(self) -> None:
        """Write the vehicles of the scene into the parameter, and update their topics."""
        self._vehicles.write(self._player.simulation.parameters)
        self._follow()

    def _answer(self, name: str, job: Callable[[], str], request: Any) -> tuple[bool, str]:
        change = intervention(CHANGE, "the scene", f"~{name}", request) if name != "snapshot" else None
        try:
            answer = self._inbox.ask(job, change)
            rospy.logdebug(answer)
            return True, answer
        except (ParameterError, ScriptError, ValueError, OSError, RuntimeError) as error:
            return False, " ".join(str(error).split())

    def _answer_step(self, request: Any) -> tuple[bool, str]:
        """Run as many steps as the parameter `step_count` says, and answer when their messages have been sent."""
        change = intervention(CHANGE, "the scene", "~step", request)
        try:
            count = _step_count(self._player.simulation.parameters.step_count)
            steps = self._inbox.ask(lambda: self._player.order_steps(count), change)
            while not rospy.is_shutdown() and not wait([steps], _POLL_PERIOD).done:
                pass  # in lockstep, a step may wait for a node for any time
            if not steps.done():
                return False, "the node ends"
            answer = steps.result()
            wait_until_taken(_SEND_TIMEOUT)
            return True, answer
        except (ScriptError, ValueError, OSError, RuntimeError) as error:
            return False, " ".join(str(error).split())

    # ---- run in the simulation's thread

    def start(self) -> str:
        """Read scene and the script of `script` from disk, and begin at time 0."""
        self._read_script()
        return self._report_start(self._player.start())

    def stop(self) -> str:
        """Run the script's cleanup, and restore the initial scene."""
        return self._player.stop()

    def restart(self) -> str:
        self._read_script()
        return self._report_start(self._player.restart())

    def pause(self, on: bool) -> str:
        """Pause, or resume if not `on`. `rosservice call ... pause "{}"` means False, so it does not pause."""
        if not on and self._player.playing:
            answer = f"not paused: `rosservice call {rospy.resolve_name('~pause')} true` pauses, false resumes"
            rospy.logwarn(f"pause: no effect: {answer}")
            return answer
        return self._player.pause(on)

    def load_scene(self) -> str:
        """Start in the scene of `scene_file`."""
        file = scene_parameter(self._config_scene)
        self._read_script()
        started = self._player.start(file)
        return self._report_start(f"{started} in {file or 'the scene of the parameters'}")

    def _report_start(self, started: str) -> str:
        self._vehicles.write(self._player.simulation.parameters)  # the scene that was read may have other vehicles
        return f"{started}{self._timeline.summary}"

    def _read_script(self) -> None:
        """Fly the script of the parameter `script` from the next start on. Raises ScriptError if it does not exist."""
        script = script_from_shell(str(rospy.get_param("~script", "")))
        script_path(script)
        self._player.simulation.script = script

    def forget_script(self) -> None:
        """Replace the script that was run in the scene before by the script of the launch."""
        rospy.set_param("~script", self._launch_script)
        self._player.simulation.script = script_from_shell(str(self._launch_script))

    def set_vehicles(self) -> str:
        """Fly the vehicles in the parameter `vehicles`; those that already fly continue."""
        added, removed = self._player.simulation.set_vehicles(rospy.get_param(_VEHICLES, {}))
        self._follow()
        changes = [f"{', '.join(names)} {verb}" for names, verb in ((added, "added"), (removed, "removed")) if names]
        return "; ".join(changes) or "no vehicle was added or removed"

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
        self._restored()
        return f"restored t = {self._player.simulation.time:.2f} s"


def scene_parameter(otherwise: str = "") -> str:
    """Return the file that the private parameter `scene_file` names; `otherwise` if it is not set, or is `none`."""
    given = str(rospy.get_param("~scene_file", "none"))
    return otherwise if given == "none" else from_shell(given)


def _step_count(otherwise: int) -> int:
    """Return how many steps `step` takes: `otherwise` if the parameter is not set. Raises ValueError."""
    try:
        count = rospy.get_param("~step_count", otherwise)
    except (*MASTER_FAILURES, OSError) as error:
        raise ValueError(f"step_count cannot be read, because the ROS master does not answer: {error}") from None
    if not (isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MAX_STEP_COUNT):
        raise ParameterError(f"must be a whole number from 1 to {MAX_STEP_COUNT}", ("step_count",), shown(count))
    return count


class VehiclesParameter:
    """The private parameter `vehicles`, which users may change.

    The node writes an entry for each vehicle that flies, unless a user has written the parameter. So a user can add
    one entry: rosparam and roslaunch merge it into the present entries, but would replace a number.
    """

    def __init__(self) -> None:
        """Read the value of the launch."""
        self._given = self._written = rospy.get_param(_VEHICLES, None)

    def write(self, parameters: Parameters) -> None:
        """Write the vehicles that fly, unless they are the scene file's, which count more than the parameter."""
        try:
            self._write(_sendable(parameters.vehicle_entries) or self._given)
        except (TypeError, OverflowError) as error:  # of XML-RPC: such as a seed of more than 32 bits
            name = rospy.resolve_name(_VEHICLES)
            rospy.logwarn(f"the parameter {name} cannot be set to the vehicles of the scene: {error}")

    def close(self) -> None:
        """Restore the value of the launch, because the next simulator of this name may have other vehicles."""
        with contextlib.suppress(*MASTER_FAILURES, OSError):
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
        return {str(key): _sendable(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_sendable(inner) for inner in value]
    return "none" if value is None else value
