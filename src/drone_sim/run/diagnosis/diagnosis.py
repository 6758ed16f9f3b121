"""Diagnosis of the simulation's pace, of the cameras, and of each vehicle."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata

from drone_sim.message_text import shown
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.finding import ERROR, WARN, Counts, Finding, Problem, between, count, finding
from drone_sim.run.diagnosis.vehicles import VehicleDiagnosis, is_unmoved
from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player
from drone_sim.sensors.vision import TINY

_ENOUGH = 0.9  # fraction of the nominal rate, and of the requested real-time factor
_FEW = 2  # pictures that may be counted in this diagnosis or the next
_LATE = 0.1  # fraction of the steps; a few are late on any busy computer
_SUSTAINED = 3  # diagnoses in a row that are too slow before that is a problem: a start, or a busy second, is none


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "of unknown version"


_PYBULLET = _version("pybullet")


class Diagnosis:
    """Diagnosis of the simulation. Only the thread that owns the simulation may call it."""

    def __init__(
        self,
        player: Player,
        pacer: Pacer,
        logs: Callable[[], Mapping[str, CommandLog]],
        simulated_time: bool,
        clock: Callable[[], float] = time.monotonic,
        frames_below: str = "",
        held: Callable[[], bool] = lambda: False,
        unheard: Callable[[], Mapping[str, list[str]]] = dict,
    ):
        """`logs` returns the command logs by vehicle; `clock` is monotonic (s).

        `frames_below` is the prefix of the vehicles' frames; `held` returns whether a step waits for a client.
        `unheard` returns the topics that look like commands and have no subscriber, with the publishers' names.
        """
        self._unheard = unheard
        self._frames_below, self._held = frames_below, held
        self._player, self._pacer, self._logs = player, pacer, logs
        self._simulated_time = simulated_time
        self._clock = clock
        self._before: Counts | None = None
        self._slow = 0  # diagnoses in a row that were too slow
        self._unmoved: dict[str, float] = {}  # by vehicle, s of simulated time without any effect of commands

    def look(self) -> list[Finding]:
        """Return the findings for the simulation, the cameras, and each vehicle."""
        now = count(self._player, self._pacer, self._clock())
        since, self._before = between(self._before, now), now
        slow = self._check_speed(since)
        self._slow = self._slow + 1 if slow else 0
        lasting = slow if self._slow >= _SUSTAINED else []
        logs, unheard = self._logs(), self._unheard()
        simulation = self._player.simulation
        flown = since.steps * simulation.parameters.time_step if since else 0.0
        self._unmoved = {
            name: self._unmoved.get(name, 0.0) + flown if flown and is_unmoved(vehicle) else 0.0
            for name, vehicle in simulation.vehicles.items()
        }
        return [
            self._check_simulation(since, lasting),
            self._check_cameras(since),
            *(
                VehicleDiagnosis(
                    vehicle,
                    self._player,
                    logs.get(name) or CommandLog(self._clock),
                    since,
                    self._frames_below,
                    self._unmoved[name],
                    unheard,
                ).finding()
                for name, vehicle in simulation.vehicles.items()
            ),
        ]

    def _check_cameras(self, since: Counts | None) -> Finding:
        """Check the renderer, the time per picture, and the rate of each subscribed camera."""
        simulation = self._player.simulation
        renderer, problems = simulation.vision.renderer, []
        shown_renderer = f"PyBullet's {TINY}" if renderer == TINY else renderer or "none yet: no camera has been used"
        drawn = since.pictures if since else 0
        mean = f"{since.drawing / drawn * 1e3:.1f} ms" if since and drawn else "not known"
        values = {"renderer": shown_renderer, "frame time": mean}
        if renderer == TINY:
            reason = f"PyBullet's slow {TINY} draws, because there is no EGL: run `rosrun drone_sim doctor`"
            problems.append(Problem(WARN, reason))
        for (vehicle, name), pictures in (since.shown if since else {}).items():
            assert since is not None
            rate = pictures / since.seconds
            nominal = self._nominal_rate(vehicle, name, since)
            values[f"{vehicle}/{name}"] = f"{rate:.1f} of {nominal:.1f} Hz"
            if pictures + _FEW < _ENOUGH * nominal * since.seconds:
                problems.append(Problem(WARN, f"{vehicle}/{name} publishes at {rate:.1f} instead of {nominal:.1f} Hz"))
        cameras = [camera for each in simulation.vehicles.values() for camera in each.cameras.values()]
        watched = sum(bool(camera.watched()) for camera in cameras)
        values["looked at"] = f"{watched} of {len(cameras)} cameras"
        fine = f"{watched} in use; time per picture: {mean}" if watched else "no camera is in use"
        return finding("cameras", fine, problems, values)

    def _nominal_rate(self, vehicle: str, camera: str, since: Counts) -> float:
        """Return the expected rate of pictures in Hz of real time."""
        parameters = self._player.simulation.parameters
        every = self._player.simulation.vehicles[vehicle].parameters.cameras[camera].every
        if not parameters.real_time_factor:  # unpaced
            return since.steps / every / since.seconds
        return parameters.real_time_factor / (parameters.time_step * every)

    def _check_speed(self, since: Counts | None) -> list[Problem]:
        """Return the problems of a real-time factor that is not reached, and of late steps."""
        problems, parameters = [], self._player.simulation.parameters
        if since is None:
            return []
        factor, target = since.steps * parameters.time_step / since.seconds, parameters.real_time_factor
        if target and factor < _ENOUGH * target:
            problems.append(Problem(WARN, f"too slow: {factor:.2f} times real time, {target:g} is wanted"))
        if since.late > _LATE * since.steps:
            problems.append(Problem(WARN, f"{since.late} of the last {since.steps} steps were late"))
        return problems

    def _check_simulation(self, since: Counts | None, slow: Sequence[Problem]) -> Finding:
        """Check state, script errors, /clock, and pace; `slow` are the problems of the pace that have lasted."""
        player, pacer = self._player, self._pacer
        simulation = player.simulation
        target, scene = simulation.parameters.real_time_factor, simulation.parameters.scene_file
        factor = since.steps * simulation.parameters.time_step / since.seconds if since else None
        problems = []
        if player.why_stopped and not player.playing:
            problems.append(Problem(ERROR, f"stopped: {player.why_stopped}"))
        for name, error in simulation.failed_scripts.items():
            problems.append(Problem(ERROR, f"script of {name} failed: {error}"))
        if self._simulated_time and not player.playing:
            still = f"{player.state}: /clock stands still, and nodes that use simulated time wait"
            problems.append(Problem(WARN, still))
        if self._held() and since and not since.steps:
            waits = "no step: a client of the remote API asked to trigger each step, and does not"
            problems.append(Problem(WARN, waits))
        else:
            problems += slow
        late = f"{since.late} of the last {since.steps}, " if since else ""
        values = {
            "state": player.state,
            "script error": player.why_stopped,
            "simulated time": f"{simulation.time:.2f} s",
            "run": f"number {simulation.run}; every start and every stop begins a new run",
            "vehicles": ", ".join(simulation.vehicles),
            "real-time factor": f"{factor:.2f}" if factor is not None else "not known",
            "real-time factor asked for": f"{target:g}" if target else "as fast as it can",
            "late steps": f"{late}{pacer.overruns} in all, by {pacer.worst * 1e3:.0f} ms at most",
            "stamps": "simulated time, from /clock" if self._simulated_time else "real time",
            "scene": shown(scene) if scene else "of the parameters",
            "PyBullet": f"{_PYBULLET}, {'with its window' if simulation.parameters.gui else 'without a window'}",
        }
        speed = f" at {factor:.2f} times real time" if factor is not None else ""
        return finding("simulation", f"{player.state}{speed}", problems, values)
