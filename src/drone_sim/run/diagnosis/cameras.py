"""Whether cameras give what they should."""

from __future__ import annotations

from drone_sim.run.diagnosis.counts import Since
from drone_sim.run.diagnosis.finding import WARN, Finding, Problem, finding
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.camera import TINY

_ENOUGH = 0.9  # of the nominal rate
_FEW = 2  # pictures that fall into this look or the next


def cameras(simulation: Simulation, since: Since | None) -> Finding:
    """Look at what draws, at how long a picture takes, and at the rate of each camera that somebody looks at."""
    renderer, values, problems = simulation.vision.renderer, {}, []
    values["renderer"] = f"PyBullet's {TINY}" if renderer == TINY else renderer or "none yet: nobody has looked"
    drawn = since.pictures if since else 0
    mean = f"{since.drawing / drawn * 1e3:.1f} ms" if since and drawn else "not known"
    values["frame time"] = mean
    if renderer == TINY:
        said = f"PyBullet's slow {TINY} draws, for there is no EGL: ask `rosrun drone_sim doctor`"
        problems.append(Problem(WARN, said))
    for (vehicle, name), shown in (since.shown if since else {}).items():
        assert since is not None
        rate = shown / since.seconds
        nominal = _nominal(simulation, vehicle, name, since)
        values[f"{vehicle}/{name}"] = f"{rate:.1f} of {nominal:.1f} Hz"
        if shown + _FEW < _ENOUGH * nominal * since.seconds:
            problems.append(Problem(WARN, f"{vehicle}/{name} comes at {rate:.1f} of {nominal:.1f} Hz"))
    watched = [key for vehicle in simulation.vehicles.values() for key, one in vehicle.cameras.items() if one.watched()]
    values["looked at"] = f"{len(watched)} of {sum(len(one.cameras) for one in simulation.vehicles.values())} cameras"
    fine = f"{len(watched)} looked at; time of a picture: {mean}" if watched else "nobody looks"
    return finding("cameras", fine, problems, values)


def _nominal(simulation: Simulation, vehicle: str, name: str, since: Since) -> float:
    """Return the pictures in a second of real time that there should be."""
    parameters = simulation.parameters
    every = simulation.vehicles[vehicle].parameters.cameras[name].every
    if not parameters.real_time_factor:  # as fast as it can
        return since.steps / every / since.seconds
    return parameters.real_time_factor / (parameters.time_step * every)
