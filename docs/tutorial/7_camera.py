"""Stage 7 of docs/tutorial.md: the picture of the front camera goes out on a ROS topic."""

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
    """Find the objects, set the variables for control, subscribe to the commands, advertise the image."""
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

    self.twist = [0, 0, 0, 0, 0, 0]  # vx, vy, vz, -, -, rz
    self.twist_subscriber = simROS.subscribe("/drone/cmd_vel", "geometry_msgs/Twist", "on_twist", 1)

    self.frontImage = sim.getObjectHandle("FrontVision")
    self.image_publisher = simROS.imageTransportAdvertise("/drone/my_front", 1)


def gain(name):
    """Return one of PARAMETERS as it is now: it may be tuned while the drone flies."""
    return sim.getScriptSimulationParameter(sim.handle_self, name)


def on_twist(msg):
    """Keep the command that has come."""
    linear, angular = msg.linear, msg.angular
    self.twist = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]


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

    twist = self.twist
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

    if simROS.getNumSubscribers(self.image_publisher):  # a picture that nobody gets is not drawn
        data, w, h = sim.getVisionSensorCharImage(self.frontImage)
        simROS.imageTransportPublish(self.image_publisher, data, w, h, "front_optical")


def target_angle(command, speed):
    """Return the lean (rad) that a speed error asks for; less of it for braking than for speeding up."""
    target = gain("Kvcorr") * (command - speed)
    if command >= 0:
        return min(max(target, -gain("angle_min")), gain("angle_max"))
    return min(max(target, -gain("angle_max")), gain("angle_min"))


def sysCall_cleanup():
    """End what init began."""
    simROS.shutdownSubscriber(self.twist_subscriber)
    simROS.shutdownPublisher(self.image_publisher)
