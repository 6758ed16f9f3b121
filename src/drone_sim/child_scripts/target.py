"""Child script of V-REP's original quadricopter, which follows position and heading of the green sphere.

The tutorial replaces this controller. Its gains depend on the time step of 0.05 s, because its derivatives are
differences between two steps.
"""

THRUST_GRAVITY = {"3.x": 5.335, "4.x": 5.45}  # m/s, by thrust model of the propellers


def sysCall_init():
    """Find the objects; detach the sphere, so that it does not move with the drone."""
    self.d = sim.getObjectHandle("Quadricopter_base")
    self.heli = sim.getObjectHandle("Drone")
    self.target = sim.getObjectHandle("DronePosition")
    sim.setObjectParent(self.target, -1, True)
    self.trackBase = sim.getObjectHandle("Track_base@silentError")  # V-REP's original quadricopter has none
    if self.trackBase != -1:
        sim.setObjectParent(self.trackBase, -1, True)
    self.propellerScripts = [sim.getScriptHandle(f"Quadricopter_propeller_respondable{i}") for i in (1, 2, 3, 4)]
    self.thrust_gravity = THRUST_GRAVITY[sim.getScriptSimulationParameter(sim.handle_self, "propeller_law")]
    self.alphaE = self.betaE = 0  # height of the ends of the base's y and x axes above its origin
    self.sp = [0, 0, 0]  # position of the sphere in the base's frame
    self.gamma = 0


def sysCall_actuation():
    """Compute thrust and corrections, and mix them into the propeller velocities."""
    thrust = vertical_control()
    alpha, beta = horizontal_control()
    rotation = rotational_control()
    particlesTargetVelocities = (
        thrust * (1 - alpha + beta + rotation),
        thrust * (1 - alpha - beta - rotation),
        thrust * (1 + alpha - beta + rotation),
        thrust * (1 + alpha + beta - rotation),
    )
    for script, velocity in zip(self.propellerScripts, particlesTargetVelocities):
        sim.setScriptSimulationParameter(script, "particleVelocity", velocity)


def vertical_control():
    """Return the collective thrust (m/s)."""
    error = sim.getObjectPosition(self.target, -1)[2] - sim.getObjectPosition(self.d, -1)[2]
    velocity, _ = sim.getVelocity(self.heli)
    return self.thrust_gravity + 2 * error - 2 * velocity[2]


def horizontal_control():
    """Return the corrections about the base's x and y axes."""
    sp = sim.getObjectPosition(self.target, self.d)
    m = sim.getObjectMatrix(self.d, -1)
    alphaE = sim.multiplyVector(m, [0, 1, 0])[2] - m[11]
    betaE = sim.multiplyVector(m, [1, 0, 0])[2] - m[11]
    alpha = 0.25 * alphaE + 2.1 * (alphaE - self.alphaE) + 0.005 * sp[1] + (sp[1] - self.sp[1])
    beta = -0.25 * betaE - 2.1 * (betaE - self.betaE) - 0.005 * sp[0] - (sp[0] - self.sp[0])
    self.alphaE, self.betaE, self.sp = alphaE, betaE, sp
    return alpha, beta


def rotational_control():
    """Return the correction about the vertical axis."""
    gamma = sim.getObjectOrientation(self.d, self.target)[2]
    rotation = 0.1 * gamma + 2 * (gamma - self.gamma)
    self.gamma = gamma
    return rotation


def sysCall_sensing():
    """Move the track frame of the tracking camera, if there is one."""
    if self.trackBase == -1:
        return
    orientation = sim.getObjectOrientation(self.d, -1)
    sim.setObjectPosition(self.trackBase, -1, sim.getObjectPosition(self.d, -1))
    sim.setObjectOrientation(self.trackBase, -1, [0, 0, orientation[2]])
