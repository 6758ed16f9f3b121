"""One step: threads, actuation, dynamics, vision, sensing; and whether every vehicle is somewhere after it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from drone_sim.mechanics.clock import Clock
from drone_sim.run.simulation_setup import SimulationSetup
from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.vehicle import Vehicle

_NOWHERE = 1e9  # m, m/s and rad/s, summed


class Diverged(RuntimeError):
    """The dynamics has ended in numbers that mean nothing; one line that says when."""


class DivergenceCheck:
    """Looks after each step where the vehicles are."""

    def __init__(self, floor: FloorParameters, clock: Clock):
        """Take the floor, and the simulation's clock.

        Where the floor has an edge, the log says once who has gone past it.
        """
        self._clock = clock
        self._edge = floor.size / 2 if floor.edge else None  # m, of what a vehicle can stand on
        self._past: set[str] = set()

    def check(self, vehicles: Iterable[Vehicle]) -> None:
        """Raise Diverged where the position or velocity of a vehicle is not finite, or absurdly large."""
        for vehicle in vehicles:
            (x, y, z), _, (vx, vy, vz), (wx, wy, wz) = vehicle.body.state
            # Of a NaN no comparison is true. One sum, since this runs in every step.
            if not -_NOWHERE < x + y + z + vx + vy + vz + wx + wy + wz < _NOWHERE:
                where = f"position {x:g} {y:g} {z:g} m, velocity {vx:g} {vy:g} {vz:g} m/s"
                who = "" if vehicle.parameters.is_alone else f"{vehicle.name}: "
                raise Diverged(
                    f"the simulation has diverged at t = {self._clock.time:.2f} s: {who}{where}; `start` begins again"
                )
            if self._edge is not None and max(abs(x), abs(y)) > self._edge:
                self._tell(vehicle, x, y)

    def _tell(self, vehicle: Vehicle, x: float, y: float) -> None:
        if vehicle.name not in self._past:
            self._past.add(vehicle.name)
            who = "the drone" if vehicle.parameters.is_alone else vehicle.name
            LOG.warning("%s left the floor at x=%.2f y=%.2f m: nothing is below it", who, x, y)


class Stepper:
    """Steps what has been set up through one run. What it calls is listed when that changes, and not in every step."""

    def __init__(self, setup: SimulationSetup):
        """Begin a run at time 0."""
        self._scripts, self._context, self._clock = setup.scripts, setup.context, setup.context.clock
        self._world, self._operations = setup.context.world, setup.operations
        self._velocities = setup.context.velocities
        self._sub_steps = setup.parameters.sub_steps
        self._vehicles = setup.vehicles
        self.lay_floor(setup.parameters.scene.floor)
        self._clock.steps = 0
        self.list_vehicles()

    def lay_floor(self, floor: FloorParameters) -> None:
        """Take another floor: past its edge, vehicles fall."""
        self._divergence_check = DivergenceCheck(floor, self._clock)

    def list_vehicles(self) -> None:
        """Know who flies: a vehicle has come or gone."""
        self.flying = tuple(self._vehicles.values())
        self._bodies = tuple(vehicle.body.number for vehicle in self.flying)
        self.feel_weather()

    def feel_weather(self) -> None:
        """Give every vehicle the forces that the present weather needs."""
        self._weather_felt = self._context.weather.changes
        for vehicle in self.flying:
            vehicle.feel_weather()
        self._context.tunings += 1
        self._any_between = any(vehicle.sub_step_forces or vehicle.instruments for vehicle in self.flying)
        self.list_scripts()

    def list_scripts(self) -> None:
        """Know which scripts there are: some have come or gone."""
        scripts = self._scripts
        self._alone = () if scripts.attached else tuple(scripts.child_scripts.values())  # they need no order
        self._threaded = tuple(one for one in scripts.all() if one.script.threaded)

    def step(self, watch: Callable[[int], None] | None = None) -> None:
        """Do what Simulation.step says."""
        vehicles, carried = self.flying, self._context.carried
        if self._threaded or self._scripts.is_changed or self._weather_felt != self._context.weather.changes:
            self._begin_step()
        for script in self._alone or self._scripts.all():
            script.actuation()
        self._velocities.begin_step()
        wrenches = dict(zip(self._bodies, map(Vehicle.wrench, vehicles)))
        carries = carried.shapes or carried.bases
        if carries:
            carried.follow()
        between = self._sub_steps_watched(watch) if self._any_between else watch
        self._world.advance(wrenches, self._sub_steps, between)
        for vehicle in vehicles:
            vehicle.body.refresh()
        if carries:
            carried.follow()
        self._velocities.end_step()
        self._clock.steps += 1
        self._divergence_check.check(vehicles)
        for vehicle in vehicles:
            vehicle.take_pictures(self._clock.steps)
        self._follow_scripts()
        self._sense()

    def _sense(self) -> None:
        self._clock.is_sensing = True
        try:
            for script in self._alone or self._scripts.all():
                script.sensing()
        finally:
            self._clock.is_sensing = False

    def _follow_scripts(self) -> None:
        """Begin and end the scripts of objects that have come and gone."""
        if self._scripts.is_changed:
            self._scripts.follow(self._operations)
            self.list_scripts()

    def _begin_step(self) -> None:
        """Follow scripts that have come or gone and a change of the weather; let each thread run for its turn."""
        self._follow_scripts()
        if self._weather_felt != self._context.weather.changes:
            self.feel_weather()
        for thread in self._threaded:
            if thread.script.threaded:
                thread.script.take_turn()

    def _sub_steps_watched(self, watch: Callable[[int], None] | None) -> Callable[[int], None]:
        """Return what is to be called before and after sub-steps, where anything is due there."""
        if watch is None:
            return self._between

        def between(count: int) -> None:
            watch(count)
            self._between(count)

        return between

    def _between(self, count: int) -> None:
        """Do what is due after so many sub-steps of the step: instruments look, and forces follow."""
        if count:
            for vehicle in self.flying:
                vehicle.after_sub_step(self._clock.steps * self._sub_steps + count)
        if count < self._sub_steps:
            for vehicle in self.flying:
                vehicle.before_sub_step()
