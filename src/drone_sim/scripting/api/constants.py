"""CoppeliaSim's constants that scripts of drones use, with its values (simConst.h of 3.6, 4.2 and 4.9).

A constant is `sim.particle_cyclic` in 4.x and `sim_particle_cyclic` in 3.x. If the three versions differ, as for
syscb_..., the values are those of 4.x. Also, functions for the flags that scripts add to handles.
"""

from __future__ import annotations

from collections.abc import Iterator

# Lines of a prefix and suffixes of names. A name without a number has, as in a C enum, the number after the previous
# one, or 0 if it is the first.
_TABLE = """\
# what stands for a handle, and what is added to one
handle all=-2 all_except_explicit=-3 self=-4 main_script=-5 tree=-6 single=-8 default=-9 all_except_self=-10
    parent=-11 scene=-12 world=-1 mainscript=-5 inverse=-14 sceneobject=-16 sandbox=-17 mesh=-18
handleflag assembly=0x400000 togglevisibility=0x400000 extended=0x400000 greyscale=0x400000 codedstring=0x400000
    depthbuffermeters=0x800000 keeporiginal=0x400000 camera=0x400000 altname=0x400000 axis=0x400000
    resetforce=0x400000 resettorque=0x800000 resetforcetorque=0xc00000 model=0x800000 rawvalue=0x1000000
    silenterror=0x2000000 wxyzquaternion=0x400000 reljointbaseframe=0x400000 setmultiple=0x400000 abscoords=0x800000
    depthbuffer=0x800000 wxyzquat=0x1000000 addmultiple=0x1000000
handle chain=-7 app=-13
# what getObjectType returns
object shape_type joint_type graph_type camera_type dummy_type proximitysensor_type path_type=8 visionsensor_type
    mill_type=11 forcesensor_type light_type mirror_type octree_type pointcloud_type script_type
sceneobject shape joint graph camera dummy proximitysensor visionsensor=9 forcesensor=12 light octree=15 pointcloud
    script
object no_subtype=200
# what getShapeType, getJointType and others return
shape simpleshape_subtype=20 multishape_subtype simple=20 compound
joint revolute_subtype=10 prismatic_subtype spherical_subtype revolute=10 prismatic spherical
proximitysensor pyramid_subtype=30 cylinder_subtype disc_subtype cone_subtype ray_subtype pyramid=30 cylinder disc
    cone ray
dummytype dynloopclosure dyntendon=7 default assembly
primitiveshape none plane disc cuboid spheroid cylinder cone heightfield capsule
pure primitive_none primitive_plane primitive_disc primitive_cuboid primitive_spheroid primitive_cylinder
    primitive_cone primitive_heightfield
light omnidirectional_subtype=1 spot_subtype directional_subtype omnidirectional=1 spot directional
# modes of joints, and their parameters
jointmode passive ik=2 dependent=4 force kinematic=0 dynamic=5
jointdynctrl free force velocity=4 position=8 spring=12 callback=16
jointintparam motor_enabled=2000 ctrl_enabled velocity_lock=2030
jointfloatparam pid_p=2002 pid_i pid_d intrinsic_x intrinsic_y intrinsic_z intrinsic_qx intrinsic_qy intrinsic_qz
    intrinsic_qw velocity spherical_qx spherical_qy spherical_qz spherical_qw upper_limit error_pos=2028
    screw_pitch=2034 step_size
# of objects of any kind, shapes and sensors
objintparam visibility_layer=10 visible=36
objfloatparam abs_x_velocity=11 abs_y_velocity abs_z_velocity abs_rot_velocity objbbox_min_x objbbox_min_y
    objbbox_min_z objbbox_max_x objbbox_max_y objbbox_max_z modelbbox_min_x modelbbox_min_y modelbbox_min_z
    modelbbox_max_x modelbbox_max_y modelbbox_max_z transparency_offset=28 size_factor=34
shapeintparam static=3003 respondable culling=3014 wireframe compound convex convex_check respondable_mask
    edge_visibility=3024 edge_borders_hidden=3027 component_cnt
shapefloatparam init_velocity_x=3000 init_velocity_y init_velocity_z mass=3005 texture_x texture_y texture_z texture_a
    texture_b texture_g texture_scaling_x texture_scaling_y init_velocity_a=3020 init_ang_velocity_x=3020
    init_velocity_b init_ang_velocity_y=3021 init_velocity_g init_ang_velocity_z=3022 shading_angle=3025 edge_angle
visionintparam resolution_x=1002 resolution_y disabled_light_components=1006 rendering_attributes entity_to_render
    windowed_size_x windowed_size_y windowed_pos_x windowed_pos_y render_mode=1017 perspective_operation
visionfloatparam near_clipping=1000 far_clipping perspective_angle=1004 ortho_size
proxintparam ray_invisibility=4000 volume_type entity_to_detect
# flags of objects and models
objectproperty collapsed=16 selectable=0x20 selectmodelbaseinstead=0x80 dontshowasinsidemodel=0x100
    selectinvisible=0x800 depthinvisible=0x1000 cannotdelete=0x2000 cannotdeleteduringsim=0x4000
    hierarchyhiddenmodelchild=0x8000
objectspecialproperty collidable=1 measurable detectable_ultrasonic=16 detectable_infrared=0x20 detectable_laser=0x40
    detectable_inductive=0x80 detectable_capacitive=0x100 renderable=0x200 detectable_all=0x1f0 cuttable=0x400
    pathplanning_ignored=0x800
modelproperty not_collidable=1 not_measurable not_renderable=4 not_detectable=8 not_cuttable=16 not_dynamic=0x20
    not_respondable=0x40 not_reset=0x80 not_visible=0x100 scripts_inactive=0x200 not_showasinsidemodel=0x400
    not_model=0xf000
# parts of a colour
colorcomponent ambient ambient_diffuse=0 diffuse specular emission transparency auxiliary
# what the mouse does
navigation passive camerashift camerarotate camerazoom cameratilt cameraangle camerafly objectshift objectrotate
    createpathpoint=0x100 clickselection=0x200 ctrlselection=0x400 shiftselection=0x800 camerazoomwheel=0x1000
    camerarotaterightbutton=0x2000 camerarotatemiddlebutton=0x2000
# how things are drawn
displayattribute renderpass=1 depthpass pickpass=4 selected=8 mainselection=0x20 forcewireframe=0x40
    forbidwireframe=0x80 forbidedges=0x100 originalcolors=0x200 ignorelayer=0x400 forvisionsensor=0x800
    colorcodedpickpass=0x1000 colorcoded=0x2000 trianglewireframe=0x4000 inertiaonly=0x8000 thickEdges=0x10000
    dynamiccontentonly=0x20000 mirror=0x40000 useauxcomponent=0x80000 ignorerenderableflag=0x100000
    noopenglcallbacks=0x200000 noghosts=0x800000 nopointclouds=0x1000000 nodrawingobjects=0x2000000
    noparticles=0x4000000 colorcodedtriangles=0x8000000
banner left=1 right nobackground=4 overlay=8 followparentvisibility=16 clickselectsparent=0x20 clicktriggersevent=0x40
    facingcamera=0x80 fullyfacingcamera=0x100 backfaceculling=0x200 keepsamesize=0x400 bitmapfont=0x800
texturemap plane cylinder sphere cube
# what getSimulationState returns
simulation stopped paused=8 advancing=16 advancing_firstafterstop=16 advancing_running advancing_lastbeforepause=19
    advancing_firstafterpause advancing_abouttostop advancing_lastbeforestop
# why a script is called (sim_call_type)
syscb init=2 cleanup=1 nonsimulation=3 beforesimulation aftersimulation actuation sensing suspended suspend resume
    beforeinstanceswitch afterinstanceswitch beforecopy aftercopy jointcallback=18 contactcallback customcallback1
    customcallback2 customcallback3 customcallback4 beforedelete afterdelete aftercreate threadmain dyncallback
    beforemainscript info=0 vision=30 userconfig=32 moduleentry event ext realtimeidle beforesave aftersave msg dyn
    contact joint thread selchange data
# the same of main and customization scripts, in 3.x
mainscriptcall initialization=2 cleanup=1 regular=6
customizationscriptcall initialization=2 cleanup=1 nonsimulation=3 lastbeforesimulation firstaftersimulation
    simulationactuation simulationsensing simulationpause simulationpausefirst simulationpauselast
    lastbeforeinstanceswitch firstafterinstanceswitch beforecopy aftercopy
# kinds and attributes of scripts
scripttype mainscript childscript addonscript addonfunction customizationscript=6 sandboxscript=8 threaded=240 main=0
    simulation addon customization=6 sandbox=8 passive
scriptattribute executionorder=1 executioncount enabled=4 debuglevel=6 scripttype
scriptexecorder first normal last
scripttreetraversal reverse forward parent
scriptthreadresume launch=-2 allnotyetresumed default actuation_first actuation_last sensing_first sensing_last custom
childscriptattribute automaticcascadingcalls=3 enabled
customizationscriptattribute activeduringsimulation cleanupbeforesave=5
# of getSimulatorMessage, and how much is logged
message ui_button_state_change object_selection_changed=2 model_loaded=4 keypress=6 bannerclicked scene_loaded
    pick_select_down=11 simulation_start_resume_request=4096 simulation_pause_request simulation_stop_request
verbosity useglobal=-1 none=100 errors=200 warnings=300 loadinfos=400 questions=410 scripterrors=420
    scriptwarnings=430 scriptinfos=450 msgs=450 infos=500 debug=600 trace=700 tracelua=800 traceall=900 default=400
    undecorated=0xf000 onlyterminal=0x10000 once=0x20000
# of the simulator
intparam error_report_mode program_version compilation_version=4 current_page flymode_camera_handle
    dynamic_step_divider dynamic_engine server_port_start server_port_range visible_layers infotext_style
    edit_mode_type=14 server_port_next platform=19 scene_unique_id work_thread_count mouse_x mouse_y core_count
    work_thread_calc_time_ms idle_fps stop_request_counter=29 program_revision mouse_buttons
    dynamic_warning_disabled_mask simulation_warning_disabled_mask scene_index motionplanning_seed speedmodifier
    dynamic_iteration_count job_count program_full_version verbosity statusbarverbosity dlgverbosity
    videoencoder_index exitcode
floatparam rand simulation_time_step stereo_distance dynamic_step_size mouse_wheel_zoom_factor
boolparam hierarchy_visible console_visible collision_handling_enabled distance_handling_enabled ik_handling_enabled
    gcs_handling_enabled dynamics_handling_enabled proximity_sensor_handling_enabled=9 vision_sensor_handling_enabled
    mill_handling_enabled browser_visible scene_and_model_load_messages shape_textures_are_visible=15 display_enabled
    infotext_visible statustext_open fog_enabled mirrors_enabled=22 realtime_simulation=25
    video_recording_triggered=29 threaded_rendering_enabled=32 fullscreen headless exit_request=41
    rosinterface_donotrunmainscript=48 online_mode scene_closing=52
stringparam application_path video_filename app_arg1 app_arg2 app_arg3 app_arg4 app_arg5 app_arg6 app_arg7 app_arg8
    app_arg9 additional_addonscript_firstscene additional_addonscript scene_path_and_name scene_path scene_name
    scene_unique_id=118 additional_addonscript1=11 additional_addonscript2 verbosity=121 statusbarverbosity
    dlgverbosity consolelogfilter startupscriptstring uniqueid tempdir tempscenedir datadir importexportdir addonpath
    scenedefaultdir modeldefaultdir
arrayparam gravity fog fog_color background_color1 background_color2 ambient_light random_euler
# how degrees of freedom of a trajectory go together, and what 3.x calls the distance of two poses
ruckig phasesync timesync nosync=3 minvel=0x100 minaccel=0x200
rml phase_sync_if_possible only_time_sync only_phase_sync no_sync
pathproperty show_line=1 show_orientation closed_path=4 automatic_orientation=8 invert_velocity=16
    infinite_acceleration=0x20 flat_path=0x40 show_position=0x80 auto_velocity_profile_translation=0x100
    auto_velocity_profile_rotation=0x200 endpoints_at_zero=0x400 keep_x_up=0x800
distcalcmethod dl dac max_dl_dac dl_and_dac sqrt_dl2_and_dac2 dl_if_nonzero dac_if_nonzero
# what a buffer holds
buffer uint8 int8 uint16 int16 uint32 int32 float double uint8rgb uint8bgr uint8rgba uint8argb base64 split
    clamp=0x100
script arg_null arg_bool arg_int32 arg_float arg_string arg_invalid arg_charbuff arg_double arg_table
# dialogs and 3.x custom user interfaces
dlgstyle message input ok ok_cancel yes_no dont_center=0x20
dlgret still_open ok cancel yes no
ui menu_title=1 menu_minimize menu_close=4 menu_systemblock=8 property_visible=1 property_visibleduringsimulationonly
    property_moveable=4 property_relativetoleftborder=8 property_relativetotopborder=16 property_fixedwidthfont=0x20
    property_systemblock=0x40 property_settocenter=0x80 property_rolledup=0x100 property_selectassociatedobject=0x200
    property_visiblewhenobjectselected=0x400 property_systemblockcanmovetofront=0x800 property_pauseactive=0x1000
buttonproperty button label slider editbox staydown=8 enabled=16 borderless=0x20 horizontallycentered=0x40
    ignoremouse=0x80 isdown=0x100 transparent=0x200 nobackgroundcolor=0x400 rollupaction=0x800 closeaction=0x1000
    verticallycentered=0x2000 downupevent=0x4000
# items of drawing objects, and how they look
drawing points lines triangles trianglepoints quadpoints discpoints cubepoints spherepoints linestrip spherepts=7
    trianglepts=9 quadpts discpts cubepts itemcolors=0x20 vertexcolors=0x40 itemsizes=0x80 backfaceculling=0x100
    wireframe=0x200 painttag=0x400 followparentvisibility=0x800 cyclic=0x1000 50percenttransparency=0x2000
    25percenttransparency=0x4000 12percenttransparency=0x8000 emissioncolor=0x10000 facingcamera=0x20000
    overlay=0x40000 itemtransparency=0x80000 persistent=0x100000 auxchannelcolor1=0x200000 auxchannelcolor2=0x400000
    local=0x800000
# particles
particle points1 points2 points4 roughspheres spheres respondable1to4=0x20 respondable5to8=0x40
    particlerespondable=0x80 ignoresgravity=0x100 invisible=0x200 itemsizes=0x400 itemdensities=0x800
    itemcolors=0x1000 cyclic=0x2000 emissioncolor=0x4000 water=0x8000 painttag=0x10000
# planners and state spaces of simOMPL, in 3.x
ompl_algorithm BiTRRT=30001 BITstar BKPIECE1 CForest EST FMT KPIECE1 LazyPRM LazyPRMstar LazyRRT LBKPIECE1 LBTRRT PDST
    PRM PRMstar RRT RRTConnect RRTstar SBL SPARS SPARStwo STRIDE TRRT
ompl_statespacetype position2d=50001 pose2d position3d pose3d joint_position dubins cyclic_joint_position
# sim_call_type in 3.x
childscriptcall initialization=2 actuation=6 sensing cleanup=1 threaded=27
"""


