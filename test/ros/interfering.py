#!/usr/bin/env python3
"""A node that runs the action named by its argument once in a flight. It prepares the action before the flight."""

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
    """Act as a flying program may, and read the scene's text."""
    sim, read = client(), edit({"text": True})

    def act():
        read()
        mark, wheel = sim.createDummy(0.1), sim.getObject("/Quadricopter_propeller_respondable1")
        sim.setObjectPosition(mark, -1, [1, 0, 1])
        sim.setObjectPosition(sim.getObject("/target"), -1, [0.5, 0, 1])
        sim.setScriptSimulationParameter(sim.getScriptAssociatedWithObject(wheel), "particleVelocity", 5.3)
        sim.setFloatSignal("flown", 1.0)

    return act


def push():
    """Push the drone via the remote API, which the grader reports."""
    sim = client()

    def act():
        drone = sim.getObject("/Drone")
        for _ in range(50):
            sim.addForceAndTorque(drone, [0, 0, 0.1], [0, 0, 0])

    return act


def edit(request=None):
    call = rospy.ServiceProxy("/drone_sim/edit_scene", AddDiagnostics, persistent=True)
    call.wait_for_service()

    def act():
        answer = call(json.dumps(request or {"edit": [GATE]}))
        assert answer.success, answer

    return act


def tune():
    call = rospy.ServiceProxy("/drone/set_parameters", Reconfigure, persistent=True)
    call.wait_for_service()
    return lambda: call(Config(doubles=[DoubleParameter("Kzref", 4.0)]))


def main():
    prepare = {function.__name__: function for function in (fly, push, edit, tune)}[sys.argv[1]]
    rospy.init_node(prepare.__name__, disable_signals=True)
    end_on_signals()
    act = prepare()
    done = []

    def on_odometry(odometry):
        if not done and odometry.header.stamp.to_sec() >= SOON:
            done.append(True)
            act()

    rospy.Subscriber("/drone/odom", Odometry, on_odometry, queue_size=1)
    rospy.spin()


if __name__ == "__main__":
    main()
