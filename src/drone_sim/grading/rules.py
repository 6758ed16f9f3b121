"""The rules of the game: what scripts may not do in a graded flight, unless the plan allows it.

They are checked by their effects, whatever function or language caused them: a body that was put elsewhere has jumped,
a push by a script acts on a body, a wall that was removed is gone. Whatever the plan's own timeline does is allowed.
"""

from __future__ import annotations

from drone_sim.grading.plan import Plan
from drone_sim.run.simulation import Simulation


class RuleBroken(ValueError):
    """A script has done what the plan does not allow; one line says what, and when."""


class Rules:
    """Looks after every step what was done to the vehicles."""

    def __init__(self, plan: Plan, simulation: Simulation):
        """Hold a `plan` against a `simulation`, whose scripts are not loaded yet.

        Who pushes cannot be told where the scene has scripts on a vehicle's own parts, such as V-REP's on propellers:
        pushing is allowed there. So it is with changes of a scene that has scripts.
        """
        self._simulation = simulation
        self._bodies = {name: one.body for name, one in simulation.vehicles.items()}
        scene = simulation.parameters.scene
        has_scripts_on_parts = {one.object for one in scene.scripts} - {one.name for one in scene.objects}
        self._may_move = "move" in plan.allowed
        self._may_push = "push" in plan.allowed or bool(has_scripts_on_parts)
        self._may_change = "change" in plan.allowed or bool(scene.scripts)
        self._rebuilt = simulation.scene.rebuilt
        self.accept()

    def accept(self) -> None:
        """Accept everything that has been done so far as not done by a script."""
        self._known = {name: (one.jumps, one.pushes) for name, one in self._bodies.items()}

    def check(self) -> None:
        """Raise RuleBroken for what a script has done since."""
        if self._simulation.scene.rebuilt != self._rebuilt and not self._may_change:
            self._refuse("changed", "the scene", "change")
        for name, (jumps, pushes) in self._known.items():
            body, vehicle = self._bodies[name], self._simulation.vehicles.get(name)
            is_moved = body.jumps != jumps or vehicle is None or vehicle.body is not body
            if is_moved and not self._may_move:
                self._refuse("moved", name, "move")
            if body.pushes != pushes and not self._may_push:
                self._refuse("pushed", name, "push")

    def _refuse(self, done: str, what: str, action: str) -> None:
        at = self._simulation.time
        raise RuleBroken(
            f"a script {done} {what} at {at:.2f} s; the plan does not allow that (allowed: [{action}] would)"
        )
