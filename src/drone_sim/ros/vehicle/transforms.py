"""The frames of all vehicles: one tree, below `world`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

import rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from drone_sim.mechanics import frames
from drone_sim.ros.core.message_conversion import BASE_LINK, TRACK_BASE, WORLD_FRAME, first_frame, frame, transform
from drone_sim.ros.core.publishing import NewSubscribers
from drone_sim.run.pacing import Throttle
from drone_sim.vehicles.vehicle import Vehicle

_EYES = 1 / 30  # s of real time, between two turns of the blades, which are for eyes


class Transforms:
    """Broadcasts where the vehicles are, once a step, and where the links of their URDFs sit on them.

    world -> base_link, Track_base, cameras with a `mount`; the links hang on each other as the URDF says, and sensors
    on what carries them. Frames that do not move relative to base_link are published once, on /tf_static; so is the
    frame that rviz follows: Track_base of the first vehicle, whatever its name, or `world`.
    """

    def __init__(self) -> None:
        """Advertise."""
        self._new_subscribers = NewSubscribers()
        self._moving = rospy.Publisher("/tf", TFMessage, subscriber_listener=self._new_subscribers, queue_size=100)
        self._fixed = rospy.Publisher("/tf_static", TFMessage, queue_size=10, latch=True)
        self._eyes = Throttle(_EYES)

    def publish_static(self, vehicles: Collection[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Publish the links that do not move, stamped with what `stamp` returns; called when vehicles come or go."""
        now = stamp()
        first = next((frame(one.parameters, TRACK_BASE) for one in vehicles), WORLD_FRAME)
        told = [transform(now, first, first_frame(rospy.get_name()), frames.IDENTITY)]
        for one in vehicles:
            told += [_link(now, one, name) for name in one.body.links if name not in one.body.rigid.blade_joints]
            told += [
                transform(now, frame(one.parameters, BASE_LINK), frame(one.parameters, name), matrix)
                for name, matrix in one.instruments.fixed_frames.items()
            ]
        self._fixed.publish(TFMessage(told))

    def publish(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Publish all moving frames, stamped with what `stamp` returns: tf2 takes only one transform per stamp."""
        if not self._moving.get_num_connections():
            return
        self._new_subscribers.take()  # what is published reaches them all
        now = stamp()
        self._moving.publish(TFMessage([one for vehicle in vehicles for one in _moving(now, vehicle)]))
        if self._eyes.passes():
            self._moving.publish(TFMessage([one for vehicle in vehicles for one in _turning(now, vehicle)]))

    def tell_new_subscribers(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Send the frames that move, with the present stamp, to new subscribers only."""
        for tell in self._new_subscribers.take():
            now = stamp()
            tell(TFMessage([one for vehicle in vehicles for one in (*_moving(now, vehicle), *_turning(now, vehicle))]))


def _moving(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    own = vehicle.parameters
    places = {
        BASE_LINK: vehicle.body.matrix,
        TRACK_BASE: vehicle.track.matrix(),
        # The URDF does not know cameras with a mount; the frame of a stereo pair is its left camera's.
        **{one.frame: vehicle.optical(one) for one in own.cameras.values() if one.mount and not one.baseline},
        **{name: matrix() for name, matrix in vehicle.instruments.moving_frames.items()},
    }
    return [transform(now, WORLD_FRAME, frame(own, name), matrix) for name, matrix in places.items()]


def _turning(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    angles = vehicle.propulsion.blades.angles
    return [
        _link(now, vehicle, link, angles.get(joint, 0.0)) for link, joint in vehicle.body.rigid.blade_joints.items()
    ]


def _link(now: rospy.Time, vehicle: Vehicle, name: str, angle: float = 0.0) -> TransformStamped:
    """Return where a link sits on the one that it hangs on, turned about its z axis."""
    parent, matrix = vehicle.body.links[name]
    if angle:
        matrix = frames.multiply(matrix, frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angle)))
    return transform(now, frame(vehicle.parameters, parent), frame(vehicle.parameters, name), matrix)
