"""`sim`: the simulation as a whole: its state, its time, and the parameters of the simulator."""

from __future__ import annotations

import os
import random
from typing import Any

from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.control import PAUSE, STOP
from drone_sim.scripting.api.host import Surroundings
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.types import Number
from drone_sim.wording import near_names

VERSION, REVISION = 40600, 0  # the CoppeliaSim whose API this is nearest to
_LINUX = 2


class SimulationFunctions:
    """The functions on the simulation and the simulator."""

    def __init__(self, surroundings: Surroundings, ignored: Ignored):
        """Take the clock and whatever else is around the drone, and what says that something is ignored."""
        self._around = surroundings
        self._ignored = ignored
        self._random = random.Random(1)  # the same flight every time
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
            "floatparam": _by_number("floatparam", simulation_time_step=surroundings.time_step),
            "boolparam": _by_number(
                "boolparam", dynamics_handling_enabled=True, vision_sensor_handling_enabled=True, display_enabled=False
            ),
            "stringparam": _by_number("stringparam", application_path="", scene_path="", scene_name=""),
            "arrayparam": _by_number("arrayparam", gravity=[0.0, 0.0, surroundings.gravity]),
        }

    # ---- state and time

    def getSimulationState(self) -> int:
        """Return sim.simulation_advancing_firstafterstop in init, then _running, _abouttostop, _lastbeforestop."""
        return self._around.control.state(self._around.clock())

    def getSimulationStopping(self) -> bool:
        """Return whether the simulation ends with this step."""
        return self._around.control.is_ending or self._around.control.asked == STOP

    def stopSimulation(self, *_wait: Any) -> int:
        """Let the simulation stop after this step; return 1."""
        self._around.control.asked = STOP
        return 1

    def pauseSimulation(self) -> int:
        """Let the simulation pause after this step; return 1."""
        self._around.control.asked = PAUSE
        return 1

    def startSimulation(self) -> int:
        """Take back what was asked for in this step: whoever can call this runs already; return 1."""
        self._around.control.asked = ""
        return 1

    def getSimulationTime(self) -> float:
        """Return the simulated time in seconds."""
        return self._around.clock()

    def getSimulationTimeStep(self) -> float:
        """Return the simulation step in seconds."""
        return self._around.time_step

    def getSystemTime(self) -> float:
        """Return the simulated time in seconds: a flight is the same however fast it is computed."""
        return self._around.clock()

    def getSystemTimeInMs(self, since: Number = -1) -> int:
        """Return the simulated time in ms, or the ms since such a time; -1 and -2 are no such times."""
        now = round(1000 * self._around.clock())
        return now if since < 0 else now - int(since)

    getSystemTimeInMilliseconds = getSystemTimeInMs

    def getRandom(self, seed: Number | None = None) -> float:
        """Return a random number from 0 to 1, the same ones in every run; a seed begins another series."""
        if seed is not None:
            self._random = random.Random(float(seed))
        return self._random.random()

    # ---- parameters of the simulator

    def getInt32Param(self, parameter: int) -> int:
        """Return sim.intparam_program_version, _program_revision, _platform, _dynamic_engine or _core_count."""
        return int(self._read("intparam", parameter, 0))

    getInt32Parameter = getIntegerParameter = getInt32Param

    def setInt32Param(self, parameter: int, _value: int) -> None:
        """Accept any sim.intparam_... and ignore it."""
        self._set("setInt32Param", "intparam", parameter)

    setInt32Parameter = setIntegerParameter = setInt32Param

    def getFloatParam(self, parameter: int) -> float:
        """Return sim.floatparam_simulation_time_step in s, or a random number for sim.floatparam_rand."""
        if parameter == CONSTANTS["floatparam_rand"]:
            return self._random.random()
        return float(self._read("floatparam", parameter, 0.0))

    getFloatParameter = getFloatingParameter = getFloatParam

    def setFloatParam(self, parameter: int, _value: Number) -> None:
        """Accept any sim.floatparam_... and ignore it."""
        self._set("setFloatParam", "floatparam", parameter)

    setFloatParameter = setFloatingParameter = setFloatParam

    def getBoolParam(self, parameter: int) -> bool:
        """Return whether the simulator does what a sim.boolparam_... names: dynamics and vision sensors."""
        return bool(self._read("boolparam", parameter, False))

    getBoolParameter = getBooleanParameter = getBoolParam

    def setBoolParam(self, parameter: int, _value: Any) -> None:
        """Accept any sim.boolparam_... and ignore it."""
        self._set("setBoolParam", "boolparam", parameter)

    setBoolParameter = setBooleanParameter = setBoolParam

    def getStringParam(self, parameter: int) -> str:
        """Return '' for any sim.stringparam_...: there is no application, and no scene of CoppeliaSim's."""
        return str(self._read("stringparam", parameter, ""))

    getStringParameter = getStringParam

    def setStringParam(self, parameter: int, _value: Any) -> None:
        """Accept any sim.stringparam_... and ignore it."""
        self._set("setStringParam", "stringparam", parameter)

    setStringParameter = setStringParam

    def getArrayParam(self, parameter: int) -> list[float]:
        """Return sim.arrayparam_gravity in m/s²; there is no other."""
        return list(self._read("arrayparam", parameter, [0.0, 0.0, 0.0]))

    getArrayParameter = getArrayParam

    def setArrayParam(self, parameter: int, _value: Any) -> None:
        """Accept any sim.arrayparam_... and ignore it: gravity is a parameter of the node."""
        self._set("setArrayParam", "arrayparam", parameter)

    setArrayParameter = setArrayParam

    def _read(self, kind: str, parameter: int, otherwise: Any) -> Any:
        """Return a parameter; raises ValueError for a number that is none of that kind."""
        values = self._values[kind]
        if parameter not in values:
            name = _name(kind, parameter)
            self._ignored.say(name, f"has no value here: {otherwise!r} is returned")
            return otherwise
        return values[parameter]

    def _set(self, function: str, kind: str, parameter: int) -> None:
        self._ignored.say(function, f"{_name(kind, parameter)} is accepted and ignored")


def _by_number(kind: str, **values: Any) -> dict[int, Any]:
    return {CONSTANTS[f"{kind}_{name}"]: value for name, value in values.items()}


def _name(kind: str, parameter: int) -> str:
    """Return the name of a parameter; raises ValueError where it is none of that kind."""
    known = {value: name for name, value in CONSTANTS.items() if name.startswith(f"{kind}_")}
    if parameter not in known:
        raise ValueError(f"no sim.{kind}_... is {parameter!r}; {near_names(kind, known.values())}")
    return known[parameter]
