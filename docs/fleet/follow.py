#!/usr/bin/env python3
"""Keep drone2 and drone3 behind drone1, left and right of it: their green spheres go where the leader's frame says."""

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from tf2_geometry_msgs import do_transform_pose

LEADER = "drone1/Track_base"  # level, so that the wings do not tilt with the leader
PLACES = {"drone2": (-1.0, 1.0, 0.0), "drone3": (-1.0, -1.0, 0.0)}  # m, seen from the leader
RATE = 20  # Hz


def main():
    """Send each follower its place until the node is told to end."""
    rospy.init_node("follow")
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)  # noqa: F841 -- fills the buffer
    publishers = {name: rospy.Publisher(f"{name}/target_pose", PoseStamped, queue_size=1) for name in PLACES}
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        try:
            leader = buffer.lookup_transform("world", LEADER, rospy.Time(0), rospy.Duration(1))
            for name, place in PLACES.items():
                publishers[name].publish(do_transform_pose(seen_from_leader(place), leader))
            rate.sleep()
        except (tf2_ros.LookupException, tf2_ros.ExtrapolationException, tf2_ros.ConnectivityException):
            rospy.logwarn_throttle(5, f"no frame {LEADER} yet: does fleet.launch run?")
        except rospy.ROSInterruptException:
            pass


def seen_from_leader(place):
    """Return a place as a pose that looks where the leader looks."""
    pose = PoseStamped()
    pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = place
    pose.pose.orientation.w = 1.0
    return pose


if __name__ == "__main__":
    main()
