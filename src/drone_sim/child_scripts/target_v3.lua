-- The stock quadricopter's controller, with which the V-REP tutorial begins: fly to the green sphere, and turn as it
-- is turned. The same law as target.py, in the form of V-REP 3.0 to 3.5.

if (sim_call_type==sim_childscriptcall_initialization) then
    -- Detach the sphere, so that it stays where it is put
    targetObj=simGetObjectHandle('Quadricopter_target')
    simSetObjectParent(targetObj,-1,true)

    d=simGetObjectHandle('Quadricopter_base')
    heli=simGetObjectAssociatedWithScript(sim_handle_self)
    propellerScripts={-1,-1,-1,-1}
    for i=1,4,1 do
        propellerScripts[i]=simGetScriptHandle('Quadricopter_propeller_respondable'..i)
    end

    particlesTargetVelocities={0,0,0,0}
    thrustOfGravity=5.335
    prevAlphaE,prevBetaE,prevEuler=0,0,0
    prevSp={0,0,0}
end

if (sim_call_type==sim_childscriptcall_actuation) then
    -- Vertical control
    targetPos=simGetObjectPosition(targetObj,-1)
    pos=simGetObjectPosition(d,-1)
    l=simGetVelocity(heli)
    thrust=thrustOfGravity+2*(targetPos[3]-pos[3])-2*l[3]

    -- Horizontal control: alphaE and betaE are the heights of the tips of the base's y and x axes over its origin
    sp=simGetObjectPosition(targetObj,d)
    m=simGetObjectMatrix(d,-1)
    alphaE=simMultiplyVector(m,{0,1,0})[3]-m[12]
    betaE=simMultiplyVector(m,{1,0,0})[3]-m[12]
    alphaCorr=0.25*alphaE+2.1*(alphaE-prevAlphaE)+0.005*sp[2]+(sp[2]-prevSp[2])
    betaCorr=-0.25*betaE-2.1*(betaE-prevBetaE)-0.005*sp[1]-(sp[1]-prevSp[1])
    prevAlphaE,prevBetaE,prevSp=alphaE,betaE,sp

    -- Rotational control
    euler=simGetObjectOrientation(d,targetObj)
    rotCorr=0.1*euler[3]+2*(euler[3]-prevEuler)
    prevEuler=euler[3]

    -- Decide of the motor velocities
    particlesTargetVelocities[1]=thrust*(1-alphaCorr+betaCorr+rotCorr)
    particlesTargetVelocities[2]=thrust*(1-alphaCorr-betaCorr-rotCorr)
    particlesTargetVelocities[3]=thrust*(1+alphaCorr-betaCorr+rotCorr)
    particlesTargetVelocities[4]=thrust*(1+alphaCorr+betaCorr-rotCorr)

    -- Send the desired motor velocities to the 4 rotors
    for i=1,4,1 do
        simSetScriptSimulationParameter(propellerScripts[i],'particleVelocity',particlesTargetVelocities[i])
    end
end
