"""`simROS`: services that a script offers to others, with or without ROS behind."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.calls import Function
from drone_sim.scripting.api.service_servers import ServiceServer
from drone_sim.scripting.api.subscriptions import Subscriptions
from drone_sim.scripting.api.types import Callback, Handle, Name

_MOST_WAITING = 100  # requests of one service
_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*")


class OfferedServices:
    """What a script advertises; its requests wait among the messages of its subscriptions."""

    def __init__(
        self,
        subscriptions: Subscriptions,
        new_handle: Callable[[], int],
        resolve: Callable[[str], str],
        backend: Callable[[], Backend | None],
    ):
        """Take where requests wait, and what gives a handle, the full name of a service, and what reaches ROS."""
        self._subscriptions = subscriptions
        self._new_handle = new_handle
        self._resolve = resolve
        self._backend = backend

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        names = ("advertiseService", "shutdownServiceServer", "serviceServerTreatUInt8ArrayAsString")
        return {name: getattr(self, name) for name in names}

    def advertiseService(self, name: Name, kind: Name, callback: Callback) -> int:
        """Offer a service: `callback` gets each request, and returns a table of the response's fields.

        It is called in the script's turn, at the beginning of the next step; who asks waits, 5 s at most.
        """
        service = self._resolve(name)
        if self._subscriptions.serves(service):
            raise ValueError(f"this script offers the service {service} already")
        if not _TYPE.fullmatch(kind):
            raise ValueError(f"'{kind:.80}' is no service type; one is, for example, std_srvs/Trigger")

        def begin(take: Callable[[Any], None]) -> Callable[[], None]:
            backend = self._backend()
            return _nothing if backend is None else _offer(backend, service, kind, take)

        handle = self._new_handle()
        self._subscriptions.add_service(handle, service, kind, callback, _MOST_WAITING, begin)
        return handle

    def shutdownServiceServer(self, handle: Handle) -> None:
        """Offer a service no longer; raises ValueError where none has that handle."""
        self._subscriptions.check_service(handle)
        self._subscriptions.end(handle)

    def serviceServerTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] is taken and given as a string anyhow."""
        self._subscriptions.check_service(handle)


def _nothing() -> None:
    pass


def _offer(backend: Backend, service: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
    """Offer a service, whose requests go to `take`; return what ends it, and refuses what still waits."""
    server = ServiceServer(take)
    end = backend.serve(service, kind, server.ask)

    def close() -> None:
        server.close()
        end()

    return close
