"""A remote client: its host, the functions that it may call, and the resources that it owns in the simulation."""

from __future__ import annotations

import functools
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from drone_sim.hosting.child_scripts import services
from drone_sim.mechanics.frames import Vector
from drone_sim.message_text import near_names
from drone_sim.remote.control import ClientControl, MovedObjects
from drone_sim.remote.conversation import Call, ClientFunction, RequestRefused, Stepping, Task, Watched, name_of
from drone_sim.remote.messages import ClientRequest
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.run.stepping import Diverged
from drone_sim.scripting import script_log
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.calls import Api, Function, contents, explain, functions_of
from drone_sim.scripting.api.control import Turns, Wait
from drone_sim.scripting.api.host import Readable, SceneServices
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros
from drone_sim.scripting.api.registry import CHILD, Attachment, Scripts
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.service_servers import ServiceRequest
from drone_sim.scripting.api.types import Name
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles.quadricopter_objects import DRONE
from drone_sim.vehicles.vehicle import Vehicle

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
            self._modules = {"sim": self._sim(host), "simROS": ros, **make_plugins(host, host.services())}
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
        return {**called, **{name: _constant(value) for name, value in constants.items()}}

    def _hear(self) -> Task:
        """Call the client's functions with the messages and service requests received for them."""
        self._bus.new_callbacks()
        for callback, message in self._bus.take():
            name = name_of(callback)
            if not isinstance(message, ServiceRequest):
                yield Call(name, [message])
            elif not message.is_abandoned:
                message.answer((yield Call(name, [message.content])))


class ClientHost:
    """Host of remote clients. Names without a suffix mean the first vehicle's objects, as in its script."""

    script_type = CHILD

    def __init__(self, simulation: Simulation):
        """Use the simulation's current context; to be created again with every topology version."""
        self.context = replace(simulation.context, scripts=_ScriptsForClients(simulation.context.scripts))
        self._operations = simulation.operations
        self._vehicles = list(simulation.vehicles.values())

    def services(self) -> SceneServices:
        """Return the services of the scene, without a time limit for calls."""
        return services(self._vehicles, self.context, self._operations, TimeLimit(0.0), Turns())

    @property
    def sensors(self) -> Mapping[str, Readable]:
        return {name: sensor for vehicle in self._vehicles for name, sensor in vehicle.instruments.by_object.items()}

    @property
    def own_script(self) -> str:
        """Name of the object with the script that `sim.handle_self` means: the first vehicle's."""
        return self._vehicles[0].object_name if self._vehicles else DRONE

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        self._of(shape).propulsion.add_force(shape, force, torque, offset)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        self._of(shape).propulsion.drop_forces(shape, forces, torques)

    def turn_joint(self, joint: str, angle: float | None) -> float:
        return self._of(joint).propulsion.blades.turn(joint, angle)

    def _of(self, name: str) -> Vehicle:
        """Return the vehicle that an object belongs to, by its suffix; the first one for an object of the scene.

        Raises ValueError if there is no vehicle.
        """
        if not self._vehicles:
            raise ValueError(f"'{name}' is not a part of a vehicle, and the scene has no vehicle")
        return next((item for item in self._vehicles if item.suffix and name.endswith(item.suffix)), self._vehicles[0])


class _ScriptsForClients(Scripts):
    """The scripts of a simulation, called by a client instead of a script."""

    are_own = False

    _NO_CALLER = Attachment(-1, "", {}, is_law=False)

    def __init__(self, scripts: Scripts):
        self.__dict__ = scripts.__dict__

    def is_own(self, _caller: Attachment, _callee: Attachment) -> bool:
        return False

    def call(self, _caller: Attachment, callee: Attachment, call: Callable[[Script], Any]) -> Any:
        return super().call(self._NO_CALLER, callee, call)


def one_line(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return the error text for a client of an error in a call, with the function's name as the client knows it."""
    return str(error) if isinstance(error, _ONE_LINE_ERRORS) else explain(name, function, arguments, error)


def _constant(value: Any) -> dict[str, Any]:
    """Return a constant, or the members of an enumeration, as the client's library expects it."""
    members = getattr(value, "__dict__", None)
    return {"const": value} if members is None else {name: _constant(member) for name, member in members.items()}


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
