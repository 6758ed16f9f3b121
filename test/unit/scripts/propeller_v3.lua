-- A propeller in V-REP's idiom: as many particles a step as their number per second says, whose momentum lifts.

function sysCall_init()
    local name = sim.getObjectName(sim.getObjectAssociatedWithScript(sim.handle_self))
    number = tonumber(string.match(name, 'respondable(%d)'))
    blades = sim.getObjectHandle('Quadricopter_propeller' .. number)
    body = sim.getObjectHandle('Quadricopter_propeller_respondable' .. number)
    axle = sim.getObjectHandle('Quadricopter_propeller_joint' .. number)
    local function own(parameter) return sim.getScriptSimulationParameter(sim.handle_self, parameter) end
    perSecond, density = own('particleCountPerSecond'), own('particleDensity')
    deviation = math.tan(math.rad(own('particleScatteringAngle') / 2))
    shown = own('simulateParticles')
    diameter = own('particleSize') * 0.005 * sim.getObjectSizeFactor(blades)
    local kind = sim.particle_roughspheres + sim.particle_cyclic + sim.particle_ignoresgravity
    particles = sim.addParticleObject(kind, diameter, density, {2, 1, 0.2, 3, 0.4}, own('particleLifeTime'),
        own('maxParticleCount'), {0.3, 0.7, 1})
    left = 0
    sense = number % 2 == 1 and -1 or 1
end

function sysCall_actuation()
    local step, m = sim.getSimulationTimeStep(), sim.getObjectMatrix(blades, -1)
    local velocity = sim.getScriptSimulationParameter(sim.handle_self, 'particleVelocity')
    sim.setJointPosition(axle, sim.getSimulationTime() * 10)
    local wanted = perSecond * step + left
    local count = math.floor(wanted)
    left = wanted % 1
    for _ = 1, shown and count or 0 do
        local x, y = math.random() - 0.5, math.random() - 0.5
        local from = {x * 0.16, y * 0.16, -diameter * 0.6}
        local to = {from[1] + x * deviation * velocity, from[2] + y * deviation * velocity, from[3] - velocity}
        from, to = sim.multiplyVector(m, from), sim.multiplyVector(m, to)
        sim.addParticleObjectItem(particles, {from[1], from[2], from[3], to[1], to[2], to[3]})
    end
    m[4], m[8], m[12] = 0, 0, 0
    local force = count * density * velocity * math.pi * diameter ^ 3 / (6 * step)
    local torque = sense * 0.002 * velocity
    sim.addForceAndTorque(body, sim.multiplyVector(m, {0, 0, force}), sim.multiplyVector(m, {0, 0, torque}))
end

function sysCall_cleanup()
    sim.removeParticleObject(particles)
end
