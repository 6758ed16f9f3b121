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

_DISPLAY_PERIOD = 1 / 30  # s of real time, between two transforms of the blades, which are only displayed


class Transforms:
    """Broadcasts the poses of vehicles once a step, and those of the links of their URDFs.

    Children of `world` are base_link, Track_base and cameras with a `mount`; links have the parents of the URDF, and
    sensors that of their carrier. Frames that do not move relative to base_link are published once, on /tf_static; so
    is the frame that rviz follows: Track_base of the first vehicle, whatever its name, or `world`.
    """

    def __init__(self) -> None:
        self._new_subscribers = NewSubscribers()
        self._moving = rospy.Publisher("/tf", TFMessage, subscriber_listener=self._new_subscribers, queue_size=100)
        self._fixed = rospy.Publisher("/tf_static", TFMessage, queue_size=10, latch=True)
        self._display_throttle = Throttle(_DISPLAY_PERIOD)

    def publish_static(self, vehicles: Collection[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Publish the fixed links with the stamp that `stamp` returns; called when vehicles are added or removed."""
        now = stamp()
        first = next((frame(vehicle.parameters, TRACK_BASE) for vehicle in vehicles), WORLD_FRAME)
        fixed = [transform(now, first, first_frame(rospy.get_name()), frames.IDENTITY)]
        for vehicle in vehicles:
            body, own = vehicle.body, vehicle.parameters
            fixed += [_link(now, vehicle, name) for name in body.links if name not in body.rigid.blade_joints]
            fixed += [
                transform(now, frame(own, BASE_LINK), frame(own, name), matrix)
                for name, matrix in vehicle.instruments.fixed_frames.items()
            ]
        self._fixed.publish(TFMessage(fixed))

    def publish(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Publish all moving frames with the stamp that `stamp` returns: tf2 takes only one transform per stamp."""
        if not self._moving.get_num_connections():
            return
        self._new_subscribers.take()  # the messages below reach them, too
        now = stamp()
        self._moving.publish(TFMessage([each for vehicle in vehicles for each in _moving(now, vehicle)]))
        if self._display_throttle.passes():
            self._moving.publish(TFMessage([each for vehicle in vehicles for each in _turning(now, vehicle)]))

    def tell_new_subscribers(self, vehicles: Iterable[Vehicle], stamp: Callable[[], rospy.Time]) -> None:
        """Send the moving frames, with the present stamp, to new subscribers only."""
        for send in self._new_subscribers.take():
            now = stamp()
            send(
                TFMessage([each for vehicle in vehicles for each in (*_moving(now, vehicle), *_turning(now, vehicle))])
            )


def _moving(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    own = vehicle.parameters
    places = {
        BASE_LINK: vehicle.body.matrix,
        TRACK_BASE: vehicle.track.matrix(),
        # The URDF does not know cameras with a mount; the frame of a stereo pair is its left camera's.
        **{
            camera.frame: vehicle.optical(camera)
            for camera in own.cameras.values()
            if camera.mount and not camera.baseline
        },
        **{name: matrix() for name, matrix in vehicle.instruments.moving_frames.items()},
    }
    return [transform(now, WORLD_FRAME, frame(own, name), matrix) for name, matrix in places.items()]


def _turning(now: rospy.Time, vehicle: Vehicle) -> list[TransformStamped]:
    angles = vehicle.propulsion.blades.angles
    return [
        _link(now, vehicle, link, angles.get(joint, 0.0)) for link, joint in vehicle.body.rigid.blade_joints.items()
    ]


def _link(now: rospy.Time, vehicle: Vehicle, name: str, angle: float = 0.0) -> TransformStamped:
    """Return the transform of a link relative to its parent, turned about its z axis."""
    parent, matrix = vehicle.body.links[name]
    if angle:
        matrix = frames.multiply(matrix, frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angle)))
    return transform(now, frame(vehicle.parameters, parent), frame(vehicle.parameters, name), matrix)
