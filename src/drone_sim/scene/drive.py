"""A joint of the scene in the dynamics."""

from __future__ import annotations

from drone_sim.mechanics.joint import FORCE, KINEMATIC, PASSIVE, POSITION, Control
from drone_sim.world import World


class JointDrive:
    """Moves a joint in the world, as mechanics.joint.Drive says; rad, m, N m, N."""

    def __init__(self, world: World, body: int, link: int):
        """Take the world, the body in it, and the link below the joint."""
        self._joints = world.joints
        self._at = body, link
        self._is_held = False

    def value(self) -> float:
        """Return its position."""
        return self._joints.state(*self._at)[0]

    def velocity(self) -> float:
        """Return its velocity."""
        return self._joints.state(*self._at)[1]

    def force(self) -> float:
        """Return what its motor gave in the last sub-step."""
        return self._joints.state(*self._at)[2]

    def put(self, value: float) -> None:
        """Put it at a position, at rest."""
        self._joints.put(*self._at, value)
        if self._is_held:
            self._joints.hold(*self._at, value)

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Let it have other limits, or none."""
        self._joints.limit(*self._at, limits)

    def command(self, control: Control) -> None:
        """Let its motor do what is told from now on."""
        self._is_held = control.mode == KINEMATIC
        if self._is_held:
            self._joints.hold(*self._at, self.value())
        elif control.mode == PASSIVE:
            self._joints.let_go(*self._at)
        elif control.mode == POSITION:
            self._joints.go_to(*self._at, control.position, control.max_force)
        elif control.mode == FORCE:
            self._joints.push(*self._at, control.force)
        else:
            self._joints.run_at(*self._at, control.velocity, control.max_force)
