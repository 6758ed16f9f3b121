"""Stage 5 with a guard: the collective thrust stays positive."""

PARAMETERS = {
    "thrust_gravity": 5.33,  # m/s, compensation for gravity
    "Dthrust": 1,  # (m/s) per (m/s)
    "Kzref": 5,  # (m/s) per m
    "Dzref": 3,  # (m/s) per (m/s)
    "Dyaw": 1,  # 1 per (rad/s)
    "angle_min": 0.2,  # rad, while braking
    "angle_max": 0.5,  # rad, while speeding up
    "Pangle": 0.3,  # 1 per rad
    "Dangle": 0.2,  # 1 per (rad/s)
    "Kvcorr": 0.5,  # rad per (m/s)
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
    self.dt = sim.getSimulationTimeStep()
    self.pitch_prev = 0
    self.roll_prev = 0


def gain(name):
    """Return one of PARAMETERS as it is now: it may be tuned while the drone flies."""
    return sim.getScriptSimulationParameter(sim.handle_self, name)


def flight_plan(t):
    """Return the twist at a time: to the left for six seconds, then stop."""
    vy = 1 if 1 <= t < 7 else 0
    return [0, vy, 0, 0, 0, 0]


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
    local_ori = sim.getObjectOrientation(self.d, self.trackBase)
    track_mat_inv = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    track_mat_inv[3] = track_mat_inv[7] = track_mat_inv[11] = 0  # a velocity is turned, not moved
    d_local_pos = sim.multiplyVector(track_mat_inv, d_global_pos)  # linear velocity in the track frame

    if twist[2] == 0:
        self.thrust = gain("thrust_gravity") + gain("Kzref") * (self.zref - pos[2]) - gain("Dzref") * d_global_pos[2]
    else:
        self.thrust = gain("thrust_gravity") + gain("Dthrust") * (twist[2] - d_global_pos[2])
        self.zref = pos[2]  # to be held when the z-speed command is null again
    self.thrust = min(max(self.thrust, 3), 8)  # the corrections are multiplied by it

    self.yaw_corr = gain("Dyaw") * (twist[5] - d_global_ori[2])

    pitch = local_ori[1]
    dpitch = (pitch - self.pitch_prev) / self.dt
    self.pitch_prev = pitch
    pitch_target = target_angle(twist[0], d_local_pos[0])
    self.pitch_corr = gain("Pangle") * (pitch_target - pitch) - gain("Dangle") * dpitch

    roll = -local_ori[0]
    droll = (roll - self.roll_prev) / self.dt
    self.roll_prev = roll
    roll_target = target_angle(twist[1], d_local_pos[1])
    self.roll_corr = gain("Pangle") * (roll_target - roll) - gain("Dangle") * droll


def target_angle(command, speed):
    """Return the lean (rad) that a speed error asks for; less of it for braking than for speeding up."""
    target = gain("Kvcorr") * (command - speed)
    if command >= 0:
        return min(max(target, -gain("angle_min")), gain("angle_max"))
    return min(max(target, -gain("angle_max")), gain("angle_min"))
