"""Stage 1, the frame left where it was.

It stays where the drone began, and with it the tracking camera and the view of rviz: they see the drone slide away.
"""

PARAMETERS = {
    "thrust_gravity": 5.33,  # m/s, compensation for gravity
}


def sysCall_init():
    """Find the objects, set the variables for control."""
    self.d = sim.getObjectHandle("Quadricopter_base")
    self.trackBase = sim.getObjectHandle("Track_base")
    sim.setObjectParent(self.trackBase, -1, True)  # from here on it moves only when this script moves it
    self.propellerScripts = [sim.getScriptHandle(f"Quadricopter_propeller_respondable{i}") for i in (1, 2, 3, 4)]

    for name, value in PARAMETERS.items():
        sim.setScriptSimulationParameter(sim.handle_self, name, value)
    self.thrust = gain("thrust_gravity")
    self.pitch_corr = self.yaw_corr = self.roll_corr = 0


def gain(name):
    """Return one of PARAMETERS as it is now: it may be tuned while the drone flies."""
    return sim.getScriptSimulationParameter(sim.handle_self, name)


def sysCall_actuation():
    """Mix the thrust and the three corrections into the four propellers."""
    prop_front_left = self.thrust * (1 - self.pitch_corr - self.roll_corr - self.yaw_corr)
    prop_back_left = self.thrust * (1 + self.pitch_corr - self.roll_corr + self.yaw_corr)
    prop_back_right = self.thrust * (1 + self.pitch_corr + self.roll_corr - self.yaw_corr)
    prop_front_right = self.thrust * (1 - self.pitch_corr + self.roll_corr + self.yaw_corr)
    particlesTargetVelocities = [prop_front_left, prop_back_left, prop_back_right, prop_front_right]
    for script, velocity in zip(self.propellerScripts, particlesTargetVelocities):
        sim.setScriptSimulationParameter(script, "particleVelocity", velocity)


def sysCall_sensing():
    """Leave the track frame where it is; set the thrust for the next actuation."""
    self.thrust = gain("thrust_gravity")
