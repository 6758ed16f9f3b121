"""Scene files: structures as YAML, damaged YAML, and hostile YAML."""

from case import Case
from hypothesis import strategies as st

from kinds.values import as_yaml, junk, mostly, mutated, numbers, small, texts, vectors, words

_SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "mesh": 3, "urdf": 0}
_COUNT = st.one_of(st.integers(0, 4), st.sampled_from([30]))


@st.composite
def _object(draw):
    shape = draw(mostly(st.sampled_from(sorted(_SIZES)), junk))
    one = {"shape": shape, "position": draw(vectors())}
    size_count = _SIZES.get(shape, 3) if isinstance(shape, str) else 3
    if size_count:
        good = st.lists(st.floats(0.01, 3), min_size=size_count, max_size=size_count)
        one["size"] = draw(mostly(good, st.one_of(vectors(size_count), junk)))
    if shape in ("mesh", "urdf"):
        one["file"] = draw(st.sampled_from(["one.obj", "one.urdf", "one.obj", "one.urdf", "none.obj"]))
    optional = {
        "name": st.one_of(words, texts),
        "rpy": vectors(),
        "mass": mostly(st.floats(0, 10), st.one_of(numbers, junk)),
        "color": mostly(st.lists(st.floats(0, 1), min_size=4, max_size=4), vectors(4)),
        "texture": st.sampled_from(["", "", "", "none.png", "one.obj", "/dev/null"]),
    }
    for key, values in optional.items():
        if draw(st.integers(0, 4)) == 0:
            one[key] = draw(values)
    if draw(st.integers(0, 19)) == 0:
        one[draw(texts)] = draw(junk)
    return one


_NAMES = st.sampled_from(["A", "B", "C", "Quadricopter_base", "FrontVision", ""])
_POINTS = st.lists(vectors(), min_size=0, max_size=4)
_KIND_FIELDS = {
    "type": st.sampled_from(["revolute", "prismatic", "spherical", "ray", "cone", "disc", "cylinder", "pyramid"]),
    "mode": st.sampled_from(["kinematic", "passive", "position", "velocity", "force"]),
    "limits": mostly(st.just([-1, 1]), vectors(2)),
    "points": _POINTS,
    **dict.fromkeys(("value", "target", "max_force", "range", "angle", "radius", "fov", "near", "width"), numbers),
}
_PARTS = st.lists(
    st.fixed_dictionaries({"shape": st.sampled_from([*_SIZES, "compound"])}, optional={"size": vectors()}), max_size=3
)


@st.composite
def _typed_object(draw):
    """Return a joint, a sensor, a path, or a shape with a parent; names may be duplicate."""
    one = {"name": draw(_NAMES), "position": draw(vectors()), "parent": draw(mostly(_NAMES, junk))}
    kind = draw(
        st.sampled_from(["dummy", "joint", "joint", "proximity_sensor", "vision_sensor", "path", "", "compound"])
    )
    if kind == "compound":
        return {**one, "shape": kind, "parts": draw(mostly(_PARTS, junk)), "mass": draw(st.sampled_from([0, 1]))}
    if not kind:
        moments = {"moments": draw(vectors())}
        one.update(shape="sphere", size=[0.1], mass=draw(st.sampled_from([0, 1])), respondable=draw(st.booleans()))
        return {**one, "inertia": moments} if draw(st.integers(0, 3)) == 0 else one
    return {**one, "kind": kind, **{key: draw(values) for key, values in _KIND_FIELDS.items() if draw(st.booleans())}}


@st.composite
def _scene(draw):
    scene = {}
    if draw(st.booleans()):
        floor = {"size": draw(mostly(st.floats(0.1, 100), st.one_of(numbers, junk)))}
        scene["floor"] = draw(mostly(st.just(floor), junk))
    if draw(st.booleans()):
        drone = {
            "position": draw(mostly(st.tuples(small, small, st.floats(0, 9)).map(list), vectors())),
            "yaw": draw(mostly(small, st.one_of(numbers, junk))),
        }
        scene["drone"] = draw(mostly(st.just(drone), junk))
    entries = st.one_of(_object(), _typed_object())
    objects = [draw(entries) for _ in range(draw(st.integers(0, 5)))] * draw(_COUNT)
    scene["objects"] = draw(mostly(st.just(objects), junk))
    if draw(st.integers(0, 19)) == 0:
        scene[draw(texts)] = draw(junk)
    return scene


@st.composite
def _bomb(draw):
    """Aliases that grow exponentially, deep nesting, a long list, duplicate keys, foreign tags."""
    count = draw(st.sampled_from([2, 9, 30, 100, 1000, 20000]))
    box = b"{shape: box, size: [1, 1, 1], position: [0, 0, 5], mass: 1}"
    key = draw(st.sampled_from([b"objects", b"floor", b"drone", b"x"]))
    aliases = b"a0: &a0 [1, 2]\n" + b"".join(b"a%d: &a%d [*a%d, *a%d]\n" % (n, n, n - 1, n - 1) for n in range(1, 26))
    return draw(
        st.sampled_from(
            [
                b"objects:\n" + b"- " + box + (b"\n- " + box) * min(count, 20000),
                aliases + key + b": *a25\n",
                key + b": " + b"[" * count + b"]" * count,
                key + b": " + b"{a: " * count + b"1" + b"}" * count,
                key + b": &x [*x]",
                key + b": &x {a: *x}",
                b"&x {objects: [*x]}",
                key + b": {<<: [*y]}",
                b"floor: {size: 1, size: 20}\n" * 2,
                b"drone: {yaw: 1:30, position: [0, 0, 1:30]}",
                key + b": !!python/object/apply:os.getcwd []",
                key + b": !!binary " + b"A" * count,
                b"\xff\xfe" + b"o" * count,
                b"? " * min(count, 1000) + b"1",
                key + b": " + b"9" * count,
                key + b": 0x" + b"f" * count,
                b"%YAML 9.9\n---\nobjects: []",
                b"objects: []\n---\nobjects: []",
                b"- " * count + b"1",
                b"#" * count,
                key + b": '" + b"x" * count,
            ]
        )
    )


_GOOD = b"""objects:
- {name: Box, shape: box, size: [1, 1, 1], position: [3, 0, 4], mass: 1}
drone: {position: [1, 2, 3], yaw: 0.5}
"""
_WHOLE = _scene().map(as_yaml)
_ODD = st.one_of(_bomb(), mutated(_GOOD), junk.map(as_yaml), st.binary(max_size=40))
_TEXTS = st.one_of(_WHOLE, _WHOLE, _WHOLE, _ODD)
_CUBE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
_LINK = b"""<robot name="one"><link name="a">
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>"""
CASES = st.builds(lambda text: Case("scene", {"scene.yaml": text, "one.obj": _CUBE, "one.urdf": _LINK}), _TEXTS)
