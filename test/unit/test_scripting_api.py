"""Functions of `sim`: objects, signals, forces, images and drawings."""

import logging

import numpy as np
import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.scripting.api.calls import UnknownName
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

SMALL = {"front": {"width": 8, "height": 6}}
PICTURE = np.array([[[255, 0, 0]] * 3, [[0, 0, 255]] * 3], dtype=np.uint8)  # red above, blue below


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    return new_simulation({"cameras": SMALL, "gravity": 0.0}, python="")


@pytest.fixture(name="sim")
def _sim(simulation):
    return make_sim(
        simulation.child_scripts["drone"],
        SceneServices({"FrontVision": lambda *_: PICTURE}, operations=simulation.operations),
    )


@pytest.fixture(name="base")
def _base(sim):
    return sim.getObject("/Quadcopter/base")


def test_positions_and_orientations(simulation, sim, base):
    simulation.drone.body.move(Pose((1, 2, 3), frames.to_quaternion(frames.from_euler((0, 0, 0), (0.1, 0.2, 0.3)))))
    heli = sim.getObject(".")
    assert sim.getObjectPosition(heli) == pytest.approx([1, 2, 3])
    assert sim.getObjectOrientation(base, -1) == pytest.approx([0.1, 0.2, 0.3])
    assert sim.getObjectPosition(base, heli) == pytest.approx([0, 0, -0.01])
    assert sim.getObjectPosition(base, sim.handle_parent) == pytest.approx([0, 0, -0.01])
    m = sim.getObjectMatrix(base, sim.handle_world)
    assert m[3::4] == pytest.approx(sim.getObjectPosition(base))
    assert sim.multiplyVector(sim.getMatrixInverse(m), m[3::4]) == pytest.approx([0, 0, 0], abs=1e-12)
    assert sim.multiplyMatrices(m, sim.getInvertedMatrix(m)) == pytest.approx(list(frames.IDENTITY), abs=1e-12)
    assert sim.buildMatrix(sim.getObjectPosition(base), sim.getEulerAnglesFromMatrix(m)) == pytest.approx(m)
    assert sim.getObjectPose(base)[3:] == pytest.approx(sim.getObjectQuaternion(base))


@pytest.mark.parametrize("order", ["3.x", "4.x", "world left out"])
def test_setters_take_their_arguments_in_either_order(sim, order):
    target = sim.getObject("/target")
    sim.setObjectParent(target, -1, True)

    def arguments(values):
        return {"3.x": (-1, values), "4.x": (values, -1), "world left out": (values,)}[order]

    sim.setObjectPosition(target, *arguments([1, 2, 3]))
    sim.setObjectOrientation(target, *arguments([0.1, -0.2, 0.3]))
    assert sim.getObjectPosition(target) == [1, 2, 3]
    assert sim.getObjectOrientation(target) == pytest.approx([0.1, -0.2, 0.3])
    sim.setObjectPose(target, *arguments([0, 0, 1, 0, 0, 0, 2]))
    assert sim.getObjectMatrix(target) == pytest.approx([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1])
    sim.setObjectMatrix(target, *arguments(list(frames.from_euler((3, 2, 1), (0, 0, 1)))))
    assert sim.getObjectOrientation(target) == pytest.approx([0, 0, 1])
    sim.setObjectQuaternion(target, *arguments([0, 0, 0, 1]))
    assert sim.getObjectOrientation(target) == pytest.approx([0, 0, 0])


def test_names(sim, base):
    assert (sim.getObjectName(base), sim.getObjectAlias(base), sim.getObjectAlias(base, 1)) == (
        "Quadricopter_base",
        "base",
        "/Quadcopter/base",
    )
    assert sim.getObjectParent(base) == sim.getObject("/Quadcopter")
    assert sim.getObject("/nothing", {"noError": True}) == -1
    suffixes = [sim.getNameSuffix(name) for name in ("Drone", "Drone#", "Drone#2", None)]
    assert suffixes == [(-1, "Drone"), (-1, "Drone"), (2, "Drone"), -1]
    assert sim.getObjectSizeFactor(base) == 1


