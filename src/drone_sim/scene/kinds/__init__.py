"""The kinds of scene objects other than shapes. Add a new kind to KINDS."""

from __future__ import annotations

from drone_sim.scene.kinds.curved_path import CurvedPathParameters
from drone_sim.scene.kinds.dummy import DummyParameters
from drone_sim.scene.kinds.force_sensor import ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.kinds.path import PathParameters
from drone_sim.scene.kinds.proximity_sensor import ProximitySensorParameters
from drone_sim.scene.kinds.script import ScriptParameters
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
