"""Whether the simulation as a whole goes as it should."""

from __future__ import annotations

from importlib import metadata

from drone_sim.run.diagnosis.counts import Since
from drone_sim.run.diagnosis.finding import ERROR, WARN, Finding, Problem, finding
from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player
from drone_sim.wording import shown

_ENOUGH = 0.9  # of the pace that is asked for
_LATE = 0.1  # of the steps; a few are late on any busy computer


def pace(player: Player, pacer: Pacer, since: Since | None, simulated_time: bool) -> Finding:
    """Look at state, script errors, real-time factor and late steps; at `simulated_time`, whether /clock goes on."""
    simulation = player.simulation
    asked = simulation.parameters.real_time_factor
    factor = since.steps * simulation.parameters.time_step / since.seconds if since else None
    problems = [Problem(ERROR, f"stopped: {player.why_stopped}")] if player.why_stopped and not player.playing else []
    if simulated_time and not player.playing:
        problems.append(Problem(WARN, f"{player.state}: /clock stands still, and whoever sleeps in ROS time sleeps on"))
    if factor is not None and asked and factor < _ENOUGH * asked:
        problems.append(Problem(WARN, f"too slow: {factor:.2f} times real time, {asked:g} are asked for"))
    if since and since.late > _LATE * since.steps:
        problems.append(Problem(WARN, f"{since.late} of the last {since.steps} steps came late"))
    late = f"{since.late} of the last {since.steps}, " if since else ""
    values = {
        "state": player.state,
        "script error": player.why_stopped,
        "simulated time": f"{simulation.time:.2f} s",
        "run": f"number {simulation.run}; every start and every stop begins another",
        "vehicles": ", ".join(simulation.vehicles),
        "real-time factor": f"{factor:.2f}" if factor is not None else "not known",
        "real-time factor asked for": f"{asked:g}" if asked else "as fast as it can",
        "late steps": f"{late}{pacer.overruns} in all, by {pacer.worst * 1e3:.0f} ms at most",
        "stamps": "simulated time, told by /clock" if simulated_time else "real time",
        "scene": shown(simulation.parameters.scene_file) if simulation.parameters.scene_file else "of the parameters",
        "PyBullet": f"{_PYBULLET}, {'with its window' if simulation.parameters.gui else 'without a window'}",
    }
    speed = f" at {factor:.2f} times real time" if factor is not None else ""
    return finding("simulation", f"{player.state}{speed}", problems, values)


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "of unknown version"


_PYBULLET = _version("pybullet")
