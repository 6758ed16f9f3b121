"""The parameter `robot_description` of a vehicle: its URDF, for rviz and whoever else asks."""

from __future__ import annotations

from xml.etree import ElementTree as Xml

import rospy

from drone_sim.files.resources import read_bytes
from drone_sim.vehicles.parameters import VehicleParameters

_LARGEST = 4 * 2**20  # bytes


def set_description(parameters: VehicleParameters) -> None:
    """Set it, in the namespace of the vehicle; without inertias.

    Who only computes poses needs none, and KDL warns of a root link that has one.
    """
    robot = Xml.fromstring(read_bytes(parameters.urdf, _LARGEST))
    for link in robot.iter("link"):
        for inertial in link.findall("inertial"):
            link.remove(inertial)
    rospy.set_param(f"{parameters.name}/robot_description", Xml.tostring(robot, encoding="unicode"))
