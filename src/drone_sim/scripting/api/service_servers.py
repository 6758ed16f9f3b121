"""Services that a script offers: a request waits until the script is called, and its sender waits for the answer."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent import futures
from concurrent.futures import Future, InvalidStateError
from typing import Any

from drone_sim.scripting.api.calls import show
from drone_sim.scripting.api.types import refuse_if_too_large
from drone_sim.scripting.script_log import LOG

PATIENCE = 5.0  # s of real time, after which a request is refused; the simulation never waits


class Unanswered(Exception):
    """A request that the script does not answer; the message is the reason."""


class ServiceRequest:
    """A request, from any thread, to a script's service; the script answers it between two steps."""

    def __init__(self, content: Any, convert: Callable[[Any], Any]):
        """`content`: the request message; `convert` converts the answer to a response message, or raises ValueError."""
        self.content = content
        self._convert = convert
        self._answer: Future[Any] = Future()

    @property
    def is_abandoned(self) -> bool:
        """Whether the sender does not wait any more, without an answer."""
        return self._answer.done() and self._answer.exception() is not None

    def answer(self, fields: Any) -> None:
        """Set the answer: the response's fields, or None for none. Ignored after another answer, or after `refuse`.

        Wrong fields are reported in the log and to the caller.
        """
        try:
            response = self._convert(_checked(fields))
        except ValueError as error:
            self.refuse(str(error))
            LOG.error("%s", error)
        else:
            with contextlib.suppress(InvalidStateError):
                self._answer.set_result(response)

    def refuse(self, why: str) -> None:
        """Refuse to answer, with a one-line reason."""
        with contextlib.suppress(InvalidStateError):
            self._answer.set_exception(Unanswered(why))

    def wait(self, seconds: float) -> Any:
        """Return the answer. Raises Unanswered, also if there is none after some seconds of real time."""
        if not futures.wait([self._answer], seconds).done:
            self.refuse(f"no answer within {seconds:g} s: the simulation is paused, or steps too slowly")
        return self._answer.result()


class ServiceServer:
    """A service of a script, in which its callers wait for their answers."""

    def __init__(self, take: Callable[[ServiceRequest], None], patience: float = PATIENCE):
        """`take` stores a request for the script; a caller waits at most `patience` seconds."""
        self._take = take
        self._patience = patience
        self._waiting: set[ServiceRequest] = set()
        self._lock = threading.Lock()
        self._is_open = True

    def ask(self, content: Any, convert: Callable[[Any], Any]) -> Any:
        """Return the response to a request; any thread but the simulation's may call this.

        `convert` converts the callback's answer to a response, in the simulation's thread; it raises ValueError for a
        wrong answer. Raises Unanswered if the service has ended, the callback failed, or there was no answer in time.
        """
        request = ServiceRequest(content, convert)
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
        """Refuse waiting and future requests."""
        with self._lock:
            self._is_open, waiting = False, list(self._waiting)
        for request in waiting:
            request.refuse("the script ended before it answered")


def execute(request: ServiceRequest, call: Callable[[Any], Any]) -> None:
    """Let the script answer a request, unless its sender does not wait any more. Raises the exceptions of `call`."""
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
    """Return the fields of a response, {} if the script returned nothing.

    Raises ValueError for a value without fields.
    """
    if value is None or value == []:
        return {}
    if isinstance(value, (str, bytes, int, float, list, tuple)):
        raise ValueError(f"the callback of a service must return a table of the response's fields, not {show(value)}")
    refuse_if_too_large(value)
    return value
