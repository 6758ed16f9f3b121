"""Joint dynamics against closed forms, and the script functions for joints."""

import itertools
import math

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

SCENE = """
objects:
  # a pendulum of 1 m, which swings about the world's y axis
  - {name: Bob, shape: sphere, size: [0.1], mass: 2, parent: Pivot, position: [0, -1, 0],
     inertia: {moments: [0.1, 0.1, 0.1]}}
  - {name: Pivot, kind: joint, type: revolute, mode: passive, value: 0.1, parent: Beam,
     rpy: [1.5707963267948966, 0, 0]}
  - {name: Beam, shape: box, size: [0.1, 0.1, 0.1], position: [4, 0, 3]}
  # a lift, held at a height by a motor
  - {name: Lift, kind: joint, type: prismatic, mode: position, limits: [0, 2], target: 0.5, max_force: 100,
     position: [8, 0, 1]}
  - {name: Cabin, shape: box, size: [0.2, 0.2, 0.2], mass: 3, parent: Lift, position: [0, 0, 0]}
  # a flywheel about the vertical, the axis through its centre
  - {name: Axle, kind: joint, type: revolute, mode: force, target: 0.5, position: [12, 0, 1]}
  - {name: Flywheel, shape: cylinder, size: [0.5, 0.1], mass: 8, parent: Axle, position: [0, 0, 0],
     inertia: {moments: [0.5, 0.5, 1]}}
  # a cart on one driven wheel and a skid without friction to speak of: a free root
  - {name: Cart, shape: box, size: [0.6, 0.1, 0.1], mass: 1, position: [16, 0, 0.25]}
  - {name: Left, kind: joint, type: revolute, mode: velocity, target: 2, max_force: 20, parent: Cart,
     position: [0, 0.3, -0.05], rpy: [-1.5707963267948966, 0, 0]}
  - {name: Right, kind: joint, type: revolute, mode: velocity, target: 2, max_force: 20, parent: Cart,
     position: [0, -0.3, -0.05], rpy: [-1.5707963267948966, 0, 0]}
  - {name: LeftWheel, shape: cylinder, size: [0.2, 0.05], mass: 1, parent: Left, position: [0, 0, 0]}
  - {name: RightWheel, shape: cylinder, size: [0.2, 0.05], mass: 1, parent: Right, position: [0, 0, 0]}
  - {name: Lamp, kind: dummy, parent: LeftWheel, position: [0.2, 0, 0]}
  # a shelf on a force sensor, and what holds it
  - {name: Wall, shape: box, size: [0.1, 0.1, 0.1], position: [20, 0, 2]}
  - {name: Gauge, kind: force_sensor, parent: Wall, position: [0.1, 0, 0]}
  - {name: Shelf, shape: box, size: [0.6, 0.2, 0.02], mass: 2, parent: Gauge, position: [0.3, 0, 0]}
  - {name: Loose, shape: box, size: [0.1, 0.1, 0.1], mass: 1, parent: Bob, position: [2, 0, 0]}
"""


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    return new_simulation({"drone": {"position": [-5, 0, 1]}}, scene=SCENE)


def find(simulation, name):
    objects = simulation.context.objects
    return objects[objects.handle(name)]


