"""The pilot on six propellers: all of its states and commands, and a mixing of its own."""

import pilot
from pilot import (  # called as they are
    on_goto,
    on_home,
    on_land,
    on_reset,
    on_takeoff,
    on_twist,
    sysCall_cleanup,
    sysCall_sensing,
)

# Propellers 1 to 6, from the front left once around: how far ahead and to the left, in 0.1 m, which gives corrections
# the effect that they have on the quadricopter; and which way they turn.
MIXING = ((1.559, 0.9, -1), (0, 1.8, 1), (-1.559, 0.9, -1), (-1.559, -0.9, 1), (0, -1.8, -1), (1.559, -0.9, 1))


def sysCall_init():
    """Begin as the pilot does, with all propellers."""
    pilot.sysCall_init()
    self.propellerScripts = [sim.getScriptHandle(f"Quadricopter_propeller_respondable{i}") for i in range(1, 7)]


def sysCall_actuation():
    """Mix thrust and corrections into the propellers."""
    for script, (ahead, left, sense) in zip(self.propellerScripts, MIXING):
        velocity = self.thrust * (1 - self.pitch_corr * ahead - self.roll_corr * left + self.yaw_corr * sense)
        sim.setScriptSimulationParameter(script, "particleVelocity", velocity)
