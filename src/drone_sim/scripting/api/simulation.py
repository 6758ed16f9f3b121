"""`sim`: state and time of the simulation, and parameters of the simulator."""

from __future__ import annotations

import os
import random
from typing import Any

from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.control import PAUSE, STOP
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Number, numbers

VERSION, REVISION = 40600, 0  # of the CoppeliaSim whose API is the most similar
_LINUX = 2
_TOLERANCE = 1e-6  # s, for single precision
_PLUGINS = ("RosInterface", "ROSInterface", "ROS", "simROS", "CustomUI", "simUI")  # with all their names over time


class SimulationFunctions(Functions):
    """The simulation: its state and time, and parameters of the simulator."""

    def __init__(self, *arguments: Any):
        super().__init__(*arguments)
        self._random = random.Random(1)  # constant seed, so that every flight is the same
        self._values: dict[str, dict[int, Any]] = {
            "intparam": _by_number(
                "intparam",
                program_version=VERSION,
                program_revision=REVISION,
                program_full_version=VERSION * 100 + REVISION,
                platform=_LINUX,
                dynamic_engine=0,
                core_count=os.cpu_count() or 1,
            ),
            "floatparam": _by_number("floatparam", simulation_time_step=self._context.clock.time_step),
            "boolparam": _by_number(
                "boolparam", dynamics_handling_enabled=True, vision_sensor_handling_enabled=True, display_enabled=False
            ),
            "stringparam": _by_number("stringparam", application_path="", scene_path="", scene_name=""),
            "arrayparam": _by_number("arrayparam", gravity=[0.0, 0.0, self._context.gravity]),
        }

    # ---- state and time

    @sim("345")
    def getSimulationState(self) -> int:
        """Return sim.simulation_advancing_firstafterstop in init, then _running, _abouttostop, _lastbeforestop."""
        return self._context.control.state(self._context.clock.time)

    @sim("5")
    def getSimulationStopping(self) -> bool:
        """Return whether the simulation ends with this step."""
        return self._context.control.is_ending or self._context.control.asked == STOP

    @sim("345")
    def stopSimulation(self, *_wait: Any) -> int:
        """Stop the simulation after this step; return 1."""
        self._context.control.asked = STOP
        return 1

    @sim("345")
    def pauseSimulation(self) -> int:
        """Pause the simulation after this step; return 1."""
        self._context.control.asked = PAUSE
        return 1

    @sim("345")
    def startSimulation(self) -> int:
        """Cancel a stop or pause requested in this step (the simulation is running already); return 1."""
        self._context.control.asked = ""
        return 1

    @sim("345")
    def getSimulationTime(self) -> float:
        """Return the simulated time in seconds; in the sensing phase, the time at which the step began."""
        return self._context.clock.script_time

    @sim("345")
    def getSimulationTimeStep(self) -> float:
        """Return the simulation step in seconds."""
        return self._context.clock.time_step

    @sim("345")
    def getSystemTime(self) -> float:
        """Return the simulated time in seconds, so that flights do not depend on the speed of the computer."""
        return self._context.clock.time

    @sim("345", getSystemTimeInMilliseconds="3")
    def getSystemTimeInMs(self, since: Number = -1) -> int:
        """Return the simulated time in ms, or the ms since an earlier one; -1 and -2 mean none."""
        now = round(1000 * self._context.clock.time)
        return now if since < 0 else now - int(since)

    @sim("345")
    def getModuleName(self, index: int) -> tuple[str | None, int]:
        """Return name and version of a plugin by its index, from 0; nothing and 0 after the last."""
        return (_PLUGINS[int(index)], 1) if 0 <= index < len(_PLUGINS) else (None, 0)

    @sim("345")
    def getRandom(self, seed: Number | None = None) -> float:
        """Return a random number from 0 to 1; the sequence is the same in every run, and a seed starts another."""
        if seed is not None:
            self._random = random.Random(float(seed))
        return self._random.random()

    # ---- parameters of the simulator

    @sim("5", getInt32Parameter="345", getIntegerParameter="3")
    def getInt32Param(self, parameter: int) -> int:
        """Return sim.intparam_program_version, _program_revision, _platform, _dynamic_engine or _core_count."""
        return int(self._read("intparam", parameter, 0))

    @sim("5", getFloatParameter="345", getFloatingParameter="3")
    def getFloatParam(self, parameter: int) -> float:
        """Return sim.floatparam_simulation_time_step in s, or a random number for sim.floatparam_rand."""
        if parameter == CONSTANTS["floatparam_rand"]:
            return self._random.random()
        return float(self._read("floatparam", parameter, 0.0))

    @sim("5", getBoolParameter="345", getBooleanParameter="3")
    def getBoolParam(self, parameter: int) -> bool:
        """Return whether a sim.boolparam_... is enabled; dynamics and vision sensors are."""
        return bool(self._read("boolparam", parameter, False))

    @sim("5", getStringParameter="345")
    def getStringParam(self, parameter: int) -> str:
        """Return '' for any sim.stringparam_..., because there is no application and no scene of CoppeliaSim."""
        return str(self._read("stringparam", parameter, ""))

    @sim("5", getArrayParameter="345")
    def getArrayParam(self, parameter: int) -> list[float]:
        """Return sim.arrayparam_gravity in m/s²; other parameters are zero."""
        return list(self._read("arrayparam", parameter, [0.0, 0.0, 0.0]))

    @sim("5", setFloatParameter="345", setFloatingParameter="3")
    def setFloatParam(self, parameter: int, value: Any) -> None:
        """Accept any sim.floatparam_... and ignore it; sim.floatparam_simulation_time_step does not change."""
        if parameter == CONSTANTS["floatparam_simulation_time_step"]:
            self.setSimulationTimeStep(value)
        else:
            self._ignored.log("setFloatParam", f"{_name('floatparam', parameter)} is accepted and ignored")

    @sim("")
    def setSimulationTimeStep(self, step: Number) -> None:
        """Raise an error if the time step (s) differs from the current one (3.x)."""
        (wanted,), current = numbers((step,), 1), self._context.clock.time_step
        if abs(wanted - current) > _TOLERANCE:
            raise ValueError(
                f"the time step stays {current:g} s, not {wanted:g}: `time_step` in the scene file sets it"
            )

    def _read(self, kind: str, parameter: int, default: Any) -> Any:
        """Return a parameter. Raises ValueError for a number without a constant of this kind."""
        values = self._values[kind]
        if parameter not in values:
            name = _name(kind, parameter)
            self._ignored.log(name, f"is not supported: {default!r} is returned")
            return default
        return values[parameter]


