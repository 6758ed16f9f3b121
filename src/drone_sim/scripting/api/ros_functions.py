"""`simROS`: time, frames, parameters and services of others, with or without ROS behind.

Without ROS transforms go nowhere, parameters are the script's alone, and there are no services.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.calls import Function, WrongValue
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.types import Handle, Name

_MOST = 100  # service clients
_KINDS: dict[str, type[Any]] = {"String": str, "Int": int, "Double": float, "Bool": bool}


class RosFunctions:
    """The functions of simROS that are not about topics."""

    def __init__(self, bus: MessageBus, clock: Callable[[], float]):
        """Take what reaches ROS and resolves names, and the simulation's clock."""
        self._bus = bus
        self._clock = clock
        self._own: dict[str, Any] = {}  # parameters, where there is no ROS
        self._clients: dict[int, tuple[str, str]] = {}

    def functions(self) -> dict[str, Function]:
        """Return every function, by name."""
        found = {name: getattr(self, name) for name in dir(self) if not name.startswith("_") and name != "functions"}
        for name, kind in _KINDS.items():
            found[f"getParam{name}"], found[f"setParam{name}"] = self._getter(kind), self._setter(kind)
        return found

    def getTime(self, _flag: int = 0) -> float:
        """Return ROS's time in s: what messages are stamped with."""
        backend = self._bus.backend
        return backend.time() if backend is not None else self._clock()

    # ---- frames

    def sendTransform(self, transform: Mapping[str, Any]) -> None:
        """Broadcast a frame: a table with the fields of geometry_msgs/TransformStamped."""
        self.sendTransforms([transform])

    def sendTransforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Broadcast several frames."""
        refuse_if_too_large(transforms)
        if isinstance(transforms, Mapping) or any(not isinstance(one, Mapping) for one in transforms):
            raise WrongValue("tables with the fields of geometry_msgs/TransformStamped are expected")
        if self._bus.backend is not None:
            self._bus.backend.send_transforms(list(transforms))

    # ---- parameters

    def hasParam(self, name: Name) -> bool:
        """Return whether a parameter is set."""
        return self._read(name)[0]

    def deleteParam(self, name: Name) -> None:
        """Forget a parameter."""
        full, backend = self._name(name), self._bus.backend
        if backend is not None:
            backend.delete_parameter(full)
        else:
            self._own.pop(full, None)

    def searchParam(self, name: Name) -> tuple[bool, str]:
        """Return whether a parameter is set in the drone's namespace or above it, and its full name ('' for none)."""
        space = self._name("x").rpartition("/")[0]
        while True:
            full = f"{space}/{name}"
            if self._read(full)[0]:
                return True, full
            if not space:
                return False, ""
            space = space.rpartition("/")[0]

    def _getter(self, kind: type[Any]) -> Function:
        def get(name: Name, default: Any = None) -> tuple[bool, Any]:
            is_set, value = self._read(name)
            is_right = isinstance(value, (int, float)) if kind is float else isinstance(value, kind)
            if not is_set or not is_right:
                return False, kind() if default is None else default
            return True, kind(value)

        get.__doc__ = "Return whether a parameter of that type is set, and its value or the default."
        return get

    def _setter(self, kind: type[Any]) -> Function:
        def put(name: Name, value: Any) -> None:
            full, backend = self._name(name), self._bus.backend
            try:
                value = kind(value)
            except (TypeError, ValueError):
                raise WrongValue(f"a value of the type {kind.__name__} is expected") from None
            if backend is not None:
                backend.set_parameter(full, value)
            else:
                self._own[full] = value

        put.__doc__ = "Set a parameter."
        return put

    def _read(self, name: str) -> tuple[bool, Any]:
        full, backend = self._name(name), self._bus.backend
        value = backend.parameter(full) if backend is not None else self._own.get(full)
        return value is not None, value

    def _name(self, name: str) -> str:
        """Return the full name; raises WrongValue for what is none."""
        if not isinstance(name, str) or not name.strip("/"):
            raise WrongValue("the name of a parameter is expected")
        return self._bus.resolve(name)

    # ---- services of others

    def serviceClient(self, name: Name, kind: Name) -> int:
        """Return a handle to call a service with."""
        if len(self._clients) >= _MOST:
            raise ValueError(f"a script has at most {_MOST} service clients")
        handle = len(self._clients) + 1
        self._clients[handle] = self._bus.resolve(name), kind
        return handle

    def call(self, handle: Handle, request: Any = None) -> Any:
        """Call a service with a table of the request's fields; return the response. It may take a second of time."""
        name, kind = self._client(handle)
        refuse_if_too_large(request)
        return self._ros().call_service(name, kind, request or {})

    def shutdownServiceClient(self, handle: Handle) -> None:
        """Forget a service client."""
        self._client(handle)
        del self._clients[handle]

    def serviceClientTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] is taken and given as a string anyhow."""
        self._client(handle)

    def _client(self, handle: int) -> tuple[str, str]:
        if handle not in self._clients:
            raise ValueError(f"no service client has the handle {handle}")
        return self._clients[handle]

    def _ros(self) -> Backend:
        if self._bus.backend is None:
            raise ValueError("there is no ROS here, and no service")
        return self._bus.backend