def sim_of(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def run(simulation, seconds):
    """Run for `seconds` and return {joint: [position after each step]}."""
    joints = {name: find(simulation, name) for name in ("Pivot", "Lift", "Axle", "Left", "Right")}
    history = {name: [] for name in joints}
    for _ in range(round(seconds / 0.05)):
        simulation.step()
        for name, joint in joints.items():
            history[name].append(joint.value)
    return history


def zeros(values, step):
    """Return the times of the upward zero crossings, linearly interpolated."""
    pairs = itertools.pairwise(values)
    return [
        step * (index + before / (before - after)) for index, (before, after) in enumerate(pairs) if before < 0 <= after
    ]


def test_joints_move_as_in_closed_forms(simulation):
    assert find(simulation, "Axle").velocity_along == 0
    history = run(simulation, 2)
    rolling = find(simulation, "Cart").matrix()[3]
    for name, positions in run(simulation, 4).items():
        history[name] += positions
    first, *_, last = crossings = zeros(history["Pivot"], 0.05)
    period = 2 * math.pi * math.sqrt((2 * 1 + 0.1) / (2 * 9.81)) * (1 + 0.1**2 / 16)
    assert (last - first) / (len(crossings) - 1) == pytest.approx(period, rel=0.002), "physical pendulum"
    assert history["Lift"][-1] == pytest.approx(0.5, abs=1e-6), "the motor holds it against gravity"
    assert find(simulation, "Lift").drive.state()[2] == pytest.approx(3 * 9.81, rel=1e-3)
    assert find(simulation, "Axle").velocity_along == pytest.approx(0.5 * 6 / 1.0, rel=1e-6), "0.5 N m on 1 kg m2"
    assert find(simulation, "Left").velocity_along == pytest.approx(2, abs=0.01)
    assert find(simulation, "Cart").matrix()[3] - rolling == pytest.approx(4 * 2 * 0.2, rel=0.02), "the cart rolls"
    assert find(simulation, "Loose").matrix()[11] < 0.1, "a dynamic child falls by itself"
    wheel, lamp = (find(simulation, name).matrix()[3::4] for name in ("LeftWheel", "Lamp"))
    assert math.dist(wheel, lamp) == pytest.approx(0.2), "a child of the wheel turns with it"
    force, torque = find(simulation, "Gauge").read()
    assert force == pytest.approx((0, 0, -2 * 9.81), abs=1e-6), "the weight"
    assert torque == pytest.approx((0, 0.3 * 2 * 9.81, 0), abs=1e-6), "weight times lever arm"
    assert find(simulation, "Shelf").matrix()[3::4] == pytest.approx((20.4, 0, 2)), "the sensor holds it"
    _, turning = find(simulation, "LeftWheel").velocity()
    assert turning[1] == pytest.approx(2, abs=0.2)


def test_scripts_command_joints(simulation):
    sim, handle = sim_of(simulation), simulation.context.objects.handle
    lift, axle, pivot = handle("Lift"), handle("Axle"), handle("Pivot")
    assert sim.getJointType(lift) == 11 and sim.getJointType(axle) == 10
    assert sim.getJointInterval(lift) == (False, [0, 2]) and sim.getJointInterval(axle)[0] is True
    assert sim.getJointMode(lift) == (5, 0)
    sim.setJointTargetPosition(lift, 1.5)
    sim.setJointTargetForce(axle, -0.25)
    sim.setJointMode(pivot, 0)
    sim.setJointPosition(pivot, 0.7)
    run(simulation, 3)
    assert sim.getJointPosition(lift) == pytest.approx(1.5, abs=1e-3)
    assert sim.getJointVelocity(axle) == pytest.approx(-0.75, rel=1e-6)
    assert sim.getJointPosition(pivot) == pytest.approx(0.7, abs=1e-3), "it stays where it was set"
    assert sim.getJointForce(lift) == pytest.approx(3 * 9.81, rel=1e-2)
    sim.setJointMaxForce(lift, 20)
    sim.setJointInterval(lift, False, [0.2, 1.8])
    sim.setJointMode(pivot, 5)
    run(simulation, 3)
    assert sim.getJointTargetPosition(lift) == 1.5 and sim.getJointMaxForce(lift) == 20
    assert sim.getJointPosition(lift) == pytest.approx(0.2, abs=0.01), "the weak lift rests on its new lower limit"
    assert abs(sim.getJointPosition(pivot) - 0.7) > 0.01, "the pendulum swings again"
    with pytest.raises(ValueError, match=r"'Cabin' is held by 'Lift'"):
        sim.setObjectPosition(handle("Cabin"), -1, [0, 0, 0])
    with pytest.raises(TypeError, match="'Cabin' is not a joint of the scene; there are: Pivot, Lift"):
        sim.getJointType(handle("Cabin"))
    with pytest.raises(TypeError, match="finite"):
        sim.setJointTargetVelocity(axle, math.inf)
    blades = handle("Quadricopter_propeller_joint1")
    sim.setJointPosition(blades, 0.5)
    assert sim.getJointPosition(blades) == 0.5, "blades are only visual"


def test_scripts_read_and_set_parameters_of_joints_and_shapes(simulation):
    sim, handle = sim_of(simulation), simulation.context.objects.handle
    left, cabin, loose = handle("Left"), handle("Cabin"), handle("Loose")
    motor, control, static = (sim.jointintparam_motor_enabled, sim.jointintparam_ctrl_enabled, sim.shapeintparam_static)
    assert [sim.getObjectInt32Param(left, one) for one in (motor, control)] == [1, 0]
    sim.setObjectInt32Param(left, control, 1)
    assert find(simulation, "Left").control.mode == "position"
    sim.setObjectInt32Param(left, control, 0)
    sim.setObjectInt32Param(left, motor, 0)
    assert find(simulation, "Left").control.mode == "passive"
    sim.setObjectInt32Param(left, motor, 1)
    assert find(simulation, "Left").control.mode == "velocity"
    assert (sim.getShapeMass(cabin), sim.getShapeMass(loose), sim.getShapeMass(handle("Beam"))) == (3, 1, 0)
    sim.setObjectInt32Param(loose, static, 1)
    assert sim.getObjectInt32Param(loose, static) == 1 and find(simulation, "Loose").is_static
    sim.setObjectInt32Param(loose, static, 0)
    sim.resetDynamicObject(sim.handle_all)


def test_snapshots_and_restarts_repeat_joint_motion_exactly(simulation):
    first = run(simulation, 1)
    sim, handle = sim_of(simulation), simulation.context.objects.handle
    snapshot = simulation.snapshot()
    second_run = run(simulation, 1)
    sim.setJointTargetVelocity(handle("Left"), -5)
    sim.setJointMode(handle("Axle"), 0)
    sim.setJointInterval(handle("Lift"), False, [0, 0.1])
    run(simulation, 0.5)
    simulation.restore(snapshot)
    assert run(simulation, 1) == second_run
    sim.setJointInterval(handle("Lift"), False, [0, 0.1])
    simulation.start()
    assert run(simulation, 1) == first


def test_moving_the_root_moves_the_whole_tree(simulation):
    sim, handle = sim_of(simulation), simulation.context.objects.handle
    before = [find(simulation, name).matrix()[3::4] for name in ("Bob", "LeftWheel", "Loose")]
    for name in ("Beam", "Cart"):
        x, y, z = sim.getObjectPosition(handle(name), -1)
        sim.setObjectPosition(handle(name), -1, [x, y + 2, z])
    after = [find(simulation, name).matrix()[3::4] for name in ("Bob", "LeftWheel", "Loose")]
    for (x, y, z), there in zip(before, after):
        assert there == pytest.approx((x, y + 2, z), abs=1e-6)


def test_a_load_can_be_attached_to_a_drone_and_released(simulation):
    """A static object moves with its new parent. Made dynamic again, it falls with its former mass."""
    loose, tree, drone = find(simulation, "Loose"), simulation.context.objects, simulation.drone
    loose.put(frames.from_rpy((-5, 0, 0.9), (0, 0, 0)))
    loose.set_static(True)
    tree.set_parent(tree.handle("Loose"), tree.handle("Drone"), keep_in_place=True)
    drone.commands.receive(Twist(Vector3(0.5, 0, 0.5)))
    run(simulation, 1)
    snapshot, there = simulation.snapshot(), loose.matrix()
    assert frames.relative(drone.body.matrix, there)[3::4] == pytest.approx((0, 0, -0.1), abs=0.01)
    assert simulation.world.state(loose.number).position == pytest.approx(there[3::4])
    loose.set_static(False)
    tree.set_parent(tree.handle("Loose"), WORLD, keep_in_place=True)
    run(simulation, 0.2)
    assert loose.velocity()[0][2] == pytest.approx(-9.81 * 0.2, rel=1e-3)
    simulation.restore(snapshot)
    assert loose.is_static and loose.parent.name == "Drone" and loose.matrix() == there
    simulation.start()
    assert not find(simulation, "Loose").is_static
    with pytest.raises(ValueError, match="'Beam' has no mass in the scene file"):
        find(simulation, "Beam").set_static(False)


def test_shapes_on_a_joint_chain_of_a_vehicle_move_with_it(new_simulation):
    simulation = new_simulation(
        scene="""
objects:
  - {name: Hinge, kind: joint, type: revolute, mode: position, parent: Drone, position: [0, 0, -0.3]}
  - {name: Arm, shape: box, size: [0.02, 0.02, 0.02], mass: 0.001, parent: Hinge, position: [0, 0, 0]}
  - {name: Flag, shape: box, size: [0.02, 0.02, 0.02], respondable: false, parent: Arm, position: [0, 0, -0.1]}
  - {name: Elbow, kind: joint, type: revolute, mode: position, parent: Flag}
  - {name: Hand, shape: box, size: [0.02, 0.02, 0.02], mass: 0.001, parent: Elbow, position: [0, 0, 0]}
  - {name: Ring, shape: box, size: [0.02, 0.02, 0.02], respondable: false, parent: Hand, position: [0, 0, -0.1]}
"""
    )
    tree, world = simulation.context.objects, simulation.world
    world.set_velocity(simulation.drone.body.number, (2.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for _ in range(3):
        simulation.step()
        for name in ("Flag", "Ring"):
            there = world.state(tree[tree.handle(name)].number).position
            assert there == pytest.approx(frames.position(tree.matrix(tree.handle(name))), abs=1e-9)
    assert there[0] > 0.2


def caterpillar(count):
    """Yield a body with `count` joints and links in chains of ten; the first of each chain is a force sensor."""
    yield {"name": "Body", "shape": "box", "size": [0.1, 0.1, 0.1], "position": [0, 0, 1], "mass": 1}
    for number in range(count):
        above = f"Link{number - 1}" if number % 10 else "Body"
        kind = {"kind": "joint", "type": "revolute", "mode": "passive"} if number % 10 else {"kind": "force_sensor"}
        yield {"name": f"Joint{number}", **kind, "parent": above, "position": [0.11, 0.01 * (number // 10), 0]}
        link = {"shape": "box", "size": [0.1, 0.005, 0.1], "mass": 0.1, "parent": f"Joint{number}"}
        yield {"name": f"Link{number}", **link, "position": [0, 0, 0]}


def test_a_chain_may_have_at_most_127_joints_and_force_sensors(new_simulation):
    simulation = new_simulation({"scene": {"objects": list(caterpillar(127))}})
    simulation.step()
    with pytest.raises(ParameterError, match="128 joints and force sensors in a chain from 'Body': at most 127"):
        Simulation(parameters.load({"scene": {"objects": list(caterpillar(128))}}))
