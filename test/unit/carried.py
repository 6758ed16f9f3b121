"""Carriers of sensors for tests: a body with a given state, a body on a circle, and a drone in its own world."""

import math
import weakref

from drone_sim.config.types import DatumParameters
from drone_sim.files.resources import package_path
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.state import Pose, State
from drone_sim.mechanics.wrench import Wrench
from drone_sim.sensors.sensor import Contact, Hit, Mounting
from drone_sim.world import World

SUB_STEP = 0.005
GRAVITY = -9.81
BODY = urdf.read(str(package_path() / "urdf" / "drone.urdf"))
ABOVE = Pose((0, 0, 1))
FLOOR = str(package_path() / "urdf" / "floor.png")
ZURICH = DatumParameters(latitude=47.397742, longitude=8.545594, altitude=488.0)
FIELD = (1.334e-6, 21.523e-6, -43.290e-6)


class Carried:
    """A body with sensors, whose `state` the test sets."""

    mass, gravity, teleports = BODY.mass, GRAVITY, 0
    datum, magnetic_field = ZURICH, FIELD
    thrusts = (0.0, 0.0, 0.0, 0.0)

    def __init__(self, state=None):
        self.state = state or State((0, 0, 0), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
        self.sensors = []
        self.count = 0
        self.hit, self.touched = None, []

    def fit(self, parameters, mount=IDENTITY, name="drone/one"):
        def pose():
            return frames.multiply(self.state.matrix, mount)

        sensor = parameters.make(Mounting(name, self, pose, SUB_STEP))
        sensor.reset()
        self.sensors.append(sensor)
        return sensor

    def ray(self, _start, _end):
        return self.hit

    def contacts(self):
        return self.touched

    def look(self):
        self.count += 1
        for sensor in self.sensors:
            sensor.look(self.count)

    def values(self, sensor):
        """Return the readings of a sensor since the last call, and clear them."""
        values_read = [reading.value for reading in sensor.readings]
        sensor.readings.clear()
        return values_read


class Circling(Carried):
    """A body on a circle (m, rad/s) about the z axis; its x axis points along the motion."""

    def __init__(self, radius, rate):
        self._radius, self._rate = radius, rate
        super().__init__(self._at(0.0))

    def _at(self, time):
        angle = self._rate * time
        (c, s), r, w = (math.cos(angle), math.sin(angle)), self._radius, self._rate
        turn = frames.to_quaternion(frames.from_rpy((0, 0, 0), (0, 0, angle + math.pi / 2)))
        return State((r * c, r * s, 0.0), turn, (-r * w * s, r * w * c, 0.0), (0.0, 0.0, w))

    def step(self):
        self.state = self._at((self.count + 1) * SUB_STEP)
        self.look()


class Flown(Carried):
    """The drone in a physics world."""

    def __init__(self, pose=ABOVE, gravity=GRAVITY, floor=True):
        self.world = World(SUB_STEP, gravity)
        weakref.finalize(self, self.world.close)
        self.world.solve_contacts_for_instruments()
        self.floor = self.world.add_floor(20.0, FLOOR) if floor else -1
        self.body = self.world.add_rigid_body(BODY, pose)
        self.names = {self.floor: "Floor"}
        self.gravity = gravity
        super().__init__(self.world.state(self.body))

    def add(self, name, shape, position):
        self.names[self.world.add_object(shape, Pose(position))] = name

    def ray(self, start, end):
        hit = self.world.queries.ray(start, end, self.body)
        return hit and Hit(hit.distance, self.names[hit.body], hit.normal)

    def contacts(self):
        return [Contact(self.names[contact.body], *contact[1:]) for contact in self.world.queries.contacts(self.body)]

    def move(self, pose):
        self.teleports += 1
        self.world.set_pose(self.body, pose)
        self.state = self.world.state(self.body)

    def step(self, sub_steps=1, force=(0, 0, 0), torque=(0, 0, 0)):
        """Apply a force (N) at the centre of mass and a torque (N m), both in the world frame, in each sub-step."""
        wrench = Wrench()
        wrench.add(force, torque, (0, 0, 0))
        for _ in range(sub_steps):
            self.world.advance({self.body: wrench}, 1)
            self.state = self.world.state(self.body)
            self.look()
