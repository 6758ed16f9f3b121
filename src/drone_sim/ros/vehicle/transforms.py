"""The frames of all vehicles: one tree, below `world`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

import rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from drone_sim.mechanics import frames
from drone_sim.ros.node.newcomers import Newcomers
from drone_sim.ros.vehicle import frame_names, messages
from drone_sim.run.pacing import Throttle
from drone_sim.vehicles.vehicle import Vehicle

_EYES = 1 / 30  # s of real time, between two turns of the blades, which are for eyes


class Transforms:
    """Broadcasts where the vehicles are, once a step, and where the links of their URDFs sit on them.

    world -> base_link, Track_base, cameras with a `mount`; the links hang on each other as the URDF says, and sensors
    on what carries them. What does not move on base_link is told once, by /tf_static; so is the frame that rviz
    follows, Track_base of the first vehicle, whatever that is called, or `world`. What they are called: frame_names.py.
    """

    def __init__(self) -> None:
        """Advertise."""
        self._newcomers = Newcomers()
        self._moving = rospy.Publisher("/tf", TFMessage, subscriber_listener=self._newcomers, queue_size=100)
        self._fixed = rospy.Publisher("/tf_static", TFMessage, queue_size=10, latch=True)
        self._eyes = Throttle(_EYES)

    def tell_fixed(self, vehicles: Collection[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Say where the links are that do not move, under what `stamp` returns; of vehicles that are new, or gone."""
        now = stamp()
        first = next((frame_names.track_base(one.parameters) for one in vehicles), messages.WORLD_FRAME)
        told = [messages.transform(now, first, frame_names.first(rospy.get_name()), frames.IDENTITY)]
        for one in vehicles:
            told += [_link(now, one, name) for name in one.body.links if name not in one.body.rigid.blade_joints]
            own = one.parameters
            told += [
                messages.transform(now, frame_names.base_link(own), frame_names.frame(own, frame), matrix)
                for frame, matrix in one.instruments.fixed_frames.items()
            ]
        self._fixed.publish(TFMessage(told))

    def publish(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Publish all that moves under what `stamp` returns: tf2 takes but one for each stamp."""
        if not self._moving.get_num_connections():
            return
        self._newcomers.forget()
        now = stamp()
        self._moving.publish(TFMessage([one for vehicle in vehicles for one in _moving(now, vehicle)]))
        if self._eyes.passes():
            self._moving.publish(TFMessage([one for vehicle in vehicles for one in _turning(now, vehicle)]))

    def tell_newcomers(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Tell those who have not heard what moves under the stamp that there is already."""
        for tell in self._newcomers.take():
            now = stamp()
            tell(TFMessage([one for vehicle in vehicles for one in (*_moving(now, vehicle), *_turning(now, vehicle))]))


def _moving(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    own, world = vehicle.parameters, messages.WORLD_FRAME
    return [
        messages.transform(now, world, frame_names.base_link(own), vehicle.matrix),
        messages.transform(now, world, frame_names.track_base(own), vehicle.track),
        *(
            messages.transform(now, world, frame_names.frame(own, camera.frame), vehicle.optical(camera))
            for camera in own.cameras.values()
            if camera.mount is not None  # the URDF does not know them
        ),
        *(
            messages.transform(now, world, frame_names.frame(own, frame), pose())
            for frame, pose in vehicle.instruments.moving_frames.items()
        ),
    ]


def _turning(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    angles = vehicle.blade_angles
    return [
        _link(now, vehicle, link, angles.get(joint, 0.0)) for link, joint in vehicle.body.rigid.blade_joints.items()
    ]


def _link(now: rospy.Time, vehicle: Vehicle, name: str, angle: float = 0.0) -> TransformStamped:
    """Return where a link sits on the one that it hangs on, turned about its z axis."""
    parent, matrix = vehicle.body.links[name]
    if angle:
        matrix = frames.multiply(matrix, frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angle)))
    own = vehicle.parameters
    return messages.transform(now, frame_names.frame(own, parent), frame_names.frame(own, name), matrix)
