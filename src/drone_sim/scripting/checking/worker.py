"""A process that checks texts: a line of JSON for each, and a line of JSON back. It ends with its input.

The compilers of Python and Lua are asked in a process of its own: whatever a text makes of them, a time limit ends it.
"""

from __future__ import annotations

import json
import resource
import sys

from drone_sim.scripting.api.calls import contents, flat_name
from drone_sim.scripting.api.listing import apis
from drone_sim.scripting.checking.findings import Finding
from drone_sim.scripting.checking.lua import check_lua
from drone_sim.scripting.checking.python import check_python

_MEMORY = 2 << 30  # bytes


class Checker:
    """Checks texts against the names of the API."""

    def __init__(self) -> None:
        """Read the API."""
        found = apis()
        self._known = {name: {*contents(one)[1], *contents(one)[2]} for name, one in found.items()}
        flat = {flat_name(name, function) for name, one in found.items() for function in contents(one)[1]}
        self._flat = {*flat, "sim_call_type", *(f"sim_{constant}" for constant in contents(found["sim"])[2])}

    def check(self, text: str, is_lua: bool) -> list[Finding]:
        """Return what is wrong with a text."""
        if not is_lua:
            return check_python(text, self._known)
        try:
            from drone_sim.scripting.lua import source, state  # whoever writes Python needs no lupa
        except ImportError:
            return []
        found = source.LuaSource(text.encode("utf-8", "replace"))
        said = state.syntax_error(found.text, bool(found.flat_names) or "phases" in found.form)
        mixed = [Finding(max(found.mixed), 1, 0, source.mixed_forms(*found.mixed))] if found.mixed else []
        return [*mixed, *check_lua(text, self._known, self._flat, said)]


def main() -> None:
    """Answer until nobody asks any more."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    checker = Checker()
    for line in sys.stdin:
        asked = json.loads(line)
        print(json.dumps(checker.check(asked["text"], asked["lua"])), flush=True)


if __name__ == "__main__":
    main()
