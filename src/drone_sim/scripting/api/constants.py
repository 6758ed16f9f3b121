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
_CALL_TYPES = {
    "childscriptcall_initialization": 0,
    "childscriptcall_actuation": 1,
    "childscriptcall_sensing": 2,
    "childscriptcall_cleanup": 3,
}
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

CONSTANTS: dict[str, int] = {**_HANDLES, **_DRAWING, **_PARTICLES, **_CALL_TYPES, **_OTHERS}
CALL_TYPES: dict[str, int] = dict(zip(PHASES, _CALL_TYPES.values()))  # of sim_call_type, by phase