def _add_setter(word: str, kind: str, old: str, note: str = "") -> None:
    """Add the function that sets parameters of a kind; `old` is the word in V-REP 3.x names."""
    name = f"set{word}Param"

    def put(self: SimulationFunctions, parameter: int, _value: Any) -> None:
        self._ignored.log(name, f"{_name(kind, parameter)} is accepted and ignored")

    others = {f"set{word}Parameter": "345"} | ({f"set{old}Parameter": "3"} if old else {})
    sim.add(SimulationFunctions, put, name, f"Accept any sim.{kind}_... and ignore it{note}.", "5", **others)


_add_setter("Int32", "intparam", "Integer")
_add_setter("Bool", "boolparam", "Boolean")
_add_setter("String", "stringparam", "")
_add_setter("Array", "arrayparam", "", ": gravity is a parameter of the node")


def _by_number(kind: str, **values: Any) -> dict[int, Any]:
    return {CONSTANTS[f"{kind}_{name}"]: value for name, value in values.items()}


def _name(kind: str, parameter: int) -> str:
    """Return the name of a parameter. Raises ValueError for a number without a constant of this kind."""
    known = {value: name for name, value in CONSTANTS.items() if name.startswith(f"{kind}_")}
    if parameter not in known:
        raise ValueError(f"{parameter!r} is not a sim.{kind}_...; {near_names(kind, known.values())}")
    return known[parameter]
