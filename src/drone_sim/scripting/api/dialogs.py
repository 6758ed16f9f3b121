"""`sim`: dialogs and consoles. What they say goes to the log, and to whoever shows `Windows`."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.windows import OK, Dialog
from drone_sim.scripting.script_log import say, shown

_STILL_OPEN, _STYLE = CONSTANTS["dlgret_still_open"], 0x1F  # the bits that say which buttons
_INPUT = CONSTANTS["dlgstyle_input"]
_BUTTONS = {
    _INPUT: (OK,),
    CONSTANTS["dlgstyle_ok"]: (OK,),
    CONSTANTS["dlgstyle_ok_cancel"]: (OK, "cancel"),
    CONSTANTS["dlgstyle_yes_no"]: ("yes", "no"),
}


class Dialogs:
    """The functions on dialogs and consoles. Nothing waits: a modal dialog is shown, and counts as answered."""

    def __init__(self, host: Host, ignored: Ignored):
        """Take what gives handles and has the windows, and what says that something is ignored."""
        self._new_handle = host.drawings.new_handle
        self._windows = host.windows
        self._ignored = ignored

    def displayDialog(
        self, title: Any, text: Any = "", style: Any = 0, modal: Any = False, initial: Any = "", *_looks: Any
    ) -> int:
        """Open a dialog, and write its title and text to the log; return a handle."""
        say(f"{_text(title)}: {_text(text)}")
        kind = style & _STYLE if isinstance(style, int) else 0
        typed = _text(initial or "") if kind == _INPUT and not modal else None
        handle = self._new_handle()
        buttons = () if modal else _BUTTONS.get(kind, ())
        self._windows.add_dialog(handle, Dialog(_text(title), _text(text), buttons, typed))
        return handle

    def getDialogResult(self, handle: int) -> int:
        """Return which button was pressed, sim.dlgret_still_open before; sim.dlgret_ok where nobody could press one."""
        dialog = self._windows.dialogs.get(handle)
        if dialog is not None and dialog.buttons and not dialog.answer:
            if self._windows.can_answer():
                return _STILL_OPEN
            self._ignored.say("getDialogResult", "nobody answers: sim.dlgret_ok is returned")
            self._windows.assume_ok(handle)
        answer = dialog.answer if dialog is not None else ""
        return CONSTANTS[f"dlgret_{answer or OK}"]

    def getDialogInput(self, handle: int) -> str:
        """Return what was written into a dialog that has been answered, '' where nobody has."""
        dialog = self._windows.dialogs.get(handle)
        return dialog.typed or "" if dialog is not None and dialog.answer else ""

    def endDialog(self, handle: int) -> int:
        """Close a dialog; return 1, or 0 where there is none."""
        return int(self._windows.close(self._windows.dialogs, handle))

    def auxiliaryConsoleOpen(self, title: Any, lines: Any = 0, *_looks: Any) -> int:
        """Open a console that shows its last lines, which also go to the log; return a handle."""
        handle = self._new_handle()
        self._windows.add_console(handle, _text(title), int(lines) if isinstance(lines, (int, float)) else 0)
        return handle

    def auxiliaryConsolePrint(self, handle: int, text: Any = None) -> int:
        """Print there, and to the log; without a text, empty the console; return 1."""
        if handle in self._windows.consoles:
            self._windows.print(handle, None if text is None else _text(text))
        if text is not None:
            say(_text(text).rstrip("\n"))
        return 1

    def auxiliaryConsoleShow(self, handle: int, show: Any = True) -> int:
        """Show or hide a console; return 1, or 0 where there is none."""
        if handle not in self._windows.consoles:
            return 0
        self._windows.show_console(handle, bool(show))
        return 1

    def auxiliaryConsoleClose(self, handle: int) -> int:
        """Close a console; return 1, or 0 where there is none."""
        return int(self._windows.close(self._windows.consoles, handle))


def _text(value: Any) -> str:
    return value if type(value) is str else shown(value)
