"""The scene objects of a vehicle: V-REP's quadricopter, under its 3.x names and 4.x paths.

    Drone                                        /Quadcopter             carried by the dynamics
      Quadricopter_base                          /Quadcopter/base        the pose that scripts read
        DronePosition                            .../target              the green sphere
      Track_base                                 /Quadcopter/Track_base
      Quadricopter_propeller<i>                  /Quadcopter/propeller[i-1]
        Quadricopter_propeller_respondable<i>    .../respondable
          Quadricopter_propeller_body<i>         .../respondable/body
            Quadricopter_propeller_joint<i>      .../respondable/body/joint
      FrontVision, TrackCam: one per camera      /FrontVision
      one per sensor                             /range and so on
      Quadricopter_floorCamera, _frontCamera     /floorCamera, /frontCamera
      Drone_script                               /Quadcopter/Script      its child script, as an object of 4.9

Each name that begins with Quadricopter_ also exists with Quadcopter_, as in CoppeliaSim 4.0.
The names of the second vehicle end in #0, those of the third in #1, and so on, as those of V-REP's copies do.
Cameras and vision sensors look along their z axis, with y up and x to the left, as V-REP's do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated

from drone_sim.config.types import Angles, Checked, Finite, Label, ParameterError, Point, Within
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, from_rpy
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.scene_object import DynamicBody
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import SensorParameters


class ObjectPlace(Checked):
    """Changes to a vehicle's object: an additional name without suffix, alias, parent and pose.

    `parent` '' is the world; the pose (m, rad) is in the parent's frame; sim.getObjectSizeFactor returns `size_factor`.
    """

    name: Label = ""
    alias: Label = ""
    parent: Label | None = None
    position: Point | None = None
    rpy: Angles | None = None
    size_factor: Annotated[Finite, Within(1e-6, 1e6)] = 1.0

    def local(self, default: Matrix) -> Matrix:
        """Return the parent's frame from the object's frame, or the default if no pose is given."""
        if self.position is None and self.rpy is None:
            return default
        return from_rpy(self.position or (0.0, 0.0, 0.0), self.rpy or (0.0, 0.0, 0.0))


NOWHERE_ELSE = ObjectPlace()


DRONE = "Drone"
TARGET = "DronePosition"  # the green sphere
TRACK_BASE = "Track_base"
SCRIPT = "Drone_script"
FLOOR_CAMERA, FRONT_CAMERA = "Quadricopter_floorCamera", "Quadricopter_frontCamera"
BASE = frames.from_rpy((0.0, 0.0, -0.01), (0.0, 0.0, 0.0))  # Quadricopter_base in the root's frame
_ALONG_X = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)  # z forward, y up, x left
OPTICAL_FROM_SENSOR = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi))  # optical frames: y down, x right


def respondable(number: int) -> str:
    """Return the name of propeller `number`'s body (from 1): forces act on it, its script reads particleVelocity."""
    return f"Quadricopter_propeller_respondable{number}"


def seen(number: int) -> str:
    """Return the name of the visible part of propeller `number` (from 1), without its blades."""
    return f"Quadricopter_propeller_body{number}"


def joint(number: int) -> str:
    """Return the name of the joint that turns the blades of propeller `number` (from 1)."""
    return f"Quadricopter_propeller_joint{number}"


def own_names(propellers: int) -> tuple[str, ...]:
    """Return the object names of a vehicle with this number of propellers, without cameras and sensors."""
    names = ("Quadricopter_propeller{}".format, respondable, seen, joint)
    of_propellers = [name(number) for number in range(1, propellers + 1) for name in names]
    return DRONE, "Quadricopter_base", TRACK_BASE, TARGET, FLOOR_CAMERA, FRONT_CAMERA, SCRIPT, *of_propellers


REMOVABLE = (FLOOR_CAMERA, FRONT_CAMERA, TRACK_BASE)  # a vehicle also flies without these


