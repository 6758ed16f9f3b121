-- A propeller that blows particles downwards, as V-REP's own does.
function sysCall_init()
    propeller = sim.getObjectHandle('Quadricopter_propeller1')
    propellerRespondable = sim.getObjectHandle('Quadricopter_propeller_respondable1')
    particleCountPerSecond = sim.getScriptSimulationParameter(sim.handle_self, 'particleCountPerSecond')
    particleDensity = sim.getScriptSimulationParameter(sim.handle_self, 'particleDensity')
    notFullParticles = 0
end

function sysCall_actuation()
    particleVelocity = sim.getScriptSimulationParameter(sim.handle_self, 'particleVelocity')
    s = sim.getObjectSizeFactor(propeller)
    particleSize = sim.getScriptSimulationParameter(sim.handle_self, 'particleSize')*0.005*s
    ts = sim.getSimulationTimeStep()
    requiredParticleCnt = particleCountPerSecond*ts + notFullParticles
    notFullParticles = requiredParticleCnt % 1
    particleCnt = math.floor(requiredParticleCnt)
    local m = sim.getObjectMatrix(propeller, -1)
    m[4], m[8], m[12] = 0, 0, 0
    local thrust = particleCnt*particleDensity*particleVelocity*math.pi*particleSize*particleSize*particleSize/(6*ts)
    force = sim.multiplyVector(m, {0, 0, thrust})
    torque = {0, 0, -0.002*particleVelocity}
    torque = sim.multiplyVector(m, torque)
    sim.addForceAndTorque(propellerRespondable, force, torque)
end
