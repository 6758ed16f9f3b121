"""Forces on bodies: propellers, pushes, drag, weather. Each kind that `forces:` in YAML allows has its line here."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.forces.drag import DragParameters

ForceParameters = one_of(
    DragParameters,
)
