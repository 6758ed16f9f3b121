"""The tutorial's child script, extended by take-off, landing, flights to a position, and reset.

The controller is the tutorial's, unchanged: the pilot only sets its commands, and stops the propellers on the ground.
Topics in the drone's namespace: takeoff, land, emergency, reset, home (std_msgs/Empty), goto
(geometry_msgs/PoseStamped, world); state (std_msgs/String) is one of five states.
"""

import math

import tutorial
from tutorial import sysCall_actuation  # called by the simulation

LANDED, TAKING_OFF, FLYING, LANDING, CRASHED = "landed", "taking off", "flying", "landing", "crashed"

CLIMB = 0.6  # m/s
AT_HEIGHT, SETTLED = 0.01, 0.05  # m, m/s: tolerances for the end of the take-off
DESCENT, SLOWEST_DESCENT, DESCENT_PER_HEIGHT = 0.4, 0.2, 0.5  # m/s, m/s, 1/s: slower near the floor
STANDS, STANDS_FOR = 0.1, 0.8  # m/s, s: if it descends more slowly than this for this time, it has landed
FASTEST, LIFT, TURN = 1.0, 0.5, 1.0  # m/s, m/s, rad/s: largest speeds to a goal
APPROACH, TURNING = 0.5, 1.0  # 1/s: speed per remaining distance or angle
NEAR = 0.3  # m: difference in height below which the tutorial's controller goes to the height itself
LEANING = math.radians(60)  # more than in any flight
AGAIN = 5.0  # s until the same refusal is logged again; refusals of twists, which are frequent, are logged once
LIES, LIES_FOR = 0.1, 1.0  # m/s, s: if it leans and is slower than this for this time, it has crashed


def sysCall_init():
    """Initialize the tutorial's script; start in flight, or on the ground."""
    # Before the tutorial's own subscription, so that a reset discards twists from the same step.
    self.requests = [
        simROS.subscribe("reset", "std_msgs/Empty", "on_reset"),
        simROS.subscribe("takeoff", "std_msgs/Empty", "on_takeoff"),
        simROS.subscribe("land", "std_msgs/Empty", "on_land"),
        simROS.subscribe("emergency", "std_msgs/Empty", "on_emergency"),
        simROS.subscribe("home", "std_msgs/Empty", "on_home"),
        simROS.subscribe("goto", "geometry_msgs/PoseStamped", "on_goto"),
    ]
    self.state_publisher = simROS.advertise("state", "std_msgs/String", 1, True)
    tutorial.sysCall_init()
    x, y, z = sim.getObjectPosition(self.d, -1)
    yaw = sim.getObjectOrientation(self.d, -1)[2]
    self.still = 0.0  # s for which it has not moved although it should
    self.goal = None  # x, y, z (m), yaw (rad)
    # What commands of a driver mean: docs/drivers.md
    self.tilts = sim.getScriptSimulationParameter(sim.handle_self, "cmd_vel_means") == "tilt"
    self.lifts_off = sim.getScriptSimulationParameter(sim.handle_self, "cmd_vel_lifts_off")
    height = takeoff_height()
    if sim.getScriptSimulationParameter(sim.handle_self, "start") == LANDED:
        self.home = (x, y, z + height, yaw)
        rest(LANDED)
    else:
        self.home = (x, y, z, yaw)
        enter(FLYING)


def sysCall_sensing():
    """Compute thrust and corrections with the tutorial's script; then call the function of the state."""
    if self.tilt is not None and self.Kvcorr:
        lean()
    tutorial.sysCall_sensing()
    if not (-LEANING < self.roll_prev < LEANING and -LEANING < self.pitch_prev < LEANING):
        watch_lean()
    if self.work is not None:
        self.work()


def sysCall_cleanup():
    """End subscriptions and publications."""
    for handle in self.requests:
        simROS.shutdownSubscriber(handle)
    simROS.shutdownPublisher(self.state_publisher)
    tutorial.sysCall_cleanup()


# ---- commands


def on_twist(msg):
    """Follow a velocity command in flight; a command during the take-off is followed afterwards."""
    if self.state == TAKING_OFF:
        self.waiting = msg
    elif self.state == FLYING:
        self.work = self.goal = None
        follow(msg)
    elif self.state == LANDED and self.lifts_off and msg.linear.z > 0:
        enter(FLYING)
        follow(msg)
    elif any((msg.linear.x, msg.linear.y, msg.linear.z, msg.angular.z)) or (self.tilts and tilt_of(msg)):
        refuse("cmd_vel")


def follow(msg):
    """Follow a command: speeds, or a tilt with a climb and turn rate."""
    tutorial.on_twist(msg)
    self.tilt = tilt_of(msg) if self.tilts else None


def tilt_of(msg):
    """Return the tilt (rad, forward and to the left) of a command; None for level, which means: stand still."""
    tilt = msg.angular.y, -msg.angular.x
    return tilt if any(tilt) else None


def lean():
    """Command the speeds at which the controller's target angles are the commanded tilt."""
    yaw = sim.getObjectOrientation(self.d, -1)[2]
    ahead, left = math.cos(yaw), math.sin(yaw)
    vx, vy, _ = sim.getObjectVelocity(self.d)[0]
    forward, sideways = self.tilt
    self.vx = ahead * vx + left * vy + forward / self.Kvcorr
    self.vy = ahead * vy - left * vx + sideways / self.Kvcorr


