"""The kinds of scene objects other than shapes. Add a new kind to KINDS."""

from __future__ import annotations

from drone_sim.scene.kinds.dummy import DummyParameters, ScriptParameters
from drone_sim.scene.kinds.joints import ForceSensorParameters, JointParameters
from drone_sim.scene.kinds.paths import CurvedPathParameters, PathParameters
from drone_sim.scene.kinds.proximity_sensor import ProximitySensorParameters
from drone_sim.scene.kinds.vision_sensor import VisionSensorParameters

KINDS = (
    DummyParameters,
    JointParameters,
    ProximitySensorParameters,
    VisionSensorParameters,
    PathParameters,
    CurvedPathParameters,
    ForceSensorParameters,
    ScriptParameters,
)
