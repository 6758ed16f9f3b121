"""The stamp of a step, and /clock; new subscribers that come while nothing is published, because nothing changes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

import genpy
import rospy
from rosgraph_msgs.msg import Clock

from drone_sim.ros.core.message_conversion import ros_time
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation

_CLOCK_PERIOD = 1 / 200  # s of real time, between two of /clock while nothing else is sent
_MOST = 100  # new subscribers that wait to be told

Tell = Callable[[genpy.Message], None]


class Stamp(Protocol):
    """Returns the stamp for a state that is `ago` old (s of simulated time)."""

    def __call__(self, ago: float = 0.0) -> rospy.Time:
        """Return the stamp."""


class NewSubscribers(rospy.SubscribeListener):  # type: ignore[misc] # rospy has no types
    """New subscribers of a topic, remembered until they are taken; rospy's threads add them."""

    def __init__(self) -> None:
        """Begin with none."""
        super().__init__()
        self._came: deque[tuple[float, Tell]] = deque(maxlen=_MOST)  # s of the monotonic clock, and what tells them

    def peer_subscribe(self, _topic: str, _publish: Tell, tell: Tell) -> None:
        """Remember a subscriber; rospy calls this, with the function that sends a message to this subscriber alone."""
        self._came.append((time.monotonic(), tell))

    def take(self) -> list[Any]:
        """Return a send function for each of them, and forget them. Only the thread that publishes calls this."""
        return [self._came.popleft()[1] for _ in range(len(self._came))]

    def have_settled(self, seconds: float) -> bool:
        """Return True once, when the last of them came more than `seconds` ago, and forget them."""
        settled = bool(self._came) and time.monotonic() - self._came[-1][0] > seconds
        if settled:
            self._came.clear()
        return settled


class StepTime:
    """What everything that belongs to a step is stamped with.

    In real time this is the moment at which the step began. In simulated time it is the simulation's time, and /clock
    publishes it before any message with this stamp; if nothing is sent, /clock may skip steps. What was measured within
    the step has an earlier stamp of its own, at the pace of the flight.
    """

    def __init__(self, simulation: Simulation, simulated: bool):
        """Take the simulation whose steps it is; advertise /clock, if the time is `simulated`."""
        self.simulated = simulated
        self._simulation = simulation
        self._new_subscribers = NewSubscribers()
        self._clock = (
            rospy.Publisher("/clock", Clock, subscriber_listener=self._new_subscribers, queue_size=10)
            if simulated
            else None
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
        """Return the stamp of a message that is sent now, about the state `ago` seconds of simulated time before."""
        if self._clock is None:
            return self._began - ros_time(ago * self._pace, rospy.Duration) if ago else self._began
        now = self._simulation.time
        stamp = ros_time(now)
        if now != self._said:
            self._said = now
            if now:
                self._clock.publish(stamp)
        return ros_time(max(0.0, now - ago)) if ago else stamp

    def tell_new_subscribers(self) -> None:
        """Tell whoever has begun to listen while the clock stands still what time it is."""
        for tell in self._new_subscribers.take() if self._said else ():
            tell(Clock(ros_time(self._said)))

    def end(self, at_once: bool = False) -> None:
        """Say that the step has been shown; `at_once`: /clock tells of it in any case."""
        if self.simulated and (at_once or self._throttle.passes()):
            self.stamp()
