"""Diagnosis of a vehicle that does not fly as its pilot expects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from drone_sim.mechanics.state import Twist
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.finding import ERROR, WARN, Counts, Finding, Problem, finding, numbers
from drone_sim.run.player import Player
from drone_sim.run.profiles import profile_cure
from drone_sim.scripting import load
from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.commands import CRASHED, LANDED
from drone_sim.vehicles.situation import FLYING, HELD, UPSIDE_DOWN, doing, hears_commands, situation, tilt
from drone_sim.vehicles.vehicle import Vehicle

COMMAND = "cmd_vel"
_RECENT = 5.0  # s of real time
_MAX_TILT = math.radians(60)  # more than twice what any flight of the tutorial needs
_CLIPPED_SHARE = 0.5  # fraction of the steps with a propeller at its limit that is a problem
_SLOW_SHARE = 0.1  # fraction of the commanded speed
_MIN_COMMAND = 0.1  # m/s and rad/s, smallest command that should move the vehicle
_IGNORED_TIME = 3.0  # s of simulated time
_DEAF = "this script does not subscribe to commands: the tutorial's scripts do from stage 6 on, and `pilot` does"


@dataclass
class VehicleDiagnosis:
    """Diagnosis of one vehicle, between two steps.

    `since` has the counts since the last diagnosis, or None. `frames_below` is the prefix of the vehicles' frames;
    `is_unmoved` has been true for `unmoved` s. `unheard` has the topics that look like commands and have no subscriber,
    with the publishers' names.
    """

    vehicle: Vehicle
    player: Player
    log: CommandLog
    since: Counts | None
    frames_below: str = ""
    unmoved: float = 0.0
    unheard: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._now = self.log.clock()
        self._tilt = tilt(self.vehicle.body)
        self._situation = doing(self.vehicle)
        self._contacts = self.vehicle.body.contacts()

    def finding(self) -> Finding:
        problems = [
            *self._check_running(),
            *self._check_script(),
            *self._check_landed(),
            *self._check_refusals(),
            *self._check_tilt(),
            *self._check_situation(),
            *self._check_limits(),
            *self._check_sender(),
            *self._check_rivals(),
            *self._check_topics(),
            *self._check_response(),
        ]
        return finding(f"vehicle {self.vehicle.name}", self._fine(), problems, self._values())

    # ---- checks

    def _check_running(self) -> list[Problem]:
        player = self.player
        if player.playing:
            return []
        if player.why_stopped:
            return [Problem(ERROR, f"stopped: {player.why_stopped}; `start` runs the edited file")]
        taken = self.log.taken.get(COMMAND)
        cure = "`pause false` resumes it" if player.state == "paused" else "`start` starts it"
        if taken is not None and self._now - taken.at < _RECENT:
            return [Problem(WARN, f"{taken.sender} sends commands, but the simulation is {player.state}: {cure}")]
        return []

    def _check_script(self) -> list[Problem]:
        """Report a failed script on an object of the vehicle, while the simulation continues."""
        error = self.vehicle.flight_state.script_error
        return [Problem(ERROR, f"script failed: {error}")] if error and not self.player.why_stopped else []

    def _check_landed(self) -> list[Problem]:
        """Report commands that have no effect because the vehicle has landed or crashed."""
        taken, state = self.log.taken.get(COMMAND), str(self.vehicle.flight_state)
        if state == CRASHED:
            return [Problem(WARN, "crashed: `reset` puts it back at its start")]
        if state == LANDED and taken is not None and self.vehicle.commands.now != Twist() and self.player.playing:
            return [Problem(WARN, f"landed: commands of {taken.sender} do not move it; send `takeoff` first")]
        return []

    def _check_refusals(self) -> list[Problem]:
        refused = self.log.last_refusal()
        if refused is None or not self.log.is_refusing(refused.topic):
            return []
        kept = ", and keeps the last valid one" if refused.topic == COMMAND else ""
        return [Problem(WARN, f"refused a message of {refused.sender} on {refused.topic}{kept}: {refused.why}")]

    def _check_tilt(self) -> list[Problem]:
        if self._tilt < _MAX_TILT or str(self.vehicle.flight_state) == CRASHED:
            return []
        how = "lies on its back" if self._tilt > math.pi / 2 and self._contacts else "leans"
        return [Problem(WARN, f"{how} ({math.degrees(self._tilt):.0f} degrees): `restart` puts it upright")]

    def _check_situation(self) -> list[Problem]:
        """Report that the vehicle lies, slides or hangs somewhere, unless its script reports another state."""
        state = self._situation
        if not self.player.playing or state in (FLYING, HELD, UPSIDE_DOWN) or state != situation(self.vehicle.body):
            return []
        is_touched = state.startswith("touches")
        return [
            Problem(WARN, state if is_touched else f"{state}: its propellers do not lift it; `restart` puts it back")
        ]

    def _check_limits(self) -> list[Problem]:
        problems = []
        since, command = self.since, self.vehicle.commands.now
        if since and since.steps and since.clipped[self.vehicle.name] > _CLIPPED_SHARE * since.steps:
            problems.append(Problem(WARN, f"propellers are at their limit in {self._clipped()}"))
        wanted = math.hypot(*command.linear)
        if since and self._contacts and wanted > _MIN_COMMAND and self._speed() < _SLOW_SHARE * wanted:
            names = ", ".join(_names(self._contacts))
            problems.append(
                Problem(WARN, f"blocked by {names}: the command is {wanted:.2f} m/s, the speed {self._speed():.2f} m/s")
            )
        return problems

    def _check_sender(self) -> list[Problem]:
        """Report that no script subscribes to commands, or that the sender of the present command has exited."""
        vehicle, taken = self.vehicle, self.log.taken.get(COMMAND)
        if taken is None or not self.player.playing or str(vehicle.flight_state) in (LANDED, CRASHED):
            return []
        if not hears_commands(vehicle):
            return [Problem(WARN, _DEAF)] if self._now - taken.at < _RECENT else []
        has_exited = taken.sender not in self.log.senders()
        if has_exited and vehicle.commands.now != Twist() and not vehicle.parameters.cmd_vel_timeout:
            problem = f"still obeys the last command of {taken.sender}, which has exited"
            return [Problem(WARN, f"{problem}: publish a zero Twist, or set cmd_vel_timeout")]
        return []

    def _check_rivals(self) -> list[Problem]:
        """Report several nodes that send commands at the same time: the drone obeys the last one before each step."""
        rivals = self.log.rivals(COMMAND)
        text = f"{' and '.join(rivals)} send {COMMAND} at the same time, and each overrides the other: stop all but one"
        idle = [sender for sender in rivals if self.log.sends_zeros(COMMAND, sender)]
        text += f"; {' and '.join(idle)} sends only zeros" if idle else ""
        return [Problem(WARN, text)] if rivals else []

    def _check_topics(self) -> list[Problem]:
        """Report commands on topics without a subscriber, while no command reaches the vehicle."""
        taken = self.log.taken.get(COMMAND)
        if taken is not None and self._now - taken.at < _RECENT:
            return []
        own = f"publish to /{self.frames_below}{self.vehicle.name}/{COMMAND}"
        problems = []
        for topic, nodes in self.unheard.items():
            what = f"no command arrives: {', '.join(nodes)} publishes {topic}, without a subscriber"
            problems.append(Problem(WARN, f"{what}: {', or '.join(filter(None, (own, profile_cure(topic))))}"))
        return problems

    def _check_response(self) -> list[Problem]:
        """Report that the script subscribes to commands, but the vehicle has not followed them for some time."""
        if self.unmoved < _IGNORED_TIME or not hears_commands(self.vehicle):
            return []
        problem = f"receives {_shown(self.vehicle.commands.now)}, but its velocity has not followed for"
        cure = "does the script use the command, or overwrite it in each step (twist[1] = 0)?"
        return [Problem(WARN, f"{problem} {self.unmoved:.0f} s: {cure}")]

    # ---- values

    def _fine(self) -> str:
        taken = self.log.taken.get(COMMAND)
        state = self.player.state
        if not self.player.playing:
            return state
        if self._situation != FLYING:
            return self._situation
        if taken is None:
            return f"{state}; no command has been received yet" if hears_commands(self.vehicle) else f"{state}; {_DEAF}"
        return f"{state} as {taken.sender} commands"

    def _values(self) -> dict[str, str]:
        vehicle, log = self.vehicle, self.log
        taken, refused = log.taken.get(COMMAND), log.last_refusal()
        limits, timeout = vehicle.parameters.propellers.velocity_limits, vehicle.parameters.cmd_vel_timeout
        return {
            "state": self.player.state,
            "flight state": str(vehicle.flight_state),
            "does": self._situation,
            "listens to commands": "yes" if hears_commands(vehicle) else "no",
            "command": _shown(vehicle.commands.now),
            "command came": self._ago(taken.at) if taken else "never",
            "command sender": taken.sender if taken else "nobody",
            "connected commanders": ", ".join(log.senders()) or "nobody",
            "command held for": f"{timeout:g} s" if timeout > 0 else "ever",
            "refused": f"{sum(refusal.times for refusal in log.refused.values())}",
            "last refused": f"{refused.topic} of {refused.sender}, {self._ago(refused.at)}" if refused else "",
            "why refused": refused.why if refused else "",
            "propellers": f"{numbers(vehicle.propulsion.particle_velocities)} m/s",
            "propeller limits": f"{numbers(limits)} m/s" if limits else "none",
            "propellers at a limit": self._clipped(),
            "tilt": f"{math.degrees(self._tilt):.1f} degrees",
            "position": f"{numbers(vehicle.body.state.position)} m",
            "speed": f"{self._speed():.2f} m/s",
            "contacts": ", ".join(_names(self._contacts)) or "none",
            "put elsewhere": f"{vehicle.body.teleports} times",
            "script": str(vehicle.parameters.script or self.player.simulation.script or load.DEFAULT),
            "frame": f"{self.frames_below}{vehicle.parameters.frame_prefix}base_link, in world",
        }

    def _ago(self, at: float) -> str:
        return f"{self._now - at:.1f} s ago"

    def _speed(self) -> float:
        return math.hypot(*self.vehicle.body.state.linear_velocity)

    def _clipped(self) -> str:
        since = self.since
        return f"{since.clipped[self.vehicle.name]} of the last {since.steps} steps" if since else "not known"


def is_unmoved(vehicle: Vehicle) -> bool:
    """Return whether a vehicle in free flight neither moves nor turns, although its command requires it."""
    command, state = vehicle.commands.now, vehicle.body.state
    wanted, yaw_rate = math.hypot(*command.linear), abs(command.angular.z)
    if max(wanted, yaw_rate) < _MIN_COMMAND or doing(vehicle) != FLYING or vehicle.body.contacts():
        return False
    pairs = (wanted, math.hypot(*state.linear_velocity)), (yaw_rate, abs(state.angular_velocity[2]))
    return all(commanded < _MIN_COMMAND or actual <= _SLOW_SHARE * commanded for commanded, actual in pairs)


def _names(contacts: list[Contact]) -> list[str]:
    """Return the names of touched objects with the total force in N, the largest force first."""
    newtons: dict[str, float] = {}
    for contact in contacts:
        newtons[contact.what] = newtons.get(contact.what, 0.0) + math.hypot(*contact.force)
    return [f"{name or 'something'} ({newtons[name]:.2g} N)" for name in sorted(newtons, key=lambda key: -newtons[key])]


def _shown(command: Twist) -> str:
    return f"{numbers(command.linear)} m/s, {numbers(command.angular)} rad/s"
