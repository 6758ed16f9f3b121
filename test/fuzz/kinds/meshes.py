"""Mesh files and images: valid, damaged, truncated, and hostile to their readers."""

import struct

from case import Case
from hypothesis import strategies as st

from kinds.values import ODD_NUMBERS, ODD_TEXTS, mutated, small

_NUMBERS = st.one_of(small, small, st.sampled_from(ODD_NUMBERS[:-1])).map(str)
_CUBE = (
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
)
_STL_TEXT = """solid one
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid one
"""
_DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
</source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


@st.composite
def _obj(draw):
    """An OBJ with lines that no exporter writes."""
    odd = st.sampled_from([*ODD_TEXTS[:-1], "one.mtl", "one.obj", "one.png", "-"])
    index = st.one_of(st.integers(-5, 9), st.sampled_from([0, 2**31, -(2**31), 10**30, 4_000_000])).map(str)
    corner = st.builds("/".join, st.lists(index, min_size=1, max_size=4))
    line = st.one_of(
        st.builds(
            "{} {}".format, st.sampled_from(["mtllib", "usemtl", "o", "g", "s", "map_Kd", "call", "l", "#"]), odd
        ),
        st.builds("v {}".format, st.lists(_NUMBERS, max_size=7).map(" ".join)),
        st.builds("{} {}".format, st.sampled_from(["vt", "vn", "vp"]), st.lists(_NUMBERS, max_size=4).map(" ".join)),
        st.builds("f {}".format, st.lists(corner, max_size=6).map(" ".join)),
        st.sampled_from(["f 1 2 3", "f 1 1 1", "f 3 2 1", "f", "v", "\\", "f 1/1/1 2/1/1 3/1/1"]),
    )
    lines = draw(st.lists(line, max_size=6))
    whole = draw(st.booleans())
    at_end = draw(st.booleans())
    text = "\n".join(lines)
    return ((_CUBE + text if at_end else text + "\n" + _CUBE) if whole else text).encode("utf-8", "replace")


@st.composite
def _stl(draw):
    """A binary STL whose stated number of triangles may be wrong."""
    triangles = draw(st.lists(st.lists(st.floats(width=32), min_size=12, max_size=12), max_size=4))
    stated_count = draw(st.one_of(st.just(len(triangles)), st.sampled_from([0, 1, 10**6, 2**31, 2**32 - 1])))
    body = b"".join(struct.pack("<12fH", *numbers, 0) for numbers in triangles)
    return draw(st.sampled_from([b"solid", b"binary"])).ljust(80) + struct.pack("<I", stated_count) + body


@st.composite
def _many(draw):
    """A disc or a strip of many triangles: a vertex with many neighbours, or many vertices."""
    count = draw(st.sampled_from([100, 1000, 5000, 20000]))
    vertices = b"".join(b"v %d %d %d\n" % (n % 997, n * 7 % 1009, n % 3) for n in range(count))
    disc = draw(st.booleans())
    faces = b"".join(b"f %d %d %d\n" % (1 if disc else n, n + 1, n + 2) for n in range(1, count - 1))
    return vertices + faces


@st.composite
def _dae(draw):
    text = _DAE
    for _ in range(draw(st.integers(0, 3))):
        old = draw(
            st.sampled_from(["0 1 2", "1.4.1", 'count="9"', 'meter="1"', "Z_UP", "#g", "#p", "#v", 'stride="3"', "<p>"])
        )
        text = text.replace(old, draw(st.one_of(_NUMBERS, st.sampled_from(ODD_TEXTS[:-1]), st.just("#n"))), 1)
    if draw(st.integers(0, 9)) == 0:
        entities = "".join(f'<!ENTITY e{n} "&e{n - 1};&e{n - 1};">' for n in range(1, 40))
        text = text.replace('"?>', f'"?><!DOCTYPE x [<!ENTITY e0 "ha">{entities}]>', 1).replace("0 1 2", "&e39;", 1)
    return text.encode("utf-8", "replace")


@st.composite
def _picture(draw):
    """The header of a PNG with a stated size and no valid data, or of another format."""
    width, height = (draw(st.sampled_from([1, 16, 4096, 20000, 65535, 2**31 - 1])) for _ in "wh")
    head = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0) + b"\x00" * 4
    flat = b"P5 %d %d 255\n" % (width, height) + b"x" * min(width * height, 64)
    return draw(st.sampled_from([head, flat, b"BM" + head, b"GIF89a" + b"\xff" * 9, b"", b"\xff\xd8\xff" + b"0" * 30]))


_MTL = st.one_of(
    st.just(b"newmtl m\nKd 1 1 1\nmap_Kd one.png\n"),
    mutated(b"newmtl m\nKd 1 0.5 0\nd 0.5\nmap_Kd one.png\n"),
    st.sampled_from([b"map_Kd ..", b"map_Kd /dev/zero", b"newmtl", b"Kd nan inf 1e400", b"d", b"newmtl m\nKd"]),
)
_FILES = st.one_of(
    st.tuples(st.just("mesh.obj"), st.one_of(_obj(), _obj(), mutated(_CUBE.encode()), _many())),
    st.tuples(st.just("mesh.stl"), st.one_of(_stl(), mutated(_STL_TEXT.encode()))),
    st.tuples(st.just("mesh.dae"), st.one_of(_dae(), mutated(_DAE.encode()))),
    st.tuples(
        st.sampled_from(["mesh.obj", "mesh.stl", "mesh.dae", "mesh.OBJ", "mesh.glb", "mesh"]), st.binary(max_size=200)
    ),
)
CASES = st.builds(
    lambda file, mtl, picture, in_urdf, mass: Case(
        "mesh", {file[0]: file[1], "one.mtl": mtl, "one.png": picture}, {"in_urdf": in_urdf, "mass": mass}
    ),
    _FILES,
    _MTL,
    _picture(),
    st.booleans(),
    st.sampled_from([0, 1, 1e-9]),
)
