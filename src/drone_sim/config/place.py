"""Where on the Earth a scene lies: what satellites and compasses have to do with it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from drone_sim.config.types import Checked, Finite, Within

_Tesla = Annotated[Finite, Within(-1, 1)]
MagneticField = Annotated[
    tuple[_Tesla, _Tesla, _Tesla], Field(description="3 numbers, [east, north, up] in T, as the world's x, y, z")
]


class DatumParameters(Checked):
    """The world's origin in WGS 84; the world's x is east there, y north, z up (REP-103)."""

    latitude: Annotated[Finite, Within(-90, 90)]  # degrees, as in sensor_msgs/NavSatFix
    longitude: Annotated[Finite, Within(-180, 180)]  # degrees
    altitude: Annotated[Finite, Within(-500, 9000)]  # m above the ellipsoid
