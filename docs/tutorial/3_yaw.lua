-- Stage 3 of the V-REP tutorial, in its own Lua: yaw is controlled.

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

    pos = simGetObjectPosition(d,-1) -- get drone absolute position
    Dthrust = 1
    zref = pos[3] -- used if z-speed command is null.
    Kzref = 5
    Dzref = 3

    Dyaw = 1
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
    local_ori = simGetObjectOrientation(d,trackBase) -- orientation in the track frame
    d_global_pos, d_global_ori = simGetObjectVelocity(d) -- global linear and angular speeds.
    track_mat = simGetObjectMatrix(trackBase,-1) -- ask me about matrices...
    track_mat_inv = simGetInvertedMatrix(track_mat)
    track_mat_inv[ 4] = 0
    track_mat_inv[ 8] = 0
    track_mat_inv[12] = 0
    d_local_pos = simMultiplyVector(track_mat_inv,d_global_pos) -- linear speed in the track frame

    -- update twist (stage 6 deletes these four lines: they would override every command)
    twist[1] = 0 -- front speed
    twist[2] = 0 -- lateral speed
    twist[3] = 0 -- absolute elevation request (if not null)
    twist[6] = 0 -- yaw speed.

    -- Elevation control
    if(twist[3] == 0) then
        -- we have to maintain current elevation at zref value
        thrust = thrust_gravity + Kzref*(zref - pos[3]) - Dzref*d_global_pos[3]
    else
        thrust = thrust_gravity + Dthrust*(twist[3]-d_global_pos[3])
        zref = pos[3] -- will be used in case of null z-speed command.
    end

    -- yaw control
    dyaw = d_global_ori[3]
    dyaw_target = twist[6]
    yaw_corr = Dyaw*(dyaw_target-dyaw)

    -- pitch and vx control
    pitch_corr = 0

    -- roll and vy control
    roll_corr = 0
end