def test_scripts(sim):
    own = sim.getScriptHandle("Drone")
    assert sim.getScriptHandle() == sim.getScriptHandle("Quadricopter") == own
    propeller = sim.getScriptHandle("Quadricopter_propeller_respondable2")
    assert sim.getScriptHandle("/propeller[1]/respondable") == propeller
    assert sim.getObjectName(sim.getObjectAssociatedWithScript(propeller)) == "Quadricopter_propeller_respondable2"
    sim.setScriptSimulationParameter(propeller, "particleVelocity", "5.5")
    assert sim.getScriptSimulationParameter(propeller, "particleVelocity") == 5.5
    sim.setScriptSimulationParameter(sim.handle_tree, "particlesAreVisible", "false")
    assert sim.getScriptSimulationParameter(sim.handle_self, "particlesAreVisible") is False
    with pytest.raises(ValueError, match="near names are particleVelocity"):
        sim.getScriptSimulationParameter(propeller, "particleVelocty")
    with pytest.raises(ValueError, match="no script is attached to 'FrontVision'"):
        sim.getScriptHandle("FrontVision")


def test_signals(sim):
    sim.setFloatSignal("a", 1)
    sim.setInt32Signal("a", 2)
    sim.setStringSignal("a", "three")
    assert (sim.getFloatSignal("a"), sim.getIntegerSignal("a"), sim.getStringSignal("a")) == (1.0, 2, "three")
    sim.clearIntegerSignal("a")
    sim.clearFloatSignal()
    assert (sim.getFloatSignal("a"), sim.getInt32Signal("a"), sim.getStringSignal("a")) == (None, None, "three")
    sim.clearStringSignal("a")
    sim.clearStringSignal("a")
    assert sim.getStringSignal("a") is None
    with pytest.raises(TypeError, match="a string is expected"):
        sim.setStringSignal("a", [1])


def test_a_force_accelerates_and_lasts_one_step(simulation, sim):
    mass = 0.52
    sim.addForceAndTorque(sim.getObject("/Quadcopter"), [0.52, 0, 0], [0, 0, 0])
    simulation.step()
    speed = simulation.drone.body.state.linear_velocity[0]
    assert speed == pytest.approx(0.52 / mass * 0.05, rel=0.05)
    simulation.step()
    assert simulation.drone.body.state.linear_velocity[0] == pytest.approx(speed, rel=1e-3)


def test_a_force_at_a_propeller_acts_at_its_centre_of_mass(simulation, sim):
    """The torque about z of a force along x at (0.09192, 0.09192) is -0.09192 F; inertia 8.93e-3."""
    sim.addForceAndTorque(sim.getObject("/propeller[0]/respondable"), [0.1, 0, 0])
    simulation.step()
    assert simulation.drone.body.state.angular_velocity[2] == pytest.approx(-0.09192 * 0.1 / 8.93e-3 * 0.05, rel=1e-2)


def test_add_force_is_given_in_the_frame_of_the_body(simulation, sim):
    simulation.drone.body.move(
        Pose((0, 0, 2), frames.to_quaternion(frames.from_rpy((0, 0, 0), (0, 0, 1.5707963267948966))))
    )
    sim.addForce(sim.getObject("/Quadcopter"), [0, 0, 0], [0.52, 0, 0])
    simulation.step()
    x, y, _ = simulation.drone.body.state.linear_velocity
    assert y == pytest.approx(0.05, rel=0.05) and abs(x) < 1e-6


def test_forces_on_static_shapes_are_refused(sim):
    with pytest.raises(ValueError, match="'Floor' is not a dynamic shape"):
        sim.addForceAndTorque(sim.getObject("/Floor"), [0, 0, 1], [0, 0, 0])
    with pytest.raises(ValueError, match="is not a joint"):
        sim.setJointPosition(sim.getObject("/Floor"), 1)


def test_get_velocity_returns_the_velocity_of_the_dynamics(simulation, sim, base):
    sim.addForceAndTorque(sim.getObject("."), [0, 0.1, 0], [0, 0, 0.001])
    simulation.step()
    linear, angular = sim.getVelocity(base)
    state = simulation.drone.body.state
    swing = frames.cross(state.angular_velocity, frames.rotate(state.matrix, (0, 0, -0.01)))
    assert linear == pytest.approx([a + b for a, b in zip(state.linear_velocity, swing)], abs=1e-12)
    assert angular == pytest.approx(simulation.drone.body.state.angular_velocity)


def test_images_come_with_the_bottom_row_first(sim):
    front = sim.getObject("/FrontVision")
    image, width, height = sim.getVisionSensorCharImage(front)
    assert (width, height, image) == (3, 2, bytes([0, 0, 255] * 3 + [255, 0, 0] * 3))
    assert sim.getVisionSensorImg(front) == (image, [3, 2])
    assert sim.getVisionSensorRes(front) == sim.getVisionSensorResolution(front) == [3, 2]
    assert sim.handleVisionSensor(sim.handle_all) == (0, (), ())
    with pytest.raises(TypeError, match="'Drone' is not a vision sensor; there are: FrontVision"):
        sim.getVisionSensorCharImage(sim.getObject("."))


