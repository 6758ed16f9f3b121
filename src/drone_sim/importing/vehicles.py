"""Conversion of an imported quadricopter into an entry of `vehicles:`: URDF, pose, objects, cameras and scripts."""

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

_STANDARD_CAMERAS = {"FrontVision": "front", "DepthVision": "depth", "TrackCam": "track", "FloorVision": "floor"}
_BODY_AXES = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # in a vision sensor: x forward, y left, z up
_OBJECT_BY_ENDING = {
    "track_base": TRACK_BASE,
    "floorcamera": "Quadricopter_floorCamera",
    "frontcamera": "Quadricopter_frontCamera",
}


class ImportedVehicle:
    """An imported quadricopter."""

    def __init__(self, quadricopter: VrepQuadricopter, scripts: Mapping[int, Sequence[VrepScript]], suffix: int):
        """`scripts` are those of the file by object handle; `suffix` is that of its objects' names."""
        self.quadricopter = quadricopter
        self.suffix = suffix
        self._scripts = scripts
        self.objects = self._known_objects()  # by drone_sim's names
        self.law = built_in_law(quadricopter, scripts)
        self.parts, self.looks, self.cameras = self._sort_objects()

    @property
    def root(self) -> Placed:
        """The body of the quadricopter."""
        return self.quadricopter.root

    def _known_objects(self) -> dict[str, Placed]:
        """Return the file's objects that correspond to a vehicle's standard objects, by drone_sim's names."""
        quadricopter = self.quadricopter
        objects = {DRONE: quadricopter.root}
        for index, propeller in enumerate(quadricopter.propellers, start=1):
            objects.update(_known_parts(index, propeller))
        if quadricopter.base is not None:
            objects["Quadricopter_base"] = quadricopter.base
        if quadricopter.target is not None:
            objects[TARGET] = quadricopter.target
        script_objects = [script.own_object for script in self._scripts.get(quadricopter.root.object.handle, ())[:1]]
        script = next((node for node in quadricopter.root.children if node.object.handle in script_objects), None)
        if script is not None:
            objects[SCRIPT] = script
        for node in quadricopter.inside():
            name = next((it for end, it in _OBJECT_BY_ENDING.items() if plain_name(node).lower().endswith(end)), None)
            is_camera = isinstance(node.object.of, VrepCamera) and node.object.of.resolution is not None
            if name is not None and name not in objects and node.object.shape is None and not is_camera:
                objects[name] = node
        return objects

    def _sort_objects(self) -> tuple[list[Placed], list[Placed], list[Placed]]:
        """Return the other objects: bodies fixed to it, shapes that are only drawn, and vision sensors."""
        known_ids = {id(node) for node in self.objects.values()}
        parts: list[Placed] = []
        looks: list[Placed] = []
        cameras: list[Placed] = []
        for node in self.quadricopter.inside():
            if id(node) in known_ids or not self.carries(node):
                continue
            if node.is_dynamic:
                parts.append(node)
            elif node.object.shape is not None:
                looks.append(node)
            elif self._is_vehicle_camera(node) and len(cameras) < MAX_CAMERAS - len(_STANDARD_CAMERAS):
                cameras.append(node)
        return parts, looks, cameras

    def carries(self, node: Placed) -> bool:
        """Return whether a descendant moves with the vehicle: no free body in between, not (below) the target."""
        current: Placed | None = node
        while current is not None and current is not self.root:
            parent = current.above
            if (
                current.is_dynamic
                and parent is not None
                and not (parent.is_force_sensor or isinstance(parent.object.of, VrepJoint))
            ):
                return False
            current = parent
        return node is not self.quadricopter.target and self.quadricopter.target not in node.between(self.root)

    def _is_vehicle_camera(self, node: Placed) -> bool:
        camera = node.object.of
        if not isinstance(camera, VrepCamera) or camera.resolution is None or not camera.is_perspective:
            return False
        if node.object.handle in self._scripts or node.above not in (self.root, self.quadricopter.base):
            return False  # scripts and paths rely on its place in the tree, which a vehicle's camera does not keep
        plain, suffix = split(node.object.name)
        if node.object.alias not in ("", plain):
            return False
        return suffix == self.suffix and re.fullmatch(r"[A-Za-z]\w{0,50}", plain, re.ASCII) is not None

    # ---- the entry

    def entry(self, folder: Folder, writer: MeshWriter, files: ScriptFiles, report: Report) -> dict[str, Any]:
        """Return the entry of `vehicles:`, and write the files that it names."""
        urdf = folder.free_name(self.root.name, ".urdf")
        folder.write(urdf, VehicleUrdf(self.quadricopter, writer, report).build(self.parts, self.looks))
        for part in self.parts:
            swings = swings_on(part, self.root) is not None
            what = "is rigidly attached: its mass counts, but it does not swing" if swings else "is rigidly attached"
            report.add(part.name, f"on {self.root.name}: {what}")
        entry: dict[str, Any] = {"urdf": urdf, "suffix": self.suffix, **self._place(report)}
        entry.update(self._script(files, report))
        if self.law is not None:
            entry["propellers"] = self.law
            report.notes.append(
                f"{self.root.name}: the built-in thrust model, which is equal, replaces V-REP's scripts of propellers"
            )
        entry["objects"] = {name: self._object(name, node) for name, node in self.objects.items()}
        cameras = {self._camera_key(camera): self._camera(camera) for camera in self.cameras}
        return {**entry, "cameras": cameras} if cameras else entry

    def _place(self, report: Report) -> dict[str, Any]:
        matrix = self.root.matrix
        x, y, z = frames.position(matrix)
        if z < 0:
            report.add(self.root.name, f"is {-z:.3g} m below the ground in the file: starts on it here")
        roll, pitch, yaw = frames.to_rpy(matrix)
        pose: dict[str, Any] = {"position": numbers((x, y, max(z, 0.0))), "yaw": number(yaw)}
        return {**pose, "tilt": numbers((roll, pitch))} if max(abs(roll), abs(pitch)) > 1e-6 else pose

    def _script(self, files: ScriptFiles, report: Report) -> dict[str, Any]:
        scripts = self._scripts.get(self.root.object.handle, ())
        if scripts:
            parameters = values(scripts[0].parameters or self.root.object.parameters)
            script = {"script": files.write(self.root.name, scripts[0])}
            return {**script, "script_parameters": parameters} if parameters else script
        report.add(self.root.name, "has no child script: give one to fly it, such as script:=pilot")
        return {"script": "none"}

    def _object(self, name: str, node: Placed) -> dict[str, Any]:
        """Return the name of a standard object, and its pose in the frame of its parent in drone_sim's vehicle."""
        keys: dict[str, Any] = {"name": node.name}
        if node.object.alias:
            keys["alias"] = label(node.object.alias)
        if name == TARGET and node.above is None:
            keys.update({"parent": "", "position": [0.0, 0.0, 0.0], **pose_keys(node.matrix)})
        elif name != DRONE:
            pose = pose_keys(frames.relative(self._parent_pose(name), node.matrix))
            keys.update({"position": [0.0, 0.0, 0.0], **pose})
        return {**keys, **size_factor(node)}

    def _parent_pose(self, name: str) -> Matrix:
        """Return the world pose of a standard object's parent."""
        if name == TARGET:
            base = self.quadricopter.base
            return frames.multiply(self.root.matrix, BASE) if base is None else base.matrix
        for index, propeller in enumerate(self.quadricopter.propellers, start=1):
            if name == respondable(index):
                return propeller.link.matrix
            if name in (seen(index), joint(index)):
                parent = self.objects.get(seen(index), propeller.body)
                return parent.matrix if name == joint(index) else propeller.body.matrix
        return self.root.matrix

    # ---- cameras

    def _camera_key(self, node: Placed) -> str:
        plain = split(node.object.name)[0]
        return _STANDARD_CAMERAS.get(plain, plain)

    def _camera(self, node: Placed) -> dict[str, Any]:
        camera = node.object.of
        assert isinstance(camera, VrepCamera) and camera.resolution is not None
        width, height = (min(max(side, 1), 4096) for side in camera.resolution)
        horizontal_fov = camera.angle if width >= height else 2 * math.atan(math.tan(camera.angle / 2) * width / height)
        key, near = self._camera_key(node), min(max(camera.near, 1e-4), 1e4)
        viewing = frames.multiply(frames.relative(self.root.matrix, node.matrix), _BODY_AXES)
        return {
            "object": split(node.object.name)[0],
            "topic": key if key in _STANDARD_CAMERAS.values() else f"{key}/image",
            "kind": "color",
            "frame": f"{key}_optical",
            "mount": {"position": [0.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0], **pose_keys(viewing)},
            "width": width,
            "height": height,
            "horizontal_fov": number(min(max(horizontal_fov, 0.01), 3.1)),
            "near": number(near),
            "far": number(min(max(camera.far, 2 * near, 1e-3), 1e5)),
            "every": 1,
        }


