"""Write docs/api.md, the functions of the script API, from the code: PYTHONPATH=src python docs/make_api.py.

A function's declaration says which generations of V-REP have it; api_names.txt says what else they have, as their
manuals and headers list it. The examples are those of the tests, which call each of them.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drone_sim.scripting.api import ignored, unknown
from drone_sim.scripting.api.calls import Declaration, contents, flat_name
from drone_sim.scripting.api.listing import apis, arguments_of, declared, first_paragraph, is_ignored

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "test" / "unit"))
from api_examples import ANY, OMPL, REMOTE_API, SIM, Example  # noqa: E402
from api_examples_ros import ROS  # noqa: E402
from api_examples_vision import VISION  # noqa: E402

EXAMPLES = {"sim": SIM, "simROS": ROS, "simVision": VISION, "simRemoteApi": REMOTE_API, "simOMPL": OMPL}
PAGE = HERE / "api.md"
_INTRODUCTION = """\
# The script API

<!-- made by docs/make_api.py from the code: edit the docstrings there, and make it anew -->

These are the functions of `sim`, `simROS`, `simUI` and `simRemoteApi` for child scripts, in Lua and in Python, with the
names of every version of V-REP and CoppeliaSim. You may mix the names: `simGetObjectPosition` and
`sim.getObjectPosition` are the same function. If you use a name that is in none of these tables, the error suggests
similar names. (`if simROS2 then` asks for a plugin; it is nil, and no error.)

- Positions are in m, angles in rad, forces in N. Orientations are Euler angles (alpha, beta, gamma; R = Rx Ry Rz) or
  quaternions (x, y, z, w). A matrix has 12 numbers, a pose 7. A relative name of a topic or parameter is in the drone's
  namespace: `pose` is `/drone/pose`. CoppeliaSim differs here: [scripts.md](scripts.md#where-this-differs).
- In Lua, you get a field of the type uint8[], such as a picture, as a string: `string.byte(data, 1)` is its first byte.
  You may send it as a string or a table.
- A constant is `sim.` and its name, or `sim_` and its name. It has CoppeliaSim's value (simConst.h).
- The first column shows how to call a function. You can leave out a value with `=`; `*` stands for any number of
  values. *Other names* are those of 3.x (`simGetObjectPosition`) and of some versions of 4.x. A function without a name
  of 3.x is new in 4.x.
- "drone_sim's own" functions do not exist in CoppeliaSim.
- An example is a line of Lua, and what it returns behind `->`; `…` is any value. In Python, write `[1, 2, 3]` for
  `{1,2,3}`. The tests run each example in both languages. In it, `BASE`, `DRONE`, `TARGET`, `CAMERA`, ... are handles
  of objects, and `REFUSED(f, ...)` is the error that `f(...)` raises.
"""
_LONG = re.compile(r"\d+\.\d{6,}")
_HEAD = "| function | other names | what it does |\n|---|---|---|\n"
_IGNORED_HEAD = "| 3.x | 4.0 to 4.2 | 4.3 and later | returns |\n|---|---|---|---|\n"


def text() -> str:
    """Return the page."""
    return "\n".join([_INTRODUCTION, *_implemented(), *_ignored(), *_absent()])


def _implemented() -> Iterator[str]:
    """Yield the sections of what does something, one for each class of scripting/api."""
    for module, api in apis().items():
        sections: dict[str, list[str]] = {}
        for declaration, function in declared(api):
            if not is_ignored(function):
                sections.setdefault(_section(function), []).append(_described(declaration, function))
        for title, rows in sections.items():
            yield f"## {module}: {title}\n\n{_HEAD}{''.join(sorted(rows, key=str.lower))}"


def _section(function: Any) -> str:
    """Return the title of the section of a function: the first line on its class."""
    of = getattr(sys.modules[function.__module__], function.__qualname__.partition(".")[0])
    title = (inspect.getdoc(of) or "").split("\n")[0].rstrip(".")
    return title[:1].lower() + title[1:]


def _described(declaration: Declaration, function: Any) -> str:
    """Return the row of a function: how it is called under its newest name, its other names, what it does."""
    module, known = declaration.module, declaration.names
    newest = max(known, key=lambda name: max(known[name], default=""))
    what = first_paragraph(inspect.getdoc(function) or "")
    example = next((found[0] for name in known if (found := EXAMPLES[module].get(name))), None)
    if example is not None:
        what += f"<br>{_shown(example, f'{module}.{newest}')}"
    return _in_table(
        f"`{module}.{newest}({arguments_of(function)})`{_mark(known[newest])}", _others(declaration, newest), what
    )


def _others(declaration: Declaration, newest: str) -> str:
    """Return the names but the newest one: those of 3.x, and those that other versions of 4.x have."""
    module, known = declaration.module, dict(sorted(declaration.names.items()))
    flat = [f"`{flat_name(module, name)}`" for name, generations in known.items() if "3" in generations]
    later = [
        f"`{module}.{name}`{_mark(generations)}"
        for name, generations in known.items()
        if name != newest and not {"4", "5"}.isdisjoint(generations)
    ]
    return ", ".join([*flat, *later])


def _mark(generations: str) -> str:
    """Return which versions of 4.x have a name, where not all do."""
    if not generations:
        return " (drone_sim's own)"
    return {"": " (3.x)", "4": " (to 4.2)", "5": " (from 4.3)"}.get(generations.replace("3", ""), "")


def _shown(example: Example, name: str) -> str:
    """Return an example, and what it returns, as Lua writes it."""
    call = _LONG.sub(lambda number: f"{float(number[0]):.4g}", example.call.replace("NAME", name))
    return f"`{call} -> {', '.join(map(_in_lua, example.returns))}`" if example.returns else f"`{call}`"


def _in_lua(value: Any) -> str:
    value = getattr(value, "expected", value)  # of pytest's approx
    if value is ANY:
        return "…"
    if isinstance(value, list | tuple):
        return f"{{{', '.join(map(_in_lua, value))}}}"
    if isinstance(value, str):
        return f"'{value}'" if value.isprintable() else repr(value)
    return str(value).lower() if isinstance(value, bool) else f"{value:.4g}" if isinstance(value, float) else str(value)


def _in_table(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


def _row(declaration: Declaration, what: str) -> str:
    module, known = declaration.module, dict(sorted(declaration.names.items()))
    flat = [flat_name(module, name) for name, generations in known.items() if "3" in generations]
    fourth = [f"{module}.{name}" for name, generations in known.items() if "4" in generations]
    new = [f"{module}.{name}" for name, generations in known.items() if "5" in generations and "4" not in generations]
    kept = [f"{module}.{name}" for name, generations in known.items() if "5" in generations]
    return f"| {_listed(flat)} | {_listed(fourth)} | {_listed(new or kept)} | {what} |\n"


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _ignored() -> Iterator[str]:
    """Yield the section of what is accepted and ignored."""
    yield "## Accepted and ignored\n\nThe log says so once for each function of a script.\n"
    for module, groups in ignored.MODULES.items():
        for group in groups:
            rows = [
                _row(Declaration(module, {name: generations}), _returned(returned))
                for name, (generations, returned) in group.functions.items()
            ]
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
    for name in _OTHERS:
        why = unknown.why_absent(f"sim.{name}") if name not in known else ""
        if why:
            missing.setdefault(why, []).append(f"sim.{name}")
    return {_listed(sorted(names)): why for why, names in missing.items()}


_LINES = (HERE / "api_names.txt").read_text(encoding="utf-8").splitlines()
_OTHERS = [line.split()[0] for line in _LINES if line and not line.startswith("#")]


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
