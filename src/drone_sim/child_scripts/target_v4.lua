-- The stock target-following controller in CoppeliaSim 4.x's manner: the script works out the thrust of
-- each propeller from the particles that it emits, and applies it itself with addForceAndTorque.

sim = require'sim'

local PARTICLES_PER_SECOND, SIZE, DENSITY = 430, 0.005, 8500
local LIFE, MOST, SCATTER = 0.5, 50, math.tan(15 * math.pi / 180)
local GRAVITY_THRUST = 5.45

function sysCall_init()
    target = sim.getObject('/target')
    sim.setObjectParent(target, -1, true)
    base = sim.getObject('/Quadcopter/base')
    body = sim.getObject('.')
    local kind = sim.particle_roughspheres + sim.particle_cyclic + sim.particle_respondable1to4
        + sim.particle_respondable5to8 + sim.particle_ignoresgravity
    propellers = {}
    for i = 1, 4 do
        local path = './propeller[' .. (i - 1) .. ']'
        local respondable = sim.getObject(path .. '/respondable')
        propellers[i] = {
            respondable = respondable,
            frame = sim.getObjectParent(respondable),
            joint = sim.getObject(path .. '/joint'),
            turn = i % 2 == 0 and 1 or -1,
            particles = sim.addParticleObject(kind, SIZE, DENSITY, {2, 1, 0.2, 3, 0.4}, LIFE, MOST, {0.3, 0.7, 1}),
        }
    end
    shadow = sim.addDrawingObject(sim.drawing_discpoints + sim.drawing_cyclic + sim.drawing_25percenttransparency
        + sim.drawing_50percenttransparency + sim.drawing_itemsizes, 0.2, 0, -1, 1)
    tilt_y, tilt_x, side, ahead, turned = 0, 0, 0, 0, 0
end

function sysCall_actuation()
    local place = sim.getObjectPosition(base, -1)
    sim.addDrawingObjectItem(shadow, {place[1], place[2], 0.002, 0, 0, 1, 0.2})

    local velocity = sim.getVelocity(body)
    local above = sim.getObjectPosition(target, -1)[3] - place[3]
    local thrust = GRAVITY_THRUST + 2 * above - 2 * velocity[3]

    local m = sim.getObjectMatrix(base, -1)
    local there = sim.getObjectPosition(target, base)
    local y = sim.multiplyVector(m, {0, 1, 0})[3] - m[12]
    local x = sim.multiplyVector(m, {1, 0, 0})[3] - m[12]
    local alpha = 0.25 * y + 2.1 * (y - tilt_y) + 0.005 * there[2] + (there[2] - side)
    local beta = -0.25 * x - 2.1 * (x - tilt_x) - 0.005 * there[1] - (there[1] - ahead)
    tilt_y, tilt_x, side, ahead = y, x, there[2], there[1]

    local yaw = sim.getObjectOrientation(base, target)[3]
    local rotation = 0.1 * yaw + 2 * (yaw - turned)
    turned = yaw

    blow(propellers[1], thrust * (1 - alpha + beta + rotation))
    blow(propellers[2], thrust * (1 - alpha - beta - rotation))
    blow(propellers[3], thrust * (1 + alpha - beta + rotation))
    blow(propellers[4], thrust * (1 + alpha + beta - rotation))
end

function blow(propeller, speed)
    local dt = sim.getSimulationTimeStep()
    sim.setJointPosition(propeller.joint, sim.getSimulationTime() * 10)
    local m = sim.getObjectMatrix(propeller.frame, -1)
    local count = math.floor(PARTICLES_PER_SECOND * dt)
    for _ = 1, count do
        emit(propeller.particles, m, speed)
    end
    m[4], m[8], m[12] = 0, 0, 0
    local force = count * DENSITY * speed * math.pi * SIZE ^ 3 / (6 * dt)
    sim.addForceAndTorque(
        propeller.respondable,
        sim.multiplyVector(m, {0, 0, force}),
        sim.multiplyVector(m, {0, 0, propeller.turn * 0.002 * speed})
    )
end

function emit(particles, m, speed)
    local x, y = (math.random() - 0.5) * 0.1, (math.random() - 0.5) * 0.1
    local from = sim.multiplyVector(m, {x, y, -0.6 * SIZE})
    local spread = 2 * SCATTER * speed
    local to = sim.multiplyVector(m, {
        x + (math.random() - 0.5) * spread,
        y + (math.random() - 0.5) * spread,
        -0.6 * SIZE - speed * (0.9 + 0.2 * math.random()),
    })
    sim.addParticleObjectItem(particles, {from[1], from[2], from[3], to[1], to[2], to[3]})
end

function sysCall_cleanup()
    sim.removeDrawingObject(shadow)
    for _, propeller in ipairs(propellers) do
        sim.removeParticleObject(propeller.particles)
    end
end
