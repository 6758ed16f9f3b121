"""`sim`: floating views, dialogs and consoles, limited in number and size."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.script_log import say, shown

MOST = 16  # windows of each kind; if there are more, the oldest are closed
_TITLE, _TEXT, _LINE, _LINES = 200, 4000, 300, 100  # characters; the last one: lines of a console

OK = "ok"
_Kind = TypeVar("_Kind")
_STILL_OPEN, _STYLE = CONSTANTS["dlgret_still_open"], 0x1F  # _STYLE: the bits for the buttons
_INPUT = CONSTANTS["dlgstyle_input"]
_BUTTONS = {
    _INPUT: (OK,),
    CONSTANTS["dlgstyle_ok"]: (OK,),
    CONSTANTS["dlgstyle_ok_cancel"]: (OK, "cancel"),
    CONSTANTS["dlgstyle_yes_no"]: ("yes", "no"),
}


@dataclass
class View:
    """A view of a vision sensor's picture; `sensor` is the object's name, '' before a script has chosen one."""

    sensor: str = ""
    label: str = ""


@dataclass
class Dialog:
    """A dialog with a title, a text, buttons, and an input field unless `typed` is None.

    `answer` is the pressed button, '' before.
    """

    title: str
    text: str
    buttons: tuple[str, ...] = ()
    typed: str | None = None
    answer: str = ""


@dataclass
class Console:
    """A console with its last lines."""

    title: str
    lines: deque[str] = field(default_factory=deque)
    shown: bool = True


class Windows:
    """The open windows of a run, by handle. `changes` is a counter from which viewers notice changes."""

    def __init__(self) -> None:
        self.readers: set[Callable[[], bool]] = set()  # viewers; each returns whether it can answer dialogs now
        self.views: dict[int, View] = {}
        self.dialogs: dict[int, Dialog] = {}
        self.consoles: dict[int, Console] = {}
        self.changes = 0

    # ---- for scripts

    def add_view(self, handle: int) -> None:
        self._put(self.views, handle, View())

    def aim(self, handle: int, sensor: str, label: str) -> None:
        """Show a vision sensor's picture in a view."""
        self.views[handle] = View(sensor, label[:_TITLE])
        self.changes += 1

    def add_dialog(self, handle: int, dialog: Dialog) -> None:
        dialog.title, dialog.text = dialog.title[:_TITLE], dialog.text[:_TEXT]
        if dialog.typed is not None:
            dialog.typed = dialog.typed[:_TEXT]
        self._put(self.dialogs, handle, dialog)

    def add_console(self, handle: int, title: str, lines: int) -> None:
        """Open a console with a number of lines, which is limited."""
        kept: deque[str] = deque(maxlen=min(max(1, lines), _LINES))
        self._put(self.consoles, handle, Console(title[:_TITLE], kept))

    def print(self, handle: int, text: str | None) -> None:
        """Print to a console, at the end of its last line; None clears it."""
        console = self.consoles[handle]
        self.changes += 1
        if text is None:
            console.lines.clear()
            return
        first, *others = text[-_LINE * _LINES :].split("\n")
        before = console.lines.pop() if console.lines else ""
        console.lines.extend(line[:_LINE] for line in (before + first, *others))

    def show_console(self, handle: int, shown: bool) -> None:
        self.consoles[handle].shown = shown
        self.changes += 1

    def close(self, kind: dict[int, Any], handle: int) -> bool:
        """Close a window of a kind; return whether it was open."""
        self.changes += handle in kind
        return kind.pop(handle, None) is not None

    def _put(self, kind: dict[int, _Kind], handle: int, window: _Kind) -> None:
        while len(kind) >= MOST:
            del kind[next(iter(kind))]
        kind[handle] = window
        self.changes += 1

    # ---- for viewers

    def can_answer(self) -> bool:
        """Return whether any viewer can answer dialogs."""
        return any(can_answer() for can_answer in self.readers)

    def answer(self, handle: int, button: str, typed: str = "") -> None:
        """Press a button of an open dialog. Raises ValueError if the dialog or the button does not exist."""
        dialog = self.dialogs.get(handle)
        if dialog is None or dialog.answer:
            raise ValueError(f"there is no open dialog with the handle {handle}")
        if button not in dialog.buttons:
            known = " and ".join(dialog.buttons) or "none"
            raise ValueError(f"the dialog '{dialog.title}' has no button '{button[:80]}', but {known}")
        dialog.answer = button
        if dialog.typed is not None:
            dialog.typed = typed[:_TEXT]
        self.changes += 1

    def assume_ok(self, handle: int) -> None:
        """Answer a dialog with ok and without text, because there is no viewer."""
        dialog = self.dialogs[handle]
        dialog.answer, dialog.typed = OK, None
        self.changes += 1

    def state(self) -> dict[str, list[dict[str, Any]]]:
        """Return the visible windows for JSON."""
        open_dialogs = {handle: dialog for handle, dialog in self.dialogs.items() if not dialog.answer}
        shown = {handle: console for handle, console in self.consoles.items() if console.shown}
        return {
            "views": [{"handle": handle, **vars(view)} for handle, view in self.views.items() if view.sensor],
            "dialogs": [
                {"handle": handle, **{key: getattr(dialog, key) for key in ("title", "text", "buttons", "typed")}}
                for handle, dialog in open_dialogs.items()
            ],
            "consoles": [
                {"handle": handle, "title": console.title, "lines": list(console.lines)}
                for handle, console in shown.items()
            ],
        }

    # ---- runs and snapshots

    def clear(self) -> None:
        self._replace({}, {}, {})

    def save_state(self) -> Callable[[], None]:
        kept = copy.deepcopy((self.views, self.dialogs, self.consoles))
        return lambda: self._replace(*copy.deepcopy(kept))

    def _replace(self, views: dict[int, View], dialogs: dict[int, Dialog], consoles: dict[int, Console]) -> None:
        if views or dialogs or consoles or self.views or self.dialogs or self.consoles:
            self.changes += 1
        self.views, self.dialogs, self.consoles = views, dialogs, consoles


