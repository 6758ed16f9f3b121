"""A remote client: the functions that it may call, and the resources that it owns in the simulation."""

from __future__ import annotations

import functools
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from typing import Any

from drone_sim.message_text import near_names
from drone_sim.remote.control import ClientControl, MovedObjects
from drone_sim.remote.conversation import Call, ClientFunction, RequestRefused, Stepping, Task, Watched, name_of
from drone_sim.remote.host import ClientHost
from drone_sim.remote.messages import ClientRequest
from drone_sim.run.player import Player
from drone_sim.run.stepping import Diverged
from drone_sim.scripting import script_log
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.calls import Api, Function, contents, explain, functions_of
from drone_sim.scripting.api.control import Wait
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros
from drone_sim.scripting.api.service_servers import ServiceRequest
from drone_sim.scripting.api.types import Name
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.errors import ScriptError

_FUNCTION_SUFFIX = "@func"  # of an argument that names a function of the client
_RETURN_BYTES = ("getStringSignal", "getVisionSensorImg", "getVisionSensorDepth", "packTable", "readCustomDataBlock")
_ONE_LINE_ERRORS = (ScriptError, Diverged, OSError, RuntimeError)  # their texts are written for the user


class Client:
    """Executes a client's requests. `sim` is the first vehicle's; drawings and subscriptions are the client's own."""

    def __init__(
        self,
        player: Player,
        moved: MovedObjects,
        backend: Backend | None,
        everybody: Callable[[], Iterable[Stepping]],
        clock: Callable[[], float],
        watched: Watched,
    ):
        """`player` runs the simulation, `moved` records moved objects, `backend` transports ROS messages.

        `everybody` returns the Stepping of each client; `clock` returns real seconds; `watched` returns the function to
        call in place of a named function.
        """
        self._watched = watched
        self.stepping = Stepping()
        self.connections: set[int] = set()
        self.heard = clock()  # s, time of its last message
        self.patience = 0.0  # s of silence after which it is removed
        self.tasks: dict[tuple[bytes, ...], list[Task]] = {}  # unfinished requests, by envelope
        self._simulation = player.simulation
        self._control = ClientControl(player, moved, self.stepping, everybody, clock)
        self._bus = MessageBus(next(iter(self._simulation.vehicles), ""), {})
        self._bus.backend = backend
        self._run = self._topology_version = -1
        self._drawn: set[int] = set()
        self._modules: dict[str, Api] = {}
        self._functions: dict[str, Function] = {}

    def functions(self) -> Mapping[str, Function]:
        """Return the functions by name, such as sim.getObject; a new mapping after a change."""
        self._update_modules()
        return self._functions

    def answer(self, request: ClientRequest) -> Task:
        """Execute a request. Raises RequestRefused."""
        self._update_modules()
        yield from self._hear()
        function = self._function(request.function)
        arguments = [_argument(value) for value in request.arguments]
        while arguments and arguments[-1] is None:
            arguments.pop()
        try:
            values = function(*arguments)
            if isinstance(values, Wait):
                values = self._control.wait_for(values)
            if isinstance(values, Generator):
                values = yield from values
        except RequestRefused:
            raise
        except Exception as error:
            raise RequestRefused(one_line(request.function, function, arguments, error)) from error
        finally:
            script_log.end_call()
        return _values(request.function, values)

    def leave(self) -> None:
        """Remove the client's drawings, subscriptions, advertised topics and services, and its hold on the steps."""
        self.stepping.let_go()
        self.tasks.clear()
        self._bus.close()
        drawings = self._simulation.context.drawings
        if self._run == self._simulation.run:
            for handle in self._drawn & set(drawings.objects):
                drawings.remove(handle)
        self._drawn.clear()

    # ---- functions

    def _update_modules(self) -> None:
        """Update the modules after a change of the scene; remove what the client left in an earlier run."""
        simulation = self._simulation
        if self._run != simulation.run:
            self._run = simulation.run
            self._drawn.clear()
            self._bus.close()
        if self._topology_version != simulation.topology_version:
            self._topology_version = simulation.topology_version
            host = ClientHost(simulation)
            ros = make_sim_ros(self._bus, simulation.clock)
            self._modules = {"sim": self._sim(host), "simROS": ros, **make_plugins(host)}
            self._functions = {
                f"{name}.{key}": self._watched(f"{name}.{key}", function)
                for name, api in self._modules.items()
                for key, function in contents(api)[1].items()
            }

    def _sim(self, host: ClientHost) -> Api:
        name, functions, constants = contents(make_sim(host, host.services()))
        draw = functions["addDrawingObject"]

        @functools.wraps(draw)
        def recorded(*arguments: Any) -> Any:
            handle = draw(*arguments)
            self._drawn.add(handle)
            return handle

        return Api(name, {**functions, draw.__name__: recorded, **functions_of(self._control)}, constants)

    def _function(self, name: str) -> Function:
        """Return a function by name. Raises RequestRefused."""
        function = self._functions.get(name)
        if function is not None:
            return function
        own = {f"zmqRemoteApi.{method.__name__}": method for method in (self.info, self.require)}
        if name in own:
            return own[name]
        module, dot, function_name = name.partition(".")
        if dot and module in self._modules:
            _, functions, constants = contents(self._modules[module])
            if function_name in constants:
                raise RequestRefused(f"{name} is not a function")
            raise RequestRefused(not_there(f"{module}.", function_name, [*functions, *constants]))
        raise RequestRefused(f"there is no function '{name:.80}'; {near_names(name[:80], [*self._functions, *own])}")

    def require(self, module: Name) -> None:
        """Raise ValueError if there is no such module."""
        if module in PLUGINS:
            raise ValueError(not_there("", module, ()))
        if module not in self._modules:
            raise ValueError(f"there is no module '{module}'; {near_names(str(module), self._modules)}")

    def info(self, module: Name) -> dict[str, Any]:
        """Return the functions and constants of a module. Raises ValueError."""
        self.require(module)
        _, functions, constants = contents(self._modules[module])
        called: dict[str, Any] = {name: {"func": {}} for name in functions}
        return {**called, **{name: {"const": value} for name, value in constants.items()}}

    def _hear(self) -> Task:
        """Call the client's functions with the messages and service requests received for them."""
        self._bus.new_callbacks()
        for callback, message in self._bus.take():
            name = name_of(callback)
            if not isinstance(message, ServiceRequest):
                yield Call(name, [message])
            elif not message.is_abandoned:
                message.answer((yield Call(name, [message.content])))


def one_line(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return the error text for a client of an error in a call, with the function's name as the client knows it."""
    return str(error) if isinstance(error, _ONE_LINE_ERRORS) else explain(name, function, arguments, error)


def _argument(value: Any) -> Any:
    if isinstance(value, dict):  # named parameters, one of which may be a function
        return {key: _argument(item) for key, item in value.items()}
    is_function = isinstance(value, str) and value.endswith(_FUNCTION_SUFFIX)
    return ClientFunction(value.removesuffix(_FUNCTION_SUFFIX)) if is_function else value


def _values(function: str, values: Any) -> list[Any]:
    """Return a function's result as the list to send, with buffers as bytes."""
    results = list(values) if isinstance(values, tuple) else [] if values is None else [values]
    if results and isinstance(results[0], str) and function.partition(".")[2] in _RETURN_BYTES:
        results[0] = results[0].encode("utf-8", "surrogateescape")
    return results
