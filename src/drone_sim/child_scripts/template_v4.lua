-- A script to begin with, in the form of V-REP 3.6 and CoppeliaSim 4.x: a function for each phase.
-- It holds the height at which the drone began. (template_v3.lua is the same in the form of V-REP 3.0 to 3.5.)

function sysCall_init() -- once, before the first step: find the objects, set the variables
    d = sim.getObjectHandle('Quadricopter_base')
    propellerScripts = {}
    for i = 1, 4 do
        propellerScripts[i] = sim.getScriptHandle('Quadricopter_propeller_respondable' .. i)
    end
    zref = sim.getObjectPosition(d, -1)[3]
    thrust = 5.33
end

function sysCall_actuation() -- in each step, before the physics: tell the propellers what to do
    for i = 1, 4 do
        sim.setScriptSimulationParameter(propellerScripts[i], 'particleVelocity', thrust)
    end
end

function sysCall_sensing() -- in each step, after the physics: measure, decide what to do next
    local pos, velocity = sim.getObjectPosition(d, -1), sim.getObjectVelocity(d)
    thrust = 5.33 + 5 * (zref - pos[3]) - 3 * velocity[3]
end

function sysCall_cleanup() -- once, at the end: end what init began
end
