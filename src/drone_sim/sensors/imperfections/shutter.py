"""Parameters of a rolling shutter, which exposes the rows of an image one after another: see render.shutter."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from drone_sim.config.types import Finite, Unit, Within
from drone_sim.sensors.imperfections.imperfection import Imperfection


class ShutterParameters(Imperfection):
    """Timing of the exposure of rows."""

    readout: Annotated[Finite, Within(0, 1), Unit("s")] = Field(
        default=0.0, description="from the first row to the last; 0: all rows at once"
    )

    @property
    def is_on(self) -> bool:
        return self.readout > 0
