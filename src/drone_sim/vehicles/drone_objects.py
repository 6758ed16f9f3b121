"""The scene as a child script finds it: V-REP's quadricopter, under its 3.x names and in its 4.x paths.

    Drone                                        /Quadcopter             carried by the dynamics
      Quadricopter_base                          /Quadcopter/base        the pose that scripts read
      Track_base                                 /Quadcopter/Track_base
      Quadricopter_propeller<i>                  /Quadcopter/propeller[i-1]
        Quadricopter_propeller_respondable<i>    .../respondable
        Quadricopter_propeller_joint<i>          .../joint
      FrontVision, TrackCam, one for every camera  /FrontVision
      Quadricopter_floorCamera, _frontCamera     /floorCamera, /frontCamera
      DronePosition                              /target                 the green sphere
    Floor                                        /Floor

Cameras and vision sensors look along their z axis, with y up and x to the left, as V-REP's do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import Body, ObjectTree
from drone_sim.run.parameters import CameraParameters, ParameterError

DRONE = "Drone"
TARGET = "DronePosition"  # the green sphere
BASE = frames.from_rpy((0.0, 0.0, -0.01), (0.0, 0.0, 0.0))  # Quadricopter_base in the root's frame
_ALONG_X = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)  # z forward, y up, x left
OPTICAL_FROM_SENSOR = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi))  # optical frames: y down, x right


def respondable(number: int) -> str:
    """Return the name of propeller 1 to 4's body: forces act on it, its script takes particleVelocity."""
    return f"Quadricopter_propeller_respondable{number}"


def joint(number: int) -> str:
    """Return the name of the joint that turns the blades of propeller 1 to 4."""
    return f"Quadricopter_propeller_joint{number}"


def scene_objects(
    body: Body,
    links: Mapping[str, Matrix],
    propellers: Sequence[Matrix],
    cameras: Mapping[str, CameraParameters],
) -> ObjectTree:
    """Return the tree; `links` and `propellers` are poses in the root link's frame."""
    objects = ObjectTree()
    objects.add(DRONE, body=body, alias="Quadcopter", also=("Quadricopter", "Quadcopter"))
    objects.add("Quadricopter_base", DRONE, BASE, alias="base")
    objects.add("Track_base", DRONE, BASE)
    for number, link in enumerate(propellers, start=1):
        name = f"Quadricopter_propeller{number}"
        objects.add(name, DRONE, link, alias="propeller")
        objects.add(respondable(number), name, alias="respondable")
        objects.add(joint(number), name, alias="joint")
    down = frames.from_rpy((0.0, 0.0, -0.01), (0.0, math.pi / 2, 0.0))
    objects.add("Quadricopter_floorCamera", DRONE, frames.multiply(down, _ALONG_X), alias="floorCamera")
    front = frames.from_rpy((0.13, 0.0, 0.0), (0.0, 0.0, 0.0))
    objects.add("Quadricopter_frontCamera", DRONE, frames.multiply(front, _ALONG_X), alias="frontCamera")
    objects.add(TARGET, DRONE, BASE, alias="target", also=("Quadricopter_target", "target"))
    objects.add("Floor", also=("ResizableFloor_5_25",))
    for camera in cameras.values():
        _add_camera(objects, links, camera)
    return objects


def _add_camera(objects: ObjectTree, links: Mapping[str, Matrix], camera: CameraParameters) -> None:
    if camera.mount is None:
        if camera.frame not in links:
            raise ParameterError(f"camera frame {camera.frame}: neither a link of the URDF, nor a `mount` given")
        parent, optical = DRONE, links[camera.frame]
    else:
        parent, optical = camera.mount.parent, camera.mount.matrix
        if parent not in objects:
            raise ParameterError(f"camera frame {camera.frame}: no object is named {parent}")
    if camera.object in objects:
        raise ParameterError(f"camera frame {camera.frame}: an object named '{camera.object}' is there already")
    objects.add(camera.object, parent, frames.multiply(optical, OPTICAL_FROM_SENSOR))
