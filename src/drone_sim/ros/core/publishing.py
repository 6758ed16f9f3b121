"""Stamps of a step's messages, /clock, and lists of new subscribers."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import genpy
import rospy
from rosgraph_msgs.msg import Clock

from drone_sim.ros.core.message_conversion import ros_time
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation

_CLOCK_PERIOD = 1 / 200  # s of real time, between two messages on /clock while nothing else is sent
_MAX_NEW_SUBSCRIBERS = 100

Send = Callable[[genpy.Message], None]
Stamp = Callable[..., rospy.Time]  # StepTime.stamp


class NewSubscribers(rospy.SubscribeListener):  # type: ignore[misc] # rospy has no types
    """Subscribers that have connected to a topic since the last `take`. rospy's threads add them."""

    def __init__(self) -> None:
        super().__init__()
        self._new: deque[tuple[float, Send]] = deque(maxlen=_MAX_NEW_SUBSCRIBERS)  # with the monotonic time, s

    def peer_subscribe(self, _topic: str, _publish: Send, send: Send) -> None:
        """Add a subscriber, by the function that sends a message to it alone. rospy calls this."""
        self._new.append((time.monotonic(), send))

    def take(self) -> list[Send]:
        """Remove all and return a send function for each. Only the thread that publishes calls this."""
        return [self._new.popleft()[1] for _ in range(len(self._new))]

    def have_settled(self, seconds: float) -> bool:
        """Return whether there are any, the last of them added more than `seconds` ago; then remove them."""
        has_settled = bool(self._new) and time.monotonic() - self._new[-1][0] > seconds
        if has_settled:
            self._new.clear()
        return has_settled


class StepTime:
    """Stamps of a step's messages.

    In real time the stamp is the moment at which the step began. In simulated time it is the simulation's time, and
    /clock publishes it before any message with this stamp; if nothing is sent, /clock may skip steps. A measurement
    from within the step has an earlier stamp.
    """

    def __init__(self, simulation: Simulation, simulated: bool):
        """Stamp the steps of `simulation`; advertise /clock if `simulated`."""
        self.simulated = simulated
        self._simulation = simulation
        self._new_subscribers = NewSubscribers()
        self._clock = (
            rospy.Publisher("/clock", Clock, subscriber_listener=self._new_subscribers, queue_size=10)
            if simulated
            else None
        )
        self._throttle = Throttle(_CLOCK_PERIOD)
        self._step_began = rospy.Time() if simulated else rospy.Time.now()
        self._pace = 0.0  # s between stamps for each second of simulated time
        self._published = 0.0  # last time on /clock, s; ROS takes 0 for "no time yet"

    def begin(self) -> None:
        """Set the stamp for the step that begins now."""
        if not self.simulated:
            before, self._step_began = self._step_began, rospy.Time.now()
            parameters = self._simulation.parameters
            # After a late step the next ones are faster. The smaller pace keeps stamps after those of the last step.
            elapsed = (self._step_began - before).to_sec() / parameters.time_step
            steady = 1 / (parameters.real_time_factor or 1.0)
            self._pace = min(elapsed, steady) if elapsed >= 0 else steady  # negative: the system clock was set back

    def stamp(self, ago: float = 0.0) -> rospy.Time:
        """Return the stamp of a message that is sent now, for the state `ago` seconds of simulated time before."""
        if self._clock is None:
            return self._step_began - ros_time(ago * self._pace, rospy.Duration) if ago else self._step_began
        now = self._simulation.time
        stamp = ros_time(now)
        if now != self._published:
            self._published = now
            if now:
                self._clock.publish(stamp)
        return ros_time(max(0.0, now - ago)) if ago else stamp

    def publish_to_new_subscribers(self) -> None:
        """Send the current time to new subscribers of /clock, while the simulation stands still."""
        for send in self._new_subscribers.take() if self._published else ():
            send(Clock(ros_time(self._published)))

    def end(self, at_once: bool = False) -> None:
        """Publish /clock at the end of a step: always if `at_once`, otherwise at most every _CLOCK_PERIOD."""
        if self.simulated and (at_once or self._throttle.passes()):
            self.stamp()