def takeoff_height():
    """Return the height (m) of a take-off, which may be tuned in flight."""
    return sim.getScriptSimulationParameter(sim.handle_self, "takeoff_height")


def on_takeoff(_msg):
    """Climb to the height of a take-off, and hold it."""
    if self.state in (LANDED, LANDING):
        enter(TAKING_OFF, climb)
        z = sim.getObjectPosition(self.d, -1)[2]
        self.zref, self.top = z, z + takeoff_height()
    elif self.state == CRASHED:
        refuse("takeoff")


def on_land(_msg):
    """Descend until the drone stands on something, and stop the propellers."""
    if self.state in (FLYING, TAKING_OFF):
        enter(LANDING, descend)
    elif self.state == CRASHED:
        refuse("land")


def on_emergency(_msg):
    """Stop the propellers at once; after its fall, the drone has landed, or crashed."""
    if self.state in (FLYING, TAKING_OFF, LANDING):
        enter(LANDING, fall)


def on_goto(msg):
    """Fly to a pose, and hold its position and heading until the next command."""
    p, q = msg.pose.position, msg.pose.orientation
    go((p.x, p.y, p.z, math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))), "goto")


def on_home(_msg):
    """Fly to the start."""
    go(self.home, "home")


def on_reset(_msg):
    """Restart the script; the simulation has already reset the drone's pose."""
    sysCall_cleanup()
    sysCall_init()


def go(goal, topic):
    """Fly to a goal, if the drone is flying."""
    if self.state == FLYING:
        self.goal, self.work, self.tilt = goal, approach, None
    else:
        refuse(topic)


def refuse(topic):
    """Log why a command is not followed."""
    now = sim.getSimulationTime()
    if now - self.refused.get(topic, -math.inf) >= AGAIN:
        self.refused[topic] = math.inf if topic == "cmd_vel" else now
        cures = {
            LANDED: "send `takeoff` first",
            CRASHED: "`reset` puts it back at its start",
            LANDING: "`takeoff` interrupts the landing",
        }
        message = (
            f"{topic} does not move the drone: it is {self.state}; {cures.get(self.state, 'wait until it is flying')}"
        )
        sim.addLog(sim.verbosity_scriptwarnings, message)


# ---- the states


def enter(state, work=None):
    """Change to a state and cancel commands; `work` is called in every step."""
    self.state, self.work = state, work
    self.refused, self.waiting, self.still = {}, None, 0.0  # refused: time (s) of the last log line by topic
    self.vx = self.vy = self.vz = self.rz = 0
    self.tilt = None  # rad, forward and to the left, that a command wants; None: commands are speeds
    simROS.publish(self.state_publisher, {"data": state})


def rest(state):
    """Stop the propellers."""
    enter(state, stop)
    stop()


def stop():
    """Set the thrust to zero, instead of the controller's."""
    self.thrust = 0


def climb():
    """Raise the setpoint of the height until the drone has reached the top."""
    self.zref = min(self.zref + CLIMB * self.dt, self.top)
    vz = sim.getObjectVelocity(self.d)[0][2]
    if abs(sim.getObjectPosition(self.d, -1)[2] - self.top) < AT_HEIGHT and abs(vz) < SETTLED:
        waiting = self.waiting
        enter(FLYING)
        if waiting is not None:
            follow(waiting)


def descend():
    """Descend, more slowly near the floor, until the drone stands."""
    z = sim.getObjectPosition(self.d, -1)[2]
    self.vz = -min(max(DESCENT_PER_HEIGHT * z, SLOWEST_DESCENT), DESCENT)
    rest_when_still()


def fall():
    """Keep the propellers stopped until the drone lies still."""
    stop()
    rest_when_still()


def rest_when_still():
    """Enter the state landed if the drone has not sunk for a while."""
    vz = sim.getObjectVelocity(self.d)[0][2]
    self.still = self.still + self.dt if abs(vz) < STANDS else 0.0
    if self.still > STANDS_FOR:
        rest(LANDED)


def approach():
    """Fly towards the goal, more slowly near it."""
    x, y, z, yaw = self.goal
    here, (_, _, heading) = sim.getObjectPosition(self.d, -1), sim.getObjectOrientation(self.d, -1)
    dx, dy, dz = x - here[0], y - here[1], z - here[2]
    distance = math.hypot(dx, dy)
    speed = min(APPROACH, FASTEST / distance) if distance else 0
    ahead, left = math.cos(heading), math.sin(heading)
    self.vx, self.vy = speed * (ahead * dx + left * dy), speed * (ahead * dy - left * dx)
    if abs(dz) < NEAR:
        self.vz, self.zref = 0, z
    else:
        self.vz = math.copysign(LIFT, dz)
    turn = math.remainder(yaw - heading, 2 * math.pi)
    self.rz = min(max(TURNING * turn, -TURN), TURN)


def watch_lean():
    """Set the state to crashed if the drone has not moved for a while; called if it leans too far."""
    self.still = self.still + self.dt if math.hypot(*sim.getObjectVelocity(self.d)[0]) < LIES else 0.0
    if self.still > LIES_FOR and self.state != CRASHED:
        rest(CRASHED)
