"""A quadricopter of a file as one of `vehicles:`: its URDF, place, objects, cameras and scripts."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.importing.entries import size_factor
from drone_sim.importing.folder import Folder, Report, label, number, numbers, pose_keys, word
from drone_sim.importing.placing import Placed
from drone_sim.importing.quadricopters import Propeller, VrepQuadricopter, built_in_law, plain_name, swings_on
from drone_sim.importing.scripts import ScriptFiles, values
from drone_sim.importing.shapes import MeshWriter
from drone_sim.importing.vehicle_urdf import VehicleUrdf
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import split
from drone_sim.sensors.camera_parameters import MAX_CAMERAS
from drone_sim.vehicles.quadricopter_objects import BASE, DRONE, SCRIPT, TARGET, TRACK_BASE, joint, respondable, seen
from drone_sim.vrep_files.model import VrepCamera, VrepJoint, VrepScript

_OWN_CAMERAS = {"FrontVision": "front", "DepthVision": "depth", "TrackCam": "track", "FloorVision": "floor"}
_FROM_SENSOR = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # x forward, y left, z up, in its axes
_BY_NAME = {
    "track_base": TRACK_BASE,
    "floorcamera": "Quadricopter_floorCamera",
    "frontcamera": "Quadricopter_frontCamera",
}


class ImportedVehicle:
    """What is made of one quadricopter."""

    def __init__(self, quadricopter: VrepQuadricopter, scripts: Mapping[int, Sequence[VrepScript]], suffix: int):
        """Take it, the scripts of the file by handle, and the suffix of the names of its objects."""
        self.quadricopter = quadricopter
        self.suffix = suffix
        self._scripts = scripts
        self.objects = self._known_objects()  # by our names
        self.law = built_in_law(quadricopter, scripts)
        self.parts, self.looks, self.cameras = self._sorted()

    @property
    def root(self) -> Placed:
        """Its body."""
        return self.quadricopter.root

    def _known_objects(self) -> dict[str, Placed]:
        """Return the file's objects that every vehicle of ours has anyway, by our names."""
        quadricopter = self.quadricopter
        found = {DRONE: quadricopter.root}
        for index, propeller in enumerate(quadricopter.propellers, start=1):
            found.update(_known_parts(index, propeller))
        if quadricopter.base is not None:
            found["Quadricopter_base"] = quadricopter.base
        if quadricopter.target is not None:
            found[TARGET] = quadricopter.target
        own = [script.own_object for script in self._scripts.get(quadricopter.root.object.handle, ())[:1]]
        script = next((one for one in quadricopter.root.children if one.object.handle in own), None)
        if script is not None:
            found[SCRIPT] = script
        for one in quadricopter.inside():
            ours = next((name for end, name in _BY_NAME.items() if plain_name(one).lower().endswith(end)), None)
            sees = isinstance(one.object.of, VrepCamera) and one.object.of.resolution is not None
            if ours is not None and ours not in found and one.object.shape is None and not sees:
                found[ours] = one
        return found

    def _sorted(self) -> tuple[list[Placed], list[Placed], list[Placed]]:
        """Return further bodies tied to it, what is only seen, and its vision sensors."""
        own = {id(one) for one in self.objects.values()}
        parts: list[Placed] = []
        looks: list[Placed] = []
        cameras: list[Placed] = []
        for one in self.quadricopter.inside():
            if id(one) in own or not self.carries(one):
                continue
            if one.is_dynamic:
                parts.append(one)
            elif one.object.shape is not None:
                looks.append(one)
            elif self._is_own_camera(one) and len(cameras) < MAX_CAMERAS - len(_OWN_CAMERAS):
                cameras.append(one)
        return parts, looks, cameras

    def carries(self, one: Placed) -> bool:
        """Tell whether an object of its tree goes with it: no body that is free lies between."""
        here: Placed | None = one
        while here is not None and here is not self.root:
            above = here.above
            if (
                here.is_dynamic
                and above is not None
                and not (above.is_force_sensor or isinstance(above.object.of, VrepJoint))
            ):
                return False
            here = above
        return one is not self.quadricopter.target and self.quadricopter.target not in one.between(self.root)

    def _is_own_camera(self, one: Placed) -> bool:
        camera = one.object.of
        if not isinstance(camera, VrepCamera) or camera.resolution is None or not camera.is_perspective:
            return False
        if one.object.handle in self._scripts or one.above not in (self.root, self.quadricopter.base):
            return False  # paths, or scripts, find it in another place of the tree than a vehicle's cameras have
        plain, suffix = split(one.object.name)
        if one.object.alias not in ("", plain):
            return False
        return suffix == self.suffix and re.fullmatch(r"[A-Za-z]\w{0,50}", plain, re.ASCII) is not None

    # ---- the entry

    def entry(self, folder: Folder, writer: MeshWriter, files: ScriptFiles, report: Report) -> dict[str, Any]:
        """Return its entry of `vehicles:`, and write what that names."""
        urdf = folder.free_name(self.root.name, ".urdf")
        folder.write(urdf, VehicleUrdf(self.quadricopter, writer, report).build(self.parts, self.looks))
        for one in self.parts:
            swings = swings_on(one, self.root) is not None
            what = "is rigidly attached: its mass counts, but it does not swing" if swings else "is rigidly attached"
            report.add(one.name, f"on {self.root.name}: {what}")
        entry: dict[str, Any] = {"urdf": urdf, "suffix": self.suffix, **self._place(report)}
        entry.update(self._script(files, report))
        if self.law is not None:
            entry["propellers"] = self.law
            report.notes.append(
                f"{self.root.name}: the built-in thrust model, which is equal, replaces V-REP's scripts of propellers"
            )
        entry["objects"] = {ours: self._object(ours, one) for ours, one in self.objects.items()}
        cameras = {self._camera_key(one): self._camera(one) for one in self.cameras}
        return {**entry, "cameras": cameras} if cameras else entry

    def _place(self, report: Report) -> dict[str, Any]:
        matrix = self.root.matrix
        x, y, z = frames.position(matrix)
        if z < 0:
            report.add(self.root.name, f"began {-z:.3g} m below the ground: begins on it")
        roll, pitch, yaw = frames.to_rpy(matrix)
        place: dict[str, Any] = {"position": numbers((x, y, max(z, 0.0))), "yaw": number(yaw)}
        return {**place, "tilt": numbers((roll, pitch))} if max(abs(roll), abs(pitch)) > 1e-6 else place

    def _script(self, files: ScriptFiles, report: Report) -> dict[str, Any]:
        own = self._scripts.get(self.root.object.handle, ())
        if own:
            parameters = values(own[0].parameters or self.root.object.parameters)
            script = {"script": files.write(self.root.name, own[0])}
            return {**script, "script_parameters": parameters} if parameters else script
        report.add(self.root.name, "has no child script: give one to fly it, such as script:=pilot")
        return {"script": "none"}

    def _object(self, ours: str, one: Placed) -> dict[str, Any]:
        """Return the name of one of its objects, and its pose in the frame of its parent in our vehicle."""
        keys: dict[str, Any] = {"name": one.name}
        if one.object.alias:
            keys["alias"] = label(one.object.alias)
        if ours == TARGET and one.above is None:
            keys.update({"parent": "", "position": [0.0, 0.0, 0.0], **pose_keys(one.matrix)})
        elif ours != DRONE:
            keys.update({"position": [0.0, 0.0, 0.0], **pose_keys(frames.relative(self._above(ours), one.matrix))})
        return {**keys, **size_factor(one)}

    def _above(self, ours: str) -> Matrix:
        """Return the pose, in the world, of the parent of one of our objects."""
        if ours == TARGET:
            base = self.quadricopter.base
            return frames.multiply(self.root.matrix, BASE) if base is None else base.matrix
        for index, propeller in enumerate(self.quadricopter.propellers, start=1):
            if ours == respondable(index):
                return propeller.link.matrix
            if ours in (seen(index), joint(index)):
                above = self.objects.get(seen(index), propeller.body)
                return above.matrix if ours == joint(index) else propeller.body.matrix
        return self.root.matrix

    # ---- cameras

    def _camera_key(self, one: Placed) -> str:
        plain = split(one.object.name)[0]
        return _OWN_CAMERAS.get(plain, plain)

    def _camera(self, one: Placed) -> dict[str, Any]:
        camera = one.object.of
        assert isinstance(camera, VrepCamera) and camera.resolution is not None
        width, height = (min(max(side, 1), 4096) for side in camera.resolution)
        wide = camera.angle if width >= height else 2 * math.atan(math.tan(camera.angle / 2) * width / height)
        key, near = self._camera_key(one), min(max(camera.near, 1e-4), 1e4)
        viewing = frames.multiply(frames.relative(self.root.matrix, one.matrix), _FROM_SENSOR)
        return {
            "object": split(one.object.name)[0],
            "topic": key if key in _OWN_CAMERAS.values() else f"{key}/image",
            "kind": "color",
            "frame": f"{key}_optical",
            "mount": {"position": [0.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0], **pose_keys(viewing)},
            "width": width,
            "height": height,
            "horizontal_fov": number(min(max(wide, 0.01), 3.1)),
            "near": number(near),
            "far": number(min(max(camera.far, 2 * near, 1e-3), 1e5)),
            "every": 1,
        }


def _known_parts(index: int, propeller: Propeller) -> dict[str, Placed]:
    """Return the file's objects that every propeller of ours has anyway, by our names."""
    found = {f"Quadricopter_propeller{index}": propeller.link, respondable(index): propeller.body}
    if propeller.joint is not None:
        if propeller.joint.above in propeller.body.children:
            found[seen(index)] = propeller.joint.above
        found[joint(index)] = propeller.joint
    return found


def suffixes(found: Sequence[VrepQuadricopter]) -> list[int]:
    """Return the suffix of each quadricopter's names, no two the same."""
    given: list[int] = []
    for one in found:
        wanted = split(one.root.object.name)[1]
        given.append(
            wanted
            if wanted not in given
            else next(free for free in range(len(found) + max(given) + 2) if free not in given)
        )
    return given


def vehicle_names(found: Sequence[VrepQuadricopter]) -> list[str]:
    """Return the vehicles' names: `drone` for the only one."""
    if len(found) == 1:
        return ["drone"]
    names: list[str] = []
    for one in found:
        wanted = word(one.root.object.name.replace("#", "_"), "drone")
        free = wanted if wanted not in names else f"{wanted}_{len(names)}"
        names.append(free)
    return names
