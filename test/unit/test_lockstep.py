"""Lockstep without a ROS master: which message counts as an answer, and when simulation time waits."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.clock import Clock
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.node import lockstep as lockstep_module
from drone_sim.ros.node.lockstep import Lockstep, NoAnswer
from drone_sim.run import parameters

NODE = "/flyer"
SETTLED = 2.0  # s, longer than connections take to settle


class Connections:
    """A substitute for rospy's connections: one node publishes cmd_vel and is connected to all triggers."""

    def __init__(self):
        self.sent, self.received, self.is_connected, self.other_connections = {}, ["/drone/cmd_vel"], True, set()
        self.opened = []

    def publishers_of(self, _topic):
        if not self.is_connected:
            return []
        self.opened.append(SimpleNamespace(callerid_pub=NODE, done=False, socket=1))
        return self.opened[-1:]

    def subscribers_of(self, _topic):
        return [SimpleNamespace(endpoint_id=NODE)] if self.is_connected else []

    def received_topics(self):
        return self.received

    def sent_count(self, topic):
        return self.sent.get(topic, 0)

    def all_connections(self):
        return {("/drone/cmd_vel", NODE), *self.other_connections}

    def has_queued(self, _connection):
        return False


class Stage:
    """A lockstep with a simulation that only counts steps and a clock that the test sets."""

    def __init__(self, monkeypatch, **overrides):
        self.now, self.executed = 0.0, []
        self.connections = Connections()
        monkeypatch.setattr(lockstep_module, "connections", self.connections)
        clock = Clock(0.05)
        self.simulation = SimpleNamespace(run=1, steps=0, time=0.0, topology_version=1, clock=clock)
        self.set_cameras("front")
        self.inbox = Inbox()
        values = parameters.load({"lockstep": {"wait_for": ["cmd_vel"], **overrides}}).lockstep
        self.lockstep = Lockstep(values, self.simulation, self.inbox, clock=lambda: self.now)
        self.receive = self.lockstep.gate("drone/cmd_vel", self.executed.append)

    def set_cameras(self, *names):
        """Replace the cameras of the vehicle, as another scene does."""
        self.camera = SimpleNamespace(image=None, age=0.0)
        owned = SimpleNamespace(cameras={name: SimpleNamespace(topic=name) for name in names})
        cameras = dict.fromkeys(names, self.camera)
        self.simulation.vehicles = {"drone": SimpleNamespace(parameters=owned, cameras=cameras)}
        self.simulation.topology_version += 1

    def send(self, *topics):
        """Publish a message on topics of the simulator."""
        for topic in topics:
            self.connections.sent[topic] = self.connections.sent_count(topic) + 1

    def close_connections(self):
        self.connections.is_connected = False
        for each in self.connections.opened:
            each.done = True

    def answer(self, text):
        """Receive a message of the node."""
        self.receive(SimpleNamespace(_connection_header={"callerid": NODE}, text=text))

    def step(self, during=lambda: None):
        """Run a step, in which a script calls `during`."""
        self.lockstep.begin_waits()
        self.simulation.steps += 1
        self.simulation.time = self.simulation.steps * 0.05
        self.simulation.clock.steps = self.simulation.steps
        during()
        self.lockstep.begin_late_waits()
        self.send("/clock", "/drone/odom", "/drone/front")

    def is_ready(self):
        self.inbox.run_jobs()
        return self.lockstep.is_ready()

    def connect(self):
        """Run the first step, and let the connections settle."""
        self.step()
        assert not self.is_ready()
        self.now += SETTLED
        assert self.is_ready()
        return self

    @property
    def texts(self):
        return [message.text for message in self.executed]

    @property
    def ignored(self):
        return self.lockstep.finding().values["ignored messages"]


@pytest.fixture(name="stage")
def _stage(monkeypatch):
    return lambda **overrides: Stage(monkeypatch, **overrides)


@pytest.mark.parametrize("trigger", ["step", "odom", "4 steps"])
def test_the_answer_releases_the_next_step(stage, trigger):
    setup = stage(trigger=trigger).connect()
    for number in range(8):
        setup.step()
        if trigger != "4 steps" or number in (3, 7):
            assert not setup.is_ready()
            setup.answer(number)
        assert setup.is_ready()
    assert setup.texts == ([3, 7] if trigger == "4 steps" else list(range(8)))


def test_an_answer_to_a_clock_message_sent_within_the_step_counts(stage):
    setup = stage(trigger="step").connect()

    def sense():
        setup.send("/clock")
        setup.answer("early bird")

    setup.step(sense)
    assert setup.is_ready()
    assert setup.texts == ["early bird"]


def test_a_clock_message_of_a_script_does_not_make_later_answers_early(stage):
    setup = stage(trigger="step").connect()
    setup.lockstep.begin_waits()
    setup.simulation.steps += 1
    setup.send("/clock")  # by the script; the simulator publishes no second clock message for the same time
    setup.lockstep.begin_late_waits()
    setup.answer("an answer")
    assert setup.is_ready()


def test_an_answer_before_the_odometry_is_ignored(stage):
    setup = stage(trigger="odom").connect()
    setup.step(lambda: setup.answer("to something else"))
    assert not setup.is_ready()
    setup.answer("to the odometry")
    assert setup.is_ready()
    assert (setup.texts, setup.ignored) == (["to the odometry"], "1 early")


def test_a_step_without_a_picture_needs_no_answer(stage):
    setup = stage(trigger="front").connect()
    setup.step()
    assert setup.is_ready()

    def look():
        setup.camera.image = "a picture"

    setup.step(look)
    assert not setup.is_ready()
    setup.answer("to the picture")
    assert setup.is_ready()


