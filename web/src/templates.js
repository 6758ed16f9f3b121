// The text of a new script: functions for V-REP's four phases.
const PYTHON = `# A child script: the simulation calls each of these functions.


def sysCall_init():
    # once, before the first step
    self.drone = sim.getObject('./base')


def sysCall_actuation():
    # in every step, before the dynamics: command the propellers
    pass


def sysCall_sensing():
    # in every step, after the dynamics: look at what has come of it
    self.position = sim.getObjectPosition(self.drone)


def sysCall_cleanup():
    # once, at the end
    pass
`;
const LUA = `-- A child script: the simulation calls each of these functions.

function sysCall_init()
    -- once, before the first step
    drone = sim.getObject('./base')
end

function sysCall_actuation()
    -- in every step, before the dynamics: command the propellers
end

function sysCall_sensing()
    -- in every step, after the dynamics: look at what has come of it
    position = sim.getObjectPosition(drone)
end

function sysCall_cleanup()
    -- once, at the end
end
`;

export const template = (isLua) => (isLua ? LUA : PYTHON);
