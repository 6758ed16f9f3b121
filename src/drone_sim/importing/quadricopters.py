"""Detection of quadricopters among the objects of a file by their structure, whatever their names.

A V-REP quadricopter is a dynamic shape with four other dynamic shapes on force sensors: the propellers. They have equal
masses, and their names or scripts identify them as propellers, or a script of the model applies forces.
The built-in thrust model replaces the scripts of V-REP's own propellers; other scripts are imported.
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
_MASS_TOLERANCE = 0.1  # relative
_PROPELLER = re.compile(r"prop|rotor", re.IGNORECASE)
_TARGET = re.compile(r"target", re.IGNORECASE)
_STOCK_TARGETS = ("Quadricopter_target", "Quadcopter_target")
_NUMBER = re.compile(r"(\d+)$")
# V-REP's propeller number, by whether x and y (in the body frame) are positive.
_QUADRANTS = {(True, True): 1, (False, True): 2, (False, False): 3, (True, False): 4}


@dataclass(frozen=True)
class Propeller:
    """A propeller: its force sensor, its body, and the joint of its blades, if any."""

    link: Placed
    body: Placed
    joint: Placed | None


@dataclass(frozen=True)
class VrepQuadricopter:
    """A quadricopter: body, propellers 1 to 4, the frame that its scripts read, and its target."""

    root: Placed
    propellers: tuple[Propeller, ...]
    base: Placed | None
    target: Placed | None
    others: frozenset[Placed]  # bodies of other quadricopters, which may be descendants of this one

    def inside(self) -> Iterator[Placed]:
        """Yield it and its descendants in tree order, without other quadricopters."""
        return self.root.subtree(without=self.others)


def find(objects: Sequence[Placed], scripts: Mapping[int, Sequence[VrepScript]]) -> list[VrepQuadricopter]:
    """Return the quadricopters in file order; `scripts` maps an object's handle to its scripts."""
    propellers_by_root = {node: _propellers(node, scripts) for node in objects if node.is_dynamic}
    roots = frozenset(node for node, propellers in propellers_by_root.items() if propellers is not None)
    return [
        VrepQuadricopter(
            node, propellers, _base(node), _target(node, roots - {node}) or _free_target(node, objects), roots - {node}
        )
        for node, propellers in propellers_by_root.items()
        if propellers is not None
    ]


