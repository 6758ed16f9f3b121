"""Where objects are put while the simulation is stopped: V-REP begins there; here `start` reads the scene anew."""

from __future__ import annotations

from drone_sim.mechanics.frames import Matrix
from drone_sim.run.simulation import Simulation

Places = dict[str, Matrix]  # by the names of objects


class Arrangement:
    """Compares a stopped simulation with how it began."""

    def __init__(self, simulation: Simulation):
        """Take the simulation."""
        self._simulation = simulation
        self._era = -1
        self._initial: Places = {}

    def watch(self) -> None:
        """Remember how an era begins; call it before anything is done to the simulation."""
        if self._era != self._simulation.era:
            self._era = self._simulation.era
            self._initial = {} if self._simulation.running else self._places()

    def moved(self) -> Places:
        """Return where in the world what is that has been put somewhere else since the simulation stopped.

        Carried by an object that was moved is not moved.
        """
        objects = self._simulation.shared.objects
        changed = (name for name, place in self._places().items() if self._initial.get(name, place) != place)
        return {name: objects[objects.handle(name)].matrix() for name in changed}

    def put(self, places: Places) -> None:
        """Put objects there again, as far as there still are some of these names."""
        objects = self._simulation.shared.objects
        for name, place in places.items():
            if name in objects:
                objects[objects.handle(name)].put(place)

    def _places(self) -> Places:
        """Return where every object is: in the world what the dynamics moves, else in its parent."""
        objects = self._simulation.shared.objects
        found = (objects[handle] for handle in objects)
        return {one.name: one.local if one.body is None else one.matrix() for one in found}
