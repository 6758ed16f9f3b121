"""The pilot's script for six propellers, with the same states and commands."""

import pilot
from pilot import (  # called by the simulation
    on_emergency,
    on_goto,
    on_home,
    on_land,
    on_reset,
    on_takeoff,
    on_twist,
    sysCall_cleanup,
    sysCall_sensing,
)

# Propellers 1 to 6, counterclockwise from the front left: distance ahead and to the left in 0.1 m, so that corrections
# have the same effect as on the quadricopter; and direction of rotation.
MIXING = ((1.559, 0.9, -1), (0, 1.8, 1), (-1.559, 0.9, -1), (-1.559, -0.9, 1), (0, -1.8, -1), (1.559, -0.9, 1))


def sysCall_init():
    """Initialize the pilot, with all propellers."""
    pilot.sysCall_init()
    self.propellerScripts = [sim.getScriptHandle(f"Quadricopter_propeller_respondable{i}") for i in range(1, 7)]


def sysCall_actuation():
    """Mix thrust and corrections into the propellers."""
    for script, (ahead, left, sense) in zip(self.propellerScripts, MIXING):
        velocity = self.thrust * (1 - self.pitch_corr * ahead - self.roll_corr * left + self.yaw_corr * sense)
        sim.setScriptSimulationParameter(script, "particleVelocity", velocity)
