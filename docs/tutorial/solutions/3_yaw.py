"""Stage 3 that holds its heading.

3.1 and -3.1 rad are 0.08 rad apart, not 6.2: math.remainder takes the short way round. The heading held is that at the
end of the command; 1.40 rad, since the drone, too, needs its time to follow 0.5 rad/s.
"""

import math

PARAMETERS = {
    "thrust_gravity": 5.33,  # m/s, compensation for gravity
    "Dthrust": 1,  # (m/s) per (m/s)
    "Kzref": 5,  # (m/s) per m
    "Dzref": 3,  # (m/s) per (m/s)
    "Dyaw": 1,  # 1 per (rad/s)
    "Kyaw": 1,  # (rad/s) per rad
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
    self.zref = sim.getObjectPosition(self.d, -1)[2]  # m, used if the z-speed command is null
    self.yaw_ref = sim.getObjectOrientation(self.d, -1)[2]  # rad, used if the yaw command is null


def gain(name):
    """Return one of PARAMETERS as it is now: it may be tuned while the drone flies."""
    return sim.getScriptSimulationParameter(sim.handle_self, name)


def flight_plan(t):
    """Return the twist at a time: turn left for three seconds."""
    rz = 0.5 if 1 <= t < 4 else 0
    return [0, 0, 0, 0, 0, rz]


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
    """Move the track frame, then compute thrust and corrections for the next actuation."""
    pos = sim.getObjectPosition(self.d, -1)
    ori = sim.getObjectOrientation(self.d, -1)
    sim.setObjectPosition(self.trackBase, -1, pos)
    sim.setObjectOrientation(self.trackBase, -1, [0, 0, ori[2]])

    twist = flight_plan(sim.getSimulationTime())
    d_global_pos, d_global_ori = sim.getObjectVelocity(self.d)  # linear in the world frame, angular in its own

    if twist[2] == 0:
        self.thrust = gain("thrust_gravity") + gain("Kzref") * (self.zref - pos[2]) - gain("Dzref") * d_global_pos[2]
    else:
        self.thrust = gain("thrust_gravity") + gain("Dthrust") * (twist[2] - d_global_pos[2])
        self.zref = pos[2]  # to be held when the z-speed command is null again

    if twist[5] == 0:
        error = math.remainder(self.yaw_ref - ori[2], 2 * math.pi)  # the short way round
        self.yaw_corr = gain("Dyaw") * (gain("Kyaw") * error - d_global_ori[2])
    else:
        self.yaw_corr = gain("Dyaw") * (twist[5] - d_global_ori[2])
        self.yaw_ref = ori[2]  # to be held when the yaw command is null again