class QuadricopterObjects:
    """Adds the objects of one vehicle to the tree, under names with its suffix."""

    def __init__(
        self,
        objects: ObjectTree,
        suffix: str,
        handles: list[int],
        places: Mapping[str, ObjectPlace | None] | None = None,
    ):
        """Create it; `suffix` is '', '#0' and so on; the handle of every object is appended to `handles`.

        `places` changes the names and places of objects, by their default names; None leaves an object out.
        """
        self._objects = objects
        self._suffix = suffix
        self._handles = handles
        self._places = {} if places is None else places

    def add(
        self,
        body: DynamicBody,
        links: Mapping[str, Matrix],
        propellers: Sequence[Matrix],
        cameras: Mapping[str, CameraParameters],
        sensors: Mapping[str, SensorParameters],
    ) -> None:
        """Add all objects; `links` and `propellers` are poses in the root link's frame.

        Raises ParameterError for a camera or sensor whose parent, frame or name is not valid.
        """
        self._add(DRONE, body=body, alias="Quadcopter", also=("Quadricopter", "Quadcopter"))
        self._add("Quadricopter_base", DRONE, BASE, alias="base")
        self._add(TRACK_BASE, DRONE, BASE)
        for number, link in enumerate(propellers, start=1):
            name = f"Quadricopter_propeller{number}"
            self._add(name, DRONE, link, alias="propeller", kind="force_sensor")
            self._add(respondable(number), name, alias="respondable", kind="shape")
            self._add(seen(number), respondable(number), alias="body", kind="shape")
            self._add(joint(number), seen(number), alias="joint", kind="joint")
        down = frames.from_rpy((0.0, 0.0, -0.01), (0.0, math.pi / 2, 0.0))
        self._add(FLOOR_CAMERA, DRONE, frames.multiply(down, _ALONG_X), alias="floorCamera", kind="camera")
        front = frames.from_rpy((0.13, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._add(FRONT_CAMERA, DRONE, frames.multiply(front, _ALONG_X), alias="frontCamera", kind="camera")
        self._add(TARGET, "Quadricopter_base", alias="target", also=("Quadricopter_target", "target"), kind="shape")
        self._add(SCRIPT, DRONE, alias="Script", kind="script")
        for camera in cameras.values():
            self._add_camera(links, camera)
        for name, sensor in sensors.items():
            self._add_sensor(links, name, sensor)

    def _add(
        self,
        name: str,
        parent: str | None = None,
        local: Matrix = frames.IDENTITY,
        *,
        body: DynamicBody | None = None,
        alias: str = "",
        also: Sequence[str] = (),
        kind: str = "",
    ) -> None:
        place = self._places.get(name, NOWHERE_ELSE)
        if place is None:
            return
        parent_name = None if parent is None else f"{parent}{self._suffix}"
        parent_name = parent_name if parent_name is None or parent_name in self._objects else parent  # such as Floor
        if place.parent is not None:
            parent_name = place.parent or None
            if parent_name is not None and parent_name not in self._objects:
                raise ParameterError(f"no object is named '{parent_name}', the parent of '{name}'")
        # names of V-REP 3.x, and of CoppeliaSim 4.0 to 4.2
        bases = [base for old in (name, *also) for base in (old, old.replace("Quadricopter_", "Quadcopter_"))]
        names = [f"{base}{self._suffix}" for base in dict.fromkeys(bases)]
        if place.name and place.name not in names:
            names.append(place.name)
        alias = place.alias or alias or name
        try:
            handle = self._objects.add(
                names[0], parent_name, place.local(local), body, alias=alias, also=names[1:], kind=kind
            )
        except ValueError as error:  # an object of the scene has that name
            raise ParameterError(str(error)) from None
        self._objects[handle].is_model = name == DRONE
        self._objects[handle].size_factor = place.size_factor
        self._handles.append(handle)

    def _add_sensor(self, links: Mapping[str, Matrix], name: str, sensor: SensorParameters) -> None:
        if sensor.mount is not None and sensor.frame in links:
            raise ParameterError(
                f"sensor {name}: the URDF already has a link {sensor.frame}; `mount` needs another frame"
            )
        parent, matrix = sensor.placed(links)
        kind = "proximity_sensor" if sensor.kind == "range" else ""
        local = frames.multiply(matrix, sensor.from_object)
        self._mount(f"sensor {name}", sensor.object or name, parent or DRONE, local, kind)

    def _add_camera(self, links: Mapping[str, Matrix], camera: CameraParameters) -> None:
        label = f"camera frame {camera.frame}"
        if camera.mount is None:
            if camera.frame not in links:
                raise ParameterError(f"{label}: must be a link of the URDF, or have a `mount`")
            parent, optical = DRONE, links[camera.frame]
        else:
            parent, optical = camera.mount.parent or DRONE, camera.mount.optical
        self._mount(label, camera.object, parent, frames.multiply(optical, OPTICAL_FROM_SENSOR), "vision_sensor")

    def _mount(self, label: str, name: str, parent: str, local: Matrix, kind: str) -> None:
        if f"{parent}{self._suffix}" not in self._objects and parent not in self._objects:
            raise ParameterError(f"{label}: no object is named {parent}")
        if f"{name}{self._suffix}" in self._objects:
            raise ParameterError(f"{label}: an object named '{name}' already exists")
        self._add(name, parent, local, kind=kind)
