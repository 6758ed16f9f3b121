"""The scripts of a quadricopter's propellers: for V-REP's own the built-in law stands in, others are brought."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.importing.quadricopters import Quadricopter
from drone_sim.vrep_files.model import Script

_UNIT_SIZE = 0.005  # m: what the stock script multiplies its parameter `particleSize` with, and the size factor
_STOCK = {  # what V-REP's script has on one line, without blanks, beside one force and one torque
    "count": "requiredParticleCnt=particleCountPerSecond*ts+notFullParticles",
    "carry": "notFullParticles=requiredParticleCnt%1",
    "thrust": "particleCnt*particleDensity*particleVelocity*math.pi*particleSize*particleSize*particleSize/(6*ts)",
    "size": "'particleSize')*0.005*s",
}
_TORQUE = re.compile(r"torque=\{0,0,(-?)(0?\.\d+)\*particleVelocity\}")
_SENSES = ("-", "", "-", "")  # of the torque, of propellers 1 to 4
_OTHER_DEEDS = re.compile(r"[Ss]ignal|imExt|imROS|setObject|SetObject|[cC]allScript")
_NUMBER = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")


def built_in_law(quadricopter: Quadricopter, scripts: Mapping[int, Sequence[Script]]) -> dict[str, Any] | None:
    """Return the keys of `propellers:` that stand for a quadricopter's own scripts; None where they are other ones."""
    laws = []
    for propeller, sense in zip(quadricopter.propellers, _SENSES):
        own = scripts.get(propeller.body.object.handle, ())
        if len(own) != 1:
            return None
        given = dict(own[0].parameters) or dict(propeller.body.object.parameters)
        laws.append(_law(own[0].text, given, propeller.link.object.size_factor, sense))
    return laws[0] if laws[0] is not None and all(law == laws[0] for law in laws) else None


def _law(text: str, parameters: Mapping[str, str], size_factor: float, sense: str) -> dict[str, Any] | None:
    code = re.sub(r"\s+", "", re.sub(r"--[^\n]*", "", text))
    torque = _TORQUE.search(code)
    if not all(part in code for part in _STOCK.values()) or torque is None or torque.group(1) != sense:
        return None
    if code.count("ddForceAndTorque(") != 1 or _OTHER_DEEDS.search(code):
        return None
    names = ("particleCountPerSecond", "particleDensity", "particleSize")
    values = [parameters.get(name, "") for name in names]
    if not all(_NUMBER.fullmatch(value.strip()) for value in values):
        return None
    rate, density, size = map(float, values)
    return {
        "law": "3.x",
        "particles_per_second": rate,
        "particle_density": density,
        "particle_size": round(size * _UNIT_SIZE * size_factor, 9),
        "torque_per_velocity": float(torque.group(2)),
    }
