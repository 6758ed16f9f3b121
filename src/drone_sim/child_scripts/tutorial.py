"""The tutorial's child script: velocity commands in, four propeller velocities out.

It has the names, gains and order of operations of the Lua script in the tutorial, and two additions: the collective
thrust is limited to `thrust_limits`, and a drone that leans by `recovery_margin` more than the largest target angle,
for example after hitting a wall, levels out first.
"""

import math

GAINS = (
    "thrust_gravity",  # compensation for gravity
    "thrust_limits",
    "Dthrust",
    "Kzref",
    "Dzref",
    "Dyaw",
    "angle_min",
    "angle_max",
    "Pangle",
    "Dangle",
    "Kvcorr",
    "recovery_margin",
    "Precovery",
)
RECOVERY_YAW = 0.3  # with a larger yaw_corr, the propellers could not level the drone


def sysCall_init():
    """Find the objects, set the variables for control, subscribe to the commands."""
    self.d = sim.getObjectHandle("Quadricopter_base")
    self.trackBase = sim.getObjectHandle("Track_base")
    sim.setObjectParent(self.trackBase, -1, True)
    self.propellerScripts = [sim.getScriptHandle(f"Quadricopter_propeller_respondable{i}") for i in (1, 2, 3, 4)]

    read_gains()
    self.dt = sim.getSimulationTimeStep()
    self.thrust = self.thrust_gravity
    self.pitch_corr = self.yaw_corr = self.roll_corr = 0
    self.pitch_prev = self.roll_prev = 0
    self.zref = sim.getObjectPosition(self.d, -1)[2]  # used if z-speed command is null
    self.vx = self.vy = self.vz = self.rz = 0  # current twist command

    self.twist_subscriber = simROS.subscribe("cmd_vel", "geometry_msgs/Twist", "on_twist", 1)
    # The function itself, because a script that imports this one does not need a function with this name.
    self.gains_subscriber = simROS.subscribe("parameter_updates", "dynamic_reconfigure/Config", on_parameters, 1)


def read_gains():
    """Read the present gains."""
    for name in GAINS:
        setattr(self, name, sim.getScriptSimulationParameter(sim.handle_self, name))
    self.most_lean = self.angle_max + self.recovery_margin if self.recovery_margin else math.inf


def on_parameters(_msg):
    """Use gains that were tuned in flight."""
    read_gains()


def on_twist(msg):
    """Store the command: forward, lateral and vertical speed (track frame, m/s), yaw rate (rad/s)."""
    self.vx, self.vy, self.vz = msg.linear.x, msg.linear.y, msg.linear.z
    self.rz = msg.angular.z


def sysCall_actuation():
    """Set the propellers' velocities: front left, back left, back right, front right."""
    particlesTargetVelocities = (
        self.thrust * (1 - self.pitch_corr - self.roll_corr - self.yaw_corr),
        self.thrust * (1 + self.pitch_corr - self.roll_corr + self.yaw_corr),
        self.thrust * (1 + self.pitch_corr + self.roll_corr - self.yaw_corr),
        self.thrust * (1 - self.pitch_corr + self.roll_corr + self.yaw_corr),
    )
    for script, velocity in zip(self.propellerScripts, particlesTargetVelocities):
        sim.setScriptSimulationParameter(script, "particleVelocity", velocity)


def sysCall_sensing():
    """Move the track frame, then compute thrust and corrections for the next actuation."""
    pos = sim.getObjectPosition(self.d, -1)
    ori = sim.getObjectOrientation(self.d, -1)
    sim.setObjectPosition(self.trackBase, -1, pos)
    sim.setObjectOrientation(self.trackBase, -1, [0, 0, ori[2]])

    local_ori = sim.getObjectOrientation(self.d, self.trackBase)  # orientation in the track frame
    d_global_pos, d_global_ori = sim.getObjectVelocity(self.d)  # linear in the world, angular in its own frame
    track_mat_inv = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    track_mat_inv[3] = track_mat_inv[7] = track_mat_inv[11] = 0
    d_local_pos = sim.multiplyVector(track_mat_inv, d_global_pos)  # linear speed in the track frame

    control_elevation(pos[2], d_global_pos[2])
    self.yaw_corr = self.Dyaw * (self.rz - d_global_ori[2])

    pitch = local_ori[1]
    dpitch = (pitch - self.pitch_prev) / self.dt
    self.pitch_prev = pitch
    pitch_target = target_angle(self.vx, d_local_pos[0])
    self.pitch_corr = self.Pangle * (pitch_target - pitch) - self.Dangle * dpitch

    roll = -local_ori[0]
    droll = (roll - self.roll_prev) / self.dt
    self.roll_prev = roll
    roll_target = target_angle(self.vy, d_local_pos[1])
    self.roll_corr = self.Pangle * (roll_target - roll) - self.Dangle * droll

    if max(abs(pitch), abs(roll)) > self.most_lean:
        recover(sim.getObjectVelocity(self.d + sim.handleflag_axis)[1])


def control_elevation(z, vz):
    """Hold the elevation zref, or follow a vertical speed and update zref."""
    if self.vz == 0:
        self.thrust = self.thrust_gravity + self.Kzref * (self.zref - z) - self.Dzref * vz
    else:
        self.thrust = self.thrust_gravity + self.Dthrust * (self.vz - vz)
        self.zref = z
    if self.thrust_limits:
        lowest, highest = self.thrust_limits
        self.thrust = min(max(self.thrust, lowest), highest)


def recover(w):
    """Level out, instead of following commands; `w` is the angular velocity (rad/s, world).

    At large tilts, Euler angles are coupled, so the tilt is computed from the world's z axis in the body's frame.
    Velocity commands are followed again when the drone leans less.
    """
    m = sim.getObjectMatrix(self.d, -1)
    up_x, up_y, up_z = m[8], m[9], m[10]
    level = math.hypot(up_x, up_y)
    tilt = math.atan2(level, up_z) / level if level > 1e-6 else 0
    roll_rate, pitch_rate = (m[i] * w[0] + m[i + 4] * w[1] + m[i + 8] * w[2] for i in (0, 1))
    self.pitch_corr = self.Precovery * tilt * up_x - self.Dangle * pitch_rate
    self.roll_corr = self.Precovery * tilt * up_y + self.Dangle * roll_rate
    self.yaw_corr = min(max(self.yaw_corr, -RECOVERY_YAW), RECOVERY_YAW)


def target_angle(command, speed):
    """Return the target angle (rad) for a commanded speed, which may be larger for accelerating than for braking."""
    target = self.Kvcorr * (command - speed)
    if command >= 0:
        return min(max(target, -self.angle_min), self.angle_max)
    return min(max(target, -self.angle_max), self.angle_min)


def sysCall_cleanup():
    """End the subscriptions."""
    simROS.shutdownSubscriber(self.twist_subscriber)
    simROS.shutdownSubscriber(self.gains_subscriber)
