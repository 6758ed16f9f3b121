"""Lockstep without a master: which message is an answer, and when time stands."""

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
    """What rospy would know: one node publishes cmd_vel and is connected to all triggers."""

    def __init__(self):
        self.sent, self.received, self.is_there, self.others = {}, ["/drone/cmd_vel"], True, set()
        self.opened = []

    def publishers_of(self, _topic):
        if not self.is_there:
            return []
        self.opened.append(SimpleNamespace(callerid_pub=NODE, done=False, socket=1))
        return self.opened[-1:]

    def subscribers_of(self, _topic):
        return [SimpleNamespace(endpoint_id=NODE)] if self.is_there else []

    def received_topics(self):
        return self.received

    def sent_count(self, topic):
        return self.sent.get(topic, 0)

    def all_connections(self):
        return {("/drone/cmd_vel", NODE), *self.others}

    def has_queued(self, _connection):
        return False


class Stage:
    """A lockstep on a simulation that only counts steps, at a time that a test sets."""

    def __init__(self, monkeypatch, **given):
        self.now, self.taken = 0.0, []
        self.connections = Connections()
        monkeypatch.setattr(lockstep_module, "connections", self.connections)
        clock = Clock(0.05)
        self.simulation = SimpleNamespace(run=1, steps=0, time=0.0, topology_version=1, clock=clock)
        self.set_cameras("front")
        self.inbox = Inbox()
        values = parameters.load({"lockstep": {"wait_for": ["cmd_vel"], **given}}).lockstep
        self.lockstep = Lockstep(values, self.simulation, self.inbox, clock=lambda: self.now)
        self.receive = self.lockstep.gate("drone/cmd_vel", self.taken.append)

    def set_cameras(self, *names):
        """Give the vehicle other cameras, as another scene does."""
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
        self.connections.is_there = False
        for each in self.connections.opened:
            each.done = True

    def answer(self, text):
        """Receive a message of the node."""
        self.receive(SimpleNamespace(_connection_header={"callerid": NODE}, text=text))

    def step(self, during=lambda: None):
        """Run a step; a script does `during`."""
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
        return [message.text for message in self.taken]

    @property
    def ignored(self):
        return self.lockstep.finding().values["ignored messages"]


@pytest.fixture(name="stage")
def _stage(monkeypatch):
    return lambda **given: Stage(monkeypatch, **given)


@pytest.mark.parametrize("trigger", ["step", "odom", "4 steps"])
def test_the_answer_lets_the_next_step_begin(stage, trigger):
    one = stage(trigger=trigger).connect()
    for number in range(8):
        one.step()
        if trigger != "4 steps" or number in (3, 7):
            assert not one.is_ready()
            one.answer(number)
        assert one.is_ready()
    assert one.texts == ([3, 7] if trigger == "4 steps" else list(range(8)))


def test_a_script_that_sends_the_clock_within_the_step_is_answered_at_once(stage):
    one = stage(trigger="step").connect()

    def sense():
        one.send("/clock")
        one.answer("early bird")

    one.step(sense)
    assert one.is_ready()
    assert one.texts == ["early bird"]


def test_a_script_that_sends_the_clock_does_not_make_later_answers_early(stage):
    one = stage(trigger="step").connect()
    one.lockstep.begin_waits()
    one.simulation.steps += 1
    one.send("/clock")  # by the script; the node publishes no second one for the same time
    one.lockstep.begin_late_waits()
    one.answer("an answer")
    assert one.is_ready()


def test_an_answer_to_odometry_needs_odometry(stage):
    one = stage(trigger="odom").connect()
    one.step(lambda: one.answer("to something else"))
    assert not one.is_ready()
    one.answer("to the odometry")
    assert one.is_ready()
    assert (one.texts, one.ignored) == (["to the odometry"], "1 early")


def test_a_step_without_a_picture_is_not_awaited(stage):
    one = stage(trigger="front").connect()
    one.step()
    assert one.is_ready()

    def look():
        one.camera.image = "a picture"

    one.step(look)
    assert not one.is_ready()
    one.answer("to the picture")
    assert one.is_ready()


def test_an_answer_whose_execution_fails_is_still_an_answer(stage, caplog):
    one = stage().connect()

    def fail(_message):
        raise KeyError("a fault of our own")

    one.receive = one.lockstep.gate("drone/cmd_vel", fail)
    one.step()
    one.answer("anything")
    assert one.is_ready()
    assert "a fault of our own" in caplog.text


