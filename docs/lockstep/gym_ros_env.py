"""A Gymnasium environment over ROS; the simulator runs with lockstep:=cmd_vel_stamped and real_time_factor:=0."""

import queue

import gymnasium
import numpy as np
import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger


class FlyTo(gymnasium.Env):
    """Observation: the way to the goal (m) and the velocity (m/s). Action: the velocity that is commanded (m/s)."""

    observation_space = gymnasium.spaces.Box(-1000, 1000, (6,), np.float64)
    action_space = gymnasium.spaces.Box(-1, 1, (3,), np.float64)

    def __init__(self):
        """Connect to the simulator."""
        rospy.init_node("gymnasium", anonymous=True, disable_signals=True)
        self.heard, self.restart = queue.Queue(), rospy.ServiceProxy("/drone_sim/restart", Trigger)
        self.commands = rospy.Publisher("/drone/cmd_vel_stamped", TwistStamped, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/drone/odom", Odometry, self.heard.put, tcp_nodelay=True)

    def reset(self, *, seed=None, options=None):
        """Begin again; the first odometry of a flight has the stamp 0.1 s."""
        super().reset(seed=seed)
        self.goal = self.np_random.uniform([0.5, -1, 1], [2, 1, 2])
        self.restart.wait_for_service()
        self.heard.queue.clear()  # what is left of the last flight has the same stamps
        answer = self.restart()
        if not answer.success:
            raise RuntimeError(answer.message)
        return self._observation(lambda stamp: stamp == rospy.Time(0, 100_000_000)), {}

    def step(self, action):
        """Answer the last odometry, and wait for the next one."""
        command, before = TwistStamped(header=self.odometry.header), self.odometry.header.stamp
        command.twist.linear.x, command.twist.linear.y, command.twist.linear.z = map(float, action)
        self.commands.publish(command)
        observation = self._observation(lambda stamp: stamp > before)
        distance = float(np.linalg.norm(observation[:3]))
        return observation, -distance, distance < 0.1, self.odometry.header.stamp.to_sec() > 20, {}

    def _observation(self, is_wanted):
        while True:
            self.odometry = self.heard.get(timeout=60)
            if is_wanted(self.odometry.header.stamp):
                here, speed = self.odometry.pose.pose.position, self.odometry.twist.twist.linear
                return np.array([*(self.goal - (here.x, here.y, here.z)), speed.x, speed.y, speed.z])
