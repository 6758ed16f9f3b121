"""CoppeliaSim's constants, with its values (simConst.h), as far as the stock scripts and ours use them.

`sim.particle_cyclic` in 4.x, `sim_particle_cyclic` in 3.x.
"""

from __future__ import annotations

from drone_sim.mechanics.object_tree import PARENT, WORLD

PHASES = ("init", "actuation", "sensing", "cleanup")

_HANDLES = {
    "handle_world": WORLD,
    "handle_all": -2,
    "handle_all_except_explicit": -3,
    "handle_self": -4,
    "handle_tree": -6,
    "handle_chain": -7,
    "handle_single": -8,
    "handle_parent": PARENT,
    "handle_scene": -12,
}
_DRAWING = {
    "drawing_points": 0,
    "drawing_lines": 1,
    "drawing_triangles": 2,
    "drawing_trianglepoints": 3,
    "drawing_quadpoints": 4,
    "drawing_discpoints": 5,
    "drawing_cubepoints": 6,
    "drawing_spherepoints": 7,
    "drawing_linestrip": 8,
    "drawing_itemcolors": 0x20,
    "drawing_vertexcolors": 0x40,
    "drawing_itemsizes": 0x80,
    "drawing_backfaceculling": 0x100,
    "drawing_wireframe": 0x200,
    "drawing_painttag": 0x400,
    "drawing_followparentvisibility": 0x800,
    "drawing_cyclic": 0x1000,
    "drawing_50percenttransparency": 0x2000,
    "drawing_25percenttransparency": 0x4000,
    "drawing_12percenttransparency": 0x8000,
    "drawing_emissioncolor": 0x10000,
    "drawing_facingcamera": 0x20000,
    "drawing_overlay": 0x40000,
    "drawing_itemtransparency": 0x80000,
}
_PARTICLES = {
    "particle_points1": 0,
    "particle_points2": 1,
    "particle_points4": 2,
    "particle_roughspheres": 3,
    "particle_spheres": 4,
    "particle_respondable1to4": 0x20,
    "particle_respondable5to8": 0x40,
    "particle_particlerespondable": 0x80,
    "particle_ignoresgravity": 0x100,
    "particle_invisible": 0x200,
    "particle_itemsizes": 0x400,
    "particle_itemdensities": 0x800,
    "particle_itemcolors": 0x1000,
    "particle_cyclic": 0x2000,
    "particle_emissioncolor": 0x4000,
    "particle_water": 0x8000,
    "particle_painttag": 0x10000,
}
_CALLBACKS = {
    "syscb_threadmain": -1,
    "syscb_thread": -1,
    "syscb_cleanup": 1,
    "syscb_init": 2,
    "syscb_nonsimulation": 3,
    "syscb_beforesimulation": 4,
    "syscb_aftersimulation": 5,
    "syscb_actuation": 6,
    "syscb_sensing": 7,
    "syscb_suspended": 8,
    "syscb_suspend": 9,
    "syscb_resume": 10,
}
_CALL_TYPES = {  # V-REP 3.5 has made the older names mean the same
    "childscriptcall_initialization": _CALLBACKS["syscb_init"],
    "childscriptcall_actuation": _CALLBACKS["syscb_actuation"],
    "childscriptcall_sensing": _CALLBACKS["syscb_sensing"],
    "childscriptcall_cleanup": _CALLBACKS["syscb_cleanup"],
    "childscriptcall_threaded": _CALLBACKS["syscb_threadmain"],
}
_SCRIPTS = {
    "scripttype_mainscript": 0,
    "scripttype_childscript": 1,
    "scripttype_addonscript": 2,
    "scripttype_customizationscript": 6,
    "scripttype_main": 0,
    "scripttype_simulation": 1,
    "scripttype_customization": 6,
}
_STATES = {
    "simulation_stopped": 0,
    "simulation_paused": 8,
    "simulation_advancing": 16,
    "simulation_advancing_firstafterstop": 16,
    "simulation_advancing_running": 17,
    "simulation_advancing_lastbeforepause": 18,
    "simulation_advancing_firstafterpause": 19,
    "simulation_advancing_abouttostop": 20,
    "simulation_advancing_lastbeforestop": 21,
}
RUNNING = _STATES["simulation_advancing_running"]
ABOUT_TO_STOP = _STATES["simulation_advancing_abouttostop"]
LAST_BEFORE_STOP = _STATES["simulation_advancing_lastbeforestop"]
_OTHERS = {
    "intparam_program_version": 9,
    "dlgstyle_message": 0,
    "dlgstyle_input": 1,
    "dlgstyle_ok": 2,
    "verbosity_errors": 200,
    "verbosity_warnings": 300,
    "verbosity_infos": 400,
    "verbosity_scripterrors": 420,
    "verbosity_scriptwarnings": 430,
    "verbosity_scriptinfos": 440,
}

CONSTANTS: dict[str, int] = {
    **_HANDLES,
    **_DRAWING,
    **_PARTICLES,
    **_CALLBACKS,
    **_CALL_TYPES,
    **_SCRIPTS,
    **_STATES,
    **_OTHERS,
}
CALL_TYPES = {phase: _CALLBACKS[f"syscb_{phase}"] for phase in (*PHASES, "thread")}  # of sim_call_type, by phase
