#!/usr/bin/env python3
"""A node that does something in a flight, once: what its argument names."""

import json
import sys

import rospy
from coppeliasim_zmqremoteapi_client import RemoteAPIClient
from diagnostic_msgs.srv import AddDiagnostics
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from nav_msgs.msg import Odometry

from drone_sim.ros.core.shutdown import end_on_signals

SOON = 0.2  # s of simulated time
GATE = {"do": "add_model", "model": "gate", "position": [3, 0, 0]}


def client():
    """Return `sim` of a client of the remote API."""
    return RemoteAPIClient(port=rospy.get_param("/drone_sim/remote_api/port")).require("sim")


def fly():
    """Do what a program that flies may do, and read the scene's text."""
    edit({"text": True})
    sim = client()
    mark, wheel = sim.createDummy(0.1), sim.getObject("/Quadricopter_propeller_respondable1")
    sim.setObjectPosition(mark, -1, [1, 0, 1])
    sim.setObjectPosition(sim.getObject("/target"), -1, [0.5, 0, 1])
    sim.setScriptSimulationParameter(sim.getScriptAssociatedWithObject(wheel), "particleVelocity", 5.3)
    sim.setFloatSignal("flown", 1.0)


def push():
    """Push by the remote API, of which one is told."""
    sim = client()
    drone = sim.getObject("/Drone")
    for _ in range(50):
        sim.addForceAndTorque(drone, [0, 0, 0.1], [0, 0, 0])


def edit(request=None):
    answer = rospy.ServiceProxy("/drone_sim/edit_scene", AddDiagnostics)(json.dumps(request or {"edit": [GATE]}))
    assert answer.success, answer


def tune():
    rospy.ServiceProxy("/drone/set_parameters", Reconfigure)(Config(doubles=[DoubleParameter("Kzref", 4.0)]))


def main():
    does = {one.__name__: one for one in (fly, push, edit, tune)}[sys.argv[1]]
    rospy.init_node(does.__name__, disable_signals=True)
    end_on_signals()
    done = []

    def hear(odometry):
        if not done and odometry.header.stamp.to_sec() >= SOON:
            done.append(True)
            does()

    rospy.Subscriber("/drone/odom", Odometry, hear, queue_size=1)
    rospy.spin()


if __name__ == "__main__":
    main()
