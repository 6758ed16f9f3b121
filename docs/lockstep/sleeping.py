#!/usr/bin/env python3
"""A node that sleeps on /clock: one command for each period of a rospy.Rate."""

import queue

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

GOAL, GAIN = (1.0, 0.5, 1.5), 0.4  # m, 1/s

rospy.init_node("sleeping")
heard = queue.Queue()
rospy.Subscriber("drone/odom", Odometry, heard.put, tcp_nodelay=True)
commands = rospy.Publisher("drone/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
rate = rospy.Rate(20, reset=True)  # Hz of simulated time, as many as there are steps; `reset`: time may begin again
while not rospy.is_shutdown():
    rate.sleep()
    here, command = heard.get().pose.pose.position, Twist()  # /clock comes first, the odometry of its time after it
    command.linear.x, command.linear.y = GAIN * (GOAL[0] - here.x), GAIN * (GOAL[1] - here.y)
    command.linear.z = GAIN * (GOAL[2] - here.z)
    commands.publish(command)
