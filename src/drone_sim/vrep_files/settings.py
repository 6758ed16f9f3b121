"""What a scene file says of the world: simulation step, gravity, the physics engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drone_sim.vrep_files.chunks import finite, level, singles, unpack
from drone_sim.vrep_files.model import Settings

_PRESET_STEPS = (0.2, 0.1, 0.05, 0.025, 0.01)  # s, of `Spi` 0 to 4
_ENGINES = ("Bullet", "ODE", "Vortex", "Newton", "MuJoCo")
_PRESETS = 5  # modes of the dynamics below this have a step of their own
_PRESET_DYNAMICS_STEP = 0.005  # s


def with_simulation(settings: Settings, data: bytes) -> Settings:
    """Return the settings with what a `SIM` says. Raises VrepFileError."""
    own = level(data)
    preset = own.integer("Spi", default=-1)
    step = own.numbers("_t3", "St3", 1)
    if step is not None:
        return replace(settings, time_step=step[0])
    if 0 <= preset < len(_PRESET_STEPS):
        return replace(settings, time_step=_PRESET_STEPS[preset])
    micro = own.find("St2")
    if micro is not None:
        return replace(settings, time_step=unpack("<Q", micro, "St2")[0] / 1e6)
    seconds = own.find("Sts")
    if seconds is not None:
        return replace(settings, time_step=finite(singles("<f", seconds, "Sts"), "Sts")[0])
    return settings


def with_dynamics(settings: Settings, data: bytes) -> Settings:
    """Return the settings with what a `DYN` says. Raises VrepFileError."""
    own = level(data)
    width = "d" if own.find("_n3") is not None else "f"
    found = own.find("_n3", "En3", "En2", "Eng")
    if found is None:
        return settings
    engine, x, y, z, mode = unpack(f"<i3{width}i", found, "_n3")
    if own.find("_n3", "En3") is None:
        mode += 1
    gravity = finite((x, y, z) if width == "d" else tuple(float(str(np.float32(one))) for one in (x, y, z)), "_n3")
    step = own.numbers("_tp", "Stp", 1)
    seconds = step[0] if step is not None else _PRESET_DYNAMICS_STEP if mode < _PRESETS else None
    return replace(
        settings,
        gravity=(gravity[0], gravity[1], gravity[2]),
        dynamics_step=seconds,
        engine=_ENGINES[engine] if 0 <= engine < len(_ENGINES) else "",
    )
