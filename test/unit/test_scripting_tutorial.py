"""The tutorial's Lua scripts give the same flight as the built-in Python script."""

from pathlib import Path

import pytest
from recorder import Recorder

from drone_sim.files.resources import package_path
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

STAGES = Path(package_path() / "docs" / "tutorial")
STEPS = 1200  # 60 s
SMALL = {"front": {"width": 16, "height": 12}}


def pose(position, rpy):
    return Pose(position, frames.to_quaternion(frames.from_rpy((0, 0, 0), rpy)))


EVENTS = {
    20: lambda drone: drone.commands.receive(Twist(Vector3(1, 0, 0))),
    120: lambda drone: drone.commands.receive(Twist(Vector3(0, -1, 0.5), Vector3(0, 0, 0.7))),
    250: lambda drone: drone.commands.receive(Twist(Vector3(-0.5, 0.4, -0.3), Vector3(0, 0, -0.4))),
    380: lambda drone: drone.commands.receive(Twist()),
    500: lambda drone: drone.body.move(pose((0, 0, 2.4), (0.3, 0.2, 1))),
    700: lambda drone: drone.commands.receive(Twist(Vector3(0, 0, 0), Vector3(0, 0, 1))),
    850: lambda drone: drone.body.move(pose((1, 0, 1.5), (-0.3, 0.4, -2))),
}


def fly(script, steps=STEPS, backend=None):
    values = parameters.load({"control": {"thrust_limits": None}, "cameras": SMALL})
    simulation = Simulation(values, script=script, backend=backend)
    path = []
    try:
        for step in range(steps):
            if step in EVENTS:
                EVENTS[step](simulation.drone)
            simulation.step()
            path.append(simulation.drone.body.state.position)
        return path
    finally:
        simulation.close()


@pytest.fixture(name="built_in", scope="module")
def _built_in():
    path = fly("")
    assert max(abs(value) for position in path for value in position) < 50, "the reference flight is out of control"
    return path


@pytest.mark.parametrize("script", ["tutorial_v3", "tutorial_v4"])
def test_lua_script_gives_the_same_flight_as_the_python_script(script, built_in):
    path = fly(script)
    worst = max(abs(a - b) for ours, theirs in zip(path, built_in) for a, b in zip(ours, theirs))
    assert len(path) == STEPS and worst < 1e-9


def test_lua_tutorial_publishes_its_camera_image():
    backend = Recorder()
    fly("tutorial_v3", steps=3, backend=backend)
    topic, kind, image = backend.published[-1]
    assert (topic, kind, len(backend.published)) == ("/drone/front", "sensor_msgs/Image", 3)
    assert (image.pixels.shape, image.frame_id) == ((12, 16, 3), "drone front")
    top, bottom = image.pixels[0], image.pixels[-1]
    assert top.mean() > bottom.mean(), "the sky is brighter than the floor: the top row comes first"


@pytest.mark.parametrize("script", ["template_v3", "template_v4", "target_v3", "target_v4"])
def test_every_built_in_lua_script_holds_the_drones_position(script):
    path = fly(script, steps=20)
    assert path[-1] == pytest.approx(path[0], abs=0.01)


def test_lua_stages_hold_the_quantities_that_they_control():
    """Stage 1 has constant thrust and sinks slowly; later stages hold the height; stage 6 follows commands."""
    flights = {file.stem: fly(str(file), steps=60) for file in sorted(STAGES.glob("*.lua"))}
    assert list(flights) == ["1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros"]
    assert flights["1_thrust"] == fly(str(STAGES / "1_thrust.py"), steps=60)
    for stage in ("2_elevation", "3_yaw", "4_pitch", "5_roll"):
        assert flights[stage][-1] == pytest.approx((0, 0, 0.8), abs=0.01)
    assert flights["6_ros"] == fly("tutorial_v3", steps=60)
    assert flights["6_ros"][-1][0] > 1
