"""simROS without ROS, and its interface to a ROS backend."""

import threading
from types import SimpleNamespace

import pytest
from recorder import Recorder

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.ros_functions import RosFunctions, TopicFunctions


class FakeSender:
    def __init__(self):
        self.sent = []
        self.ended = False

    def publish(self, message):
        self.sent.append(message)

    def shutdown(self):
        self.ended = True


class FakeBackend:
    def __init__(self):
        self.takes = {}
        self.senders = {}
        self.ended = []

    def subscribe(self, topic, kind, take):
        if kind == "no/Type":
            raise ValueError("no message type no/Type")
        self.takes[topic] = take
        return lambda: self.ended.append(topic)

    def advertise(self, topic, kind, queue, latch):
        return self.senders.setdefault((topic, kind, queue, latch), FakeSender())

    def advertise_image(self, topic, queue):
        return self.senders.setdefault((topic, "image", queue), FakeSender())


def test_relative_topic_names_resolve_in_the_drones_namespace(caplog):
    bus, received = MessageBus("drone"), []
    bus.subscribe("cmd_vel", "geometry_msgs/Twist", "relative")
    bus.subscribe("/drone/cmd_vel", "geometry_msgs/Twist", "absolute")
    bus.subscribe("/other/cmd_vel", "geometry_msgs/Twist", "other")
    bus.post("cmd_vel", 1)
    received += bus.take()
    assert received == [("relative", 1), ("absolute", 1)]
    warning = "/other/cmd_vel: no message will be received, because this flight runs without ROS"
    assert [item.getMessage() for item in caplog.records] == [warning]


def test_repeated_subscription_returns_the_existing_handle():
    bus, received = MessageBus("drone"), []
    for _ in range(300):  # as from a script that subscribes in every step
        assert bus.subscribe("/cmd_vel", "geometry_msgs/Twist", "on_twist") == 1
    others = [
        bus.subscribe("/cmd_vel", "geometry_msgs/Twist", "on_other"),
        bus.subscribe("/cmd_vel", "std_msgs/String", "on_twist"),
        bus.subscribe("/more", "geometry_msgs/Twist", "on_twist"),
    ]
    assert others == [2, 3, 4]
    bus.end_subscription(3)
    bus.post("/cmd_vel", 1)
    received += bus.take()
    assert received == [("on_twist", 1), ("on_other", 1)]
    bus.end_subscription(1)
    assert bus.subscribe("/cmd_vel", "geometry_msgs/Twist", "on_twist") == 5


@pytest.mark.parametrize("queue, kept", [(0, [4]), (1, [4]), (3, [2, 3, 4]), (10, [0, 1, 2, 3, 4])])
def test_queue_holds_the_last_messages(queue, kept):
    bus, received = MessageBus("drone"), []
    handle = bus.subscribe("x", "std_msgs/Int32", "f", queue)
    for message in range(5):
        bus.post("x", message)
    received += [message for _, message in bus.take() + bus.take()]
    assert received == kept
    bus.end_subscription(handle)
    with pytest.raises(ValueError, match=f"no subscription with the handle {handle}"):
        bus.end_subscription(handle)


@pytest.mark.parametrize("backend", [None, Recorder()])
def test_publishers_work_with_and_without_a_backend(backend):
    bus = MessageBus("drone")
    bus.backend = backend
    handle = bus.advertise("said", "std_msgs/String")
    bus.publish(handle, {"data": "x"})
    image, sim_ros = bus.advertise_image("/drone/front"), TopicFunctions(bus)
    sim_ros.imageTransportPublish(image, bytes(range(12)), 2, 2, "here")
    if backend is not None:
        first, (topic, kind, sent) = backend.published
        assert first == ("/drone/said", "std_msgs/String", {"data": "x"})
        assert (topic, kind, sent.frame_id) == ("/drone/front", "sensor_msgs/Image", "here")
        assert sent.pixels.tolist() == [[[6, 7, 8], [9, 10, 11]], [[0, 1, 2], [3, 4, 5]]]
    assert [bus.subscribers(item) for item in (handle, image)] == ([0, 0] if backend is None else [1, 1])
    with pytest.raises(ValueError, match="an image of 2 x 2 must have 12 bytes, not 3"):
        sim_ros.imageTransportPublish(image, b"abc", 2, 2, "here")
    with pytest.raises(ValueError, match="an image cannot have 0 x 2"):
        sim_ros.imageTransportPublish(image, b"", 0, 2, "here")
    bus.end_publisher(handle)
    sim_ros.imageTransportShutdownPublisher(image)
    for call in (lambda: bus.publish(handle, {}), lambda: bus.subscribers(handle)):
        with pytest.raises(ValueError, match="no publisher with the handle"):
            call()


