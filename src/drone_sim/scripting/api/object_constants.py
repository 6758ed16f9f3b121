"""CoppeliaSim's constants on objects, with its values (simConst.h of 3.6, 4.2 and 4.9, which agree on them)."""

from __future__ import annotations

HANDLES: dict[str, int] = dict(  # what stands for a handle, and what is added to one
    handle_all=-2, handle_all_except_explicit=-3, handle_self=-4, handle_main_script=-5, handle_tree=-6,
    handle_single=-8, handle_default=-9, handle_all_except_self=-10, handle_parent=-11, handle_scene=-12,
    handle_app=-13,
    handle_world=-1, handle_mainscript=-5, handle_inverse=-14, handle_sceneobject=-16, handle_sandbox=-17,
    handle_mesh=-18, handleflag_assembly=4194304, handleflag_togglevisibility=4194304, handleflag_extended=4194304,
    handleflag_greyscale=4194304, handleflag_codedstring=4194304, handleflag_depthbuffermeters=8388608,
    handleflag_keeporiginal=4194304, handleflag_camera=4194304, handleflag_altname=4194304, handleflag_axis=4194304,
    handleflag_resetforce=4194304, handleflag_resettorque=8388608, handleflag_resetforcetorque=12582912,
    handleflag_model=8388608, handleflag_rawvalue=16777216, handleflag_silenterror=33554432,
    handleflag_wxyzquaternion=4194304, handleflag_reljointbaseframe=4194304, handleflag_setmultiple=4194304,
    handleflag_abscoords=8388608, handleflag_depthbuffer=8388608, handleflag_wxyzquat=16777216,
    handleflag_addmultiple=16777216, handle_chain=-7,
)  # fmt: skip

KINDS: dict[str, int] = dict(  # what getObjectType returns
    object_shape_type=0, object_joint_type=1, object_graph_type=2, object_camera_type=3, object_dummy_type=4,
    object_proximitysensor_type=5, object_path_type=8, object_visionsensor_type=9, object_mill_type=11,
    object_forcesensor_type=12, object_light_type=13, object_mirror_type=14, object_octree_type=15,
    object_pointcloud_type=16, sceneobject_shape=0, sceneobject_joint=1, sceneobject_graph=2, sceneobject_camera=3,
    sceneobject_dummy=4, sceneobject_proximitysensor=5, sceneobject_visionsensor=9, sceneobject_forcesensor=12,
    sceneobject_light=13, sceneobject_octree=15, sceneobject_pointcloud=16, sceneobject_script=17,
    object_no_subtype=200,
)  # fmt: skip

KINDS_OF_KINDS: dict[str, int] = dict(  # what getShapeType, getJointType and others return
    shape_simpleshape_subtype=20, shape_multishape_subtype=21, shape_simple=20, shape_compound=21,
    joint_revolute_subtype=10, joint_prismatic_subtype=11, joint_spherical_subtype=12, joint_revolute=10,
    joint_prismatic=11, joint_spherical=12, proximitysensor_pyramid_subtype=30, proximitysensor_cylinder_subtype=31,
    proximitysensor_disc_subtype=32, proximitysensor_cone_subtype=33, proximitysensor_ray_subtype=34,
    proximitysensor_pyramid=30, proximitysensor_cylinder=31, proximitysensor_disc=32, proximitysensor_cone=33,
    proximitysensor_ray=34, dummytype_dynloopclosure=0, dummytype_dyntendon=7, dummytype_default=8,
    dummytype_assembly=9, primitiveshape_none=0, primitiveshape_plane=1, primitiveshape_disc=2,
    primitiveshape_cuboid=3, primitiveshape_spheroid=4, primitiveshape_cylinder=5, primitiveshape_cone=6,
    primitiveshape_heightfield=7, primitiveshape_capsule=8, pure_primitive_none=0, pure_primitive_plane=1,
    pure_primitive_disc=2, pure_primitive_cuboid=3, pure_primitive_spheroid=4, pure_primitive_cylinder=5,
    pure_primitive_cone=6, pure_primitive_heightfield=7, light_omnidirectional_subtype=1, light_spot_subtype=2,
    light_directional_subtype=3, light_omnidirectional=1, light_spot=2, light_directional=3,
)  # fmt: skip

JOINTS: dict[str, int] = dict(  # modes of joints, and their parameters
    jointmode_passive=0, jointmode_ik=2, jointmode_dependent=4, jointmode_force=5, jointmode_kinematic=0,
    jointmode_dynamic=5, jointdynctrl_free=0, jointdynctrl_force=1, jointdynctrl_velocity=4,
    jointdynctrl_position=8, jointdynctrl_spring=12, jointdynctrl_callback=16, jointintparam_motor_enabled=2000,
    jointintparam_ctrl_enabled=2001, jointintparam_velocity_lock=2030, jointfloatparam_pid_p=2002,
    jointfloatparam_pid_i=2003, jointfloatparam_pid_d=2004, jointfloatparam_intrinsic_x=2005,
    jointfloatparam_intrinsic_y=2006, jointfloatparam_intrinsic_z=2007, jointfloatparam_intrinsic_qx=2008,
    jointfloatparam_intrinsic_qy=2009, jointfloatparam_intrinsic_qz=2010, jointfloatparam_intrinsic_qw=2011,
    jointfloatparam_velocity=2012, jointfloatparam_spherical_qx=2013, jointfloatparam_spherical_qy=2014,
    jointfloatparam_spherical_qz=2015, jointfloatparam_spherical_qw=2016, jointfloatparam_upper_limit=2017,
    jointfloatparam_error_pos=2028, jointfloatparam_screw_pitch=2034, jointfloatparam_step_size=2035,
)  # fmt: skip

