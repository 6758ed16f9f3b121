"""What every sensor's parameters have in common; each kind adds its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from drone_sim.config.types import TOPIC, Checked, Finite, Name, ParameterError, Within
from drone_sim.mechanics.frames import IDENTITY, Matrix, invert, multiply
from drone_sim.sensors.mount import MountParameters

if TYPE_CHECKING:
    from drone_sim.sensors.sensor import Fitting, Instrument

Topic = Annotated[str, Field(pattern=TOPIC, max_length=128)]


class SensorParameters(Checked):
    """When a sensor samples, where it sits, and what it is called; cameras have parameters of their own."""

    kind: str  # each kind names its own
    rate: Annotated[Finite, Within(1e-3, 1e5)]  # Hz of simulated time; sub_step divides its period
    topic: Topic  # in the vehicle's namespace
    frame: Name  # of its messages
    object: Name | None = None  # its name among the objects that a script finds; the sensor's own if left out
    mount: MountParameters | None = None
    latency: Annotated[Finite, Within(0, 60)] = 0.0  # s, whole sub-steps, from measuring to reading
    seed: Annotated[int, Within(0, 2**63 - 1)] = 0

    suffixes: ClassVar[tuple[str, ...]] = ("",)  # of the topics that it publishes, after `topic`
    default_mount: ClassVar[Matrix] = IDENTITY  # the root from the sensor's frame, where nothing says anything else
    from_object: ClassVar[Matrix] = IDENTITY  # the sensor's frame from that of the object that scripts find

    def make(self, fitting: Fitting) -> Instrument:
        """Return the instrument; `reset` comes before its first look."""
        raise NotImplementedError

    def period(self, sub_step: float) -> int:
        """Return the sub-steps (of `sub_step` seconds) between two samples."""
        return max(1, round(1 / (self.rate * sub_step)))

    def check(self, sub_step: float) -> None:
        """Raise ParameterError for a period or a latency that is no whole multiple of `sub_step` (s).

        The message begins with the wrong key, which is its location too.
        """
        steps = self.period(sub_step)
        if abs(steps * sub_step * self.rate - 1) > 1e-4:
            raise ParameterError(
                f"rate = {self.rate:g}: its period must be a whole multiple of sub_step = {sub_step:g} s; "
                f"{1 / (steps * sub_step):.6g} Hz is near",
                ("rate",),
            )
        if abs(round(self.latency / sub_step) * sub_step - self.latency) > 1e-6 * sub_step:
            raise ParameterError(
                f"latency = {self.latency:g}: must be a whole multiple of sub_step = {sub_step:g} s", ("latency",)
            )

    def topics(self) -> Iterator[tuple[str, str]]:
        """Yield what it publishes, and what each topic is."""
        for suffix in self.suffixes:
            yield f"{self.topic}{suffix}", suffix[1:] or self.kind

    def placed(self, links: Mapping[str, Matrix]) -> tuple[str, Matrix]:
        """Return the object that it hangs on ('' is the vehicle's root), and that from the sensor's frame.

        It sits where `mount` says, or at the link of the URDF (given as root from link) that is named like its frame.
        """
        if self.mount is not None:
            return self.mount.parent, self.mount.frame
        return "", links.get(self.frame, self.default_mount)

    def object_in(self, parent_from_sensor: Matrix) -> Matrix:
        """Return the parent from the object that scripts find."""
        return multiply(parent_from_sensor, self.from_object)

    def sensor_at(self, world_from_object: Matrix) -> Matrix:
        """Return the world from the sensor's frame, given the object's pose."""
        if self.from_object is IDENTITY:  # most often, and a fast sensor asks in every sub-step
            return world_from_object
        return multiply(world_from_object, invert(self.from_object))
