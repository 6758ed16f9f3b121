"""A vehicle: its body, what pushes it, what it sees with, its objects under V-REP's names, and its child script."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from drone_sim.forces.drag import DragParameters
from drone_sim.forces.force import Force
from drone_sim.forces.pushes import Push, Pushes
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.inertia import Inertia, Inertial, together
from drone_sim.mechanics.object_tree import ObjectTree, SceneObject
from drone_sim.mechanics.state import Pose, State, Twist
from drone_sim.mechanics.wrench import Wrench
from drone_sim.scripting import load
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import Instrument
from drone_sim.vehicles.blades import Blades
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.child_script import Pictures, call_init, load_child_script, refuse_if_idle
from drone_sim.vehicles.faults import Faults
from drone_sim.vehicles.flight_state import LANDED, FlightState
from drone_sim.vehicles.instruments import Carrying, Instruments
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import (
    DRONE,
    OPTICAL_FROM_SENSOR,
    TARGET,
    TRACK_BASE,
    QuadricopterObjects,
    respondable,
)
from drone_sim.vehicles.requests import RESET, request
from drone_sim.vehicles.rotors import Rotors
from drone_sim.vehicles.script_parameters import NUMBERS, PARTICLE_VELOCITY, bring_back, script_parameters
from drone_sim.vehicles.shared import Shared


class Vehicle:
    """A quadricopter in a world. What it shares with others is in `Shared`, and nothing else is."""

    def __init__(self, parameters: VehicleParameters, suffix: str, shared: Shared):
        """Put it at its starting place, at rest, without a script; its objects' names get the suffix.

        Raises UrdfError and ParameterError.
        """
        self.name = parameters.name
        self.parameters = parameters
        self.suffix = suffix
        self.bus = MessageBus(parameters.name)
        self.bus.backend = shared.backend
        self._shared = shared
        self._timeout, self._time_step = parameters.cmd_vel_timeout, shared.time_step  # asked for in every step
        rigid = urdf.read(parameters.urdf)
        self._rotors = Rotors(rigid, parameters.urdf)
        turned = frames.from_rpy((0, 0, 0), (*parameters.tilt, parameters.yaw))
        start = Pose(parameters.position, frames.to_quaternion(turned))
        self.body = Body(rigid, start, shared.world)
        if parameters.start == LANDED:
            self.body.begin_on_floor()
        self.body.air = shared.weather.at
        shapes = [(respondable(number), link) for number, link in zip(NUMBERS, self._rotors.links)]
        self._shapes = {
            name + suffix: frames.multiply(self.body.inertial_from_root, link)
            for name, link in [(DRONE, IDENTITY), *shapes]
        }
        self.blades = Blades(self._rotors, self.body, suffix, lambda: self._propellers.air)
        self.script: load.Script = load.NoScript()
        self.listening: list[MessageBus] = []  # of scripts on its parts
        self.flight_state = FlightState(lambda: (self.bus, *self.listening))
        self._tree: ObjectTree | None = None  # the one that its objects are in
        self._handles: list[int] = []  # of its objects
        self.script_parameters: dict[str, dict[str, Any]] = {}  # of its scripts, by their objects
        self.cameras = {
            name: Camera(one, partial(self.optical, one), shared.vision) for name, one in parameters.cameras.items()
        }
        shared.names[self.body.number] = (parameters.name, self.own_script)
        carrying = Carrying(self.body, lambda: self._propellers.thrusts, shared)
        try:
            self.instruments = Instruments(parameters, suffix, self.body, carrying, shared)
            self.sensors: Mapping[str, Instrument] = self.instruments.by_object  # as scripts find them
            self.faults = Faults(self.name, parameters.faults, self.instruments, self.cameras, shared.time)
            self.reset()
        except BaseException:
            self.leave()
            raise

    def reset(self) -> None:
        """Return to the starting place, at rest, with no script loaded, and its objects anew in the shared tree."""
        self.close()
        self.body.reset()
        self._begin_forces()
        self.flight_state.begin()
        self._leave_tree()
        self._tree = self.objects
        self._handles = []
        objects = QuadricopterObjects(self._tree, self.suffix, self._handles, self.parameters.objects)
        own, links = self.parameters, self.body.rigid.links
        objects.add(self.body, links, self._rotors.links, own.cameras, own.sensors)
        self._track = self.objects[self.objects.handle(TRACK_BASE + self.suffix)]
        self.script_parameters = script_parameters(self.parameters, self.suffix)
        for name, values in self.script_parameters.items():
            self.scripts.add(name, values, is_law=name != self.own_script)
        self._commanded = [self.script_parameters[respondable(number) + self.suffix] for number in NUMBERS]
        self._driven = list(self._commanded)
        self.listening = []
        for camera in self.cameras.values():
            camera.reset()
        self.instruments.reset()
        self.faults.begin(self._propellers)
        self._prepare()

    def _begin_forces(self) -> None:
        law, from_root = self.parameters.propellers, self.body.inertial_from_root
        self._propellers = self._rotors.propellers(law, from_root, self._time_step, self._velocities)
        self._pushes = Pushes(self._time_step)
        others = [one.make() for one in self.parameters.forces.values()]
        self._forces: list[Force] = [self._propellers, *(one for one in others if not one.every_sub_step)]
        self.sub_step_forces = [one for one in others if one.every_sub_step]
        self._has_drag = any(one.feels_wind for one in others)
        self.feel_weather()
        self.command = Twist()
        self._command_age = 0.0
        self.blades.reset()

    def feel_weather(self) -> None:
        """Have drag, once there is weather; what `forces` does not give has the coefficients of DragParameters."""
        if self._shared.weather.is_felt and not self._has_drag:
            self._has_drag = True
            self.sub_step_forces = [*self.sub_step_forces, DragParameters(kind="drag").make()]

    def _prepare(self) -> None:
        """List what comes before the script in every step; a sound vehicle without sensors has nothing."""
        self._before_script = [self.instruments.clear] if self.sensors else []
        if self.faults.commands is not None:
            self._before_script.append(self._take_commands)

    def _leave_tree(self) -> None:
        """Take its objects out of the tree that they are in, if that is still the simulation's."""
        if self._tree is self.objects:
            self._tree.remove(self._handles)
            for name in self.script_parameters:
                self.scripts.remove(name)
            self._tree = None

    # ---- what scripts and topics see

    @property
    def own_script(self) -> str:
        """Name of the object that the child script is attached to."""
        return DRONE + self.suffix

    @property
    def own_object(self) -> SceneObject:
        """The object that the child script is attached to: the root of all of its own."""
        return self.objects[self._handles[0]]

    def owns(self, handle: int) -> bool:
        """Tell whether an object is one of its own, which come and go with it."""
        return handle in self._handles

    @property
    def scripts(self) -> Scripts:
        """The scripts of the simulation."""
        return self._shared.scripts

    @property
    def objects(self) -> ObjectTree:
        """The objects of the scene, those of every vehicle among them."""
        return self._shared.objects

    @property
    def signals(self) -> Signals:
        """The signals that scripts leave for each other."""
        return self._shared.signals

    @property
    def drawings(self) -> Drawings:
        """What scripts draw."""
        return self._shared.drawings

    @property
    def state(self) -> State:
        """Pose and velocity of base_link, after the last step or move."""
        return self.body.state

    @property
    def matrix(self) -> Matrix:
        """World from base_link."""
        return self.body.matrix

    @property
    def jumps(self) -> int:
        """How often it was put somewhere else."""
        return self.body.jumps

    @property
    def track(self) -> Matrix:
        """World from Track_base: at the drone, level, turned by its yaw."""
        return self._track.matrix()

    @property
    def particle_velocities(self) -> tuple[float, ...]:
        """What the script commands: m/s, propellers 1 to 4."""
        (first, second, third, fourth), key = self._commanded, PARTICLE_VELOCITY
        return first[key], second[key], third[key], fourth[key]

    def _velocities(self) -> tuple[float, ...]:
        (first, second, third, fourth), key = self._driven, PARTICLE_VELOCITY
        return first[key], second[key], third[key], fourth[key]

    def give_way(self, name: str) -> dict[str, Any] | None:
        """Let a script of its own drive a propeller, in the place of the built-in law.

        Return its parameters; None for the name of what is no propeller.
        """
        numbers = [number for number in NUMBERS if respondable(number) + self.suffix == name]
        for number in numbers:
            self._driven[number - 1] = {PARTICLE_VELOCITY: 0.0}
        return self._commanded[numbers[0] - 1] if numbers else None

    @property
    def clipped_steps(self) -> int:
        """Steps of the run in which the script commanded more than the propellers can do."""
        return self._propellers.clipped

    @property
    def blade_angles(self) -> dict[str, float]:
        """Angle (rad) of each propeller's blades, by joint of the URDF."""
        return self.blades.angles

    def turn_joint(self, joint: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError."""
        return self.blades.turn(joint, angle)

    def optical(self, camera: CameraParameters) -> Matrix:
        """World from a camera's optical frame (z forward, x right, y down)."""
        sensor = self.objects.matrix(self.objects.handle(camera.object + self.suffix))
        return frames.multiply(sensor, OPTICAL_FROM_SENSOR)

    def masses(self) -> dict[str, float]:
        """Return the mass (kg) of each of its shapes, by object name; they are one body."""
        of_propellers = {name: one.mass for name, one in self._of_propellers()}
        return {self.own_script: self.body.mass - sum(of_propellers.values()), **of_propellers}

    def inertias(self) -> dict[str, Inertia]:
        """Return how the mass of each of its shapes lies, in that shape's frame, by object name."""
        frames_of = dict(zip((name for name, _ in self._of_propellers()), self._rotors.links))
        found = {name: one.seen_from(frames_of[name]) for name, one in self._of_propellers() if one.mass}
        if sum(one.mass for one in self._rotors.others):
            found[self.own_script] = together(self._rotors.others).seen_from(IDENTITY)
        return found

    def _of_propellers(self) -> list[tuple[str, Inertial]]:
        return [(respondable(number) + self.suffix, one) for number, one in zip(NUMBERS, self._rotors.inertials)]

    # ---- commands

    def receive(self, twist: Twist) -> None:
        """Take a command for the next step, or for when it comes over a link that is slow (`faults`).

        It is held until the next one, or for cmd_vel_timeout.
        """
        if self.faults.commands is None:
            self._obey(twist)
        else:
            self.faults.commands.send(self._shared.time(), twist)

    def _take_commands(self) -> None:
        came = self.faults.commands and self.faults.commands.receive(self._shared.time())
        if came:
            self._obey(came[1])

    def _obey(self, twist: Twist) -> None:
        self.command = twist
        self._command_age = 0.0
        for bus in (self.bus, *self.listening):
            bus.post("cmd_vel", twist)

    def ask(self, topic: str, pose: Pose | None = None) -> None:
        """Let the script do what a topic of `requests` asks for, if it offers that; `reset` puts it back before.

        While the simulation is stopped, and has no script, nothing happens.
        """
        if isinstance(self.script, load.NoScript):
            return
        before = self._begin_again if topic == RESET else lambda: None
        self.flight_state.ask(topic, request(pose), before)

    def _begin_again(self) -> None:
        """Be where it began, at rest and sound, while time and sensors go on."""
        self.body.begin_again()
        self._begin_forces()
        self.faults.begin(self._propellers)
        self._prepare()

    def move(self, pose: Pose) -> None:
        """Put it somewhere else, at rest."""
        self.body.move(pose)

    def move_target(self, pose: Pose) -> None:
        """Put its green sphere, DronePosition, there."""
        self.objects[self.objects.handle(TARGET + self.suffix)].put(pose.matrix)

    def push(self, force: Vector, torque: Vector, duration: float) -> None:
        """Push with a force (N) at the centre of mass and a torque (N m), fixed in the world, for `duration` s."""
        self._pushes.add(Push(force, torque, duration))

    def change_faults(self, changes: Mapping[str, Any]) -> None:
        """Let other things be wrong with it: keys of `faults`, as in YAML. Raises ParameterError."""
        self.faults.change(changes)
        self._prepare()

    def change_weather(self, changes: Mapping[str, Any]) -> None:
        """Let another weather be where it and all others are: keys of `weather`, as in YAML. Raises ParameterError."""
        self._shared.weather.change(changes)

    def has_shape(self, name: str) -> bool:
        """Tell whether that is the name of a dynamic shape of it."""
        return name in self._shapes

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Both keep their direction through the sub-steps. Raises ValueError for an object that is no dynamic shape.
        """
        if shape not in self._shapes:
            raise ValueError(f"'{shape}' is not a dynamic shape; there are: {', '.join(self._shapes)}")
        self.body.add_force(force, torque, frames.transform(self._shapes[shape], offset))

    # ---- script

    def load_script(self, path: str) -> None:
        """Load a child script ('' for the pilot) and call its init. Raises ScriptError."""
        self.close()
        self.script = load_child_script(path, self, self.bus, [self], self._shared)
        refuse_if_idle(self.script, path, self.bus)
        call_init(self.script, self.bus)

    @property
    def pictures(self) -> Pictures:
        """What its cameras see now, by the name of their object."""
        cameras = self.parameters.cameras
        return {cameras[name].object + self.suffix: partial(self.look, one) for name, one in self.cameras.items()}

    @property
    def planes(self) -> dict[str, tuple[float, float]]:
        """The near and far plane (m) of its cameras, by the name of their object."""
        return {one.object + self.suffix: (one.near, one.far) for one in self.parameters.cameras.values()}

    def leave(self) -> None:
        """Go out of the world, without a word to the script."""
        self.close()
        self._leave_tree()
        self._shared.names.pop(self.body.number, None)
        self._shared.world.remove(self.body.number)

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        self.script.close()
        self.script = load.NoScript()
        self.bus.close()

    # ---- phases

    def actuation(self) -> None:
        """Hand waiting messages to the script, then let it command the propellers."""
        for prepare in self._before_script:
            prepare()
        timeout = self._timeout
        if timeout and self._command_age > timeout - self._time_step / 2 and self.command != Twist():
            self._obey(Twist())
        self._command_age += self._time_step
        for callback in self.bus.new_callbacks():
            self.script.check(callback)
        self.bus.deliver(self.script.callback)
        self.script.call("actuation")

    def wrench(self) -> Wrench:
        """Return what pushes the body through this step, the forces of single sub-steps aside."""
        body = self.body
        wrench, body.wrench = body.wrench, Wrench()
        for force in self._forces:
            force.add_to(wrench, body)
        if self._pushes.lasting:
            self._pushes.add_to(wrench, body)
        return wrench

    def before_sub_step(self) -> None:
        """Let the forces act that follow the body through the sub-steps."""
        for force in self.sub_step_forces:
            self.body.apply(force)

    def after_sub_step(self, count: int) -> None:
        """Let the instruments look, after so many sub-steps of the run."""
        self.body.refresh()
        self.instruments.look(count)

    def take_pictures(self, steps: int, now: bool = False) -> None:
        """Let the cameras that are watched take a picture: those that are due after so many steps, or all `now`."""
        for camera in self.cameras.values():
            if camera.watched():
                camera.show(steps, self.look(camera) if now or camera.is_due(steps) else None)
            elif camera.image is not None:
                camera.show(steps, None)

    def look(self, camera: Camera) -> np.ndarray:
        """Return what a camera sees now."""
        self._shared.before_pictures()
        return camera.look()

    # ---- snapshots

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what the body is not: forces, script, messages, parameters."""
        command, age = self.command, self._command_age
        parameters = copy.deepcopy(self.script_parameters)
        parts = (
            *self._forces,
            self._pushes,
            *self.sub_step_forces,
            self.blades,
            self.bus,
            self.script,
            *self.cameras.values(),
        )
        others = [one.remember() for one in parts]
        instruments, faults = self.instruments.remember(), self.faults.remember()
        sub_step_forces, has_drag = self.sub_step_forces, self._has_drag

        def recall() -> None:
            self.command, self._command_age = command, age
            bring_back(self.script_parameters, parameters)
            for one in others:
                one()
            self.body.restored()
            instruments()  # which ask the body how often it was put somewhere
            faults()
            self._prepare()
            self.sub_step_forces, self._has_drag = sub_step_forces, has_drag

        return recall
