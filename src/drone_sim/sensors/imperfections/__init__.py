"""What sets a camera's pictures apart from what is drawn.

Each imperfection is a file, and has its line here: they come in the order in which light meets them. All are off
unless a camera's parameters say otherwise.
"""

from __future__ import annotations

from drone_sim.config.types import Checked
from drone_sim.sensors.imperfections.exposure import ExposureParameters
from drone_sim.sensors.imperfections.noise import PixelNoiseParameters
from drone_sim.sensors.imperfections.shutter import ShutterParameters
from drone_sim.sensors.imperfections.vignette import VignetteParameters


class Imperfections(Checked):
    """A camera's imperfections; by default there are none."""

    shutter: ShutterParameters = ShutterParameters()
    vignette: VignetteParameters = VignetteParameters()
    exposure: ExposureParameters = ExposureParameters()
    noise: PixelNoiseParameters = PixelNoiseParameters()
