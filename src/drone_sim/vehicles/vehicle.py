"""A vehicle: its body, what pushes it, what it sees with, what it is told, and its objects under V-REP's names."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from drone_sim.context import SimulationContext
from drone_sim.forces.drag import DragParameters
from drone_sim.forces.force import Force
from drone_sim.forces.pushes import Pushes
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose
from drone_sim.mechanics.wrench import Wrench
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.sensors.camera import Camera, CameraFitting
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.commands import LANDED, RESET, Commands, FlightState, request
from drone_sim.vehicles.faults import Faults
from drone_sim.vehicles.instruments import Instruments
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.propulsion import Propulsion, Rotors
from drone_sim.vehicles.quadricopter_objects import DRONE, OPTICAL_FROM_SENSOR, TARGET, TRACK_BASE, QuadricopterObjects
from drone_sim.vehicles.types import TYPES


class Vehicle:
    """A vehicle of any type in a world. What it shares with others is in its context, and nothing else is."""

    object: SceneObject  # that its child script is attached to, the root of all of its own
    target: SceneObject  # DronePosition, the green sphere
    pushes: Pushes  # of the run

    def __init__(self, parameters: VehicleParameters, suffix: str, context: SimulationContext):
        """Put it at its starting place, at rest; its objects' names get the suffix.

        Raises UrdfError and ParameterError.
        """
        self.context = context
        self.name = parameters.name
        self.parameters = parameters
        self.suffix = suffix
        self.object_name = DRONE + suffix
        self.bus = MessageBus(parameters.name)
        self.commands = Commands(self.bus, parameters.cmd_vel_timeout, context.clock)
        self.flight_state = FlightState(self.commands)
        rigid = urdf.read(parameters.urdf)
        rotors = Rotors(rigid, parameters.urdf, TYPES[parameters.type])
        turned = frames.from_rpy((0, 0, 0), (*parameters.tilt, parameters.yaw))
        self.body = Body(rigid, Pose(parameters.position, frames.to_quaternion(turned)), context)
        if parameters.start == LANDED:
            self.body.begin_on_floor()
        self.propulsion = Propulsion(rotors, self.body, suffix)
        self.handles: list[int] = []  # of its objects
        self._cleared = -1  # how often the tree had been, when they were added
        self.cameras = {
            name: Camera(one, self._fitting(name, one), context.vision) for name, one in parameters.cameras.items()
        }
        context.blades.append(self.propulsion.blades)
        context.names[self.body.number] = (parameters.name, self.object_name)
        try:
            self.instruments = Instruments(parameters, suffix, self.body, context)
            self.faults = Faults(self.name, parameters.faults, self.instruments, self.cameras, context.clock)
            self.reset()
        except BaseException:
            self.leave()
            raise

    def reset(self) -> None:
        """Return to the starting place, at rest, and its objects anew in the shared tree."""
        self.body.reset()
        self._begin_forces()
        self.flight_state.begin()
        self._leave_tree()
        tree, own, rigid = self.context.objects, self.parameters, self.body.rigid
        self._cleared = tree.cleared
        objects = QuadricopterObjects(tree, self.suffix, self.handles, own.objects)
        objects.add(self.body, rigid.links, self.propulsion.rotors.links, own.cameras, own.sensors)
        self.object, self.target = (tree[tree.handle(one + self.suffix)] for one in (DRONE, TARGET))
        for handle in self.handles:
            if tree[handle].body is not None:
                self.context.velocities.follow(handle)
        self.propulsion.attach(own.propellers)
        self.commands.listening = []
        for camera in self.cameras.values():
            camera.reset()
        self.instruments.reset()
        self._begin_faults()

    @property
    def track(self) -> SceneObject:
        """Track_base: at the drone, level, turned by its yaw; the scene's own, or the drone, where it brings none."""
        tree, name = self.context.objects, TRACK_BASE + self.suffix
        return tree[tree.handle(name)] if name in tree else self.object

    def _begin_forces(self) -> None:
        time_step = self.context.clock.time_step
        self.propulsion.begin(self.parameters.propellers, time_step)
        self.pushes = Pushes(time_step)
        others = [one.make() for one in self.parameters.forces.values()]
        self._forces: list[Force] = [self.propulsion.law, *(one for one in others if not one.every_sub_step)]
        self.sub_step_forces = [one for one in others if one.every_sub_step]
        self._has_drag = any(one.feels_wind for one in others)
        self.feel_weather()
        self.commands.begin()

    def feel_weather(self) -> None:
        """Have drag, once there is weather; if `forces` gives none, with the default coefficients of DragParameters."""
        if self.context.weather.is_felt and not self._has_drag:
            self._has_drag = True
            self.sub_step_forces = [*self.sub_step_forces, DragParameters(kind="drag").make()]

    def _begin_faults(self) -> None:
        self.faults.begin(self.propulsion.law)
        self._prepare()

    def _prepare(self) -> None:
        """List what comes before the script in every step; a sound vehicle without sensors has nothing."""
        self._before_script = [self.instruments.clear] if self.instruments else []
        self.commands.link = self.faults.commands
        if self.commands.link is not None:
            self._before_script.append(self.commands.take)

    def _leave_tree(self) -> None:
        """Take its objects out of the tree, unless they have gone with all others."""
        if self._cleared == self.context.objects.cleared:
            self.context.objects.remove(self.handles)
        self.handles = []

    def leave(self) -> None:
        """Remove it from the world."""
        self._leave_tree()
        self.context.blades.remove(self.propulsion.blades)
        self.context.names.pop(self.body.number, None)
        self.context.world.remove(self.body.number)

    def optical(self, camera: CameraParameters) -> Matrix:
        """World from a camera's optical frame (z forward, x right, y down)."""
        objects = self.context.objects
        sensor = objects.matrix(objects.handle(camera.object + self.suffix))
        return frames.multiply(sensor, OPTICAL_FROM_SENSOR)

    def _fitting(self, name: str, camera: CameraParameters) -> CameraFitting:
        pose, velocity = partial(self.optical, camera), partial(self._velocity, camera)
        return CameraFitting(f"{self.name}/{name}", pose, velocity, self.context.clock)

    def _velocity(self, camera: CameraParameters) -> tuple[Vector, Vector]:
        """Velocity of a camera and of its turn: now, or over the last step, where a script moves it."""
        objects, meter = self.context.objects, self.context.velocities
        handle = objects.handle(camera.object + self.suffix)
        if objects[handle].carrier is not None:
            return objects[handle].velocity()
        return meter.velocity(handle)[0], meter.rotation(handle)

    # ---- from outside

    def ask(self, topic: str, pose: Pose | None = None) -> None:
        """Let the script do what a topic of `requests` asks for, if it offers that; `reset` puts it back before.

        While the simulation is stopped, and has no script, nothing happens but a line in the log.
        """
        before = self._begin_again if topic == RESET else lambda: None
        self.flight_state.ask(topic, request(pose), before)

    def _begin_again(self) -> None:
        """Be where it began, at rest and sound, while time and sensors go on."""
        self.body.begin_again()
        self._begin_forces()
        self._begin_faults()
        self.context.tunings += 1

    def change_faults(self, changes: Mapping[str, Any]) -> None:
        """Change its faults: keys of `faults`, as in YAML. Raises ParameterError."""
        self.faults.change(changes)
        self._prepare()
        self.context.tunings += 1

    # ---- phases

    def begin_step(self) -> None:
        """Forget the readings of the last step, and let scripts hear the command of this one."""
        for prepare in self._before_script:
            prepare()
        self.commands.advance()

    def wrench(self) -> Wrench:
        """Return what pushes the body through this step, the forces of single sub-steps aside; nothing while held."""
        body = self.body
        wrench = body.take_pushes()
        for force in self._forces:
            force.add_to(wrench, body)
        if self.pushes.lasting:
            self.pushes.add_to(wrench, body)
        return Wrench() if body.is_held else wrench

    def before_sub_step(self) -> None:
        """Let the forces act that follow the body through the sub-steps."""
        for force in self.sub_step_forces:
            self.body.apply(force)

    def after_sub_step(self, count: int) -> None:
        """Let the instruments look, after so many sub-steps of the run."""
        self.body.refresh()
        self.instruments.look(count)

    def take_pictures(self, steps: int, now: bool = False) -> None:
        """Let the cameras that are watched take a picture: those that are due after so many steps, or all `now`.

        Those with automatic exposure measure the light whenever they are due.
        """
        for name, camera in self.cameras.items():
            if not now:
                camera.meter(steps)
            is_watched = camera.watched()
            if is_watched or camera.image is not None:
                looks = is_watched and (now or camera.is_due(steps)) and camera.failure != "silent"
                camera.show(steps, *self.faults.transmit(name, camera.look() if looks else None))

    # ---- snapshots

    def save_state(self) -> Restore:
        """Return a function that brings back what the body is not: forces, commands, cameras, sensors, faults."""
        forces = (*self._forces, self.pushes, *self.sub_step_forces)
        parts = (*forces, self.propulsion.blades, self.commands, *self.cameras.values())
        return in_turn(
            *(one.save_state() for one in parts),
            self.body.restored,
            self.instruments.save_state(),  # which ask the body how often it was put somewhere
            self.faults.save_state(),
            self._prepare,
            saved(self, "sub_step_forces", "_has_drag"),
        )
