"""`simRemoteApi`: ports for V-REP's legacy remote API (`simxStart`), which scripts open."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from drone_sim.scripting.api.calls import Module, sim
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.types import WrongValue

simRemoteApi = Module("simRemoteApi")
_LOWEST, _HIGHEST = 1024, 65535
_MOST = 16
_DONE, _NOT = 1, -1
_WAITING, _CONNECTED = 0, 1


class RemotePorts:
    """Ports that scripts of a run request; the server reads `wanted`, and sets `connected`."""

    def __init__(self, are_served: bool = False):
        """`are_served`: whether there is a server."""
        self.are_served = are_served
        self.clear()

    def clear(self) -> None:
        self.wanted: dict[int, bool] = {}  # by port: whether its clients trigger the steps from the start
        self.connected: Collection[int] = ()  # ports


class RemotePortFunctions:
    """Ports for clients of V-REP's legacy remote API, as long as the simulation runs."""

    def __init__(self, ports: RemotePorts, ignored: Ignored):
        """`ports` are those of the simulation; `ignored` logs what is ignored."""
        self._ports, self._ignored = ports, ignored

    @simRemoteApi("45")
    def start(self, port: int, _size: Any = None, _debug: Any = False, synchronous: Any = False, *_others: Any) -> int:
        """Let clients connect to a port, 1024 to 65535; return 1, or -1 if `remote_api` is off.

        `synchronous`: clients trigger the steps from the start, as after simxSynchronous.
        """
        number = _port(port)
        if not self._ports.are_served:
            self._ignored.log("start", "the legacy remote API is off: start it with remote_api:=true", "simRemoteApi")
            return _NOT
        if number not in self._ports.wanted and len(self._ports.wanted) >= _MOST:
            raise ValueError(f"at most {_MOST} ports can be open")
        self._ports.wanted[number] = bool(synchronous)
        return _DONE

    @simRemoteApi("45")
    def stop(self, port: int) -> int:
        """Close a port and disconnect its clients; return 1, or -1 if it was not open."""
        return _DONE if self._ports.wanted.pop(_port(port), None) is not None else _NOT

    @simRemoteApi("45")
    def reset(self, port: int) -> int:
        """Return 1 for an open port, otherwise -1; there is nothing to reset."""
        return _DONE if _port(port) in self._ports.wanted else _NOT

    @simRemoteApi("45")
    def status(self, port: int) -> int:
        """Return 1 if a client is connected to a port, 0 if the port is open, otherwise -1."""
        number = _port(port)
        if number not in self._ports.wanted:
            return _NOT
        return _CONNECTED if number in self._ports.connected else _WAITING


class OlderRemotePortFunctions:
    """Ports for clients of V-REP's legacy remote API (3.x names)."""

    def __init__(self, functions: RemotePortFunctions):
        self._functions = functions

    @sim("3")
    def extRemoteApiStart(
        self, port: int, _size: Any = None, _debug: Any = False, synchronous: Any = False, *_others: Any
    ) -> int:
        """Like simRemoteApi.start."""
        return self._functions.start(port, _size, _debug, synchronous)

    @sim("3")
    def extRemoteApiStop(self, port: int) -> int:
        """Like simRemoteApi.stop."""
        return self._functions.stop(port)

    @sim("3")
    def extRemoteApiReset(self, port: int) -> int:
        """Like simRemoteApi.reset."""
        return self._functions.reset(port)

    @sim("3")
    def extRemoteApiStatus(self, port: int) -> int:
        """Like simRemoteApi.status."""
        return self._functions.status(port)


def _port(number: Any) -> int:
    """Return a checked port number. Raises WrongValue, ValueError."""
    if not isinstance(number, (int, float)) or isinstance(number, bool):
        raise WrongValue("expected the number of a port")
    if not _LOWEST <= number <= _HIGHEST:
        raise ValueError(f"a port must be from {_LOWEST} to {_HIGHEST}, not {number:g}")
    return int(number)
