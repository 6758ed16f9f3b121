"""Rules of a graded flight: what scripts may not do to vehicles and to the scene unless the plan allows it.

The rules look at effects, whatever function or language caused them: a moved body was teleported, a push by a script
acts on a body, a removed wall is missing. The plan's own timeline may do everything. The scene's scripts may push
vehicles and change the scene, also in a function that the submission calls.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from drone_sim.grading.plan import Plan
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.script import Script

# The methods of a Script that run code of the script.
_RUNNING_METHODS = {"call", "take_turn", "call_function", "call_own", "execute", "execute_own", "callback", "answer"}
_Value = TypeVar("_Value")


class ScriptWatch:
    """Tracks whether the running script is one of the scene's, and counts the changes by the scene's scripts.

    Scripts call each other: a change during a call counts for the called script.
    """

    def __init__(self) -> None:
        self.is_scene = False  # whether the running script is one of the scene's
        self.count: Callable[[], dict[str, int]] = dict  # number of changes by anybody, by the changed thing
        self.scene_changes: dict[str, int] = {}  # number of changes by the scene's scripts
        self._count_before: dict[str, int] = {}  # when the running script was called

    def wrap(self, script: Script, is_scene: bool) -> Script:
        """Return a script that goes through `run` whenever it is called."""
        return cast(Script, _WatchedScript(script, functools.partial(self.run, is_scene)))

    def run(self, is_scene: bool, action: Callable[..., _Value], *arguments: Any) -> _Value:
        was_scene = self.is_scene
        self._switch(is_scene)
        try:
            return action(*arguments)
        finally:
            self._switch(was_scene)

    def _switch(self, is_scene: bool) -> None:
        if self.is_scene != is_scene:
            now = self.count()
            if self.is_scene:
                for name, count in now.items():
                    changes = count - self._count_before.get(name, 0)
                    self.scene_changes[name] = self.scene_changes.get(name, 0) + changes
            self.is_scene, self._count_before = is_scene, now


class _WatchedScript:
    """A proxy of a script whose running methods go through `run`."""

    def __init__(self, script: Script, run: Callable[..., Any]):
        self._script, self._run = script, run

    def __getattr__(self, name: str) -> Any:
        attribute = getattr(self._script, name)
        return functools.partial(self._run, attribute) if name in _RUNNING_METHODS else attribute


class RuleBroken(ValueError):
    """A script has done something that the plan does not allow; one line says what, and when."""


class Rules:
    """Checks after every step that scripts did nothing to the vehicles and the scene that the plan does not allow."""

    def __init__(self, plan: Plan, simulation: Simulation, watch: ScriptWatch):
        """Create this before the scripts are loaded; `watch` watches them."""
        self._simulation, self._watch = simulation, watch
        self._bodies = {name: vehicle.body for name, vehicle in simulation.vehicles.items()}
        self._may_move, self._may_push, self._may_change = (word in plan.allowed for word in ("move", "push", "change"))
        watch.count = self._count
        self._accepted = self._count_without_scene()
        self.accept()

    def _count(self) -> dict[str, int]:
        """Return how often the scene was rebuilt ('') and each vehicle was pushed, by anybody."""
        return {"": self._simulation.scene.rebuilt, **{name: body.pushes for name, body in self._bodies.items()}}

    def _count_without_scene(self) -> dict[str, int]:
        """Return `_count` without the changes by the scene's scripts."""
        by_scene = self._watch.scene_changes
        return {name: count - by_scene.get(name, 0) for name, count in self._count().items()}

    def accept(self) -> None:
        """Accept all teleports and pushes until now; a change of the scene is never accepted."""
        self._teleports = {name: body.teleports for name, body in self._bodies.items()}
        self._accepted = {**self._count_without_scene(), "": self._accepted[""]}

    def check(self) -> None:
        """Raise RuleBroken if a script has broken a rule since `accept`."""
        count = self._count_without_scene()
        if count[""] != self._accepted[""] and not self._may_change:
            self._refuse("changed", "the scene", "change")
        for name, body in self._bodies.items():
            vehicle = self._simulation.vehicles.get(name)
            is_moved = body.teleports != self._teleports[name] or vehicle is None or vehicle.body is not body
            if is_moved and not self._may_move:
                self._refuse("moved", name, "move")
            if count[name] != self._accepted[name] and not self._may_push:
                self._refuse("pushed", name, "push")

    def _refuse(self, participle: str, name: str, action: str) -> None:
        at = self._simulation.time
        raise RuleBroken(
            f"a script {participle} {name} at {at:.2f} s; the plan does not allow that (allowed: [{action}] would)"
        )