def _numbered(table: str) -> Iterator[tuple[str, int]]:
    """Yield the names of constants and their numbers."""
    beginning, last = "", -1
    for line in table.splitlines():
        if line.startswith("#"):
            continue
        if not line.startswith(" "):
            beginning, _, line = line.partition(" ")
            last = -1
        for name, _, number in (entry.partition("=") for entry in line.split()):
            last = int(number, 0) if number else last + 1
            yield f"{beginning}_{name}", last


CONSTANTS = dict(_numbered(_TABLE))
PHASES = ("init", "actuation", "sensing", "cleanup")
CUSTOMIZATION_PHASES = ("nonSimulation", "beforeSimulation", "afterSimulation")  # also, in customization scripts
# Values of sim_call_type by phase.
CALL_TYPES = {
    phase: CONSTANTS[f"syscb_{'threadmain' if phase == 'thread' else phase.lower()}"]
    for phase in (*PHASES, "thread", *CUSTOMIZATION_PHASES)
}

AXIS = GREYSCALE = CODED = CONSTANTS["handleflag_axis"]  # the same bit, with a different meaning in each function
BASE, WXYZ = CONSTANTS["handleflag_reljointbaseframe"], CONSTANTS["handleflag_wxyzquat"]
METRES = ABSOLUTE = CONSTANTS["handleflag_depthbuffermeters"]  # ABSOLUTE: handleflag_abscoords
RESET_FORCE, RESET_TORQUE = CONSTANTS["handleflag_resetforce"], CONSTANTS["handleflag_resettorque"]
FIRST_FLAG, _BEYOND_FLAGS = 1 << 20, 1 << 31  # a handle below FIRST_FLAG has no flags


def bare(handle: int) -> int:
    """Return a handle without its flags."""
    return int(handle) % FIRST_FLAG if FIRST_FLAG <= handle < _BEYOND_FLAGS else handle


def has(handle: int, flag: int) -> bool:
    """Return whether a flag was added to a handle."""
    return FIRST_FLAG <= handle < _BEYOND_FLAGS and bool(int(handle) & flag)
