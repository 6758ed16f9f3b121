"""A vehicle: body, forces, cameras, sensors, commands, faults, and its objects under V-REP's names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
from drone_sim.sensors.camera import Camera, CameraMounting
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
    """A vehicle of any type. Everything that it shares with other vehicles is in its context."""

    object: SceneObject  # the root of its objects, to which its child script is attached
    target: SceneObject  # DronePosition, the green sphere
    pushes: Pushes  # of the present run

    def __init__(self, parameters: VehicleParameters, suffix: str, context: SimulationContext):
        """Create the vehicle at its start pose, at rest. `suffix` is appended to the names of its objects.

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
        rotation = frames.from_rpy((0, 0, 0), (*parameters.tilt, parameters.yaw))
        self.body = Body(rigid, Pose(parameters.position, frames.to_quaternion(rotation)), context)
        if parameters.start == LANDED:
            self.body.begin_on_floor()
        self.propulsion = Propulsion(rotors, self.body, suffix)
        self.handles: list[int] = []  # of its objects
        self.step_calls: list[Callable[[], None]] = []  # always this list; see _update_step_calls
        self._cleared = -1  # the tree's count of clearings when the objects were added
        self.cameras: dict[str, Camera] = {}
        for name, item in parameters.cameras.items():
            pose, velocity = partial(self.optical, item), partial(self._velocity, item)
            mounting = CameraMounting(f"{self.name}/{name}", pose, velocity, context.clock)
            self.cameras[name] = Camera(item, mounting, context.vision)
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
        """Reset to the start pose, at rest; replace its objects in the tree; reset forces, sensors and faults."""
        self.body.reset()
        self._begin_forces()
        self.flight_state.begin()
        self._leave_tree()
        tree, parameters, rigid = self.context.objects, self.parameters, self.body.rigid
        self._cleared = tree.cleared
        objects = QuadricopterObjects(tree, self.suffix, self.handles, parameters.objects)
        objects.add(self.body, rigid.links, self.propulsion.rotors.links, parameters.cameras, parameters.sensors)
        self.object, self.target = (tree[tree.handle(name + self.suffix)] for name in (DRONE, TARGET))
        for handle in self.handles:
            if tree[handle].body is not None:
                self.context.velocities.follow(handle)
        self.propulsion.attach(parameters.propellers)
        self.commands.buses = [self.bus]
        for camera in self.cameras.values():
            camera.reset()
        self.instruments.reset()
        self._begin_faults()

    @property
    def track(self) -> SceneObject:
        """Track_base: at the drone, level, rotated by its yaw; else a scene object of this name, else the drone."""
        tree, name = self.context.objects, TRACK_BASE + self.suffix
        return tree[tree.handle(name)] if name in tree else self.object

    def _begin_forces(self) -> None:
        time_step = self.context.clock.time_step
        self.propulsion.begin(self.parameters.propellers, time_step)
        self.pushes = Pushes(time_step)
        others = [parameters.make() for parameters in self.parameters.forces.values()]
        self._forces: list[Force] = [self.propulsion.law, *(force for force in others if not force.every_sub_step)]
        self.sub_step_forces = [force for force in others if force.every_sub_step]
        self._has_drag = any(force.feels_wind for force in others)
        self.update_wind_forces()
        self.commands.begin()

    def update_wind_forces(self) -> None:
        """Add a drag force with DragParameters' defaults if there is wind and `forces` defines none."""
        if self.context.weather.is_felt and not self._has_drag:
            self._has_drag = True
            self.sub_step_forces = [*self.sub_step_forces, DragParameters(kind="drag").make()]

    def _begin_faults(self) -> None:
        self.faults.begin(self.propulsion.law)
        self._update_step_calls()

    def _update_step_calls(self) -> None:
        """Update the calls before its script in every step: clear the last readings, post and age the command."""
        self.commands.link = self.faults.commands
        self.step_calls[:] = [self.instruments.clear] if self.instruments else []
        if self.commands.link is not None:
            self.step_calls.append(self.commands.take)
        self.step_calls.append(self.commands.advance)

    def _leave_tree(self) -> None:
        """Remove its objects from the tree, unless the tree was already cleared."""
        if self._cleared == self.context.objects.cleared:
            self.context.objects.remove(self.handles)
        self.handles = []

    def leave(self) -> None:
        """Remove the vehicle from the world and from the tree."""
        self._leave_tree()
        self.context.blades.remove(self.propulsion.blades)
        self.context.names.pop(self.body.number, None)
        self.context.world.remove(self.body.number)

    def optical(self, camera: CameraParameters) -> Matrix:
        """World from a camera's optical frame (z forward, x right, y down)."""
        objects = self.context.objects
        sensor = objects.matrix(objects.handle(camera.object + self.suffix))
        return frames.multiply(sensor, OPTICAL_FROM_SENSOR)

    def _velocity(self, camera: CameraParameters) -> tuple[Vector, Vector]:
        """Linear and angular velocity of a camera: present ones, or over the last step if scripts move it."""
        objects, meter = self.context.objects, self.context.velocities
        handle = objects.handle(camera.object + self.suffix)
        if objects[handle].carrier is not None:
            return objects[handle].velocity()
        return meter.velocity(handle)[0], meter.rotation(handle)

    # ---- requests and faults

    def ask(self, topic: str, pose: Pose | None = None) -> None:
        """Send a request on a topic of REQUESTS to the scripts; `reset` also resets the vehicle before.

        If no script subscribes to it or the simulation is stopped, only log a warning.
        """
        before = self._begin_again if topic == RESET else lambda: None
        self.flight_state.ask(topic, request(pose), before)

    def _begin_again(self) -> None:
        """Reset pose, velocity, forces and faults to their initial state; simulation time and sensors continue."""
        self.body.begin_again()
        self._begin_forces()
        self._begin_faults()
        self.context.tunings += 1

    def change_faults(self, changes: Mapping[str, Any]) -> None:
        """Change some keys of `faults`, as in YAML. Raises ParameterError."""
        self.faults.change(changes)
        self._update_step_calls()
        self.context.tunings += 1

    # ---- phases

    def wrench(self) -> Wrench:
        """Return the wrench for this step without the sub-step forces; zero while the body is held."""
        wrench, body = Wrench(), self.body
        if body.pending:
            body.take_pushes(wrench)
        for force in self._forces:
            force.add_to(wrench, body)
        if self.pushes.lasting:
            self.pushes.add_to(wrench, body)
        return Wrench() if body.is_held else wrench

    def take_pictures(self, steps: int, now: bool = False) -> None:
        """Render every subscribed camera that is due at step `steps`, or all of them if `now`.

        Cameras with automatic exposure measure the light whenever they are due.
        """
        for name, camera in self.cameras.items():
            if camera.photography.is_metering and not now and camera.is_due(steps):
                camera.meter()
            is_watched = camera.viewers and camera.watched()
            if is_watched or camera.image is not None:
                is_rendered = is_watched and (now or camera.is_due(steps)) and camera.failure != "silent"
                camera.show(steps, *self.faults.transmit(name, camera.look() if is_rendered else None))

    # ---- snapshots

    def save_state(self) -> Restore:
        """Return a function that restores everything but the body: forces, commands, cameras, sensors, faults."""
        forces = (*self._forces, self.pushes, *self.sub_step_forces)
        parts = (*forces, self.propulsion.blades, self.commands, *self.cameras.values())
        return in_turn(
            *(part.save_state() for part in parts),
            self.body.restored,
            self.instruments.save_state(),  # after the body: they read its number of teleports
            self.faults.save_state(),
            self._update_step_calls,
            saved(self, "sub_step_forces", "_has_drag"),
        )
