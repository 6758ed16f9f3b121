"""Stage 1 of docs/tutorial.md: constant thrust, no control yet; the track frame follows the drone."""

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
    """Keep the track frame on the drone, level, turned by its yaw; set the thrust for the next actuation."""
    pos = sim.getObjectPosition(self.d, -1)
    ori = sim.getObjectOrientation(self.d, -1)
    sim.setObjectPosition(self.trackBase, -1, pos)
    sim.setObjectOrientation(self.trackBase, -1, [0, 0, ori[2]])

    self.thrust = gain("thrust_gravity")
