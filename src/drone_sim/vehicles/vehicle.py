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
from drone_sim.forces.weather import WeatherParameters
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.object_tree import ObjectTree, SceneObject
from drone_sim.mechanics.state import Pose, State, Twist
from drone_sim.mechanics.wrench import Wrench
from drone_sim.scripting import load
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import Instrument
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.child_script import Pictures, call_init, load_child_script, refuse_if_idle
from drone_sim.vehicles.commands import Commands
from drone_sim.vehicles.faults import Faults
from drone_sim.vehicles.flight_state import LANDED, FlightState
from drone_sim.vehicles.instruments import Carrying, Instruments
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.propulsion import Propulsion
from drone_sim.vehicles.quadricopter_objects import DRONE, OPTICAL_FROM_SENSOR, TARGET, TRACK_BASE, QuadricopterObjects
from drone_sim.vehicles.requests import RESET, request
from drone_sim.vehicles.rotors import Rotors
from drone_sim.vehicles.script_parameters import bring_back, script_parameters
from drone_sim.vehicles.shared import Shared
from drone_sim.vehicles.shared_view import SharedView
from drone_sim.vehicles.tuning import Tuning


class Vehicle(SharedView):
    """A quadricopter in a world. What it shares with others is in `Shared`, and nothing else is."""

    def __init__(self, parameters: VehicleParameters, suffix: str, shared: Shared):
        """Put it at its starting place, at rest, without a script; its objects' names get the suffix.

        Raises UrdfError and ParameterError.
        """
        super().__init__(shared)
        self.name = parameters.name
        self.parameters = parameters
        self.suffix = suffix
        self.bus = MessageBus(parameters.name)
        self.bus.backend = shared.backend
        self.commands = Commands(self.bus, parameters.cmd_vel_timeout, shared.time_step, shared.time)
        rigid = urdf.read(parameters.urdf)
        rotors = Rotors(rigid, parameters.urdf)
        turned = frames.from_rpy((0, 0, 0), (*parameters.tilt, parameters.yaw))
        start = Pose(parameters.position, frames.to_quaternion(turned))
        self.body = Body(rigid, start, shared.world)
        if parameters.start == LANDED:
            self.body.begin_on_floor()
        self.body.air = shared.weather.at
        self.propulsion = Propulsion(rotors, self.body, suffix)
        self.script: load.Script = load.NoScript()
        self.flight_state = FlightState(lambda: self.commands.buses)
        self._tree: ObjectTree | None = None  # the one that its objects are in
        self._handles: list[int] = []  # of its objects
        self.script_parameters: dict[str, dict[str, Any]] = {}  # of its scripts, by their objects
        self.tuning = Tuning(self)
        self.cameras = {
            name: Camera(one, partial(self.optical, one), shared.vision) for name, one in parameters.cameras.items()
        }
        shared.names[self.body.number] = (parameters.name, self.own_script)
        carrying = Carrying(self.body, lambda: self.propulsion.thrusts, shared)
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
        objects.add(self.body, links, self.propulsion.rotors.links, own.cameras, own.sensors)
        self._track = self.objects[self.objects.handle(TRACK_BASE + self.suffix)]
        self.script_parameters = script_parameters(self.parameters, self.suffix)
        for name, values in self.script_parameters.items():
            self.scripts.add(name, values, is_law=name != self.own_script)
        self.propulsion.attach(self.script_parameters)
        self.commands.listening = []
        for camera in self.cameras.values():
            camera.reset()
        self.instruments.reset()
        self.faults.begin(self.propulsion.law)
        self._prepare()

    def _begin_forces(self) -> None:
        time_step = self._shared.time_step
        self.propulsion.begin(self.parameters.propellers, time_step)
        self._pushes = Pushes(time_step)
        others = [one.make() for one in self.parameters.forces.values()]
        self._forces: list[Force] = [self.propulsion.law, *(one for one in others if not one.every_sub_step)]
        self.sub_step_forces = [one for one in others if one.every_sub_step]
        self._has_drag = any(one.feels_wind for one in others)
        self.feel_weather()
        self.commands.begin()

    def feel_weather(self) -> None:
        """Have drag, once there is weather; what `forces` does not give has the coefficients of DragParameters."""
        if self._shared.weather.is_felt and not self._has_drag:
            self._has_drag = True
            self.sub_step_forces = [*self.sub_step_forces, DragParameters(kind="drag").make()]

    def _prepare(self) -> None:
        """List what comes before the script in every step; a sound vehicle without sensors has nothing."""
        self._before_script = [self.instruments.clear] if self.sensors else []
        self.commands.link = self.faults.commands
        if self.commands.link is not None:
            self._before_script.append(self.commands.take)

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
    def command(self) -> Twist:
        """The command that it obeys: m/s and rad/s, in the frame Track_base."""
        return self.commands.now

    @property
    def particle_velocities(self) -> tuple[float, float, float, float]:
        """What the script commands: m/s, propellers 1 to 4."""
        return self.propulsion.particle_velocities

    @property
    def blade_angles(self) -> dict[str, float]:
        """Angle (rad) of each propeller's blades, by joint of the URDF."""
        return self.propulsion.blades.angles

    def turn_joint(self, joint: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError."""
        return self.propulsion.blades.turn(joint, angle)

    def optical(self, camera: CameraParameters) -> Matrix:
        """World from a camera's optical frame (z forward, x right, y down)."""
        sensor = self.objects.matrix(self.objects.handle(camera.object + self.suffix))
        return frames.multiply(sensor, OPTICAL_FROM_SENSOR)

    def masses(self) -> dict[str, float]:
        """Return the mass (kg) of each of its shapes, by object name; they are one body."""
        return self.propulsion.masses()

    def inertias(self) -> dict[str, Inertia]:
        """Return how the mass of each of its shapes lies, in that shape's frame, by object name."""
        return self.propulsion.inertias()

    # ---- commands

    def receive(self, twist: Twist) -> None:
        """Take a command for the next step, or for when it comes over a link that is slow (`faults`).

        It is held until the next one, or for cmd_vel_timeout.
        """
        self.commands.receive(twist)

    def ask(self, topic: str, pose: Pose | None = None) -> None:
        """Let the script do what a topic of `requests` asks for, if it offers that; `reset` puts it back before.

        While the simulation is stopped, and has no script, nothing happens but a line in the log.
        """
        if isinstance(self.script, load.NoScript):
            self.flight_state.drop(topic)
            return
        before = self._begin_again if topic == RESET else lambda: None
        self.flight_state.ask(topic, request(pose), before)

    def _begin_again(self) -> None:
        """Be where it began, at rest and sound, while time and sensors go on."""
        self.body.begin_again()
        self._begin_forces()
        self.faults.begin(self.propulsion.law)
        self._prepare()
        self.count_change()

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
        self.count_change()

    def change_weather(self, changes: Mapping[str, Any]) -> None:
        """Let another weather be where it and all others are: keys of `weather`, as in YAML. Raises ParameterError."""
        self._shared.weather.change(changes)

    @property
    def weather(self) -> WeatherParameters:
        """The weather that it and all others are in."""
        return self._shared.weather.now

    def count_change(self) -> None:
        """Let those know that show what may be tuned."""
        self._shared.tunings += 1

    def has_shape(self, name: str) -> bool:
        """Tell whether that is the name of a dynamic shape of it."""
        return name in self.propulsion.shapes

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Both keep their direction through the sub-steps. Raises ValueError for an object that is no dynamic shape.
        """
        shapes = self.propulsion.shapes
        if shape not in shapes:
            raise ValueError(f"'{shape}' is not a dynamic shape; there are: {', '.join(shapes)}")
        self.body.add_force(force, torque, frames.transform(shapes[shape], offset))

    # ---- script

    def load_script(self, path: str) -> None:
        """Load a child script ('' for the pilot) and call its init. Raises ScriptError."""
        self.close()
        self.script = load_child_script(path, self, self.bus, [self], self._shared)
        refuse_if_idle(self.script, path, self.bus)
        call_init(self.script, self.bus)
        self.tuning.begin()

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
        self.commands.advance()
        for callback in self.bus.new_callbacks():
            self.script.check(callback)
        self.bus.deliver(self.script)
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
        parameters = copy.deepcopy(self.script_parameters)
        parts = (
            *self._forces,
            self._pushes,
            *self.sub_step_forces,
            self.propulsion.blades,
            self.commands,
            self.bus,
            self.script,
            *self.cameras.values(),
            self.tuning,
        )
        others = [one.remember() for one in parts]
        instruments, faults = self.instruments.remember(), self.faults.remember()
        sub_step_forces, has_drag = self.sub_step_forces, self._has_drag

        def recall() -> None:
            bring_back(self.script_parameters, parameters)
            for one in others:
                one()
            self.body.restored()
            instruments()  # which ask the body how often it was put somewhere
            faults()
            self._prepare()
            self.sub_step_forces, self._has_drag = sub_step_forces, has_drag

        return recall
