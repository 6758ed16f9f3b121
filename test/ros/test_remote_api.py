#!/usr/bin/env python3
"""A node driven by clients of both remote APIs, together with its services and topics."""

import struct
import sys
import threading
import time
import unittest
from pathlib import Path

import rospy
import rostest
from coppeliasim_zmqremoteapi_client import RemoteAPIClient
from listening import Listener, connected
from std_msgs.msg import String
from std_srvs.srv import Trigger

from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))
from legacy_client import Client as LegacyClient
from legacy_client import command, floats, ints, text

SYNCHRONOUS, TRIGGER, POSITION, SET_POSITION = 0x0001, 0x0003, 0x200E, 0x101B
TOOLBAR_START = 0x1007, ints(0)


class RemoteApi(unittest.TestCase):
    """A node that runs in a thread of this process."""

    @classmethod
    def setUpClass(cls):
        cls.ready = threading.Event()
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        assert cls.ready.wait(60)
        cls.state = Listener(rospy.resolve_name("~state"), String)
        cls.services = {name: rospy.ServiceProxy(f"~{name}", Trigger) for name in ("start", "stop")}

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.thread.join()

    @classmethod
    def run_node(cls):
        """Create and run the node in one thread, which owns the simulation."""
        api_settings = {"serve": True, "port": 0, "legacy_port": 0}
        settings = {"script": "target", "cameras": {}, "remote_api": api_settings, "real_time_factor": 0}
        node = Node(parameters.load(settings))
        cls.port, cls.legacy_port = node._remote.zeromq.port, node._remote.legacy.port
        cls.ready.set()
        node.run()
        node.close()

    def test_a_client_flies_step_by_step(self):
        client = RemoteAPIClient(port=self.port)
        sim = client.require("sim")
        self.assertEqual(sim.getSimulationState(), sim.simulation_stopped)
        sim.setStepping(True)
        sim.startSimulation()
        target = sim.getObject("/target")
        sim.setObjectPosition(target, [0.3, 0.0, 1.0])
        for _ in range(60):
            sim.step()
        self.assertAlmostEqual(sim.getSimulationTime(), 3.0)
        self.assertAlmostEqual(sim.getObjectPosition(sim.getObject("/Quadcopter/base"))[2], 1.0, delta=0.1)
        self.services["stop"]()  # answered although the client holds the simulation
        self.assertEqual(sim.getSimulationState(), sim.simulation_stopped)

    def test_a_step_is_interrupted_while_a_client_holds_the_simulation(self):
        sim = RemoteAPIClient(port=self.port).require("sim")
        sim.startSimulation()
        sim.pauseSimulation()
        step = rospy.ServiceProxy("~step", Trigger)
        self.assertTrue(step().success)
        sim.setStepping(True)
        answer = step()
        self.assertFalse(answer.success)
        self.assertEqual(
            answer.message,
            "interrupted: a client of the remote API holds the simulation: 1 of 1 steps have not been run",
        )
        sim.setStepping(False)
        self.assertTrue(step().success)
        sim.stopSimulation()

    def test_b_topics_call_functions_of_the_client(self):
        client = RemoteAPIClient(port=self.port)
        sim, ros = client.require("sim"), client.require("simROS")
        self.services["start"]()
        heard, echo = [], Listener("/echo", String)
        ros.subscribe("/said", "std_msgs/String", lambda message: heard.append(message["data"]))
        publisher = ros.advertise("/echo", "std_msgs/String")
        connected(rospy.Publisher("/said", String, queue_size=1, latch=True)).publish("hello")
        while not heard:
            self.assertEqual(sim.getSimulationState(), sim.simulation_advancing_running)
        while not ros.getNumSubscribers(publisher):
            pass
        ros.publish(publisher, {"data": heard[0]})
        echo.wait_for(lambda message: message.data == "hello", after=0)
        sim.stopSimulation()

    def test_c_the_flight_continues_after_its_client_disconnects(self):
        client = RemoteAPIClient(port=self.port)
        sim = client.require("sim")
        sim.setStepping(True)
        sim.startSimulation()
        self.assertEqual(sim.getSimulationTime(), 0.0)
        client.socket.close()
        client.context.term()
        watcher = RemoteAPIClient(port=self.port).require("sim")
        while watcher.getSimulationTime() < 1.0:
            pass
        watcher.stopSimulation()
        self.state.wait_for(lambda message: message.data == "stopped", after=0)

    def test_d_a_client_of_the_legacy_api_triggers_steps(self):
        client = LegacyClient(self.legacy_port, time.sleep)
        for code, key in ((SYNCHRONOUS, b""), TOOLBAR_START):
            client.call(code, key)
        target = ints(client.handle("Quadricopter_target"))
        client.call(SET_POSITION, target, ints(-1) + floats(0.3, 0.0, 1.0))
        for _ in range(60):
            client.call(TRIGGER)
        reply = client.ask(command(POSITION, ints(client.handle("Quadricopter_base"), -1)))
        self.assertEqual(reply.times, [3000])
        (position,) = reply.answers.values()
        self.assertAlmostEqual(struct.unpack("<3f", position)[2], 1.0, delta=0.1)
        self.services["stop"]()  # answered although the client holds the simulation
        client.vanish()
        self.services["start"]()
        watcher = LegacyClient(self.legacy_port, time.sleep)
        while watcher.ask(command(0x3001, text("Floor"))).times[0] < 1000:
            pass
        self.services["stop"]()


if __name__ == "__main__":
    rospy.init_node("test_remote_api", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "remote_api", RemoteApi))
