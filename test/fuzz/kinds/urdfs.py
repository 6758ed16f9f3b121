"""URDFs of the drone or an object of a scene: trees and other graphs, odd numbers and names, broken XML."""

from pathlib import Path

from case import Case
from hypothesis import strategies as st

from kinds.values import ODD_NUMBERS, ODD_TEXTS, finite, mutated, small

_DRONE = (Path(__file__).parents[3] / "urdf" / "drone.urdf").read_bytes()
_NUMBER = st.one_of(
    small, small, finite, st.sampled_from(ODD_NUMBERS[:-1]), st.sampled_from(["", "one", "1,2", "0x1"])
).map(str)
_GOOD = st.floats(0.01, 2).map(str)
_THREE = st.one_of(st.lists(_GOOD, min_size=3, max_size=3), st.lists(_NUMBER, max_size=5)).map(" ".join)
_ODD_NAMES = tuple(text for text in ODD_TEXTS if text.isprintable() and not set(text) & set('<&"') and len(text) < 400)
_PROPELLERS = [f"propeller_{side}_{place}" for side in ("front", "back") for place in ("left", "right")]


def _element(tag, **attributes):
    return f"<{tag} " + " ".join(f'{key}="{value}"' for key, value in attributes.items()) + "/>"


@st.composite
def _geometry(draw):
    shapes = [
        _element("box", size=draw(_THREE)),
        _element("sphere", radius=draw(_NUMBER)),
        _element("cylinder", radius=draw(_NUMBER), length=draw(_NUMBER)),
        _element("capsule", radius=draw(_GOOD), length=draw(_GOOD)),
        _element(
            "mesh",
            filename=draw(st.sampled_from(["one.obj", "none.stl", "", "..", "package://no/x.obj", "robot.urdf"])),
        ),
        _element("mesh", filename="one.obj", scale=draw(_THREE)),
        _element("plane", normal="0 0 1"),
        "",
    ]
    good = '<box size="0.1 0.1 0.1"/>'
    return f"<geometry>{draw(st.one_of(st.just(good), st.just(good), st.sampled_from(shapes)))}</geometry>"


@st.composite
def _link(draw, name):
    number = st.one_of(_GOOD, _GOOD, _GOOD, _NUMBER)
    origin = draw(
        st.one_of(st.just(""), st.builds(lambda xyz, rpy: _element("origin", xyz=xyz, rpy=rpy), _THREE, _THREE))
    )
    inertia = {key: draw(number) for key in ("ixx", "iyy", "izz")} | dict.fromkeys(("ixy", "ixz", "iyz"), draw(_NUMBER))
    inertial = f"<inertial>{origin}{_element('mass', value=draw(number))}{_element('inertia', **inertia)}</inertial>"
    parts = [inertial if draw(st.integers(0, 4)) else ""]
    for tag in ("collision", "visual"):
        parts += [f"<{tag}>{origin}{draw(_geometry())}</{tag}>" for _ in range(draw(st.integers(0, 2)))]
    return f'<link name="{name}">{"".join(parts)}</link>'


@st.composite
def _robot(draw):
    """Links with random joints: often a tree, sometimes several trees, or a graph with a cycle."""
    names = _PROPELLERS + draw(st.lists(st.sampled_from(["a", "b", "c", *_ODD_NAMES]), max_size=3))
    names = ["root", *names] if draw(st.integers(0, 9)) else names
    tree = draw(st.integers(0, 9)) < 7
    joints = []
    for number, name in enumerate(names[1:], start=1):
        parent = names[draw(st.integers(0, number - 1 if tree else len(names) - 1))]
        kind = draw(
            st.sampled_from(["fixed"] * 6 + ["continuous", "revolute", "prismatic", "floating", "planar", "", "bad"])
        )
        limit = draw(
            st.sampled_from(["", '<limit lower="-1" upper="1" effort="1" velocity="1"/>', '<limit lower="nan"/>'])
        )
        ends = f'<parent link="{parent}"/><child link="{name}"/>'
        axis = _element("axis", xyz=draw(_THREE))
        joints.append(
            f'<joint name="j{number}" type="{kind}">{ends}{_element("origin", xyz=draw(_THREE))}{axis}{limit}</joint>'
        )
    if not tree and joints:
        del joints[draw(st.integers(0, len(joints) - 1))]
    links = [draw(_link(name)) for name in names]
    return f'<robot name="{draw(st.sampled_from(["r", *_ODD_NAMES]))}">{"".join(links + joints)}</robot>'.encode()


def _entities(depth):
    entities = "".join(f'<!ENTITY e{n} "&e{n - 1};&e{n - 1};">' for n in range(1, depth))
    return f'<!DOCTYPE r [<!ENTITY e0 "ha">{entities}]><robot name="&e{depth - 1};"><link name="a"/></robot>'.encode()


_ODD = st.sampled_from(
    [
        b"<robot/>",
        b'<robot name="r"><link/></robot>',
        b'<robot name="r"><link name=""/></robot>',
        b'<robot name="r"><link name="a"/><link name="a"/></robot>',
        b'<robot name="r"><joint/></robot>',
        b'<robot name="r">' + b'<link name="a">' * 5000 + b"</link>" * 5000 + b"</robot>",
        b'<robot xmlns:xacro="x" name="r"><xacro:if value="1"/><link name="a"/></robot>',
        b"<sdf><model/></sdf>",
        _entities(9),
        _entities(40),
        b'<!DOCTYPE r [<!ENTITY f SYSTEM "/etc/passwd">]><robot name="&f;"/>',
    ]
)
_TRIANGLES = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
CASES = st.builds(
    lambda text, use: Case("urdf", {"robot.urdf": text, "one.obj": _TRIANGLES}, use),
    st.one_of(_robot(), _robot(), _robot(), mutated(_DRONE), _ODD),
    st.sampled_from(["drone", "object", "heavy object"]),
)
