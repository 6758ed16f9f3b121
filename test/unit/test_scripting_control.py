"""Scripts that control the simulation, draw, store data and use ROS."""

import numpy as np
import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.run.player import Player
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_sim_ros

CONTROL_SCRIPT = """
sim = require 'sim'
function sysCall_init() states = {sim.getSimulationState()} end
function sysCall_sensing()
  states[#states + 1] = sim.getSimulationState()
  if sim.getSimulationTime() > 0.07 then sim.%s() end
  stopping = sim.getSimulationStopping()
end
function sysCall_cleanup()
  states[#states + 1] = sim.getSimulationState()
  print(table.concat(states, ' ') .. ' ' .. tostring(stopping))
end
"""


@pytest.fixture
def play_script(new_simulation):
    def play(text):
        simulation, states = new_simulation(lua=text), []
        player = Player(simulation, states.append, simulated_time=False)
        while player.playing and simulation.steps < 10:
            player.step()
        return simulation, states

    return play


def test_a_script_stops_the_simulation(play_script, caplog):
    simulation, states = play_script(CONTROL_SCRIPT % "stopSimulation")
    assert states == ["flying", "stopped"] and not simulation.running
    assert "16 17 17 17 22 true" in caplog.messages, "first after stop, running, last before stop"
    assert simulation.context.control.asked == ""


def test_a_script_pauses_the_simulation(play_script):
    simulation, states = play_script(CONTROL_SCRIPT % "pauseSimulation")
    assert states == ["flying", "paused"] and simulation.steps == 3


def test_an_error_in_cleanup_does_not_hide_the_first_error(play_script, caplog):
    """The cockpit shows the last error of the log; that must be the cause."""
    fails = "function sysCall_actuation() x.y = 1 end function sysCall_cleanup() z.y = 1 end"
    simulation, _ = play_script(fails)
    logs = {record.levelname: record.getMessage() for record in caplog.records if "script error" in record.getMessage()}
    assert "[actuation]" in logs["ERROR"] and "[cleanup]" in logs["WARNING"]
    assert simulation.running is False


DRAWING_SCRIPT = """
def sysCall_init():
    self.drawn = sim.addDrawingObject(sim.drawing_discpts, 0.1, 0, sim.getObject('/target'), 5)
    self.local_one = sim.addDrawingObject(sim.drawing_points + sim.drawing_local, 1, 0, sim.getObject('/target'), 5)
    sim.addDrawingObjectItem(self.drawn, [1, 0, 0, 0, 0, 0, 1])
    sim.addDrawingObjectItem(self.local_one, [1, 0, 0])
    self.end = sim.tubeOpen(0, 'a', 3), sim.tubeOpen(0, 'a', 3)
def sysCall_sensing():
    drone = sim.getObject('.')
    count = int(sim.readCustomDataBlock(drone, 'count') or 0)
    sim.writeCustomDataBlock(drone, 'count', str(count + 1))
    sim.tubeWrite(self.end[0], 'x')
    sim.setFloatSignal('waiting', sim.tubeStatus(self.end[0])[2])
"""


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    return new_simulation({"gravity": 0.0}, python=DRAWING_SCRIPT, drawings=Drawings())


def test_drawings_move_with_their_parent(simulation):
    turned, local = simulation._drawings.objects.values()
    x, y, z = simulation.drone.body.state.position
    assert turned.in_world() == [pytest.approx((1, 0, 0, 0, 0, 1))], "a quaternion becomes a normal"
    assert local.in_world() == [pytest.approx((x + 1, y, z - 0.01))]
    simulation.drone.target.put(frames.from_rpy((5, 0, 0), (0, 0, np.pi / 2)))
    assert local.in_world() == [pytest.approx((5, 1, 0))]
    assert turned.in_world() == [pytest.approx((5 - y, 1 - x, 0.01 - z, 0, 0, 1))]
    assert simulation._drawings.carried


def test_custom_data_and_tubes_are_in_snapshots_and_end_with_the_run(simulation):
    data = simulation.context
    simulation.step()
    saved_state = simulation.snapshot()
    for _ in range(2):
        simulation.step()
    assert list(data.data.values.values()) == ["3"] and simulation.context.signals.get(float, "waiting") == 3
    simulation.restore(saved_state)
    simulation.step()
    assert list(data.data.values.values()) == ["2"] and simulation.context.signals.get(float, "waiting") == 2
    simulation.stop()
    assert not data.data.values


class Ros:
    def __init__(self):
        self.parameters, self.sent = {"/drone/gain": 2}, []

    def time(self):
        return 12.5

    def send_transforms(self, transforms):
        self.sent += transforms

    def parameter(self, name):
        return self.parameters.get(name)

    def set_parameter(self, name, value):
        self.parameters[name] = value

    def delete_parameter(self, name):
        self.parameters.pop(name, None)

    def call_service(self, name, kind, request):
        return {"name": name, "kind": kind, **request}


def test_ros_is_reached_through_the_backend():
    bus = MessageBus("drone")
    bus.backend = ros = Ros()
    sim_ros = make_sim_ros(bus, Clock(0.05))
    assert sim_ros.getTime() == 12.5
    assert sim_ros.getParamInt("gain") == (True, 2) and sim_ros.getParamDouble("gain") == (True, 2.0)
    assert sim_ros.getParamString("gain", "none") == (False, "none"), "the parameter has another type"
    sim_ros.setParamString("/who", "x")
    assert ros.parameters["/who"] == "x" and sim_ros.searchParam("who") == (True, "/who")
    sim_ros.deleteParam("/who")
    assert not sim_ros.hasParam("/who")
    sim_ros.sendTransform({"child_frame_id": "a"})
    assert ros.sent == [{"child_frame_id": "a"}]
    reset = sim_ros.serviceClient("reset", "std_srvs/Trigger")
    assert sim_ros.call(reset, {"x": 1}) == {"name": "/drone/reset", "kind": "std_srvs/Trigger", "x": 1}
