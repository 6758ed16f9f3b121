"""The simulation parameters of a vehicle's scripts, as V-REP's have them."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE, respondable

PARTICLE_VELOCITY = "particleVelocity"
NUMBERS = (1, 2, 3, 4)  # of the propellers


def script_parameters(vehicle: VehicleParameters, suffix: str) -> dict[str, dict[str, Any]]:
    """Return them by the object that a script is attached to: V-REP's, the gains of control, and the user's own."""
    law = vehicle.propellers
    seen = {"particlesAreVisible": True, "simulateParticles": True, "fakeShadow": True}
    particles = {
        "particleCountPerSecond": law.particles_per_second,
        "particleDensity": law.particle_density,
        "particleSize": 1.0,  # a factor, in the stock scripts
    }
    own = {**vehicle.control.model_dump(), **seen, **particles, "propeller_law": law.law}
    own.update(start=vehicle.start, takeoff_height=vehicle.takeoff_height)
    return {
        DRONE + suffix: {**own, **vehicle.script_parameters},
        **{respondable(number) + suffix: {PARTICLE_VELOCITY: 0.0, **particles} for number in NUMBERS},
    }


def propeller_script_parameters() -> dict[str, Any]:
    """Return what V-REP's own script of a propeller reads besides what the built-in law does."""
    seen = {"particlesAreVisible": True, "simulateParticles": True}
    return {**seen, "particleScatteringAngle": 30.0, "particleLifeTime": 0.5, "maxParticleCount": 50.0}


def bring_back(values: Mapping[str, dict[str, Any]], kept: Mapping[str, dict[str, Any]]) -> None:
    """Give every script's parameters the values that were kept of them; the mappings stay the same ones."""
    for name, one in copy.deepcopy(dict(kept)).items():
        values[name].clear()
        values[name].update(one)
