"""One drone: its body, the objects that move with it, its propellers and its child script."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from drone_sim.forces.propellers import Propellers
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.state import Pose, State, Twist
from drone_sim.mechanics.wrench import Wrench
from drone_sim.run.parameters import CameraParameters, Parameters
from drone_sim.scripting import load
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import Surroundings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_sim, make_sim_ros
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles import drone_objects
from drone_sim.vehicles.drone_objects import DRONE, joint, respondable
from drone_sim.wording import near_names
from drone_sim.world import World

# V-REP's propellers 1 to 4: where they sit, and the sense of their reaction torque.
PROPELLERS = (("front_left", -1), ("back_left", +1), ("back_right", -1), ("front_right", +1))
_PARTICLE_VELOCITY = "particleVelocity"
_BLADE_TURN = 3.0  # rad per metre of air: slow enough for 20 pictures a second to show which way


class _Push(NamedTuple):
    force: Vector
    torque: Vector
    steps: int  # that it still lasts


class Drone:
    """A quadricopter in a world. Its frame is the URDF's root link; nothing of it is shared with another."""

    def __init__(self, parameters: Parameters, world: World):
        """Put it at its starting place, at rest. Raises urdf.UrdfError."""
        own = parameters.drone
        self.name = own.name
        self.body = urdf.read(own.urdf)
        self.bus = MessageBus(own.name)
        self._parameters = parameters
        self._timeout, self._time_step = parameters.cmd_vel_timeout, parameters.time_step  # asked for in every step
        self._world = world
        self._start = Pose(own.position, frames.to_quaternion(frames.from_rpy((0, 0, 0), (0, 0, own.yaw))))
        self._id = world.add_rigid_body(self.body, self._start)
        inertial_from_root = frames.invert(world.inertial_frame(self._id))
        self._links = [self._link(f"propeller_{place}") for place, _ in PROPELLERS]
        self._points = [frames.position(frames.multiply(inertial_from_root, link)) for link in self._links]
        self._axes = [(link[2], link[6], link[10]) for link in self._links]
        shapes = [(respondable(number), link) for number, link in enumerate(self._links, start=1)]
        self._shapes = {name: frames.multiply(inertial_from_root, link) for name, link in [(DRONE, IDENTITY), *shapes]}
        self.script: load.Script = load.NoScript()
        self.drawings: Drawings | None = None
        self.jumps = 0  # how often it was put somewhere else
        self.reset()

    def reset(self) -> None:
        """Return to the starting place, at rest, with no script loaded."""
        self.close()
        self._world.set_pose(self._id, self._start)
        self.refresh()
        rotations = [rotation for _, rotation in PROPELLERS]
        law = self._parameters.propellers
        self._propellers = Propellers(law, self._axes, self._points, rotations, self._time_step)
        self.command = Twist()
        self._command_age = 0.0
        self._pushes: list[_Push] = []
        self._added = Wrench()
        self._joint_angles: dict[str, float] = {}
        cameras = self._parameters.cameras
        self.objects = drone_objects.scene_objects(self, self.body.links, self._links, cameras)
        self.signals = Signals()
        self.drawings_made = 0
        self.script_parameters = self._script_parameters()
        self._commanded = [self.script_parameters[respondable(number)] for number in (1, 2, 3, 4)]

    def _script_parameters(self) -> dict[str, dict[str, Any]]:
        """Return what V-REP's scripts have as simulation parameters, and the gains of control."""
        law = self._parameters.propellers
        seen = {"particlesAreVisible": True, "simulateParticles": True, "fakeShadow": True}
        particles = {
            "particleCountPerSecond": law.particles_per_second,
            "particleDensity": law.particle_density,
            "particleSize": 1.0,  # a factor, in the stock scripts
        }
        own = {**self._parameters.control.model_dump(), **seen, **particles, "propeller_law": law.law}
        return {
            DRONE: own,
            **{respondable(number): {_PARTICLE_VELOCITY: 0.0, **particles} for number in (1, 2, 3, 4)},
        }

    @property
    def own_script(self) -> str:
        """Name of the object that the child script is attached to."""
        return DRONE

    def _link(self, name: str) -> Matrix:
        if name not in self.body.links:
            raise urdf.UrdfError(f"{self._parameters.drone.urdf}: no link {name}")
        return self.body.links[name]

    # ---- state

    @property
    def track(self) -> Matrix:
        """World from Track_base: at the drone, level, turned by its yaw."""
        return self.objects.matrix(self.objects.handle("Track_base"))

    @property
    def particle_velocities(self) -> tuple[float, ...]:
        """What the script commands: m/s, propellers 1 to 4."""
        (first, second, third, fourth), key = self._commanded, _PARTICLE_VELOCITY
        return first[key], second[key], third[key], fourth[key]

    @property
    def blade_angles(self) -> dict[str, float]:
        """Angle (rad) of each propeller's blades, by joint of the URDF.

        They turn against the torque that they leave, unless the script turns them.
        """
        return {
            f"blades_{place}_joint": self.turn_joint(joint(number)) % (2 * math.pi)
            for number, (place, _) in enumerate(PROPELLERS, start=1)
        }

    def turn_joint(self, name: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError."""
        names = [joint(number) for number in (1, 2, 3, 4)]
        if name not in names:
            raise ValueError(f"'{name}' is not a joint; {near_names(name, names)}")
        if angle is not None:
            self._joint_angles[name] = angle
        number = names.index(name)
        return self._joint_angles.get(name, -PROPELLERS[number][1] * _BLADE_TURN * self._propellers.air[number])

    def show_blades(self) -> None:
        """Turn the blades in the world's pictures to where they are."""
        angles = self.blade_angles
        places = {}
        for blades in self.body.blades:
            turned = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angles.get(blades.joint_name, 0.0)))
            places[blades.visual] = frames.multiply(frames.multiply(blades.joint, turned), blades.local)
        self._world.place_visuals(self._id, places)

    def refresh(self) -> None:
        """Read the state back from the world."""
        self.state: State = self._world.state(self._id)  # of base_link, after the last step or move
        self.matrix: Matrix = self.state.matrix  # world from base_link

    def move(self, pose: Pose) -> None:
        """Put the drone somewhere else, at rest."""
        self.jumps += 1
        self._world.set_pose(self._id, pose)
        self.refresh()

    def optical(self, camera: CameraParameters) -> Matrix:
        """World from a camera's optical frame (z forward, x right, y down)."""
        sensor = self.objects.matrix(self.objects.handle(camera.object))
        return frames.multiply(sensor, drone_objects.OPTICAL_FROM_SENSOR)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what the drone's body is not: propellers, objects, script, messages."""
        own = (self.command, self._command_age, self.drawings_made, list(self._pushes), dict(self._joint_angles))
        parameters = copy.deepcopy(self.script_parameters)
        parts = (self._propellers, self.objects, self.signals, self.bus, self.drawings, self.script)
        others = [one.remember() for one in parts if one is not None]

        def recall() -> None:
            self.command, self._command_age, self.drawings_made, pushes, angles = own
            self._pushes, self._joint_angles = list(pushes), dict(angles)
            self._added = Wrench()
            for name, values in copy.deepcopy(parameters).items():
                self.script_parameters[name].clear()
                self.script_parameters[name].update(values)
            for one in others:
                one()
            self.jumps += 1
            self.refresh()

        return recall

    # ---- script

    def load_script(
        self, path: str, clock: Callable[[], float], pictures: Mapping[str, Callable[[], np.ndarray]] | None = None
    ) -> None:
        """Load a child script ('' for the tutorial's) and call its init. Raises ScriptError.

        `pictures` are the cameras by name: functions that return a picture (height, width, 3).
        """
        self.close()
        limit = TimeLimit(self._parameters.script_time_limit)
        sensors = {self._parameters.cameras[name].object: take for name, take in (pictures or {}).items()}
        surroundings = Surroundings(clock, self._time_step, sensors, limit.outside)
        modules = {"sim": make_sim(self, surroundings), "simROS": make_sim_ros(self.bus)}
        self.script = load.load(path, modules, limit)
        self.script.call("init")
        self._check_callbacks()

    def _check_callbacks(self) -> None:
        """Raise ScriptError for a subscription since the last check whose function the script does not have."""
        for callback in self.bus.new_callbacks():
            self.script.check(callback)

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        self.script.close()
        self.script = load.NoScript()
        self.bus.close()

    def receive(self, twist: Twist) -> None:
        """Take a command for the next step; held until the next one, or for cmd_vel_timeout."""
        self.command = twist
        self._command_age = 0.0
        self.bus.post("cmd_vel", twist)

    def push(self, force: Vector, torque: Vector, duration: float) -> None:
        """Push with a force (N) at the centre of mass and a torque (N m), fixed in the world.

        It lasts `duration` seconds of simulated time, rounded to whole steps, one at least. Pushes add up.
        """
        self._pushes.append(_Push(force, torque, max(1, round(duration / self._time_step))))

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Both keep their direction through the sub-steps. Raises ValueError for an object that is no dynamic shape.
        """
        if shape not in self._shapes:
            raise ValueError(f"'{shape}' is not a dynamic shape; there are: {', '.join(self._shapes)}")
        self._added.add(force, torque, frames.transform(self._shapes[shape], offset))

    # ---- phases

    def actuation(self) -> None:
        """Hand waiting messages to the script, then let it command the propellers."""
        timeout = self._timeout
        if timeout and self._command_age > timeout - self._time_step / 2 and self.command != Twist():
            self.receive(Twist())
        self._command_age += self._time_step
        self._check_callbacks()
        self.bus.deliver(self.script.callback)
        self.script.call("actuation")

    def wrenches(self) -> dict[int, Wrench]:
        """Emit a step's particles, use up a step of the pushes; return the step's wrench on each body, by its id."""
        wrench, self._added = self._added, Wrench()
        self._propellers.blow(self.particle_velocities, self.matrix, wrench)
        if self._pushes:
            for push in self._pushes:
                wrench.add(push.force, push.torque, (0.0, 0.0, 0.0))
            self._pushes = [push._replace(steps=push.steps - 1) for push in self._pushes if push.steps > 1]
        return {self._id: wrench}
