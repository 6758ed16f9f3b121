"""Write docs/api.md, the functions of the script API, from the code: PYTHONPATH=src python docs/make_api.py.

api_names.txt says which names each generation of V-REP has: 3 for 3.x, 4 for 4.0 to 4.2, 5 for 4.3 and later, as its
manuals and headers list them.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api import ignored, unknown
from drone_sim.scripting.api.calls import Api, contents
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import Surroundings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.windows import Windows

HERE = Path(__file__).resolve().parent
PAGE = HERE / "api.md"
_INTRODUCTION = """\
# The script API

<!-- made by docs/make_api.py from the code: edit the docstrings there, and make it anew -->

What a child script reaches as `sim`, `simROS`, `simUI` and `simRemoteApi`, in Lua and in Python, under the names of
every generation of V-REP and CoppeliaSim. All names work at any time: `simGetObjectPosition` and
`sim.getObjectPosition` are the same function. A name that is in none of these tables is an error that names near ones,
where it is read; but `if simROS2 then` asks for a plugin, and is answered with nil.

- Positions are in m, angles in rad, forces in N. Orientations are Euler angles (alpha, beta, gamma; R = Rx Ry Rz) or
  quaternions (x, y, z, w), matrices 12 numbers, poses 7. Velocities are in the world frame. A relative name of a topic
  or parameter stands in the drone's namespace: `pose` is `/drone/pose`. Both differ from CoppeliaSim's in part:
  [scripts.md](scripts.md#where-this-differs).
- A field of the type uint8[], such as a picture's, arrives as a string, and goes as a string or a table:
  `string.byte(data, 1)` is its first byte.
- `sim.` and a constant's name, or `sim_` and the name: both have CoppeliaSim's value (simConst.h).
- An own function of drone_sim is marked so: CoppeliaSim has none of that name.
"""
_HEAD = "| 3.x | 4.0 to 4.2 | 4.3 and later | what it does |\n|---|---|---|---|\n"
_IGNORED_HEAD = "| 3.x | 4.0 to 4.2 | 4.3 and later | returns |\n|---|---|---|---|\n"


def apis() -> dict[str, Api]:
    """Return every module of the script API, of a drone that is not there."""
    scripts = Scripts()
    scripts.add("Drone", {})
    host: Any = SimpleNamespace(
        objects=ObjectTree(),
        sensors={},
        scripts=scripts,
        signals=Signals(),
        own_script="Drone",
        drawings=Drawings(shown=False),
        windows=Windows(),
    )
    sim = make_sim(host, Surroundings(lambda: 0.0, 0.05))
    return {"sim": sim, "simROS": make_sim_ros(MessageBus("drone")), **make_plugins(host)}


def same(functions: Mapping[str, Any]) -> list[tuple[Any, list[str]]]:
    """Return each function once, with all its names."""
    names: dict[Any, list[str]] = {}
    for name, function in functions.items():
        names.setdefault(getattr(function, "__func__", function), []).append(name)
    return list(names.items())


def is_ignored(function: Any) -> bool:
    """Tell whether a function of the API does nothing."""
    return bool(function.__module__ == ignored.__name__)


def text() -> str:
    """Return the page."""
    return "\n".join([_INTRODUCTION, *_implemented(), *_ignored(), *_absent()])


def _implemented() -> Iterator[str]:
    """Yield the sections of what does something, one for each file of scripting/api."""
    for module, api in apis().items():
        sections: dict[str, list[str]] = {}
        for function, names in same(contents(api)[1]):
            if is_ignored(function):
                continue
            what = _first_sentences(inspect.getdoc(function) or "")
            sections.setdefault(function.__module__, []).append(_row(module, names, what))
        for file, rows in sections.items():
            about = (importlib.import_module(file).__doc__ or "").split("\n")[0]
            title = about.split(": ", 1)[-1].rstrip(".")
            yield f"## {module}: {title}\n\n{_HEAD}{''.join(sorted(rows, key=str.lower))}"


def _first_sentences(doc: str) -> str:
    """Return the first paragraph of a docstring, on one line."""
    return " ".join(doc.split("\n\n")[0].split()).replace("|", "\\|")


def _row(module: str, names: list[str], what: str) -> str:
    known = {name: _GENERATIONS.get(name, "") if module == "sim" else "345" for name in sorted(names)}
    if not any(known.values()):
        own = f"`{module}.{names[0]}`"
        return f"| | | {own} (drone_sim's own) | {what} |\n"
    flat = [flat_name(module, name) for name, generations in known.items() if "3" in generations]
    fourth = [f"{module}.{name}" for name, generations in known.items() if "4" in generations]
    new = [f"{module}.{name}" for name, generations in known.items() if "5" in generations and "4" not in generations]
    kept = [f"{module}.{name}" for name, generations in known.items() if "5" in generations]
    return f"| {_listed(flat)} | {_listed(fourth)} | {_listed(new or kept)} | {what} |\n"


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def flat_name(module: str, name: str) -> str:
    """Return the name of a function in 3.x."""
    if module == "sim":
        return f"sim{name[0].upper()}{name[1:]}"
    return {"simROS": "simExtRosInterface_", "simUI": "simExtCustomUI_"}.get(module, f"{module}.") + name


def _ignored() -> Iterator[str]:
    """Yield the section of what is accepted and ignored."""
    yield "## Accepted and ignored\n\nThe log says so once for each function of a script.\n"
    for module, groups in {"sim": ignored.SIM, **ignored.MODULES}.items():
        found = contents(apis()[module])[1]
        for group in groups:
            idle = {name: gives for name, gives in group.functions.items() if is_ignored(found[name])}
            rows = [_row(module, [name], _returned(gives)) for name, gives in idle.items()]
            yield f"### {module}: {group.why}\n\n{_IGNORED_HEAD}{''.join(sorted(rows, key=str.lower))}"


def _returned(gives: Any) -> str:
    if gives is ignored.HANDLE:
        return "a new handle"
    return "nothing" if gives is None else f"`{gives!r}`"


def _absent() -> Iterator[str]:
    """Yield the sections of what is not here."""
    plugins = [f"| `{name}` | {why} |\n" for name, why in sorted(unknown.PLUGINS.items())]
    yield "## Plugins that are not here\n\n| plugin | why not, and what to use |\n|---|---|\n" + "".join(plugins)
    rows = [f"| {names} | {why} |\n" for names, why in _by_reason().items() if names]
    yield "## Functions of CoppeliaSim that are not here\n\n| functions | why not |\n|---|---|\n" + "".join(rows)


def _by_reason() -> dict[str, str]:
    """Return the functions of CoppeliaSim that are refused with a reason, those of one reason together."""
    known = contents(apis()["sim"])[1]
    missing: dict[str, list[str]] = {}
    for name in _GENERATIONS:
        why = unknown.why_absent(f"sim.{name}") if name not in known else ""
        if why:
            missing.setdefault(why, []).append(f"sim.{name}")
    return {_listed(sorted(names)): why for why, names in missing.items()}


_LINES = (HERE / "api_names.txt").read_text(encoding="utf-8").splitlines()
_GENERATIONS = dict(line.split() for line in _LINES if line and not line.startswith("#"))


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
