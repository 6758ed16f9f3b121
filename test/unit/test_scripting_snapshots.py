"""Snapshots include pending messages, topics, drawings and a script's variables."""

import struct

import pytest
from recorder import Recorder

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.errors import ScriptError

LUA = """
local count, point = 0, setmetatable({}, {__index = {step = 1}})
function sysCall_init()
    said = simROS.advertise('said', 'x/Y')
    heard = simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'on_twist', 8)
    path = sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 100)
end
function on_twist(m)
    count = count + getmetatable(point).__index.step
    simROS.publish(said, {count = count, x = m.linear.x})
    if m.linear.x == 3 then
        simROS.shutdownSubscriber(heard)
        simROS.shutdownPublisher(said)
        said = simROS.advertise('other', 'x/Y')
        getmetatable(point).__index.step = 5
        sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 100)
    end
    sim.addDrawingObjectItem(path, {count, 0, 0})
    sim.setObjectPosition(sim.getObject('/target'), {count, 0, 1})
end
"""


def flight(simulation, steps=4):
    path, backend = [], simulation.drone.bus.backend
    backend.published.clear()
    for _ in range(steps):
        simulation.step()
        path.append(struct.pack("3d", *simulation.drone.body.state.position))
    drawn = {handle: list(entry.items) for handle, entry in simulation.context.drawings.objects.items()}
    return path, list(backend.published), drawn


def test_pending_commands_are_delivered_again_after_a_restore(new_simulation):
    simulation = new_simulation(lua=LUA, drawings=Drawings(), backend=Recorder())
    flights = []
    for x in (1, 2):
        simulation.drone.commands.receive(Twist(Vector3(x)))
        simulation.step()
    simulation.drone.commands.receive(Twist(Vector3(3)))
    snapshot = simulation.snapshot()
    for _ in range(3):
        flights.append(flight(simulation))
        simulation.restore(snapshot)
    assert flights[0] == flights[1] == flights[2]
    assert [entry.message for entry in flights[0][1]] == [{"count": 3, "x": 3}]
    assert flights[0][2] == {1: [(1, 0, 0), (2, 0, 0), (3, 0, 0)], 2: []}


@pytest.mark.parametrize("script", ["", "target"])
def test_flight_after_a_restore_is_bit_identical(script, new_simulation):
    simulation = new_simulation(script=script, drawings=Drawings(), backend=Recorder())
    simulation.step()
    simulation.drone.commands.receive(Twist(Vector3(1, 0.5, 0.2), Vector3(0, 0, 0.3)))
    snapshot = simulation.snapshot()
    first = flight(simulation, 50)
    simulation.drone.commands.receive(Twist(Vector3(-1)))
    simulation.restore(snapshot)
    assert flight(simulation, 50) == first


class TopicBackend:
    """A backend that lists the topics that are currently subscribed or advertised."""

    def __init__(self):
        self.topics = set()

    def subscribe(self, topic, kind, take):
        self.topics.add(topic)
        return lambda: self.topics.discard(topic)

    def advertise(self, topic, kind, queue, latch):
        self.topics.add(topic)
        return TopicBackend.Sender(self, topic)

    class Sender:
        def __init__(self, backend, topic):
            self._backend, self._topic = backend, topic

        def publish(self, message):
            assert self._topic in self._backend.topics

        def shutdown(self):
            self._backend.topics.discard(self._topic)


def test_restored_topics_have_their_former_handles():
    bus = MessageBus("drone")
    bus.backend = TopicBackend()
    heard, said = bus.subscribe("/in", "std_msgs/String", "f", 4), bus.advertise("/out", "std_msgs/String")
    bus.post("/in", {"data": [1]})
    restore = bus.save_state()
    bus.end_subscription(heard)
    bus.end_publisher(said)
    assert (bus.subscribe("/more", "std_msgs/String", "g"), bus.advertise("/else", "std_msgs/String")) == (3, 4)
    for _ in range(2):
        restore()
        assert bus.backend.topics == {"/in", "/out"}
        bus.publish(said, {})
        messages = []
        messages += [(callback, message["data"].pop()) for callback, message in bus.take()]
        assert messages == [("f", 1)], "each restore delivers an unchanged copy"
    assert bus.advertise("/new", "std_msgs/String") == 3


def test_snapshot_and_restore_fail_after_the_script_was_stopped(new_simulation):
    limit = {"script_time_limit": 2.0}  # s, more than a snapshot takes on a busy machine
    search = "string.find(('x'):rep(100), '.-.-.-.-.-y')"  # takes about 10 s, beyond the end of this test
    simulation = new_simulation(limit, lua=f"function sysCall_sensing() {search} end")
    snapshot = simulation.snapshot()
    for attempt in (simulation.step, simulation.step, simulation.snapshot, lambda: simulation.restore(snapshot)):
        with pytest.raises(ScriptError, match="stopped after"):
            attempt()


def test_time_between_calls_does_not_count_against_the_time_limit(new_simulation):
    """A deadline that passed between two calls must stop neither a step nor a snapshot."""
    simulation = new_simulation(
        {"script_time_limit": 5}, lua="x = {} for i = 1, 20000 do x[i] = {i} end function sysCall_init() end"
    )
    simulation.child_scripts["drone"].script._limit._deadline = 0.0  # as after a long pause
    for _ in range(5):
        simulation.step()
    simulation.restore(simulation.snapshot())


def test_snapshot_of_a_script_that_refers_to_itself(new_simulation):
    simulation = new_simulation(
        python="self.me, self.too, self.list, self.count = self, [self], [], 0\n"
        "def sysCall_sensing(): self.me.count += 1; self.list.append(self)\n"
    )
    simulation.step()
    snapshot = simulation.snapshot()
    simulation.step()
    simulation.restore(snapshot)
    simulation.step()
    me = simulation.child_scripts["drone"].script._globals["self"]
    assert (me.me is me, me.too[0] is me, me.count, len(me.list)) == (True, True, 2, 2)


@pytest.mark.parametrize("phase", ["init", "actuation", "sensing"])
def test_snapshot_of_a_script_that_cleared_its_globals(phase, new_simulation):
    simulation = new_simulation(
        python="def sysCall_init(): self.count = 0\n"
        "def sysCall_actuation(): self.count += 1\n"
        "def sysCall_sensing(): pass\n"
        f"before = sysCall_{phase}\ndef sysCall_{phase}(before=before):\n    before()\n    globals().clear()\n"
    )
    first = simulation.snapshot()
    for _ in range(2):
        simulation.step()
    simulation.restore(simulation.snapshot())
    simulation.step()
    simulation.restore(first)
    simulation.step()


@pytest.mark.parametrize(
    ("has", "said"),
    [
        ("class A:\n    def __deepcopy__(self, _): raise KeyboardInterrupt\nx = A()", "script.py:2: KeyboardInterrupt"),
        ("class A:\n    def __deepcopy__(self, _):\n        while True: pass\nx = A()", "script.py:3: stopped after"),
        ("class A(str):\n    def __eq__(self, _): return 1 / 0\n    __hash__ = str.__hash__\n"
         "def sysCall_init(): globals()[A('x')] = 1", "script.py:2: ZeroDivisionError"),
    ],
)  # fmt: skip
def test_error_while_copying_a_script_is_reported_as_a_script_error(has, said, new_simulation):
    limit = 0.2 if "stopped" in said else 60.0
    simulation = new_simulation({"script_time_limit": limit}, python=f"{has}\ndef sysCall_sensing(): pass\n")
    with pytest.raises(ScriptError, match=rf"^\[snapshot\] .*{said}"):
        simulation.snapshot()
