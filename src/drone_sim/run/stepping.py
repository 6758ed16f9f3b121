"""Execution of one step (scripts, forces, advance, read back, sense), and detection of divergence."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.wrench import Wrench
from drone_sim.run.simulation_setup import SimulationSetup
from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.vehicle import Vehicle

_MAX_SUM = 1e9  # of position (m), velocity (m/s) and angular velocity (rad/s)


class Diverged(RuntimeError):
    """The state of a vehicle became NaN or absurdly large. The message is one line with the time."""


class DivergenceCheck:
    """Detector of vehicles whose state is not finite, or that left the floor."""

    def __init__(self, floor: FloorParameters, clock: Clock):
        """Use a floor and the simulation's clock.

        If the floor has an edge, each vehicle that crosses it is logged once; one that begins beside the floor is not.
        """
        self._clock = clock
        self._edge = floor.size / 2 if floor.edge else None  # m, largest |x| and |y| on the floor
        self._over_floor: set[str] = set()  # names of vehicles that have been there
        self._left_floor: set[str] = set()

    def check(self, vehicles: Iterable[Vehicle]) -> None:
        """Raise Diverged if the position or velocity of a vehicle is not finite, or absurdly large."""
        for vehicle in vehicles:
            (x, y, z), _, (vx, vy, vz), (wx, wy, wz) = vehicle.body.state
            # A NaN makes the comparison false. A single sum keeps this per-step check cheap.
            if not -_MAX_SUM < x + y + z + vx + vy + vz + wx + wy + wz < _MAX_SUM:
                where = f"position {x:g} {y:g} {z:g} m, velocity {vx:g} {vy:g} {vz:g} m/s"
                name = "" if vehicle.parameters.is_alone else f"{vehicle.name}: "
                raise Diverged(
                    f"the simulation has diverged at t = {self._clock.time:.2f} s: {name}{where}; `start` begins again"
                )
            if self._edge is None:
                continue
            if max(abs(x), abs(y)) <= self._edge:
                self._over_floor.add(vehicle.name)
            elif vehicle.name in self._over_floor and vehicle.name not in self._left_floor:
                self._left_floor.add(vehicle.name)
                name = "the drone" if vehicle.parameters.is_alone else vehicle.name
                LOG.warning("%s left the floor at x=%.2f y=%.2f m: nothing is below it", name, x, y)


class Stepper:
    """Execution of the steps of one run. Lists of vehicles and scripts are cached, and rebuilt only after a change."""

    def __init__(self, setup: SimulationSetup):
        """Begin a run at time 0."""
        self._scripts, self._context, self._clock = setup.scripts, setup.context, setup.context.clock
        self._world, self._operations = setup.context.world, setup.operations
        self._hold_linked_dummies = setup.scene.hold_linked_dummies
        self._velocities = setup.context.velocities
        self._sub_steps = setup.parameters.sub_steps
        self._vehicles = setup.vehicles
        self.set_floor(setup.parameters.scene.floor)
        self._clock.steps = 0
        self.refresh_vehicles()

    def set_floor(self, floor: FloorParameters) -> None:
        """Use another floor for the check whether vehicles left it."""
        self._divergence_check = DivergenceCheck(floor, self._clock)

    def refresh_vehicles(self) -> None:
        """Refresh the vehicle lists after a vehicle was added or removed."""
        self.flying = tuple(self._vehicles.values())
        self.update_wind_forces()

    def update_wind_forces(self) -> None:
        """Update the forces of every vehicle after a change of the weather."""
        self._weather_change_seen = self._context.weather.changes
        for vehicle in self.flying:
            vehicle.update_wind_forces()
        self._context.tunings += 1
        # Vehicles with work in every sub-step: each with what updates its instruments, None without any.
        looks = [(vehicle, vehicle.instruments.look if vehicle.instruments else None) for vehicle in self.flying]
        self._in_sub_steps = [(vehicle, look) for vehicle, look in looks if look or vehicle.sub_step_forces]
        self.list_scripts()

    def list_scripts(self) -> None:
        """Refresh the script lists after scripts were added or removed."""
        scripts = self._scripts
        # The order of child scripts matters only if there are attached scripts.
        self._unordered = () if scripts.attached else tuple(scripts.child_scripts.values())
        self._threaded = tuple(hosted for hosted in scripts.all() if hosted.script.threaded)

    def step(self, watch: Callable[[int], None] | None = None) -> None:
        """Run one step as Simulation.step documents."""
        if self._threaded or self._scripts.is_changed or self._weather_change_seen != self._context.weather.changes:
            self._begin_step()
        self._actuate()
        wrenches = self._sum_forces()
        self._advance(wrenches, watch)
        self._read_back()
        self._sense()

    # ---- phases

    def _actuate(self) -> None:
        """Let the scripts command the propellers, apply forces and place objects."""
        for script in self._unordered or self._scripts.all():
            script.actuation()

    def _sum_forces(self) -> dict[int, Wrench]:
        """Return the sum of each vehicle's forces, by body."""
        wrenches = {}
        for vehicle in self.flying:
            wrenches[vehicle.body.number] = vehicle.wrench()
        return wrenches

    def _advance(self, wrenches: dict[int, Wrench], watch: Callable[[int], None] | None) -> None:
        """Take the sub-steps, with the vehicles' forces and instruments that follow each of them."""
        self._velocities.begin_step()
        carried = self._context.carried
        if carried.shapes or carried.bases:
            carried.follow()
        self._hold_linked_dummies()
        between = self._with_watch(watch) if self._in_sub_steps else watch
        self._world.advance(wrenches, self._sub_steps, between)

    def _read_back(self) -> None:
        """Read the vehicles' states; measure velocities, and check that the states are finite."""
        carried = self._context.carried
        for vehicle in self.flying:
            vehicle.body.refresh()
        if carried.shapes or carried.bases:
            carried.follow()
        self._velocities.end_step()
        self._clock.steps += 1
        self._divergence_check.check(self.flying)

    def _sense(self) -> None:
        """Take the pictures that are due, then let the scripts sense."""
        for vehicle in self.flying:
            vehicle.take_pictures(self._clock.steps)
        if self._scripts.is_changed:
            self._follow_scripts()
        self._clock.is_sensing = True
        try:
            for script in self._unordered or self._scripts.all():
                script.sensing()
        finally:
            self._clock.is_sensing = False

    # ---- parts of phases

    def _follow_scripts(self) -> None:
        """Start and end scripts of objects that were added or removed."""
        self._scripts.follow(self._operations)
        self.list_scripts()

    def _begin_step(self) -> None:
        """Apply changes of scripts and weather, then run each script thread until it yields."""
        if self._scripts.is_changed:
            self._follow_scripts()
        if self._weather_change_seen != self._context.weather.changes:
            self.update_wind_forces()
        for thread in self._threaded:
            if thread.script.threaded:
                thread.script.take_turn()

    def _with_watch(self, watch: Callable[[int], None] | None) -> Callable[[int], None]:
        """Return the callback for World.advance: `watch`, if any, then _at_sub_step."""
        if watch is None:
            return self._at_sub_step

        def between(count: int) -> None:
            watch(count)
            self._at_sub_step(count)

        return between

    def _at_sub_step(self, count: int) -> None:
        """After `count` sub-steps of the step, read the instruments, then apply the forces for the next one."""
        number, is_last = self._clock.steps * self._sub_steps + count, count == self._sub_steps
        for vehicle, look in self._in_sub_steps:
            vehicle.body.refresh()
            if count and look:
                look(number)
            if vehicle.sub_step_forces and not is_last:
                vehicle.body.apply(vehicle.sub_step_forces)