PARAMETERS: dict[str, int] = dict(  # of objects of any kind, shapes and sensors
    objintparam_visibility_layer=10, objintparam_visible=36, objfloatparam_abs_x_velocity=11,
    objfloatparam_abs_y_velocity=12, objfloatparam_abs_z_velocity=13, objfloatparam_abs_rot_velocity=14,
    objfloatparam_objbbox_min_x=15, objfloatparam_objbbox_min_y=16, objfloatparam_objbbox_min_z=17,
    objfloatparam_objbbox_max_x=18, objfloatparam_objbbox_max_y=19, objfloatparam_objbbox_max_z=20,
    objfloatparam_modelbbox_min_x=21, objfloatparam_modelbbox_min_y=22, objfloatparam_modelbbox_min_z=23,
    objfloatparam_modelbbox_max_x=24, objfloatparam_modelbbox_max_y=25, objfloatparam_modelbbox_max_z=26,
    objfloatparam_transparency_offset=28, objfloatparam_size_factor=34, shapeintparam_static=3003,
    shapeintparam_respondable=3004, shapeintparam_culling=3014, shapeintparam_wireframe=3015,
    shapeintparam_compound=3016, shapeintparam_convex=3017, shapeintparam_convex_check=3018,
    shapeintparam_respondable_mask=3019, shapeintparam_edge_visibility=3024, shapeintparam_edge_borders_hidden=3027,
    shapeintparam_component_cnt=3028, shapefloatparam_init_velocity_x=3000, shapefloatparam_init_velocity_y=3001,
    shapefloatparam_init_velocity_z=3002, shapefloatparam_mass=3005, shapefloatparam_texture_x=3006,
    shapefloatparam_texture_y=3007, shapefloatparam_texture_z=3008, shapefloatparam_texture_a=3009,
    shapefloatparam_texture_b=3010, shapefloatparam_texture_g=3011, shapefloatparam_texture_scaling_x=3012,
    shapefloatparam_texture_scaling_y=3013, shapefloatparam_init_velocity_a=3020,
    shapefloatparam_init_ang_velocity_x=3020, shapefloatparam_init_velocity_b=3021,
    shapefloatparam_init_ang_velocity_y=3021, shapefloatparam_init_velocity_g=3022,
    shapefloatparam_init_ang_velocity_z=3022, shapefloatparam_shading_angle=3025, shapefloatparam_edge_angle=3026,
    visionintparam_resolution_x=1002, visionintparam_resolution_y=1003,
    visionintparam_disabled_light_components=1006, visionintparam_rendering_attributes=1007,
    visionintparam_entity_to_render=1008, visionintparam_windowed_size_x=1009, visionintparam_windowed_size_y=1010,
    visionintparam_windowed_pos_x=1011, visionintparam_windowed_pos_y=1012, visionintparam_render_mode=1017,
    visionintparam_perspective_operation=1018, visionfloatparam_near_clipping=1000,
    visionfloatparam_far_clipping=1001, visionfloatparam_perspective_angle=1004, visionfloatparam_ortho_size=1005,
    proxintparam_ray_invisibility=4000, proxintparam_entity_to_detect=4002,
)  # fmt: skip

PROPERTIES: dict[str, int] = dict(  # flags of objects and models
    objectproperty_collapsed=16, objectproperty_selectable=32, objectproperty_selectmodelbaseinstead=128,
    objectproperty_dontshowasinsidemodel=256, objectproperty_selectinvisible=2048,
    objectproperty_depthinvisible=4096, objectproperty_cannotdelete=8192,
    objectproperty_cannotdeleteduringsim=16384, objectproperty_hierarchyhiddenmodelchild=32768,
    objectspecialproperty_collidable=1, objectspecialproperty_measurable=2,
    objectspecialproperty_detectable_ultrasonic=16, objectspecialproperty_detectable_infrared=32,
    objectspecialproperty_detectable_laser=64, objectspecialproperty_detectable_inductive=128,
    objectspecialproperty_detectable_capacitive=256, objectspecialproperty_renderable=512,
    objectspecialproperty_detectable_all=496, objectspecialproperty_cuttable=1024,
    objectspecialproperty_pathplanning_ignored=2048, modelproperty_not_collidable=1, modelproperty_not_measurable=2,
    modelproperty_not_renderable=4, modelproperty_not_detectable=8, modelproperty_not_cuttable=16,
    modelproperty_not_dynamic=32, modelproperty_not_respondable=64, modelproperty_not_reset=128,
    modelproperty_not_visible=256, modelproperty_scripts_inactive=512, modelproperty_not_showasinsidemodel=1024,
    modelproperty_not_model=61440,
)  # fmt: skip

COLORS: dict[str, int] = dict(  # parts of a colour
    colorcomponent_ambient=0, colorcomponent_ambient_diffuse=0, colorcomponent_diffuse=1, colorcomponent_specular=2,
    colorcomponent_emission=3, colorcomponent_transparency=4, colorcomponent_auxiliary=5,
)  # fmt: skip

ALL: dict[str, int] = {**HANDLES, **KINDS, **KINDS_OF_KINDS, **JOINTS, **PARAMETERS, **PROPERTIES, **COLORS}
