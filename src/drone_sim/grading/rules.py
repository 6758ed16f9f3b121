"""The rules of the game: what scripts may not do in a graded flight, unless the plan allows it.

They are checked by their effects, whatever function or language caused them: a body that was put elsewhere has jumped,
a push by a script acts on a body, a wall that was removed is gone. Whatever the plan's own timeline does is allowed.
The scene's own scripts may push vehicles and change the scene, also in a function that the submission calls.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from drone_sim.grading.plan import Plan
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.script import Script

_CALLED = {"call", "take_turn", "call_function", "call_own", "execute", "execute_own", "callback", "answer"}
_Value = TypeVar("_Value")


class ScriptWatch:
    """Knows whether the script that runs is one of the scene's, and counts what those do.

    Scripts call each other: what is done in a call is done by the script that is called.
    """

    def __init__(self) -> None:
        """Begin while no script runs."""
        self.is_scene = False
        self.count: Callable[[], dict[str, int]] = dict  # of changes by anybody
        self.by_scene: dict[str, int] = {}  # of changes by the scene's scripts
        self._before: dict[str, int] = {}

    def watched(self, script: Script, is_scene: bool) -> Script:
        """Return a script whose calls are watched."""
        return cast(Script, _Watched(script, functools.partial(self.run, is_scene)))

    def run(self, is_scene: bool, action: Callable[..., _Value], *arguments: Any) -> _Value:
        """Return what an action of a script returns."""
        outer = self.is_scene
        self._switch(is_scene)
        try:
            return action(*arguments)
        finally:
            self._switch(outer)

    def _switch(self, is_scene: bool) -> None:
        if self.is_scene != is_scene:
            now = self.count()
            if self.is_scene:
                for what, number in now.items():
                    self.by_scene[what] = self.by_scene.get(what, 0) + number - self._before.get(what, 0)
            self.is_scene, self._before = is_scene, now


class _Watched:
    """A script, as it is, whose calls go through `run`."""

    def __init__(self, script: Script, run: Callable[..., Any]):
        self._script, self._run = script, run

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._script, name)
        return functools.partial(self._run, found) if name in _CALLED else found


class RuleBroken(ValueError):
    """A script has done what the plan does not allow; one line says what, and when."""


class Rules:
    """Looks after every step what was done to the vehicles and to the scene."""

    def __init__(self, plan: Plan, simulation: Simulation, watch: ScriptWatch):
        """Hold a `plan` against a `simulation`, whose scripts are not loaded yet; `watch` watches them."""
        self._simulation, self._watch = simulation, watch
        self._bodies = {name: one.body for name, one in simulation.vehicles.items()}
        self._may_move, self._may_push, self._may_change = (word in plan.allowed for word in ("move", "push", "change"))
        watch.count = self._count
        self._began = self._done()
        self.accept()

    def _count(self) -> dict[str, int]:
        """Return how often the scene was rebuilt ('') and each vehicle was pushed, by anybody."""
        return {"": self._simulation.scene.rebuilt, **{name: one.pushes for name, one in self._bodies.items()}}

    def _done(self) -> dict[str, int]:
        """Return the same without what the scene's scripts have done."""
        theirs = self._watch.by_scene
        return {what: number - theirs.get(what, 0) for what, number in self._count().items()}

    def accept(self) -> None:
        """Accept everything that has been done so far as not done by a script, except a change of the scene."""
        self._teleports = {name: one.teleports for name, one in self._bodies.items()}
        self._began = {**self._done(), "": self._began[""]}

    def check(self) -> None:
        """Raise RuleBroken for what a script has done since."""
        done = self._done()
        if done[""] != self._began[""] and not self._may_change:
            self._refuse("changed", "the scene", "change")
        for name, body in self._bodies.items():
            vehicle = self._simulation.vehicles.get(name)
            is_moved = body.teleports != self._teleports[name] or vehicle is None or vehicle.body is not body
            if is_moved and not self._may_move:
                self._refuse("moved", name, "move")
            if done[name] != self._began[name] and not self._may_push:
                self._refuse("pushed", name, "push")

    def _refuse(self, done: str, what: str, action: str) -> None:
        at = self._simulation.time
        raise RuleBroken(
            f"a script {done} {what} at {at:.2f} s; the plan does not allow that (allowed: [{action}] would)"
        )