def test_backend_transports_messages():
    bus, backend, received = MessageBus("drone"), FakeBackend(), []
    bus.backend = backend
    bus.subscribe("/scan", "sensor_msgs/LaserScan", "on_scan", 2)
    bus.subscribe("cmd_vel", "geometry_msgs/Twist", "on_twist")
    assert list(backend.takes) == ["/scan"], "the drone itself posts its velocity commands"
    thread = threading.Thread(target=backend.takes["/scan"], args=("message",))
    thread.start()
    thread.join()
    received += bus.take()
    assert received == [("on_scan", "message")]

    bus.publish(bus.advertise("said", "std_msgs/String", 5, True), {"data": "x"})
    bus.advertise_image("front")
    sender = backend.senders[("/drone/said", "std_msgs/String", 5, True)]
    assert sender.sent == [{"data": "x"}]
    bus.close()
    assert backend.ended == ["/scan"] and all(sender.ended for sender in backend.senders.values())
    with pytest.raises(ValueError, match="no message type"):
        bus.subscribe("/x", "no/Type", "f")


LUA = """
function sysCall_init()
    said = simROS.advertise('said', 'x/Y')
    simROS.subscribe('/in', 'x/Y', 'heard')
    simROS.subscribe('/in', 'x/Y', function(msg) print('also') end)
end
function heard(msg)
    simROS.publish(said, {
        x = msg.linear.x, list = msg.list, first = msg.list[1], n = #msg.list, name = msg.name, raw = msg.raw,
        nested = {a = {1, {b = true}}}, stamp = msg.stamp,
    })
end
"""

PYTHON = """
def sysCall_init():
    self.said = simROS.advertise('said', 'x/Y')
    simROS.subscribe('/in', 'x/Y', 'heard')

def heard(msg):
    simROS.publish(self.said, {
        'x': msg.linear.x, 'list': msg.list, 'first': msg.list[0], 'n': len(msg.list), 'name': msg.name,
        'raw': msg.raw, 'nested': {'a': [1, {'b': True}]}, 'stamp': msg.stamp.to_sec(),
    })
"""


@pytest.mark.parametrize("ending, source", [("lua", LUA), ("py", PYTHON)])
def test_script_receives_and_publishes_messages(tmp_path, ending, source, new_simulation):
    path = tmp_path / f"script.{ending}"
    path.write_text(source, encoding="utf-8")
    backend = FakeBackend()
    simulation = new_simulation(script=str(path), backend=backend)
    simulation.drone.bus.post(
        "/in",
        SimpleNamespace(
            linear=Vector3(1.5, 0, 0),
            list=[1.5, 2.5],
            name="näme",
            raw=b"\xff\x00",
            stamp=SimpleNamespace(to_sec=lambda: 12.5),
        ),
    )
    simulation.step()
    (sender,) = backend.senders.values()
    assert sender.sent == [
        {
            "x": 1.5,
            "list": [1.5, 2.5],
            "first": 1.5,
            "n": 2,
            "name": "näme",
            "raw": b"\xff\x00",
            "nested": {"a": [1, {"b": True}]},
            "stamp": 12.5,
        }
    ]
    simulation.close()
    assert sender.ended


def test_script_receives_the_drones_velocity_commands(new_simulation):
    simulation = new_simulation(
        lua="simROS.subscribe('/drone/cmd_vel', 'geometry_msgs/Twist', 'f')\n"
        "function f(m) assert(m.linear.x == 1 and m.linear.z == 0 and m.angular.z == 0.5) heard = true end\n"
        "function sysCall_cleanup() assert(heard) end"
    )
    simulation.drone.commands.receive(Twist(Vector3(1, 0, 0), Vector3(0, 0, 0.5)))
    simulation.step()


def test_closed_scripts_are_garbage_collected(tmp_path):
    import gc
    import weakref

    path = tmp_path / "script.lua"
    path.write_text("function sysCall_sensing() sim.getObjectPosition(0) end", encoding="utf-8")
    scripts = []
    for _ in range(5):
        simulation = Simulation(parameters.load(), script=str(path))
        simulation.step()
        scripts.append(weakref.ref(simulation.child_scripts["drone"].script))
        simulation.close()
    del simulation
    gc.collect()
    assert [script() for script in scripts] == [None] * 5


@pytest.mark.parametrize("name", ["a b\n", "", "a//b", "a/", "~a", "x\u00e4", "a\x00"])
def test_an_impossible_name_of_a_topic_is_refused_at_once(name):
    bus = MessageBus("drone")
    for call in (
        lambda: bus.advertise(name, "std_msgs/Empty"),
        lambda: bus.advertise_image(name),
        lambda: bus.subscribe(name, "std_msgs/Empty", print),
        lambda: bus.offer(name, "std_srvs/Empty", print),
        lambda: RosFunctions(bus, Clock(0.05)).serviceClient(name, "std_srvs/Empty"),
    ):
        with pytest.raises(ValueError, match=r"is no name of a (topic|service)"):
            call()
    assert bus.advertise("/a/B_1", "std_msgs/Empty") == 1
