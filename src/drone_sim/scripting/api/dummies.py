"""`sim`: dummies that a script makes, and takes away again. Whatever else there is comes from the scene file."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.calls import WrongValue, numbers
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Number

_MOST = 1000  # of all scripts together
_ALIAS = "Dummy"


class MadeDummy(SceneObject):
    """A dummy that a script has made."""


class Dummies:
    """The functions on dummies."""

    def __init__(self, host: Host):
        """Take the drone whose objects they are among."""
        self._objects = host.objects

    def createDummy(self, size: Number, _color: Any = None) -> int:
        """Make a dummy at the origin of the world; return its handle. It is not drawn; it is gone after the run.

        Its name is Dummy, or Dummy0, Dummy1 and so on; setObjectPosition and setObjectParent put it somewhere.
        """
        numbers((size,), 1)
        if sum(isinstance(self._objects[one], MadeDummy) for one in self._objects) >= _MOST:
            raise ValueError(f"scripts make at most {_MOST} dummies")
        names = itertools.chain([_ALIAS], (f"{_ALIAS}{number}" for number in itertools.count()))
        free = next(name for name in names if name not in self._objects and plain(name) == name)
        return self._objects.insert(MadeDummy((free,), _ALIAS, None))

    def removeObject(self, handle: Handle) -> int:
        """Take away a dummy that a script has made; what hangs on it stays. Return 1."""
        return self.removeObjects([handle])

    def removeObjects(self, handles: Sequence[Handle], _later: bool = False) -> int:
        """Take away dummies that a script has made; what hangs on them stays. Return 1."""
        if isinstance(handles, (int, float, str)):
            raise WrongValue("a table of handles is expected")
        for one in handles:
            found = self._objects[one]
            if not isinstance(found, MadeDummy):
                raise ValueError(f"'{found.name}' is not a dummy that a script has made: only those can be removed")
        self._objects.remove({int(one) for one in handles})
        return 1

    def removeModel(self, handle: Handle, _later: bool = False) -> int:
        """Take away a dummy that a script has made, with all that hangs on it. Return how many objects are gone."""
        top = self._objects[handle]
        going = [one for one in self._objects if self._objects[one] is top or self._objects[one].hangs_on(top)]
        self.removeObjects(going)
        return len(going)
