-- The tutorial's controller as a CoppeliaSim 4.x script: `sim`, `simROS`, paths, a function for each phase.

sim = require'sim'
simROS = require'simROS'

function sysCall_init()
    d = sim.getObject('./base')
    trackBase = sim.getObject('./Track_base')
    sim.setObjectParent(trackBase, -1, true)
    propellerScripts = {}
    for i = 1, 4 do
        propellerScripts[i] = sim.getScriptHandle('./propeller[' .. (i - 1) .. ']/respondable')
    end

    thrust_gravity, Dthrust, Kzref, Dzref = 5.33, 1, 5, 3
    Dyaw, angle_min, angle_max = 1, .2, .5
    Pangle, Dangle, Kvcorr = .3, .2, .5
    dt = sim.getSimulationTimeStep()
    thrust, pitch_corr, yaw_corr, roll_corr = thrust_gravity, 0, 0, 0
    pitch_prev, roll_prev = 0, 0
    zref = sim.getObjectPosition(d)[3]
    linear, angular = {x = 0, y = 0, z = 0}, {x = 0, y = 0, z = 0}
    subscriber = simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'on_twist')
end

function on_twist(msg)
    linear, angular = msg.linear, msg.angular
end

function sysCall_actuation()
    local velocities = {
        thrust * (1 - pitch_corr - roll_corr - yaw_corr),
        thrust * (1 + pitch_corr - roll_corr + yaw_corr),
        thrust * (1 + pitch_corr + roll_corr - yaw_corr),
        thrust * (1 - pitch_corr + roll_corr + yaw_corr),
    }
    for i, script in ipairs(propellerScripts) do
        sim.setScriptSimulationParameter(script, 'particleVelocity', velocities[i])
    end
end

local function target_angle(command, speed)
    local target = Kvcorr * (command - speed)
    if command >= 0 then
        return math.min(math.max(target, -angle_min), angle_max)
    end
    return math.min(math.max(target, -angle_max), angle_min)
end

function sysCall_sensing()
    local pos, ori = sim.getObjectPosition(d), sim.getObjectOrientation(d)
    sim.setObjectPosition(trackBase, pos)
    sim.setObjectOrientation(trackBase, {0, 0, ori[3]})

    local local_ori = sim.getObjectOrientation(d, trackBase)
    local velocity, rate = sim.getObjectVelocity(d)
    local turn = sim.getMatrixInverse(sim.getObjectMatrix(trackBase))
    turn[4], turn[8], turn[12] = 0, 0, 0
    local speed = sim.multiplyVector(turn, velocity)

    if linear.z == 0 then
        thrust = thrust_gravity + Kzref * (zref - pos[3]) - Dzref * velocity[3]
    else
        thrust = thrust_gravity + Dthrust * (linear.z - velocity[3])
        zref = pos[3]
    end
    yaw_corr = Dyaw * (angular.z - rate[3])

    local pitch, roll = local_ori[2], -local_ori[1]
    pitch_corr = Pangle * (target_angle(linear.x, speed[1]) - pitch) - Dangle * ((pitch - pitch_prev) / dt)
    roll_corr = Pangle * (target_angle(linear.y, speed[2]) - roll) - Dangle * ((roll - roll_prev) / dt)
    pitch_prev, roll_prev = pitch, roll
end

function sysCall_cleanup()
    simROS.shutdownSubscriber(subscriber)
end