def read_answer(answer: Any) -> tuple[int, str, str]:
    """Return handle, button and text of an answer from JSON. Raises ValueError."""
    if not isinstance(answer, Mapping) or not isinstance(answer.get("handle"), int):
        raise ValueError("an answer must have a handle (a whole number) and a button, and may have a typed text")
    button, typed = answer.get("button"), answer.get("typed") or ""
    if not (isinstance(button, str) and isinstance(typed, str)):
        raise ValueError("the button and the typed text of an answer must be strings")
    return answer["handle"], button, typed


class Dialogs:
    """Dialogs and consoles, in the log and in the cockpit.

    No function waits: a modal dialog is shown, and counts as answered."""

    def __init__(self, windows: Windows, new_handle: Callable[[], int], ignored: Ignored):
        """`windows` are those of the run, `new_handle` returns an unused handle, `ignored` logs what is ignored."""
        self._new_handle = new_handle
        self._windows = windows
        self._ignored = ignored

    @sim("345")
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

    @sim("345")
    def getDialogResult(self, handle: int) -> int:
        """Return the pressed button: sim.dlgret_still_open before, sim.dlgret_ok if there is no viewer."""
        dialog = self._windows.dialogs.get(handle)
        if dialog is not None and dialog.buttons and not dialog.answer:
            if self._windows.can_answer():
                return _STILL_OPEN
            self._ignored.log("getDialogResult", "nobody can answer here: sim.dlgret_ok is returned")
            self._windows.assume_ok(handle)
        answer = dialog.answer if dialog is not None else ""
        return CONSTANTS[f"dlgret_{answer or OK}"]

    @sim("345")
    def getDialogInput(self, handle: int) -> str:
        """Return the text that was typed into a dialog; '' before an answer."""
        dialog = self._windows.dialogs.get(handle)
        return dialog.typed or "" if dialog is not None and dialog.answer else ""

    @sim("345")
    def endDialog(self, handle: int) -> int:
        """Close a dialog; return 1, or 0 if there is none."""
        return int(self._windows.close(self._windows.dialogs, handle))

    @sim("345")
    def auxiliaryConsoleOpen(self, title: Any, lines: Any = 0, *_looks: Any) -> int:
        """Open a console that shows its last lines, which also go to the log; return a handle."""
        handle = self._new_handle()
        self._windows.add_console(handle, _text(title), int(lines) if isinstance(lines, (int, float)) else 0)
        return handle

    @sim("345")
    def auxiliaryConsolePrint(self, handle: int, text: Any = None) -> int:
        """Print to a console and to the log; without a text, clear the console; return 1."""
        if handle in self._windows.consoles:
            self._windows.print(handle, None if text is None else _text(text))
        if text is not None:
            say(_text(text).rstrip("\n"))
        return 1

    @sim("345")
    def auxiliaryConsoleShow(self, handle: int, show: Any = True) -> int:
        """Show or hide a console; return 1, or 0 if there is none."""
        if handle not in self._windows.consoles:
            return 0
        self._windows.show_console(handle, bool(show))
        return 1

    @sim("345")
    def auxiliaryConsoleClose(self, handle: int) -> int:
        """Close a console; return 1, or 0 if there is none."""
        return int(self._windows.close(self._windows.consoles, handle))


def _text(value: Any) -> str:
    return value if type(value) is str else shown(value)


class Views:
    """Floating views, in the cockpit."""

    def __init__(self, windows: Windows, new_handle: Callable[[], int], objects: ObjectTree):
        """`windows` are those of the run, `new_handle` returns an unused handle, `objects` include the sensors."""
        self._new_handle = new_handle
        self._objects = objects
        self._windows = windows

    @sim("345")
    def floatingViewAdd(self, *_place: Any) -> int:
        """Open a floating view, which is empty until sim.adjustView; return its handle."""
        handle = self._new_handle()
        self._windows.add_view(handle)
        return handle

    @sim("345")
    def adjustView(self, view: int, sensor: int, _options: Any = 0, label: Any = None) -> int:
        """Show a vision sensor's picture in a floating view (-1: nothing); return 1, or 0 if there is none."""
        if view not in self._windows.views:
            return 0
        name = "" if sensor == -1 else self._objects[sensor].name
        self._windows.aim(view, name, name if label is None else shown(label))
        return 1

    @sim("345")
    def floatingViewRemove(self, view: int) -> int:
        """Close a floating view; return 1, or 0 if there is none."""
        return int(self._windows.close(self._windows.views, view))
