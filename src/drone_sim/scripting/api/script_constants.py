"""CoppeliaSim's constants on scripts and the simulation, with its values (simConst.h of 3.6, 4.2 and 4.9).

Where the three disagree, as on syscb_..., the values are those of 4.x.
"""

from __future__ import annotations

SIMULATION: dict[str, int] = dict(  # what getSimulationState returns
    simulation_stopped=0, simulation_paused=8, simulation_advancing=16, simulation_advancing_firstafterstop=16,
    simulation_advancing_running=17, simulation_advancing_lastbeforepause=19,
    simulation_advancing_firstafterpause=20, simulation_advancing_abouttostop=21,
    simulation_advancing_lastbeforestop=22,
)  # fmt: skip

CALLS: dict[str, int] = dict(  # why a script is called (sim_call_type)
    syscb_init=2, syscb_cleanup=1, syscb_nonsimulation=3, syscb_beforesimulation=4, syscb_aftersimulation=5,
    syscb_actuation=6, syscb_sensing=7, syscb_suspended=8, syscb_suspend=9, syscb_resume=10,
    syscb_beforeinstanceswitch=11, syscb_afterinstanceswitch=12, syscb_beforecopy=13, syscb_aftercopy=14,
    syscb_jointcallback=18, syscb_contactcallback=19, syscb_customcallback1=20, syscb_customcallback2=21,
    syscb_customcallback3=22, syscb_customcallback4=23, syscb_beforedelete=24, syscb_afterdelete=25,
    syscb_aftercreate=26, syscb_threadmain=27, syscb_dyncallback=28, syscb_beforemainscript=29, syscb_info=0,
    syscb_vision=30, syscb_userconfig=32, syscb_moduleentry=33, syscb_event=34, syscb_ext=35, syscb_realtimeidle=36,
    syscb_beforesave=37, syscb_aftersave=38, syscb_msg=39, syscb_dyn=40, syscb_contact=41, syscb_joint=42,
    syscb_thread=43, syscb_selchange=44, syscb_data=45,
)  # fmt: skip

SCRIPTS: dict[str, int] = dict(  # kinds and attributes of scripts
    scripttype_mainscript=0, scripttype_childscript=1, scripttype_addonscript=2, scripttype_addonfunction=3,
    scripttype_customizationscript=6, scripttype_sandboxscript=8, scripttype_threaded=240, scripttype_main=0,
    scripttype_simulation=1, scripttype_addon=2, scripttype_customization=6, scripttype_sandbox=8,
    scripttype_passive=9, scriptattribute_executionorder=1, scriptattribute_executioncount=2,
    scriptattribute_enabled=4, scriptattribute_debuglevel=6, scriptattribute_scripttype=7, scriptexecorder_first=0,
    scriptexecorder_normal=1, scriptexecorder_last=2, scripttreetraversal_reverse=0, scripttreetraversal_forward=1,
    scripttreetraversal_parent=2, scriptthreadresume_launch=-2, scriptthreadresume_allnotyetresumed=-1,
    scriptthreadresume_default=0, scriptthreadresume_actuation_first=1, scriptthreadresume_actuation_last=2,
    scriptthreadresume_sensing_first=3, scriptthreadresume_sensing_last=4, scriptthreadresume_custom=5,
    childscriptattribute_automaticcascadingcalls=3, childscriptattribute_enabled=4,
    customizationscriptattribute_activeduringsimulation=0, customizationscriptattribute_cleanupbeforesave=5,
)  # fmt: skip

MESSAGES: dict[str, int] = dict(  # of getSimulatorMessage, and how much is logged
    message_ui_button_state_change=0, message_object_selection_changed=2, message_model_loaded=4,
    message_keypress=6, message_bannerclicked=7, message_scene_loaded=8, message_pick_select_down=11,
    message_simulation_start_resume_request=4096, message_simulation_pause_request=4097,
    message_simulation_stop_request=4098, verbosity_useglobal=-1, verbosity_none=100, verbosity_errors=200,
    verbosity_warnings=300, verbosity_loadinfos=400, verbosity_questions=410, verbosity_scripterrors=420,
    verbosity_scriptwarnings=430, verbosity_scriptinfos=450, verbosity_msgs=450, verbosity_infos=500,
    verbosity_debug=600, verbosity_trace=700, verbosity_tracelua=800, verbosity_traceall=900, verbosity_default=400,
    verbosity_undecorated=61440, verbosity_onlyterminal=65536, verbosity_once=131072,
)  # fmt: skip