def _propellers(root: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> tuple[Propeller, ...] | None:
    links = (node for node in root.children if node.is_force_sensor)
    pairs = [(link, body) for link in links for body in link.children if body.is_dynamic]
    named = [pair for pair in pairs if any(_is_propeller(node, scripts) for node in pair)]
    selected = pairs if not named and _is_pushed(root, scripts) else named
    if len(selected) != COUNT or not _are_equal([body for _, body in selected]):
        return None
    by_number = _numbered(root, selected)
    return None if by_number is None else tuple(_propeller(*by_number[number]) for number in range(1, COUNT + 1))


def _is_propeller(node: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> bool:
    in_scripts = [pair for script in scripts.get(node.object.handle, ()) for pair in script.parameters]
    parameters = [*node.object.parameters, *in_scripts]
    return bool(_PROPELLER.search(node.object.name)) or any(name == "particleVelocity" for name, _ in parameters)


def _is_pushed(root: Placed, scripts: Mapping[int, Sequence[VrepScript]]) -> bool:
    """Return whether a script of the model applies forces."""
    model_scripts = (script for node in root.subtree() for script in scripts.get(node.object.handle, ()))
    return any("ddForce" in script.text for script in model_scripts)


def _are_equal(bodies: Sequence[Placed]) -> bool:
    masses = [body.object.shape.mass for body in bodies if body.object.shape is not None]
    return max(masses) - min(masses) <= _MASS_TOLERANCE * max(masses)


def _numbered(root: Placed, pairs: Sequence[tuple[Placed, Placed]]) -> dict[int, tuple[Placed, Placed]] | None:
    """Return the pairs as propellers 1 to 4, by numbers in their names, else by position; None if neither works."""
    for index in (1, 0):
        numbers = [_NUMBER.search(plain_name(pair[index])) for pair in pairs]
        by_name = {int(match.group(1)): pair for match, pair in zip(numbers, pairs) if match}
        if sorted(by_name) == [1, 2, 3, 4]:
            return by_name
    by_quadrant = {}
    for link, body in pairs:
        x, y, _ = frames.position(frames.relative(root.matrix, body.matrix))
        by_quadrant[_QUADRANTS[x > 0, y > 0]] = (link, body)
    return by_quadrant if len(by_quadrant) == COUNT else None


def plain_name(node: Placed) -> str:
    """Return an object's name without a copy's suffix, such as #0."""
    return node.object.name.partition("#")[0]


def swings_on(node: Placed, root: Placed) -> Placed | None:
    """Return the spherical joint, nearest to the root, that a body swings on; None if the body is rigidly held.

    If a pair of linked dummies below such a joint closes a loop, as in a gripper, the body does not swing.
    """
    for ancestor in reversed(node.between(root)):
        if isinstance(ancestor.object.of, VrepJoint) and ancestor.object.of.kind == "spherical":
            below = [node.object.of for node in ancestor.subtree()]
            return None if any(isinstance(node, VrepDummy) and node.linked >= 0 for node in below) else ancestor
    return None


def _propeller(link: Placed, body: Placed) -> Propeller:
    joints = (node for node in body.subtree() if isinstance(node.object.of, VrepJoint))
    return Propeller(link, body, next(joints, None))


def _base(root: Placed) -> Placed | None:
    """Return the frame that scripts read: the child dummy whose name ends in "base"."""
    dummies = [dummy for dummy in root.children if isinstance(dummy.object.of, VrepDummy)]
    return next((dummy for dummy in dummies if plain_name(dummy).lower().endswith("base")), None)


def _target(root: Placed, others: frozenset[Placed]) -> Placed | None:
    """Return the target among the root's descendants."""
    nodes = [node for node in root.subtree(others) if node is not root]
    named = [node for node in nodes if _TARGET.search(node.object.alias or node.object.name)]
    return next((node for node in named if not node.is_dynamic), None)


def _free_target(root: Placed, objects: Sequence[Placed]) -> Placed | None:
    """Return the quadricopter's target that has no parent, found by V-REP's names for targets."""
    plain, suffix = split(root.object.name)
    names = [suffixed(name, suffix) for name in (f"{plain}_target", *_STOCK_TARGETS)]
    free = {node.object.name: node for node in objects if node.above is None and not node.is_dynamic}
    return next((free[name] for name in names if name in free), None)


_UNIT_SIZE = 0.005  # m: the stock script multiplies `particleSize` by this and by the size factor
_STOCK = {  # lines of V-REP's script, without spaces; it also has one force and one torque
    "count": "requiredParticleCnt=particleCountPerSecond*ts+notFullParticles",
    "carry": "notFullParticles=requiredParticleCnt%1",
    "thrust": "particleCnt*particleDensity*particleVelocity*math.pi*particleSize*particleSize*particleSize/(6*ts)",
    "size": "'particleSize')*0.005*s",
}
_TORQUE = re.compile(r"torque=\{0,0,(-?)(0?\.\d+)\*particleVelocity\}")
_TORQUE_SIGNS = ("-", "", "-", "")  # signs of the torque of propellers 1 to 4
_OTHER_ACTIONS = re.compile(r"[Ss]ignal|imExt|imROS|setObject|SetObject|[cC]allScript")
_DECIMAL = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")


def built_in_law(quadricopter: VrepQuadricopter, scripts: Mapping[int, Sequence[VrepScript]]) -> dict[str, Any] | None:
    """Return the keys of `propellers:` equal to the quadricopter's stock scripts; None if its scripts differ."""
    laws = []
    for propeller, sign in zip(quadricopter.propellers, _TORQUE_SIGNS):
        own_scripts = scripts.get(propeller.body.object.handle, ())
        if len(own_scripts) != 1:
            return None
        parameters = dict(own_scripts[0].parameters) or dict(propeller.body.object.parameters)
        laws.append(_law(own_scripts[0].text, parameters, propeller.link.object.size_factor, sign))
    return laws[0] if laws[0] is not None and all(law == laws[0] for law in laws) else None


def _law(text: str, parameters: Mapping[str, str], size_factor: float, sign: str) -> dict[str, Any] | None:
    code = re.sub(r"\s+", "", re.sub(r"--[^\n]*", "", text))
    torque = _TORQUE.search(code)
    if not all(part in code for part in _STOCK.values()) or torque is None or torque.group(1) != sign:
        return None
    if code.count("ddForceAndTorque(") != 1 or _OTHER_ACTIONS.search(code):
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