def _known_parts(index: int, propeller: Propeller) -> dict[str, Placed]:
    """Return the objects of a propeller that correspond to a vehicle's standard objects, by drone_sim's names."""
    objects = {f"Quadricopter_propeller{index}": propeller.link, respondable(index): propeller.body}
    if propeller.joint is not None:
        if propeller.joint.above in propeller.body.children:
            objects[seen(index)] = propeller.joint.above
        objects[joint(index)] = propeller.joint
    return objects


def suffixes(quadricopters: Sequence[VrepQuadricopter]) -> list[int]:
    """Return a unique name suffix for each quadricopter, that of its own name where possible."""
    used: list[int] = []
    for quadricopter in quadricopters:
        wanted = split(quadricopter.root.object.name)[1]
        used.append(
            wanted
            if wanted not in used
            else next(free for free in range(len(quadricopters) + max(used) + 2) if free not in used)
        )
    return used


def vehicle_names(quadricopters: Sequence[VrepQuadricopter]) -> list[str]:
    """Return unique vehicle names; a single quadricopter is called `drone`."""
    if len(quadricopters) == 1:
        return ["drone"]
    names: list[str] = []
    for quadricopter in quadricopters:
        wanted = word(quadricopter.root.object.name.replace("#", "_"), "drone")
        name = wanted if wanted not in names else f"{wanted}_{len(names)}"
        names.append(name)
    return names
