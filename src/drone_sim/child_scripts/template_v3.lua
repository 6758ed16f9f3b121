-- A script to begin with, in the form of V-REP 3.0 to 3.5: the whole script runs in each phase.
-- It holds the height at which the drone began. (template_v4.lua is the same in the form of V-REP 3.6 and newer.)

-- Once, before the first step: find the objects, set the variables.
if (sim_call_type==sim_childscriptcall_initialization) then
    d=simGetObjectHandle('Quadricopter_base')
    propellerScripts={-1,-1,-1,-1}
    for i=1,4,1 do
        propellerScripts[i]=simGetScriptHandle('Quadricopter_propeller_respondable'..i)
    end
    pos=simGetObjectPosition(d,-1)
    zref=pos[3]
    thrust=5.33
end

-- Once, at the end: end what init began.
if (sim_call_type==sim_childscriptcall_cleanup) then
end

-- In each step, before the physics: tell the propellers what to do.
if (sim_call_type==sim_childscriptcall_actuation) then
    for i=1,4,1 do
        simSetScriptSimulationParameter(propellerScripts[i],'particleVelocity',thrust)
    end
end

-- In each step, after the physics: measure, decide what to do next.
if (sim_call_type==sim_childscriptcall_sensing) then
    pos=simGetObjectPosition(d,-1)
    velocity=simGetObjectVelocity(d)
    thrust=5.33+5*(zref-pos[3])-3*velocity[3]
end
