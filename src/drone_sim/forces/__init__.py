"""What pushes: propellers, pushes, drag and wind. A kind that `forces:` may name has its line here."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.forces.drag import DragParameters

ForceParameters = one_of(
    DragParameters,
)
