"""Air drag, by which a body feels the weather, and a steady wind for one vehicle.

    F = -c (v - w)    N: c the coefficients along the body's axes (kg/s), v and w velocities of body and air (m/s)

It is linear in the velocity, like the drag of turning propellers: R. Mahony, V. Kumar, P. Corke, "Multirotor Aerial
Vehicles", IEEE Robotics & Automation Magazine 19(3), 2012, section on blade flapping and induced drag.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Finite, Within
from drone_sim.forces.force import Force, PushedBody
from drone_sim.mechanics.frames import rotate, rotate_back
from drone_sim.mechanics.wrench import Wrench

_Coefficient = Annotated[Finite, Within(0, 100)]
_Coefficients = tuple[_Coefficient, _Coefficient, _Coefficient]
_Speed = Annotated[Finite, Within(-100, 100)]
_Velocity = tuple[_Speed, _Speed, _Speed]
_DRAG = (0.1, 0.1, 0.1)  # kg/s


class DragParameters(Checked):
    """`coefficients` along the body's x, y and z; `wind`: velocity of the air in the world, added to the weather's."""

    kind: Literal["drag"]
    coefficients: Annotated[_Coefficients, Field(description="3 numbers, along the body's [x, y, z] in kg/s")] = _DRAG
    wind: Annotated[_Velocity, Field(description="3 numbers, [x, y, z] in m/s, in the world")] = (0.0, 0.0, 0.0)

    def make(self) -> Drag:
        return Drag(self)


class Drag(Force):
    """Drag of a body that moves through the air; it acts at the centre of mass, in every sub-step."""

    every_sub_step: ClassVar[bool] = True
    feels_wind: ClassVar[bool] = True

    def __init__(self, parameters: DragParameters):
        self._coefficients, self._wind = parameters.coefficients, parameters.wind

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        (vx, vy, vz), (wx, wy, wz), (ax, ay, az) = body.state.linear_velocity, self._wind, body.wind
        x, y, z = rotate_back(body.matrix, (vx - wx - ax, vy - wy - ay, vz - wz - az))
        cx, cy, cz = self._coefficients
        wrench.push(rotate(body.matrix, (-cx * x, -cy * y, -cz * z)))