def test_an_answer_counts_even_if_its_execution_fails(stage, caplog):
    setup = stage().connect()

    def fail(_message):
        raise KeyError("a fault of our own")

    setup.receive = setup.lockstep.gate("drone/cmd_vel", fail)
    setup.step()
    setup.answer("anything")
    assert setup.is_ready()
    assert "a fault of our own" in caplog.text


def test_time_waits_until_the_nodes_are_connected_and_the_reason_is_reported(stage, caplog):
    setup = stage()
    setup.connections.is_connected = False
    setup.step()
    setup.now += SETTLED
    assert not setup.is_ready()
    assert "time stands at 0.05 s until there is a publisher of /drone/cmd_vel" in setup.lockstep.finding().message
    setup.connections.is_connected = True
    setup.connections.other_connections = {("/drone/odom", NODE)}  # the node has just connected
    assert not setup.is_ready()
    assert setup.lockstep.finding().message == "time stands at 0.05 s until connections have settled"
    setup.now += SETTLED
    assert setup.is_ready()


@pytest.mark.parametrize("is_before_the_step", [False, True])
def test_a_lost_node_is_named_and_a_new_node_is_accepted(stage, caplog, is_before_the_step):
    setup = stage().connect()
    setup.step()
    setup.answer("an answer")
    assert setup.is_ready()
    setup.connections.is_connected = not is_before_the_step
    setup.step()
    if not is_before_the_step:
        setup.close_connections()
    assert not setup.is_ready()
    assert "/drone/cmd_vel: /flyer has gone (the stamp is 0.15 s); waiting for a new one" in caplog.text
    setup.now += SETTLED
    assert not setup.is_ready()
    setup.connections.is_connected = True
    setup.is_ready()
    setup.now += SETTLED
    assert setup.is_ready()


def test_unrelated_nodes_do_not_delay_the_flight(stage):
    setup = stage()
    setup.step()
    for number in range(10):  # rostopic is started repeatedly
        setup.connections.other_connections = {("/clock", f"/rostopic_{number}"), ("/tf", f"/rostopic_{number}")}
        setup.is_ready()
        setup.now += 0.4
    assert setup.is_ready()


def test_start_timeout_does_not_count_a_pause(stage):
    setup = stage(on_timeout="end", start_timeout=5.0)
    setup.connections.is_connected = False
    setup.step()
    assert not setup.is_ready()
    for _ in range(10):  # paused
        setup.now += 1.0
        setup.lockstep.skip_pause()
    assert not setup.is_ready()
    setup.now += 6.0
    with pytest.raises(NoAnswer, match="did not come within 5 s"):
        setup.is_ready()


def test_timeout_does_not_count_a_pause(stage):
    setup = stage(on_timeout="end", timeout=2.0).connect()
    setup.step()
    setup.now += 100.0
    setup.lockstep.skip_pause()
    assert not setup.is_ready()
    setup.now += 3.0
    with pytest.raises(NoAnswer, match="/drone/cmd_vel: /flyer has not answered within 2 s"):
        setup.is_ready()


def test_an_unknown_trigger_is_a_startup_error_and_stops_time_later(stage):
    with pytest.raises(ParameterError, match="no such trigger; near names are front"):
        stage(trigger="fronnt")
    setup = stage(trigger="front").connect()
    setup.set_cameras("back")
    setup.step()
    setup.now += SETTLED
    assert not setup.is_ready()
    assert "no such trigger" in setup.lockstep.finding().message
    setup.set_cameras("front")
    setup.is_ready()
    setup.now += SETTLED
    assert setup.is_ready()


def test_a_topic_without_subscriber_is_a_startup_error_and_stops_time_later(stage):
    setup = stage()
    setup.connections.received = []
    setup.step()
    with pytest.raises(ParameterError, match="nothing listens to /drone/cmd_vel"):
        setup.is_ready()
    setup.connections.received = ["/drone/cmd_vel"]
    setup.now += SETTLED
    assert setup.is_ready()
    setup.connections.received = []  # another scene
    setup.simulation.topology_version += 1
    setup.simulation.run, setup.simulation.steps = 2, 0
    setup.step()
    setup.now += SETTLED
    assert not setup.is_ready()
    assert "nothing listens to /drone/cmd_vel" in setup.lockstep.finding().message


def test_a_step_that_fails_before_publishing_leaves_no_answer_to_ignore(stage):
    setup = stage(timeout=1000.0).connect()
    setup.lockstep.begin_waits()  # then a script fails
    setup.simulation.run, setup.simulation.steps = 2, 0
    setup.step()
    assert not setup.is_ready()
    setup.now += SETTLED
    assert setup.is_ready()


@pytest.mark.parametrize("is_restored", [False, True])
def test_an_answer_to_a_step_before_a_start_or_restore_is_ignored(stage, is_restored):
    setup = stage(every=2).connect()
    setup.step()
    setup.step()
    assert not setup.is_ready()
    if is_restored:
        setup.lockstep.reset()
    else:
        setup.simulation.run, setup.simulation.steps = 2, 0
        setup.step()
    setup.now += 0.2
    assert not setup.is_ready()
    setup.answer("too late")
    assert not setup.texts
    setup.now += SETTLED
    assert setup.is_ready()
    setup.step()
    assert setup.is_ready()
    setup.step()
    setup.answer("in time")
    assert setup.is_ready()
    assert (setup.texts, setup.ignored) == (["in time"], "1 of the last run")