def test_time_stands_until_the_nodes_are_connected_and_says_why(stage, caplog):
    one = stage()
    one.connections.is_there = False
    one.step()
    one.now += SETTLED
    assert not one.is_ready()
    assert "time stands at 0.05 s until there is a publisher of /drone/cmd_vel" in one.lockstep.finding().message
    one.connections.is_there = True
    one.connections.others = {("/drone/odom", NODE)}  # the node has just connected
    assert not one.is_ready()
    assert one.lockstep.finding().message == "time stands at 0.05 s until connections have settled"
    one.now += SETTLED
    assert one.is_ready()


@pytest.mark.parametrize("is_before_the_step", [False, True])
def test_a_node_that_has_gone_is_named_and_a_new_one_is_taken(stage, caplog, is_before_the_step):
    one = stage().connect()
    one.step()
    one.answer("an answer")
    assert one.is_ready()
    one.connections.is_there = not is_before_the_step
    one.step()
    if not is_before_the_step:
        one.close_connections()
    assert not one.is_ready()
    assert "/drone/cmd_vel: /flyer has gone (the stamp is 0.15 s); waiting for a new one" in caplog.text
    one.now += SETTLED
    assert not one.is_ready()
    one.connections.is_there = True
    one.is_ready()
    one.now += SETTLED
    assert one.is_ready()


def test_nodes_that_have_nothing_to_do_with_the_flight_do_not_delay_it(stage):
    one = stage()
    one.step()
    for number in range(10):  # rostopic, again and again
        one.connections.others = {("/clock", f"/rostopic_{number}"), ("/tf", f"/rostopic_{number}")}
        one.is_ready()
        one.now += 0.4
    assert one.is_ready()


def test_start_timeout_does_not_count_a_pause(stage):
    one = stage(on_timeout="end", start_timeout=5.0)
    one.connections.is_there = False
    one.step()
    assert not one.is_ready()
    for _ in range(10):  # paused
        one.now += 1.0
        one.lockstep.skip_pause()
    assert not one.is_ready()
    one.now += 6.0
    with pytest.raises(NoAnswer, match="did not come within 5 s"):
        one.is_ready()


def test_timeout_does_not_count_a_pause(stage):
    one = stage(on_timeout="end", timeout=2.0).connect()
    one.step()
    one.now += 100.0
    one.lockstep.skip_pause()
    assert not one.is_ready()
    one.now += 3.0
    with pytest.raises(NoAnswer, match="/drone/cmd_vel: /flyer has not answered within 2 s"):
        one.is_ready()


def test_an_unknown_trigger_is_an_error_at_startup_and_lets_time_stand_in_another_scene(stage):
    with pytest.raises(ParameterError, match="no such trigger; near names are front"):
        stage(trigger="fronnt")
    one = stage(trigger="front").connect()
    one.set_cameras("back")
    one.step()
    one.now += SETTLED
    assert not one.is_ready()
    assert "no such trigger" in one.lockstep.finding().message
    one.set_cameras("front")
    one.is_ready()
    one.now += SETTLED
    assert one.is_ready()


def test_a_topic_without_a_listener_is_an_error_at_startup_and_lets_time_stand_later(stage):
    one = stage()
    one.connections.received = []
    one.step()
    with pytest.raises(ParameterError, match="nothing listens to /drone/cmd_vel"):
        one.is_ready()
    one.connections.received = ["/drone/cmd_vel"]
    one.now += SETTLED
    assert one.is_ready()
    one.connections.received = []  # another scene
    one.simulation.topology_version += 1
    one.simulation.run, one.simulation.steps = 2, 0
    one.step()
    one.now += SETTLED
    assert not one.is_ready()
    assert "nothing listens to /drone/cmd_vel" in one.lockstep.finding().message


def test_a_step_that_failed_before_it_was_published_leaves_nothing_to_ignore(stage):
    one = stage(timeout=1000.0).connect()
    one.lockstep.begin_waits()  # then a script fails
    one.simulation.run, one.simulation.steps = 2, 0
    one.step()
    assert not one.is_ready()
    one.now += SETTLED
    assert one.is_ready()


@pytest.mark.parametrize("is_restored", [False, True])
def test_an_answer_from_before_a_start_or_a_restore_is_ignored(stage, is_restored):
    one = stage(every=2).connect()
    one.step()
    one.step()
    assert not one.is_ready()
    if is_restored:
        one.lockstep.reset()
    else:
        one.simulation.run, one.simulation.steps = 2, 0
        one.step()
    one.now += 0.2
    assert not one.is_ready()
    one.answer("too late")
    assert not one.texts
    one.now += SETTLED
    assert one.is_ready()
    one.step()
    assert one.is_ready()
    one.step()
    one.answer("in time")
    assert one.is_ready()
    assert (one.texts, one.ignored) == (["in time"], "1 of the last run")
