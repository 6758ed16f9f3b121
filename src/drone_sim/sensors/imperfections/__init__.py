"""Imperfections of a camera, applied to its rendered images.

Each imperfection has its own class and an entry here, in the order of the light's path. All are off by default.
"""

from __future__ import annotations

from drone_sim.config.types import Checked
from drone_sim.sensors.imperfections.exposure import ExposureParameters, ShutterParameters
from drone_sim.sensors.imperfections.noise import PixelNoiseParameters
from drone_sim.sensors.imperfections.vignette import VignetteParameters


class Imperfections(Checked):
    """Parameters of a camera's imperfections, all off by default."""

    shutter: ShutterParameters = ShutterParameters()
    vignette: VignetteParameters = VignetteParameters()
    exposure: ExposureParameters = ExposureParameters()
    noise: PixelNoiseParameters = PixelNoiseParameters()
