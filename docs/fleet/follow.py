#!/usr/bin/env python3
"""Keep drone2 and drone3 behind drone1, left and right of it: their green spheres go where two frames of its are."""

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, TransformStamped

from drone_sim.ros.core.shutdown import end_on_signals

LEADER = "drone1/Track_base"  # level, so that the wings do not tilt with the leader
WINGS = {"drone2": (-1.0, 1.0, 0.0), "drone3": (-1.0, -1.0, 0.0)}  # m, seen from the leader
RATE = 20  # Hz


def main():
    """Send each follower to its wing until the node is told to end."""
    rospy.init_node("follow", disable_signals=True)
    end_on_signals()
    wings = tf2_ros.StaticTransformBroadcaster()
    wings.sendTransform([wing(follower, *place) for follower, place in WINGS.items()])
    frames = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(frames)  # noqa: F841 -- fills the buffer
    targets = {name: rospy.Publisher(f"{name}/target_pose", PoseStamped, queue_size=1) for name in WINGS}
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        try:
            for follower, target in targets.items():
                target.publish(pose(frames.lookup_transform("world", f"wing_of_{follower}", rospy.Time(0))))
            rate.sleep()
        except tf2_ros.TransformException:
            rospy.logwarn_throttle(5, f"no frame {LEADER} yet: does fleet.launch run?")
            rospy.rostime.wallsleep(0.1)
        except rospy.ROSInterruptException:
            return


def wing(follower, x, y, z):
    """Return a frame that hangs on the leader's, where a follower is to be."""
    frame = TransformStamped(child_frame_id=f"wing_of_{follower}")
    frame.header.frame_id = LEADER
    frame.transform.translation.x, frame.transform.translation.y, frame.transform.translation.z = x, y, z
    frame.transform.rotation.w = 1.0
    return frame


def pose(transform):
    """Return the pose of a frame that was looked up."""
    message = PoseStamped(header=transform.header)
    place = transform.transform.translation
    message.pose.position.x, message.pose.position.y, message.pose.position.z = place.x, place.y, place.z
    message.pose.orientation = transform.transform.rotation
    return message


if __name__ == "__main__":
    main()
