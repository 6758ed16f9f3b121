"""Process that checks scripts: reads a request and writes its findings as a line of JSON each, until its input ends.

It is a separate process because a script may make a compiler of Python or Lua hang; its client ends it after a time.
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
    """Checks scripts against the names in the API."""

    def __init__(self) -> None:
        """Collect the names in the API."""
        modules = apis()
        self._known = {name: {*contents(api)[1], *contents(api)[2]} for name, api in modules.items()}
        flat = {flat_name(name, function) for name, api in modules.items() for function in contents(api)[1]}
        self._flat = {*flat, "sim_call_type", *(f"sim_{constant}" for constant in contents(modules["sim"])[2])}

    def check(self, text: str, is_lua: bool) -> list[Finding]:
        if not is_lua:
            return check_python(text, self._known)
        try:
            from drone_sim.scripting.lua import source, state  # imported here because Python scripts do not need lupa
        except ImportError:
            return []
        script = source.LuaSource(text.encode("utf-8", "replace"))
        error = state.syntax_error(script.text, bool(script.flat_names) or "phases" in script.form)
        mixed = [Finding(max(script.mixed), 1, 0, source.mixed_forms(*script.mixed))] if script.mixed else []
        return [*mixed, *check_lua(text, self._known, self._flat, error)]


def main() -> None:
    """Answer requests until the input ends."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    checker = Checker()
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(checker.check(request["text"], request["lua"])), flush=True)


if __name__ == "__main__":
    main()
