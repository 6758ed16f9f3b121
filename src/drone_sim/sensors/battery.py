"""A battery that the propellers drain: sensor_msgs/BatteryState. Even an empty one does not affect the flight.

Momentum theory (Leishman, Principles of Helicopter Aerodynamics, 2006, chapter 2): a hovering propeller of thrust T
and disk area A needs the power T^1.5 / sqrt(2 ρ A). With the power that hovering needs,

    P = idle_power + (hover_power - idle_power) · mean_i (T_i / T_hover)^1.5,   T_hover = weight / propellers

The cells are a source U0 behind a resistance R (the Rint model): with U = U0 - R I and U I = P,

    I = (U0 - sqrt(U0² - 4 R P)) / 2R

U0 falls linearly with the charge, from `full` to `empty` volts per cell.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Fraction, Name, ParameterError, Unit, Within
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic

_DISCHARGING, _GOOD, _DEAD, _LIPO = 2, 1, 3, 3  # sensor_msgs/BatteryState: status, health, health, technology
_HOUR = 3600.0  # s
_Volts = Annotated[Finite, Within(0.1, 1e3), Unit("V")]
_Watts = Annotated[Finite, Within(0, 1e6), Unit("W")]


class BatteryParameters(SensorParameters):
    """Lithium polymer cells in series."""

    kind: Literal["battery"]
    topic: Topic = "battery"
    frame: Name = "base_link"
    cells: Annotated[int, Within(1, 1000)]
    capacity: Annotated[Finite, Within(1e-3, 1e4), Unit("Ah")]
    full: _Volts  # per cell, without load
    empty: _Volts  # per cell, without load
    resistance: Annotated[Finite, Within(0, 1e3), Unit("Ω")]  # of the whole battery
    hover_power: _Watts
    idle_power: _Watts
    charge: Fraction = 1.0  # at the start, as a fraction of the capacity
    noise: NoiseParameters = NoiseParameters()  # V

    def make(self, mounting: Mounting) -> Battery:
        return Battery(self, mounting)

    def check(self, sub_step: float) -> None:
        """Raise ParameterError as the base class does, and for contradictory values."""
        super().check(sub_step)
        if self.empty > self.full:
            raise ParameterError(f"must be at most full = {self.full:g}", ("empty",), f"{self.empty:g}")
        if self.idle_power > self.hover_power:
            limit = f"must be at most hover_power = {self.hover_power:g}"
            raise ParameterError(limit, ("idle_power",), f"{self.idle_power:g}")


class BatterySample(NamedTuple):
    """The values that a battery monitor shows."""

    voltage: float  # V
    current: float  # A, positive when discharging
    charge: float  # Ah left


class Battery(Instrument):
    """Integrates the drawn current in every sub-step."""

    parameters: BatteryParameters

    def __init__(self, parameters: BatteryParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._noise = self.make_noise(parameters.noise, 1)
        self._charge = 0.0  # Ah
        self.outputs = (Output("", "sensor_msgs/BatteryState", self._message),)

    def reset(self) -> None:
        """Return to the state at the start of a run, with the initial charge."""
        super().reset()
        self._charge = self.parameters.charge * self.parameters.capacity

    def look(self, count: int) -> None:
        """Drain the battery over a sub-step, then sample if due."""
        used = self._load()[1] * self.mounting.sub_step / _HOUR
        self._charge = max(0.0, self._charge - used)
        super().look(count)

    def sample(self) -> BatterySample:
        """Return voltage, current and charge; only the voltage is noisy."""
        voltage, current = self._load()
        (measured,) = self._noise.add((voltage,))
        return BatterySample(measured, current, self._charge)

    def save_state(self) -> Restore:
        return in_turn(super().save_state(), saved(self, "_charge"))

    def power(self) -> float:
        """Return the power drawn now, in W."""
        p, thrusts = self.parameters, self.carrier.thrusts
        hover = self.carrier.mass * abs(self.carrier.gravity) / len(thrusts)
        if not hover:
            return p.idle_power
        lift = sum(abs(thrust / hover) ** 1.5 for thrust in thrusts) / len(thrusts)
        return p.idle_power + (p.hover_power - p.idle_power) * lift

    def _load(self) -> tuple[float, float]:
        """Return voltage (V) and current (A) under the present load."""
        p = self.parameters
        source = p.cells * (p.empty + (p.full - p.empty) * self._charge / p.capacity)
        if not self._charge:
            return source, 0.0
        power = self.power()
        if not p.resistance:
            return source, power / source
        # It cannot deliver more than U0²/4R; if more is needed, it delivers that.
        root = math.sqrt(max(0.0, source**2 - 4 * p.resistance * power))
        current = (source - root) / (2 * p.resistance)
        return source - p.resistance * current, current

    def _message(self, value: BatterySample, header: Mapping[str, Any]) -> Fields:
        p = self.parameters
        return {
            "header": header,
            "voltage": value.voltage,
            "temperature": math.nan,
            "current": -value.current,  # negative when discharging
            "charge": value.charge,
            "capacity": p.capacity,
            "design_capacity": p.capacity,
            "percentage": value.charge / p.capacity,
            "power_supply_status": _DISCHARGING,
            "power_supply_health": _GOOD if value.charge else _DEAD,
            "power_supply_technology": _LIPO,
            "present": True,
            "cell_voltage": [value.voltage / p.cells] * p.cells,
        }
