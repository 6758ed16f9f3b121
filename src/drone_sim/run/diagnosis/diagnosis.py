"""One look at everything."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from drone_sim.run.diagnosis.cameras import cameras
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.counts import Counts, between, count
from drone_sim.run.diagnosis.finding import Finding
from drone_sim.run.diagnosis.pace import pace
from drone_sim.run.diagnosis.vehicles import VehicleDiagnosis
from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player


class Diagnosis:
    """Looks when it is asked, and keeps nothing but some counts; the thread that owns the simulation asks."""

    def __init__(
        self,
        player: Player,
        pacer: Pacer,
        logs: Callable[[], Mapping[str, CommandLog]],
        simulated_time: bool,
        clock: Callable[[], float] = time.monotonic,
        frames_below: str = "",
    ):
        """Take what plays and paces, what returns the commands that came in, by vehicle, and a monotonic clock (s).

        The names of the vehicles' frames begin with `frames_below`.
        """
        self._frames_below = frames_below
        self._player, self._pacer, self._logs = player, pacer, logs
        self._simulated_time = simulated_time
        self._clock = clock
        self._before: Counts | None = None

    def look(self) -> list[Finding]:
        """Return what is found: the simulation's, the cameras', and each vehicle's."""
        now = count(self._player, self._pacer, self._clock())
        since, self._before = between(self._before, now), now
        logs = self._logs()
        return [
            pace(self._player, self._pacer, since, self._simulated_time),
            cameras(self._player.simulation, since),
            *(
                VehicleDiagnosis(
                    vehicle, self._player, logs.get(name) or CommandLog(self._clock), since, self._frames_below
                ).finding()
                for name, vehicle in self._player.simulation.vehicles.items()
            ),
        ]
