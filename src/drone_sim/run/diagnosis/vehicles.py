"""Why a vehicle does not fly as its pilot expects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from drone_sim.mechanics.state import Twist
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.counts import Since
from drone_sim.run.diagnosis.finding import ERROR, WARN, Finding, Problem, finding, numbers
from drone_sim.run.player import Player
from drone_sim.scripting import load
from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.commands import CRASHED, LANDED
from drone_sim.vehicles.situation import FLYING, HELD, UPSIDE_DOWN, doing, hears_commands, situation, tilt
from drone_sim.vehicles.vehicle import Vehicle

COMMAND = "cmd_vel"
_RECENT = 5.0  # s of real time
_LEANING = math.radians(60)  # no flight of the tutorial's needs half as much
_SHARE = 0.5  # of the steps with a propeller at its limit, after which it is a problem
_SLOW = 0.1  # of the speed that is commanded
_MOVES = 0.1  # m/s, of a command that means to
_IGNORED_FOR = 3.0  # s of simulated time
_DEAF = "this script does not subscribe to commands: the tutorial's scripts do from stage 6 on, and `pilot` does"


class VehicleDiagnosis:
    """Looks at one vehicle, between two steps."""

    def __init__(
        self,
        vehicle: Vehicle,
        player: Player,
        log: CommandLog,
        since: Since | None,
        frames_below: str = "",
        unmoved: float = 0.0,
        unheard: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ):
        """Take what is to be looked at; `since` is what was counted since the last look, None where nothing was.

        The names of the vehicles' frames begin with `frames_below`; `is_unmoved` has been true for `unmoved` s.
        `unheard` has the topics on which Twists are published and that have no subscriber, with the publishers' names.
        """
        self._frames_below, self._unmoved, self._unheard = frames_below, unmoved, unheard
        self._vehicle, self._player, self._log, self._since = vehicle, player, log, since
        self._now = log.clock()
        self._tilt = tilt(vehicle.body)
        self._doing = doing(vehicle)
        self._contacts = vehicle.body.contacts()

    def finding(self) -> Finding:
        """Return what was found."""
        problems = [
            *self._stands(),
            *self._has_failed(),
            *self._rests(),
            *self._refuses(),
            *self._leans(),
            *self._lies(),
            *self._cannot(),
            *self._is_on_its_own(),
            *self._has_rivals(),
            *self._misses(),
            *self._ignores(),
        ]
        return finding(f"vehicle {self._vehicle.name}", self._fine(), problems, self._values())

    # ---- what may be wrong

    def _stands(self) -> list[Problem]:
        player = self._player
        if player.playing:
            return []
        if player.why_stopped:
            return [Problem(ERROR, f"stopped: {player.why_stopped}; `start` runs the edited file")]
        taken = self._log.taken.get(COMMAND)
        cure = "`pause false` resumes it" if player.state == "paused" else "`start` starts it"
        if taken is not None and self._now - taken.at < _RECENT:
            return [Problem(WARN, f"{taken.sender} sends commands, but the simulation is {player.state}: {cure}")]
        return []

    def _has_failed(self) -> list[Problem]:
        """Report a script on an object of the vehicle that has failed, while the simulation goes on."""
        error = self._vehicle.flight_state.script_error
        return [Problem(ERROR, f"script failed: {error}")] if error and not self._player.why_stopped else []

    def _rests(self) -> list[Problem]:
        """Tell of commands that do not move it, for it has landed or crashed."""
        taken, state = self._log.taken.get(COMMAND), str(self._vehicle.flight_state)
        if state == CRASHED:
            return [Problem(WARN, "crashed: `reset` puts it back at its start")]
        if state == LANDED and taken is not None and self._vehicle.commands.now != Twist() and self._player.playing:
            return [Problem(WARN, f"landed: commands of {taken.sender} do not move it; send `takeoff` first")]
        return []

    def _refuses(self) -> list[Problem]:
        refused = self._log.last_refusal()
        if refused is None or not self._log.is_refusing(refused.topic):
            return []
        kept = ", and keeps the last valid one" if refused.topic == COMMAND else ""
        return [Problem(WARN, f"refused a message of {refused.sender} on {refused.topic}{kept}: {refused.why}")]

    def _leans(self) -> list[Problem]:
        if self._tilt < _LEANING or str(self._vehicle.flight_state) == CRASHED:
            return []
        how = "lies on its back" if self._tilt > math.pi / 2 and self._contacts else "leans"
        return [Problem(WARN, f"{how} ({math.degrees(self._tilt):.0f} degrees): `restart` puts it upright")]

    def _lies(self) -> list[Problem]:
        """Tell that it lies, slides or hangs somewhere, where its script has not said so itself."""
        said = self._doing
        if not self._player.playing or said in (FLYING, HELD, UPSIDE_DOWN) or said != situation(self._vehicle.body):
            return []
        is_touched = said.startswith("touches")
        return [Problem(WARN, said if is_touched else f"{said}: nothing is below it; `restart` puts it back")]

    def _cannot(self) -> list[Problem]:
        problems = []
        since, command = self._since, self._vehicle.commands.now
        if since and since.steps and since.clipped[self._vehicle.name] > _SHARE * since.steps:
            problems.append(Problem(WARN, f"propellers are at their limit in {self._clipped()}"))
        wanted = math.hypot(*command.linear)
        if since and self._contacts and wanted > _MOVES and self._speed() < _SLOW * wanted:
            met = ", ".join(_names(self._contacts))
            problems.append(
                Problem(WARN, f"blocked by {met}: the command is {wanted:.2f} m/s, the speed {self._speed():.2f} m/s")
            )
        return problems

    def _is_on_its_own(self) -> list[Problem]:
        """Tell that no script listens to commands, or that the sender of the present command is gone."""
        vehicle, taken = self._vehicle, self._log.taken.get(COMMAND)
        if taken is None or not self._player.playing or str(vehicle.flight_state) in (LANDED, CRASHED):
            return []
        if not hears_commands(vehicle):
            return [Problem(WARN, _DEAF)]
        gone = taken.sender not in self._log.senders()
        if gone and vehicle.commands.now != Twist() and not vehicle.parameters.cmd_vel_timeout:
            said = f"still obeys the last command of {taken.sender}, which has exited"
            return [Problem(WARN, f"{said}: publish a zero Twist, or set cmd_vel_timeout")]
        return []

    def _has_rivals(self) -> list[Problem]:
        """Report several nodes that send commands at the same time: the drone obeys the last one before each step."""
        rivals = self._log.rivals(COMMAND)
        said = f"{' and '.join(rivals)} send {COMMAND} at the same time, and each overrides the other: stop all but one"
        return [Problem(WARN, said)] if rivals else []

    def _misses(self) -> list[Problem]:
        """Report Twists on topics without a subscriber, while no command reaches the vehicle."""
        taken = self._log.taken.get(COMMAND)
        if taken is not None and self._now - taken.at < _RECENT:
            return []
        own = f"{self._vehicle.name}/{COMMAND}"
        return [
            Problem(WARN, f"no command comes: {', '.join(nodes)} publishes {topic}, which nobody receives, not {own}")
            for topic, nodes in self._unheard.items()
        ]

    def _ignores(self) -> list[Problem]:
        """Return a problem if the script hears commands, but the vehicle has not followed them for some time."""
        if self._unmoved < _IGNORED_FOR or not hears_commands(self._vehicle):
            return []
        said = f"receives {_shown(self._vehicle.commands.now)}, but its velocity has not followed for"
        cure = "does the script use the command, or overwrite it in each step (twist[1] = 0)?"
        return [Problem(WARN, f"{said} {self._unmoved:.0f} s: {cure}")]

    # ---- what is so

    def _fine(self) -> str:
        taken = self._log.taken.get(COMMAND)
        state = self._player.state
        if not self._player.playing:
            return state
        if self._doing != FLYING:
            return self._doing
        if taken is None:
            return (
                f"{state}; no command has been received yet" if hears_commands(self._vehicle) else f"{state}; {_DEAF}"
            )
        return f"{state} as {taken.sender} commands"

    def _values(self) -> dict[str, str]:
        vehicle, log = self._vehicle, self._log
        taken, refused = log.taken.get(COMMAND), log.last_refusal()
        limits, timeout = vehicle.parameters.propellers.velocity_limits, vehicle.parameters.cmd_vel_timeout
        return {
            "state": self._player.state,
            "flight state": str(vehicle.flight_state),
            "does": self._doing,
            "listens to commands": "yes" if hears_commands(vehicle) else "no",
            "command": _shown(vehicle.commands.now),
            "command came": self._ago(taken.at) if taken else "never",
            "command sender": taken.sender if taken else "nobody",
            "connected commanders": ", ".join(log.senders()) or "nobody",
            "command held for": f"{timeout:g} s" if timeout > 0 else "ever",
            "refused": f"{sum(one.times for one in log.refused.values())}",
            "last refused": f"{refused.topic} of {refused.sender}, {self._ago(refused.at)}" if refused else "",
            "why refused": refused.why if refused else "",
            "propellers": f"{numbers(vehicle.propulsion.particle_velocities)} m/s",
            "propeller limits": f"{numbers(limits)} m/s" if limits else "none",
            "propellers at a limit": self._clipped(),
            "tilt": f"{math.degrees(self._tilt):.1f} degrees",
            "position": f"{numbers(vehicle.body.state.position)} m",
            "speed": f"{self._speed():.2f} m/s",
            "contacts": ", ".join(_names(self._contacts)) or "none",
            "put elsewhere": f"{vehicle.body.jumps} times",
            "script": str(vehicle.parameters.script or self._player.simulation.script or load.DEFAULT),
            "frame": f"{self._frames_below}{vehicle.parameters.frame_prefix}base_link, in world",
        }

    def _ago(self, at: float) -> str:
        return f"{self._now - at:.1f} s ago"

    def _speed(self) -> float:
        return math.hypot(*self._vehicle.body.state.linear_velocity)

    def _clipped(self) -> str:
        since = self._since
        return f"{since.clipped[self._vehicle.name]} of the last {since.steps} steps" if since else "not known"


def is_unmoved(vehicle: Vehicle) -> bool:
    """Return whether a vehicle that flies freely neither moves nor turns, though its command says so."""
    command, state = vehicle.commands.now, vehicle.body.state
    wanted, turn = math.hypot(*command.linear), abs(command.angular.z)
    if max(wanted, turn) < _MOVES or doing(vehicle) != FLYING or vehicle.body.contacts():
        return False
    asked_and_done = (wanted, math.hypot(*state.linear_velocity)), (turn, abs(state.angular_velocity[2]))
    return all(asked < _MOVES or done <= _SLOW * asked for asked, done in asked_and_done)


def _names(contacts: list[Contact]) -> list[str]:
    """Return what is touched, and with how many newtons in all, the hardest first."""
    newtons: dict[str, float] = {}
    for one in contacts:
        newtons[one.what] = newtons.get(one.what, 0.0) + math.hypot(*one.force)
    return [f"{what or 'something'} ({newtons[what]:.2g} N)" for what in sorted(newtons, key=lambda one: -newtons[one])]


def _shown(command: Twist) -> str:
    return f"{numbers(command.linear)} m/s, {numbers(command.angular)} rad/s"
