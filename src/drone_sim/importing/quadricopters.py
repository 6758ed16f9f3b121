"""Quadricopters among the objects of a file, by how they are built, whatever they are called.

V-REP's is a dynamic shape with four others on force sensors, which are the propellers: as heavy as each other, and
they say by their names or their scripts what they are, or a script of the model applies forces.
The built-in law replaces the scripts of V-REP's own propellers; other scripts are imported.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drone_sim.importing.placing import Placed
from drone_sim.mechanics import frames
from drone_sim.mechanics.object_names import split, suffixed
from drone_sim.vrep_files.model import VrepDummy, VrepJoint, VrepScript

COUNT = 4  # propellers
_EQUAL = 0.1  # masses that differ by less than this part are the same
_PROPELLER = re.compile(r"prop|rotor", re.IGNORECASE)
_TARGET = re.compile(r"target", re.IGNORECASE)
_OWN_TARGETS = ("Quadricopter_target", "Quadcopter_target")
_NUMBER = re.compile(r"(\d+)$")
# Quarters around the body, by the signs of x and y: V-REP's propellers 1 to 4.
_QUARTERS = {(True, True): 1, (False, True): 2, (False, False): 3, (True, False): 4}


@dataclass(frozen=True)
class Propeller:
    """One of four: the force sensor that it sits on, its body, and the joint of its blades, if it has one."""

    link: Placed
    body: Placed
    joint: Placed | None


@dataclass(frozen=True)
class VrepQuadricopter:
    """A body with propellers 1 to 4, the frame that its scripts read, and the target that it follows."""

    root: Placed
    propellers: tuple[Propeller, ...]
    base: Placed | None
    target: Placed | None
    others: frozenset[Placed]  # bodies of other quadricopters, which may hang on this one

    def inside(self) -> Iterator[Placed]:
        """Yield it and all that hangs on it, other quadricopters aside, in the order of the tree."""
        return self.root.subtree(without=self.others)


def find(objects: Sequence[Placed], scripts: Mapping[int, Sequence[VrepScript]]) -> list[VrepQuadricopter]:
    """Return the quadricopters, in the order of the file; `scripts` are by the handle of their object."""
    built = {one: _propellers(one, scripts) for one in objects if one.is_dynamic}
    roots = frozenset(one for one, propellers in built.items() if propellers is not None)
    return [
        VrepQuadricopter(
            one, propellers, _base(one), _target(one, roots - {one}) or _free_target(one, objects), roots - {one}
        )
        for one, propellers in built.items()
        if propellers is not None
    ]


def _propellers(root: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> tuple[Propeller, ...] | None:
    links = (one for one in root.children if one.is_force_sensor)
    tied = [(link, body) for link in links for body in link.children if body.is_dynamic]
    named = [pair for pair in tied if any(_says_propeller(one, scripts) for one in pair)]
    chosen = tied if not named and _is_pushed(root, scripts) else named
    if len(chosen) != COUNT or not _are_equal([body for _, body in chosen]):
        return None
    by_number = _by_number(root, chosen)
    return None if by_number is None else tuple(_propeller(*by_number[number]) for number in range(1, COUNT + 1))


def _says_propeller(one: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> bool:
    own = [
        *one.object.parameters,
        *(pair for script in scripts.get(one.object.handle, ()) for pair in script.parameters),
    ]
    return bool(_PROPELLER.search(one.object.name)) or any(name == "particleVelocity" for name, _ in own)


def _is_pushed(root: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> bool:
    """Tell whether a script of the model applies forces."""
    own = (script for one in root.subtree() for script in scripts.get(one.object.handle, ()))
    return any("ddForce" in script.text for script in own)


def _are_equal(bodies: Sequence[Placed]) -> bool:
    masses = [body.object.shape.mass for body in bodies if body.object.shape is not None]
    return max(masses) - min(masses) <= _EQUAL * max(masses)


def _by_number(root: Placed, chosen: Sequence[tuple[Placed, Placed]]) -> dict[int, tuple[Placed, Placed]] | None:
    """Return them as propellers 1 to 4: by the numbers in their names, or by where they are; None for neither."""
    for which in (1, 0):
        numbers = [_NUMBER.search(plain_name(pair[which])) for pair in chosen]
        by_name = {int(match.group(1)): pair for match, pair in zip(numbers, chosen) if match}
        if sorted(by_name) == [1, 2, 3, 4]:
            return by_name
    quarters = {}
    for link, body in chosen:
        x, y, _ = frames.position(frames.relative(root.matrix, body.matrix))
        quarters[_QUARTERS[x > 0, y > 0]] = (link, body)
    return quarters if len(quarters) == COUNT else None


def plain_name(one: Placed) -> str:
    """Return an object's name without the suffix of a copy."""
    return one.object.name.partition("#")[0]


def swings_on(one: Placed, root: Placed) -> Placed | None:
    """Return the spherical joint, nearest to a quadricopter, on which a body of it swings; None if the body is held.

    If a pair of linked dummies below such a joint closes a loop, as in a gripper, the body does not swing.
    """
    for here in reversed(one.between(root)):
        if isinstance(here.object.of, VrepJoint) and here.object.of.kind == "spherical":
            kinds = [below.object.of for below in here.subtree()]
            return None if any(isinstance(one, VrepDummy) and one.linked >= 0 for one in kinds) else here
    return None


def _propeller(link: Placed, body: Placed) -> Propeller:
    joints = (one for one in body.subtree() if isinstance(one.object.of, VrepJoint))
    return Propeller(link, body, next(joints, None))


def _base(root: Placed) -> Placed | None:
    """Return the frame that scripts read: the dummy called base."""
    dummies = [one for one in root.children if isinstance(one.object.of, VrepDummy)]
    return next((one for one in dummies if plain_name(one).lower().endswith("base")), None)


def _target(root: Placed, others: frozenset[Placed]) -> Placed | None:
    """Return the target that hangs on it."""
    below = [
        one for one in root.subtree(others) if one is not root and _TARGET.search(one.object.alias or one.object.name)
    ]
    return next((one for one in below if not one.is_dynamic), None)


def _free_target(root: Placed, objects: Sequence[Placed]) -> Placed | None:
    """Return the target that stands in the world, by the names that V-REP's targets have."""
    plain, suffix = split(root.object.name)
    names = [suffixed(name, suffix) for name in (f"{plain}_target", *_OWN_TARGETS)]
    free = {one.object.name: one for one in objects if one.above is None and not one.is_dynamic}
    return next((free[name] for name in names if name in free), None)


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
_DECIMAL = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")


def built_in_law(quadricopter: VrepQuadricopter, scripts: Mapping[int, Sequence[VrepScript]]) -> dict[str, Any] | None:
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
    if not all(_DECIMAL.fullmatch(value.strip()) for value in values):
        return None
    rate, density, size = map(float, values)
    return {
        "law": "3.x",
        "particles_per_second": rate,
        "particle_density": density,
        "particle_size": round(size * _UNIT_SIZE * size_factor, 9),
        "torque_per_velocity": float(torque.group(2)),
    }
