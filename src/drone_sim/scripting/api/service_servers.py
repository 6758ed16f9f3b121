"""Services that a script offers: a request waits for the script's turn, and its sender waits for the answer."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent import futures
from concurrent.futures import Future, InvalidStateError
from typing import Any

from drone_sim.scripting.api.calls import show
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.script_log import LOG

PATIENCE = 5.0  # s of real time, after which a request is refused; the simulation never waits for anybody


class Unanswered(Exception):
    """A request to which the script gives no answer; one line that says why."""


class ServiceRequest:
    """A request, from any thread, to what a script offers; the script answers it between two steps."""

    def __init__(self, content: Any, made: Callable[[Any], Any]):
        """`content`: the request message; `made` makes the response message of the answer, or raises ValueError."""
        self.content = content
        self._made = made
        self._answer: Future[Any] = Future()

    @property
    def is_abandoned(self) -> bool:
        """Whether nobody waits for the answer any more, and none was given."""
        return self._answer.done() and self._answer.exception() is not None

    def answer(self, fields: Any) -> None:
        """Give the answer: the response's fields, None for none; dropped after another answer, or after `refuse`.

        Fields that do not fit are reported in the log, and to the caller.
        """
        try:
            made = self._made(_checked(fields))
        except ValueError as error:
            self.refuse(str(error))
            LOG.error("%s", error)
        else:
            with contextlib.suppress(InvalidStateError):
                self._answer.set_result(made)

    def refuse(self, why: str) -> None:
        """Give no answer, and say why in one line."""
        with contextlib.suppress(InvalidStateError):
            self._answer.set_exception(Unanswered(why))

    def wait(self, seconds: float) -> Any:
        """Return the answer. Raises Unanswered, also where none comes within so many seconds of real time."""
        if not futures.wait([self._answer], seconds).done:
            self.refuse(f"no answer within {seconds:g} s: the simulation is paused, or steps too slowly")
        return self._answer.result()


class ServiceServer:
    """One service of a script; its callers wait here for their answers."""

    def __init__(self, take: Callable[[ServiceRequest], None], patience: float = PATIENCE):
        """`take` leaves a request where the script finds it; a caller waits at most `patience` seconds."""
        self._take = take
        self._patience = patience
        self._waiting: set[ServiceRequest] = set()
        self._lock = threading.Lock()
        self._is_open = True

    def ask(self, content: Any, made: Callable[[Any], Any]) -> Any:
        """Return what the script's callback answers to a request; any thread but the simulation's may call it.

        `made` makes the returned value from that answer, in the simulation's thread. It raises ValueError for an answer
        that does not fit.
        Raises Unanswered: the service has ended, the callback failed, or no answer came in time.
        """
        request = ServiceRequest(content, made)
        with self._lock:
            if not self._is_open:
                raise Unanswered("the script no longer offers this service")
            self._waiting.add(request)
        try:
            self._take(request)
            return request.wait(self._patience)
        finally:
            with self._lock:
                self._waiting.discard(request)

    def close(self) -> None:
        """Refuse what waits, and what comes."""
        with self._lock:
            self._is_open, waiting = False, list(self._waiting)
        for request in waiting:
            request.refuse("the script ended before it answered")


def carry_out(request: ServiceRequest, call: Callable[[Any], Any]) -> None:
    """Let the script answer a request that is still waited for. Raises what `call` raises."""
    if request.is_abandoned:
        return
    try:
        fields = call(request.content)
    except Unanswered as error:
        request.refuse(str(error))
    except Exception as error:
        request.refuse(" ".join(str(error).split()))
        raise
    else:
        request.answer(fields)


def _checked(value: Any) -> Any:
    """Return the fields of a response, none where the script returned nothing. Raises ValueError for what has none."""
    if value is None or value == []:
        return {}
    if isinstance(value, (str, bytes, int, float, list, tuple)):
        raise ValueError(f"the callback of a service must return a table of the response's fields, not {show(value)}")
    refuse_if_too_large(value)
    return value
