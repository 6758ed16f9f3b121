"""The script API without a simulation, for docs/api.md, editors and checks."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.scripting.api import ignored
from drone_sim.scripting.api.calls import Api, Declaration, contents, declaration_of, flat_name
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import SceneServices, ScriptContext
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros, make_sim_vision
from drone_sim.scripting.api.registry import CHILD, Scripts
from drone_sim.scripting.api.windows import Windows

_MANUAL = "https://manual.coppeliarobotics.com/en"
_PAGES = {
    "simROS": "rosInterf",
    "simUI": "simUI",
    "simVision": "simVision",
    "simOMPL": "simOMPL",
}  # of the manual, one for each plugin


def apis(objects: ObjectTree | None = None, services: SceneServices | None = None) -> dict[str, Api]:
    """Return the modules of the script API, without a simulation; only functions that need none may be called.

    Functions that read and move objects use `objects`, by default none.
    """
    scripts = Scripts()
    scripts.add("Drone", {})
    clock, objects, services = Clock(0.05), objects or ObjectTree(), services or SceneServices()
    host: Any = SimpleNamespace(
        context=ScriptContext(
            clock=clock,
            gravity=-9.81,
            drawings=Drawings(shown=False),
            windows=Windows(),
            objects=objects,
            velocities=VelocityMeter(objects, clock),
            scripts=scripts,
        ),
        sensors={},
        own_script="Drone",
        script_type=CHILD,
    )
    ros = make_sim_ros(MessageBus("drone"), host.context.clock)
    vision = make_sim_vision(host, services)
    return {
        "sim": make_sim(host, services),
        "simROS": ros,
        "simVision": vision,
        **make_plugins(host, services),
    }


@functools.cache
def classes_of_sim() -> tuple[type, ...]:
    """Return the classes whose methods are the functions of `sim`."""
    functions = contents(apis()["sim"])[1].values()
    return tuple(dict.fromkeys(type(function.__self__) for function in functions if inspect.ismethod(function)))


def declared(api: Api) -> Iterator[tuple[Declaration, Any]]:
    """Yield each function of a module once, with its declaration."""
    seen: set[int] = set()
    for function in contents(api)[1].values():
        declaration = declaration_of(function)
        if declaration is not None and id(declaration) not in seen:
            seen.add(id(declaration))
            yield declaration, function


def is_ignored(function: Any) -> bool:
    """Return whether a function of the API is accepted and ignored."""
    return bool(function.__module__ == ignored.__name__)


def first_paragraph(doc: str) -> str:
    return " ".join(doc.split("\n\n")[0].split())


def for_editors() -> dict[str, Any]:
    """Return all names of the API, for JSON.

    `functions`: rows of module, name, V-REP 3.x name, generations, arguments, description, address in the manual, and
    whether the function does nothing; `constants`: names and values in `sim`.
    """
    modules = apis()
    rows = [
        [
            *(module, name, flat_name(module, name), generations, arguments_of(function)),
            *(_sentence(function), _page(module, name, generations), is_ignored(function)),
        ]
        for module, api in modules.items()
        for declaration, function in declared(api)
        for name, generations in declaration.names.items()
    ]
    return {"functions": sorted(rows), "constants": dict(sorted(contents(modules["sim"])[2].items()))}


def _sentence(function: Any) -> str:
    if is_ignored(function):
        return "Accepted, and does nothing here."
    return first_paragraph(inspect.getdoc(function) or "")


_STARS: dict[Any, str] = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}


def arguments_of(function: Any) -> str:
    """Return a function's parameters without types: 'objectHandle, relativeTo=-1'."""
    if is_ignored(function):
        return "..."
    shown = []
    for parameter in inspect.signature(function).parameters.values():
        star = _STARS.get(parameter.kind, "")
        default = "" if parameter.default is parameter.empty else f"={parameter.default!r}"
        shown.append(f"{star}{parameter.name.lstrip('_')}{default}")
    return ", ".join(shown)


def _page(module: str, name: str, generations: str) -> str:
    """Return the address of a function's page in CoppeliaSim's manual; '' for drone_sim's own functions."""
    if not generations:
        return ""
    if module in _PAGES:
        return f"{_MANUAL}/{_PAGES[module]}.htm"
    return f"{_MANUAL}/regularApi/{flat_name(module, name)}.htm" if module == "sim" else ""
