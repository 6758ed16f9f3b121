"""A program outside: what it may call, and what it has left here."""

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

_IS_FUNCTION = "@func"  # what the name of a client's own function ends in, among the arguments
_BUFFERS = ("getStringSignal", "getVisionSensorImg", "getVisionSensorDepth", "packTable", "readCustomDataBlock")
_OWN_LINES = (ScriptError, Diverged, OSError, RuntimeError)  # their messages are one line for the user


class Client:
    """Answers requests. `sim` is that of the first vehicle's script; what it draws and hears is the client's own."""

    def __init__(
        self,
        player: Player,
        moved: MovedObjects,
        backend: Backend | None,
        everybody: Callable[[], Iterable[Stepping]],
        clock: Callable[[], float],
        watched: Watched,
    ):
        """`player` plays the simulation, `moved` watches where objects are put, `backend` carries messages.

        `everybody` returns the Stepping of each client; `clock` counts real seconds; `watched` returns what is called
        instead of a function, by its name.
        """
        self._watched = watched
        self.stepping = Stepping()
        self.connections: set[int] = set()
        self.heard = clock()  # s, when it last said something
        self.patience = 0.0  # s
        self.tasks: dict[tuple[bytes, ...], list[Task]] = {}  # what is not answered yet, by the way back
        self._simulation = player.simulation
        self._control = ClientControl(player, moved, self.stepping, everybody, clock)
        self._bus = MessageBus(next(iter(self._simulation.vehicles), ""), {})
        self._bus.backend = backend
        self._run = self._era = -1
        self._drawn: set[int] = set()
        self._modules: dict[str, Api] = {}
        self._functions: dict[str, Function] = {}

    def functions(self) -> Mapping[str, Function]:
        """Return what it may call now, by names such as sim.getObject; another mapping where that has changed."""
        self._keep_up()
        return self._functions

    def answer(self, request: ClientRequest) -> Task:
        """Carry out a request; raises RequestRefused."""
        self._keep_up()
        yield from self._hear()
        function = self._function(request.function)
        arguments = [_argument(one) for one in request.arguments]
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
        """Remove what it has left: drawings, subscriptions, what it advertises, and its say in the steps."""
        self.stepping.let_go()
        self.tasks.clear()
        self._bus.close()
        drawings = self._simulation.context.drawings
        if self._run == self._simulation.run:
            for handle in self._drawn & set(drawings.objects):
                drawings.remove(handle)
        self._drawn.clear()

    # ---- what it may call

    def _keep_up(self) -> None:
        """Update the modules to the simulation as it is now; what the client left in an earlier run is removed."""
        simulation = self._simulation
        if self._run != simulation.run:
            self._run = simulation.run
            self._drawn.clear()
            self._bus.close()
        if self._era != simulation.era:
            self._era = simulation.era
            host = ClientHost(simulation)
            ros = make_sim_ros(self._bus, simulation.clock)
            self._modules = {"sim": self._sim(host), "simROS": ros, **make_plugins(host)}
            self._functions = {
                f"{name}.{function}": self._watched(f"{name}.{function}", one)
                for name, api in self._modules.items()
                for function, one in contents(api)[1].items()
            }

    def _sim(self, host: ClientHost) -> Api:
        name, functions, constants = contents(make_sim(host, host.surroundings()))
        draw = functions["addDrawingObject"]

        @functools.wraps(draw)
        def recorded(*arguments: Any) -> Any:
            handle = draw(*arguments)
            self._drawn.add(handle)
            return handle

        return Api(name, {**functions, draw.__name__: recorded, **functions_of(self._control)}, constants)

    def _function(self, name: str) -> Function:
        """Return a function by name; raises RequestRefused."""
        function = self._functions.get(name)
        if function is not None:
            return function
        own = {f"zmqRemoteApi.{one.__name__}": one for one in (self.info, self.require)}
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
        """Raise ValueError for a module that there is not."""
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
        """Let the client's functions have the messages and requests that wait for it."""
        self._bus.new_callbacks()
        for callback, message in self._bus.take():
            name = name_of(callback)
            if not isinstance(message, ServiceRequest):
                yield Call(name, [message])
            elif not message.is_abandoned:
                message.answer((yield Call(name, [message.content])))


def one_line(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return what a client is told of an error in a call of a function, under the name that it knows it by."""
    return str(error) if isinstance(error, _OWN_LINES) else explain(name, function, arguments, error)


def _argument(value: Any) -> Any:
    if isinstance(value, dict):  # of parameters, one of which may be a function
        return {key: _argument(one) for key, one in value.items()}
    is_function = isinstance(value, str) and value.endswith(_IS_FUNCTION)
    return ClientFunction(value.removesuffix(_IS_FUNCTION)) if is_function else value


def _values(function: str, values: Any) -> list[Any]:
    """Return what a function returned as the list that is sent, where buffers are bytes and texts are texts."""
    listed = list(values) if isinstance(values, tuple) else [] if values is None else [values]
    if listed and isinstance(listed[0], str) and function.partition(".")[2] in _BUFFERS:
        listed[0] = listed[0].encode("utf-8", "surrogateescape")
    return listed
