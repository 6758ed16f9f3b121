"""CoppeliaSim's constants, with its values (simConst.h), as far as scripts of drones use them.

`sim.particle_cyclic` in 4.x, `sim_particle_cyclic` in 3.x.
"""

from __future__ import annotations

from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.scripting.api import object_constants, script_constants

PHASES = ("init", "actuation", "sensing", "cleanup")

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
    "drawing_spherepts": 7,  # names of 4.3 on, of which four have numbers of their own
    "drawing_trianglepts": 9,
    "drawing_quadpts": 10,
    "drawing_discpts": 11,
    "drawing_cubepts": 12,
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
    "drawing_persistent": 0x100000,
    "drawing_auxchannelcolor1": 0x200000,
    "drawing_auxchannelcolor2": 0x400000,
    "drawing_local": 0x800000,
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
_CALLS = {  # names of 3.x, and of 4.x
    "initialization": "init",
    **{phase: phase for phase in PHASES[1:]},
    "threaded": "threadmain",
}
_CALL_TYPES = {f"childscriptcall_{old}": script_constants.CALLS[f"syscb_{new}"] for old, new in _CALLS.items()}

CONSTANTS: dict[str, int] = {
    **object_constants.ALL,
    **script_constants.ALL,
    **_DRAWING,
    **_PARTICLES,
    **_CALL_TYPES,
    "handle_world": WORLD,
    "handle_parent": PARENT,
}
CALL_TYPES: dict[str, int] = dict(zip((*PHASES, "thread"), _CALL_TYPES.values()))  # of sim_call_type, by phase