PARAMETERS: dict[str, int] = dict(  # of the simulator
    intparam_error_report_mode=0, intparam_program_version=1, intparam_compilation_version=4,
    intparam_current_page=5, intparam_flymode_camera_handle=6, intparam_dynamic_step_divider=7,
    intparam_dynamic_engine=8, intparam_visible_layers=11, intparam_infotext_style=12, intparam_edit_mode_type=14,
    intparam_platform=19, intparam_scene_unique_id=20, intparam_work_thread_count=21, intparam_mouse_x=22,
    intparam_mouse_y=23, intparam_core_count=24, intparam_work_thread_calc_time_ms=25, intparam_idle_fps=26,
    intparam_stop_request_counter=29, intparam_program_revision=30, intparam_mouse_buttons=31,
    intparam_dynamic_warning_disabled_mask=32, intparam_simulation_warning_disabled_mask=33,
    intparam_scene_index=34, intparam_motionplanning_seed=35, intparam_speedmodifier=36,
    intparam_dynamic_iteration_count=37, intparam_job_count=38, intparam_program_full_version=39,
    intparam_verbosity=40, intparam_statusbarverbosity=41, intparam_dlgverbosity=42, intparam_videoencoder_index=43,
    intparam_exitcode=44, floatparam_rand=0, floatparam_simulation_time_step=1, floatparam_stereo_distance=2,
    floatparam_dynamic_step_size=3, floatparam_mouse_wheel_zoom_factor=4, boolparam_hierarchy_visible=0,
    boolparam_console_visible=1, boolparam_collision_handling_enabled=2, boolparam_distance_handling_enabled=3,
    boolparam_ik_handling_enabled=4, boolparam_gcs_handling_enabled=5, boolparam_dynamics_handling_enabled=6,
    boolparam_proximity_sensor_handling_enabled=9, boolparam_vision_sensor_handling_enabled=10,
    boolparam_mill_handling_enabled=11, boolparam_browser_visible=12, boolparam_scene_and_model_load_messages=13,
    boolparam_shape_textures_are_visible=15, boolparam_display_enabled=16, boolparam_infotext_visible=17,
    boolparam_statustext_open=18, boolparam_fog_enabled=19, boolparam_mirrors_enabled=22,
    boolparam_realtime_simulation=25, boolparam_video_recording_triggered=29,
    boolparam_threaded_rendering_enabled=32, boolparam_fullscreen=33, boolparam_headless=34,
    boolparam_exit_request=41, boolparam_rosinterface_donotrunmainscript=48, boolparam_online_mode=49,
    boolparam_scene_closing=52, stringparam_application_path=0, stringparam_video_filename=1,
    stringparam_app_arg1=2, stringparam_app_arg2=3, stringparam_app_arg3=4, stringparam_app_arg4=5,
    stringparam_app_arg5=6, stringparam_app_arg6=7, stringparam_app_arg7=8, stringparam_app_arg8=9,
    stringparam_app_arg9=10, stringparam_additional_addonscript_firstscene=11,
    stringparam_additional_addonscript=12, stringparam_scene_path_and_name=13, stringparam_scene_path=14,
    stringparam_scene_name=15, stringparam_scene_unique_id=118, stringparam_additional_addonscript1=11,
    stringparam_additional_addonscript2=12, stringparam_verbosity=121, stringparam_statusbarverbosity=122,
    stringparam_dlgverbosity=123, stringparam_consolelogfilter=124, stringparam_startupscriptstring=125,
    stringparam_uniqueid=126, arrayparam_gravity=0, arrayparam_fog=1, arrayparam_fog_color=2,
    arrayparam_background_color1=3, arrayparam_background_color2=4, arrayparam_ambient_light=5,
    arrayparam_random_euler=6,
)  # fmt: skip

BUFFERS: dict[str, int] = dict(  # what a buffer holds
    buffer_uint8=0, buffer_int8=1, buffer_uint16=2, buffer_int16=3, buffer_uint32=4, buffer_int32=5, buffer_float=6,
    buffer_double=7, buffer_uint8rgb=8, buffer_uint8bgr=9, buffer_uint8rgba=10, buffer_uint8argb=11,
    buffer_base64=12, buffer_split=13, buffer_clamp=256, script_arg_null=0, script_arg_bool=1, script_arg_int32=2,
    script_arg_float=3, script_arg_string=4, script_arg_invalid=5, script_arg_charbuff=6, script_arg_double=7,
    script_arg_table=8,
)  # fmt: skip

WINDOWS: dict[str, int] = dict(  # dialogs and 3.x custom user interfaces
    dlgstyle_message=0, dlgstyle_input=1, dlgstyle_ok=2, dlgstyle_ok_cancel=3, dlgstyle_yes_no=4,
    dlgstyle_dont_center=32, dlgret_still_open=0, dlgret_ok=1, dlgret_cancel=2, dlgret_yes=3, dlgret_no=4,
    ui_menu_title=1, ui_menu_minimize=2, ui_menu_close=4, ui_menu_systemblock=8, ui_property_visible=1,
    ui_property_visibleduringsimulationonly=2, ui_property_moveable=4, ui_property_relativetoleftborder=8,
    ui_property_relativetotopborder=16, ui_property_fixedwidthfont=32, ui_property_systemblock=64,
    ui_property_settocenter=128, ui_property_rolledup=256, ui_property_selectassociatedobject=512,
    ui_property_visiblewhenobjectselected=1024, ui_property_systemblockcanmovetofront=2048,
    ui_property_pauseactive=4096, buttonproperty_button=0, buttonproperty_label=1, buttonproperty_slider=2,
    buttonproperty_editbox=3, buttonproperty_staydown=8, buttonproperty_enabled=16, buttonproperty_borderless=32,
    buttonproperty_horizontallycentered=64, buttonproperty_ignoremouse=128, buttonproperty_isdown=256,
    buttonproperty_transparent=512, buttonproperty_nobackgroundcolor=1024, buttonproperty_rollupaction=2048,
    buttonproperty_closeaction=4096, buttonproperty_verticallycentered=8192, buttonproperty_downupevent=16384,
)  # fmt: skip

ALL: dict[str, int] = {**SIMULATION, **CALLS, **SCRIPTS, **MESSAGES, **PARAMETERS, **BUFFERS, **WINDOWS}
