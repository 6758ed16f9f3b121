"""`sim`: floating views. Whoever shows `Windows` shows what the sensor sees; where it stands is theirs to say."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.host import Host
from drone_sim.scripting.script_log import shown


class Views:
    """The functions on floating views."""

    def __init__(self, host: Host):
        """Take what gives handles, and has the objects and the windows."""
        self._new_handle = host.drawings.new_handle
        self._objects = host.objects
        self._windows = host.windows

    def floatingViewAdd(self, *_place: Any) -> int:
        """Open a floating view, which shows nothing before sim.adjustView has said what; return a handle."""
        handle = self._new_handle()
        self._windows.add_view(handle)
        return handle

    def adjustView(self, view: int, sensor: int, _options: Any = 0, label: Any = None) -> int:
        """Let a floating view show what a vision sensor sees, -1 for nothing; return 1, or 0 for another view."""
        if view not in self._windows.views:
            return 0
        name = "" if sensor == -1 else self._objects[sensor].name
        self._windows.aim(view, name, name if label is None else shown(label))
        return 1

    def floatingViewRemove(self, view: int) -> int:
        """Close a floating view; return 1, or 0 where there is none."""
        return int(self._windows.close(self._windows.views, view))
