-- Stage 1 of the V-REP tutorial, in its own Lua: the mixing alone: the drone hangs in the air, and drifts.

if (sim_call_type==sim_childscriptcall_initialization) then
    d=simGetObjectHandle('Quadricopter_base')

    propellerScripts={-1,-1,-1,-1}
    for i=1,4,1 do
        propellerScripts[i]=simGetScriptHandle('Quadricopter_propeller_respondable'..i)
    end

    trackBase=simGetObjectHandle('Track_base')
    simSetObjectParent(trackBase,-1,true)

    trackCam=simGetObjectHandle('TrackCam')
    trackView=simFloatingViewAdd(0.9,0.9,0.2,0.2,0)
    simAdjustView(trackView,trackCam,64)

    -- Variables for control
    thrust_gravity = 5.33 -- compensation for gravity
    thrust = thrust_gravity
    pitch_corr = 0
    yaw_corr = 0
    roll_corr = 0
    dt = .05
    prop_front_left = 1
    prop_back_left = 2
    prop_back_right = 3
    prop_front_right = 4
    particlesTargetVelocities = {0,0,0,0}
    twist = {0,0,0,0,0,0} -- current twist command {vx,vy,vz,-,-,rz}.
end

if (sim_call_type==sim_childscriptcall_cleanup) then
    simFloatingViewRemove(trackView)
end

if (sim_call_type==sim_childscriptcall_actuation) then
    -- propellers velocities computation
    particlesTargetVelocities[prop_front_left] = thrust*(1 - pitch_corr - roll_corr - yaw_corr)
    particlesTargetVelocities[prop_back_left] = thrust*(1 + pitch_corr - roll_corr + yaw_corr)
    particlesTargetVelocities[prop_back_right] = thrust*(1 + pitch_corr + roll_corr - yaw_corr)
    particlesTargetVelocities[prop_front_right]= thrust*(1 - pitch_corr + roll_corr + yaw_corr)

    -- Send the desired motor velocities to the 4 rotors:
    for i=1,4,1 do
        simSetScriptSimulationParameter(propellerScripts[i],'particleVelocity',particlesTargetVelocities[i])
    end
end

if (sim_call_type==sim_childscriptcall_sensing) then
    pos=simGetObjectPosition(d,-1)
    ori = simGetObjectOrientation(d,-1)
    simSetObjectPosition(trackBase,-1,pos)
    simSetObjectOrientation(trackBase,-1,{0,0,ori[3]})

    -- compute local velocities

    -- update twist (stage 6 deletes these four lines: they would override every command)
    twist[1] = 0 -- front speed
    twist[2] = 0 -- lateral speed
    twist[3] = 0 -- absolute elevation request (if not null)
    twist[6] = 0 -- yaw speed.

    -- Elevation control
    thrust = thrust_gravity

    -- yaw control
    yaw_corr = 0

    -- pitch and vx control
    pitch_corr = 0

    -- roll and vy control
    roll_corr = 0
end
