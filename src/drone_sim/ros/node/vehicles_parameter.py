"""The private parameter `vehicles`: who flies, for people to change."""

from __future__ import annotations

import contextlib
from typing import Any

import rospy

from drone_sim.ros.node.starting import MASTER_GONE
from drone_sim.run.parameters import Parameters

_NAME = "~vehicles"


class VehiclesParameter:
    """Holds an entry for each that flies, as long as nobody else has written it.

    rosparam, as roslaunch, leaves out empty entries and lays the others over what is there: an entry laid over a
    number, or over nothing, would be alone.
    """

    def __init__(self) -> None:
        """Take what was given."""
        self._given = self._told = rospy.get_param(_NAME, None)

    def tell(self, parameters: Parameters) -> None:
        """Say who flies: what a scene file does not say, which comes before the parameter."""
        try:
            self._write(_sendable(parameters.vehicle_entries) or self._given)
        except (TypeError, OverflowError) as error:  # of XML-RPC: such as a seed of more than 32 bits
            rospy.logwarn(f"the parameter {rospy.resolve_name(_NAME)} cannot say who flies: {error}")

    def read(self) -> Any:
        """Return what it holds."""
        return rospy.get_param(_NAME, {})

    def close(self) -> None:
        """Put back what was given: the next simulator of this name may be given another drone."""
        with contextlib.suppress(*MASTER_GONE, OSError):
            self._write(self._given)

    def _write(self, value: Any) -> None:
        if value == self._told or rospy.get_param(_NAME, None) != self._told:
            return
        if value is None:
            rospy.delete_param(_NAME)
        else:
            rospy.set_param(_NAME, value)
        self._told = value


def _sendable(value: Any) -> Any:
    """Return a value of YAML without null, which parameters cannot hold."""
    if isinstance(value, dict):
        return {str(key): _sendable(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_sendable(one) for one in value]
    return "none" if value is None else value
