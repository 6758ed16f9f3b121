"""The stamp of a step, and /clock."""

from __future__ import annotations

from typing import Protocol

import rospy
from rosgraph_msgs.msg import Clock

from drone_sim.ros.node.newcomers import Newcomers
from drone_sim.ros.vehicle.messages import ros_time
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation

_CLOCK_PERIOD = 1 / 200  # s of real time, between two of /clock while nothing else is sent


class Stamp(Protocol):
    """Returns the stamp of what was the case so long ago (s of simulated time)."""

    def __call__(self, ago: float = 0.0) -> rospy.Time:
        """Return it."""


class StepTime:
    """What everything that belongs to a step is stamped with.

    In real time that is the moment at which the step began. In simulated time it is the simulation's, and /clock
    has said it before anything is sent under it; where nothing is sent, /clock need not tell of every step. What was
    measured within the step has a stamp of its own: so long before, at the pace of the flight.
    """

    def __init__(self, simulation: Simulation, simulated: bool):
        """Advertise /clock, if the time is `simulated`."""
        self.simulated = simulated
        self._simulation = simulation
        self._newcomers = Newcomers()
        self._clock = (
            rospy.Publisher("/clock", Clock, subscriber_listener=self._newcomers, queue_size=10) if simulated else None
        )
        self._throttle = Throttle(_CLOCK_PERIOD)
        self._began = rospy.Time() if simulated else rospy.Time.now()
        self._pace = 0.0  # s of the stamps for a second of simulated time
        self._said = 0.0  # by /clock, s; 0 is no time for ROS

    def begin(self) -> None:
        """Say that a step begins."""
        if not self.simulated:
            before, self._began = self._began, rospy.Time.now()
            parameters = self._simulation.parameters
            # After a late step the next ones come faster: then too no stamp is before those of the step before.
            elapsed = (self._began - before).to_sec() / parameters.time_step
            steady = 1 / (parameters.real_time_factor or 1.0)
            self._pace = min(elapsed, steady) if elapsed >= 0 else steady  # or the machine's clock was set back

    def stamp(self, ago: float = 0.0) -> rospy.Time:
        """Return the stamp of what is sent now, and was the case `ago` seconds of simulated time before."""
        if self._clock is None:
            return self._began - ros_time(ago * self._pace, rospy.Duration) if ago else self._began
        time = self._simulation.time
        stamp = ros_time(time)
        if time != self._said:
            self._said = time
            if time:
                self._clock.publish(stamp)
        return ros_time(max(0.0, time - ago)) if ago else stamp

    def tell_newcomers(self) -> None:
        """Tell whoever has begun to listen while the clock stands still what time it is."""
        for tell in self._newcomers.take() if self._said else ():
            tell(Clock(ros_time(self._said)))

    def end(self, at_once: bool = False) -> None:
        """Say that the step has been shown; `at_once`: /clock tells of it in any case."""
        if self.simulated and (at_once or self._throttle.passes()):
            self.stamp()
