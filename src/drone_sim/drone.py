"""One drone: its body, the objects that move with it, its propellers and its child script."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, Dict, Tuple

from drone_sim import frames, urdf
from drone_sim.frames import Matrix
from drone_sim.objects import ObjectTree
from drone_sim.parameters import CameraParameters, ParameterError, Parameters
from drone_sim.propeller import ParticleFan, Wrench
from drone_sim.scripting.api import Sim
from drone_sim.scripting.messages import MessageBus
from drone_sim.scripting.python_script import PythonScript
from drone_sim.state import Pose, State, Twist
from drone_sim.world import World

# V-REP's propellers 1 to 4: where they sit, and the sense of their reaction torque.
PROPELLERS = (("front_left", -1), ("back_left", +1), ("back_right", -1), ("front_right", +1))
_BASE = frames.from_rpy((0.0, 0.0, -0.01), (0.0, 0.0, 0.0))  # Quadricopter_base in the root's frame
TUTORIAL = Path(__file__).parent / "child_scripts" / "tutorial.py"
_PARTICLE_VELOCITY = "particleVelocity"


class Drone:
    """A quadricopter in a world. Its frame is the URDF's root link; nothing of it is shared with another."""

    def __init__(self, parameters: Parameters, world: World):
        """Put it at its starting place, at rest. Raises urdf.UrdfError."""
        own = parameters.drone
        self.name = own.name
        self.body = urdf.read(own.urdf)
        self.bus = MessageBus(own.name)
        self._parameters = parameters
        self._world = world
        self._start = Pose(own.position, frames.to_quaternion(frames.from_rpy((0, 0, 0), (0, 0, own.yaw))))
        self._id = world.add_rigid_body(self.body, self._start)
        inertial_from_root = frames.invert(world.inertial_frame(self._id))
        self._links = [self._link(f"propeller_{place}") for place, _ in PROPELLERS]
        self._points = [frames.position(frames.multiply(inertial_from_root, link)) for link in self._links]
        self.reset()

    def reset(self) -> None:
        """Return to the starting place, at rest, with no script loaded."""
        self._world.set_pose(self._id, self._start)
        self.refresh()
        step = self._parameters.time_step
        self.fans = [ParticleFan(self._parameters.propellers, turn, step) for _, turn in PROPELLERS]
        self.command = Twist()
        self._command_age = 0.0
        self.objects, self._scripts = self._scene_objects()

    def _scene_objects(self) -> Tuple[ObjectTree, Dict[str, Dict[str, Any]]]:
        objects = ObjectTree()
        objects.add("Drone", body=self)
        objects.add("Quadricopter_base", "Drone", _BASE)
        objects.add("Track_base", "Drone", _BASE)
        scripts: Dict[str, Dict[str, Any]] = {"Drone": self._parameters.control.model_dump()}
        for number, link in enumerate(self._links, start=1):
            name = f"Quadricopter_propeller_respondable{number}"
            objects.add(name, "Drone", link)
            scripts[name] = {_PARTICLE_VELOCITY: 0.0}
        return objects, scripts

    def _link(self, name: str) -> Matrix:
        if name not in self.body.links:
            raise urdf.UrdfError(f"{self._parameters.drone.urdf}: no link {name}")
        return self.body.links[name]

    # ---- state

    @property
    def state(self) -> State:
        """Pose and velocity of the root link (base_link) after the last step, or the last move."""
        return self._state

    @property
    def matrix(self) -> Matrix:
        """World from base_link."""
        return self._matrix

    @property
    def track(self) -> Matrix:
        """World from Track_base: at the drone, level, turned by its yaw."""
        return self.objects.matrix(self.objects.handle("Track_base"))

    @property
    def particle_velocities(self) -> Tuple[float, ...]:
        """What the script commands: m/s, propellers 1 to 4."""
        return tuple(self._velocity(number) for number in (1, 2, 3, 4))

    def refresh(self) -> None:
        """Read the state back from the world."""
        self._state = self._world.state(self._id)
        self._matrix = self._state.matrix

    def move(self, pose: Pose) -> None:
        """Put the drone somewhere else, at rest."""
        self._world.set_pose(self._id, pose)
        self.refresh()

    def mount(self, camera: CameraParameters) -> Callable[[], Matrix]:
        """Return a function that gives the pose world from the camera's optical frame.

        A camera stands at the URDF's link that is named like its frame, or where its `mount` says.
        Raises ParameterError where there is neither, or no such parent.
        """
        if camera.mount is None:
            if camera.frame not in self.body.links:
                raise ParameterError(f"camera frame {camera.frame}: neither a link of the URDF, nor a `mount` given")
            link = self.body.links[camera.frame]
            return lambda: frames.multiply(self.matrix, link)
        parent, local = camera.mount.parent, camera.mount.matrix
        if parent not in self.objects:
            raise ParameterError(f"camera frame {camera.frame}: no object is named {parent}")
        return lambda: frames.multiply(self.objects.matrix(self.objects.handle(parent)), local)

    # ---- script

    def load_script(self, path: str, clock: Callable[[], float]) -> None:
        """Load a child script ('' for the tutorial's) and call its init. Raises ScriptError."""
        path = path or str(TUTORIAL)
        sim = Sim(self.objects, self._scripts, "Drone", clock, self._parameters.time_step)
        self.script = PythonScript(path, {"sim": sim, "simROS": self.bus})
        self.script.call("init")

    def receive(self, twist: Twist) -> None:
        """Take a command for the next step; held until the next one, or for cmd_vel_timeout."""
        self.command = twist
        self._command_age = 0.0
        self.bus.post("cmd_vel", twist)

    # ---- phases

    def actuation(self) -> None:
        """Hand waiting messages to the script, then let it command the propellers."""
        timeout, step = self._parameters.cmd_vel_timeout, self._parameters.time_step
        if timeout and self._command_age > timeout - step / 2 and self.command != Twist():
            self.receive(Twist())
        self._command_age += step
        self.bus.deliver(self.script.callback)
        self.script.call("actuation")

    def wrench(self) -> Tuple[int, Wrench]:
        """Emit a step's particles; return the body id, and thrusts and torques turned into the world."""
        wrench = Wrench()
        for number, (fan, link, point) in enumerate(zip(self.fans, self._links, self._points), start=1):
            thrust, torque = fan.emit(self._velocity(number))
            x, y, z = frames.rotate(self._matrix, (link[2], link[6], link[10]))  # the propeller's +z
            wrench.add((x * thrust, y * thrust, z * thrust), (x * torque, y * torque, z * torque), point)
        return self._id, wrench

    def _velocity(self, propeller: int) -> float:
        value = self._scripts[f"Quadricopter_propeller_respondable{propeller}"][_PARTICLE_VELOCITY]
        velocity = float(value)
        if not math.isfinite(velocity):
            raise ValueError(f"propeller {propeller}: particleVelocity {velocity}: must be finite")
        return velocity