def test_calls_that_cannot_draw_are_logged_once(sim, caplog):
    with caplog.at_level(logging.DEBUG, "drone_sim.script"):
        first = sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 10)
        second = sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 10)
        for _ in range(3):
            assert sim.addDrawingObjectItem(first, [0, 0, 0]) is None
    assert first != second
    messages = [record.getMessage() for record in caplog.records]
    assert [line.partition(":")[0] for line in messages] == ["sim.addDrawingObject", "sim.addDrawingObjectItem"]


@pytest.fixture(name="drawings")
def _drawings(simulation):
    simulation.context.drawings = Drawings()
    return simulation.context.drawings


def test_drawing_objects_store_items_up_to_their_maximum(drawings, sim, caplog):
    path = sim.addDrawingObject(sim.drawing_linestrip + sim.drawing_50percenttransparency, 2, 0, -1, 3, [1, 0, 0])
    for x in range(5):
        sim.addDrawingObjectItem(path, [x, 0, 1])
    assert drawings.objects[path].kind == "linestrip" and drawings.objects[path].rgba == (1, 0, 0, 0.5)
    assert list(drawings.objects[path].items) == [(0, 0, 1), (1, 0, 1), (2, 0, 1)], "a full object drops new items"
    sim.addDrawingObjectItem(path, None)
    assert not drawings.objects[path].items
    last = sim.addDrawingObject(sim.drawing_discpoints | sim.drawing_cyclic | sim.drawing_itemsizes, 0.2, 0.1, -1, 2)
    for x in (0, 0.01, 1, 2):
        sim.addDrawingObjectItem(last, [x, 0, 0.002, 0, 0, 1, 0.2])
    assert list(drawings.objects[last].items) == [(1, 0, 0.002, 0, 0, 1), (2, 0, 0.002, 0, 0, 1)], "drops the oldest"
    sim.removeDrawingObject(path)
    assert list(drawings.objects) == [last]
    assert not caplog.records
    sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 10**9)
    assert "maxItemCount = 1000000000" in caplog.text
    sim.addParticleObject(sim.particle_points1, 1)
    assert "accepted and ignored" in caplog.text


def test_invalid_drawing_calls_are_refused(drawings, sim):
    lines = sim.addDrawingObject(sim.drawing_lines, 1, 0, -1, 10)
    with pytest.raises(ValueError, match="an item of lines must have 6 numbers, not 3"):
        sim.addDrawingObjectItem(lines, [1, 2, 3])
    with pytest.raises(TypeError, match="finite numbers are expected"):
        sim.addDrawingObjectItem(lines, [float("nan")] * 6)
    with pytest.raises(ValueError, match="no drawing object with the handle 99"):
        sim.addDrawingObjectItem(99, [1, 2, 3])
    with pytest.raises(ValueError, match="31 is not a type of drawing object"):
        sim.addDrawingObject(31, 1)


def test_a_stop_removes_all_drawings(new_simulation):
    drawings = Drawings()
    draw = "sim.addDrawingObjectItem(sim.addDrawingObject(sim.drawing_points, 1), [1, 2, 3])"
    simulation = new_simulation(python=f"def sysCall_init(): {draw}", drawings=drawings)
    assert len(drawings.objects) == 1
    simulation.stop()
    assert not drawings.objects


def test_unknown_functions_and_constants_list_the_near_ones(sim):
    with pytest.raises(UnknownName, match="sim has no 'getObjctHandle'; near names are getObjectHandle"):
        sim.getObjctHandle("x")
    assert not hasattr(sim, "nothing_of_the_kind")


def test_a_camera_takes_one_picture_per_step_for_a_script(new_simulation):
    look = "sim.getVisionSensorCharImage(sim.getObject('/FrontVision'))"
    simulation = new_simulation({"cameras": SMALL}, python=f"def sysCall_sensing():\n    assert {look} == {look}")
    camera, picture_steps = simulation.drone.cameras["front"], []
    take = camera.take
    camera.take = lambda *kind: picture_steps.append(simulation.steps) or take(*kind)
    simulation.step()
    simulation.step()
    camera.viewers.add(lambda: True)
    simulation.step()
    assert picture_steps == [1, 2, 3]
