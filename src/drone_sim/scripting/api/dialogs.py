"""`sim`: what a script tells a person in a window goes to the log."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.script_log import say

_OK = CONSTANTS["dlgret_ok"]


class Dialogs:
    """The functions on dialogs and consoles."""

    def __init__(self, host: Host, ignored: Ignored):
        """Take what gives handles, and what says that something is ignored."""
        self._new_handle = host.drawings.new_handle
        self._ignored = ignored

    def displayDialog(self, title: Any, text: Any = "", *_looks: Any) -> int:
        """Write a dialog's title and text to the log; return a handle. Whoever asks gets `ok` for an answer."""
        say(f"{title}: {text}")
        return self._new_handle()

    def getDialogResult(self, _handle: int) -> int:
        """Return sim.dlgret_ok: nobody can say anything else."""
        self._ignored.say("getDialogResult", "nobody answers: sim.dlgret_ok is returned")
        return _OK

    def getDialogInput(self, _handle: int) -> str:
        """Return '': nobody writes anything."""
        self._ignored.say("getDialogInput", "nobody answers: '' is returned")
        return ""

    def auxiliaryConsoleOpen(self, title: Any, *_looks: Any) -> int:
        """Open a console, whose lines go to the log; return a handle."""
        return self._new_handle()

    def auxiliaryConsolePrint(self, _handle: int, text: Any = None) -> int:
        """Write to the log; without a text, which empties the console, do nothing; return 1."""
        if text is not None:
            say(str(text).rstrip("\n"))
        return 1
