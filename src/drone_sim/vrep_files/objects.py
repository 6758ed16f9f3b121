"""Reads objects: their common data, that of joints, dummies, paths, cameras and sensors, and scripts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from drone_sim.vrep_files.chunks import Level, Texts, decoded, finite, level, levels, quaternion_first
from drone_sim.vrep_files.model import (
    ORIGIN,
    Kind,
    Other,
    VrepCamera,
    VrepDummy,
    VrepFileError,
    VrepJoint,
    VrepObject,
    VrepProximitySensor,
    VrepScript,
    within,
)
from drone_sim.vrep_files.paths import read_path, read_path_object
from drone_sim.vrep_files.shapes import Pools, read_shape

_JOINTS = {10: "revolute", 11: "prismatic", 12: "spherical"}
_SENSORS = {30: "pyramid", 31: "cylinder", 32: "disc", 33: "cone", 34: "ray"}
_OTHERS = {
    "FSE": "force sensor", "LGT": "light", "SCT": "script", "GRH": "graph", "MIL": "mill",
    "MIR": "mirror", "OCT": "octree", "PTC": "point cloud", "MKR": "marker", "CSO": "custom object",
}  # fmt: skip
_USED = {"pyramid": (0, 1, 2, 3), "cylinder": (0, 1, 6), "disc": (0, 1, 6, 8), "cone": (0, 1, 6, 8), "ray": (0, 1)}
_DYNAMIC_MODE = 5
_LOOP_CLOSURE = 0  # type of a link between dummies: sim_dummy_linktype_dynamics_loop_closure
_CYCLIC, _MOTOR, _POSITION_CONTROL = 0x01, 0x10, 0x20  # bits of a joint's `Va9`
SCRIPT = "SCT"
_SCRIPT_KINDS = {0: "main", 1: "child", 6: "customization"}
_DISABLED, _PARENT_IS_PROXY, _OWN_MAIN = 2, 4, 8
_MAX_PARAMETERS = 10_000


def read_object(tag: str, data: bytes, pools: Pools) -> VrepObject:
    """Return an object. Raises VrepFileError that names the object."""
    base, *more = levels(data, 3)
    handle, parent = base.integers("Ids", count=2) or (-1, -1)
    name = base.text("Nme")
    with within(f"object {name or handle}"):
        if handle < 0:
            raise VrepFileError("has no handle")
        sizes = base.numbers("_fa", "Sfa", 1)
        kind = _read(tag, more[0] if more else Level(), pools)
        if isinstance(kind, VrepDummy):  # a dummy with points is a path of 4.x
            kind = replace(kind, path=read_path(base.find("Cda")))
        return VrepObject(
            handle=handle,
            parent=parent,
            name=name,
            alias=base.text("Ali"),
            pose=quaternion_first(base.numbers("_fq", "Cfq", 7), "_fq"),
            of=kind,
            is_model=bool(base.bits("Va3", "Va2", "Var") & 1),
            model_flags=base.integer("Mpo") & ~0xF000,
            layers=base.integer("Lar", default=1, kind="H"),
            size_factor=1.0 if sizes is None else sizes[0],
            parameters=read_parameters(base.find("Lsp")),
        )


def is_object(tag: str) -> bool:
    return tag in _READERS or tag in _OTHERS


def script_of(data: bytes) -> bytes | None:
    """Return the data of the script in a script object; None if it has none."""
    object_levels = levels(data, 3)
    return object_levels[1].find("Soo") if len(object_levels) > 1 else None


def _read(tag: str, class_level: Level, pools: Pools) -> Kind:
    if tag == "SHP":
        return read_shape(class_level, pools)
    return _READERS[tag](class_level) if tag in _READERS else Other(_OTHERS[tag])


def _joint(joint: Level) -> Kind:
    kind = _JOINTS.get(joint.integer("Jtt", default=10), "revolute")
    low, span = joint.numbers("_mr", "Pmr", 2) or (0.0, 0.0)
    position = joint.numbers("_rt", "Prt", 1) or (0.0,)
    quaternion = joint.numbers("_st", "Jst", 4)
    lead = joint.numbers("Sld", "", 1) or [math.tau * pitch for pitch in joint.numbers("", "Jsp", 1) or (0.0,)]
    velocity, force = joint.numbers("_mp", "Dmp", 2) or (0.0, 0.0)
    mode, (target,) = _mode(joint), joint.numbers("_tp", "Dtp", 1) or (0.0,)
    return VrepJoint(
        kind="screw" if kind == "revolute" and lead[0] else kind,
        position=position[0],
        limits=None if joint.bits("Va9") & _CYCLIC or kind == "spherical" else (low, low + span),
        turn=ORIGIN if quaternion is None else quaternion_first((*quaternion, 0.0, 0.0, 0.0), "_st"),
        lead=lead[0],
        mode=mode,
        target=velocity if mode == "velocity" else target,
        max_force=abs(force),
    )


def _mode(joint: Level) -> str:
    if joint.integer("Jmd") != _DYNAMIC_MODE:
        return "kinematic"
    switches = joint.bits("Va9")
    if not switches & _MOTOR:
        return "passive"
    return "position" if switches & _POSITION_CONTROL else "velocity"


def _dummy(dummy: Level) -> Kind:
    size = dummy.numbers("_y2", "Dy2", 1) or (0.01,)
    linked = dummy.integer("Lli", default=-1)
    return VrepDummy(size[0], linked, linked >= 0 and dummy.integer("Dl2") == _LOOP_CLOSURE)


def _vision_sensor(sensor: Level) -> Kind:
    size, angle, near, far = sensor.numbers("_cp", "Ccp", 4) or (1.0, math.pi / 3, 0.01, 10.0)
    width, height = sensor.integers("Res", count=2) or (32, 32)
    return VrepCamera(bool(sensor.bits("Va3", "Var") & 1), angle, size, near, far, (width, height))


def _camera(data: Level) -> Kind:
    size, angle = data.numbers("_p3", "Cp3", 2) or (1.0, math.pi / 3)
    near, far = data.numbers("_cp", "Ccp", 2) or (0.05, 500.0)
    perspective = bool(data.bits("Ca3") & 2) if data.find("Ca3") is not None else data.integer("Cpm", default=1) != 0
    return VrepCamera(perspective, angle, size, near, far)


def _proximity_sensor(sensor: Level) -> Kind:
    data = sensor.find("Vod")
    volume = Level() if data is None else level(data)
    kind = _SENSORS.get(sensor.integer("Snt"), "ray")
    numbers = volume.unchecked("_s3", "Ss3", 9) or (0.0,) * 9
    # V-REP writes uninitialised memory into the numbers that a kind does not use.
    used = finite(tuple(number if index in _USED[kind] else 0.0 for index, number in enumerate(numbers)), "Ss3")
    offset, reach, x, y, _, _, radius, _, angle = used
    return VrepProximitySensor(kind, offset, reach, (x, y), radius, angle)


_READERS: dict[str, Callable[[Level], Kind]] = {
    "SHP": lambda _level: Other("shape"),  # read by _read, since it needs the pools
    "JNT": _joint,
    "DMY": _dummy,
    "RSN": _vision_sensor,
    "CMA": _camera,
    "SNR": _proximity_sensor,
    "PAT": read_path_object,
}


# ---- scripts


def read_script(data: bytes, owner: int | None = None) -> VrepScript:
    """Return a script. `owner` is the handle of the object that it is attached to; None: the file contains it.

    Raises VrepFileError.
    """
    script = level(data)
    switches = script.bits("Va2", default=_OWN_MAIN)
    _, stored, number = script.integers("Si2", count=3) or (0, -1, -1)
    override = script.integer("Coc", default=-1)
    handle = owner if owner is not None else override if override >= 0 else stored
    kind = _SCRIPT_KINDS.get(number, f"of type {number}")
    language = script.text("Lne").lower()
    text = _plain_text(script.find("Ste") or b"")
    return VrepScript(
        object=handle,
        kind=kind,
        text=text,
        is_enabled=not switches & _DISABLED,
        language="python" if "python" in language or text.startswith("#python") else "lua",
        parameters=read_parameters(script.find("Prm")),
        parent_is_proxy=bool(switches & _PARENT_IS_PROXY),
        is_stock_main=kind == "main" and (not switches & _OWN_MAIN or "defaultMainScript" in text),
    )


def read_parameters(data: bytes | None) -> tuple[tuple[str, str], ...]:
    """Return the names and values of script parameters. Raises VrepFileError."""
    parameters = None if data is None else level(data).find("Par")
    if parameters is None:
        return ()
    texts = Texts(parameters, "Par")
    count = texts.integer()
    if not 0 <= count <= _MAX_PARAMETERS:
        raise VrepFileError(f"Par: {count} script parameters; at most {_MAX_PARAMETERS} are allowed")
    pairs = []
    for _ in range(count):
        name, _unit, value = texts.text(), texts.text(), texts.text()
        texts.integer()
        pairs.append((name, value))
    return tuple(pairs)


def unscrambled(data: bytes) -> bytes:
    """Return the text of a script. The file scrambles all but its first and last byte."""
    if len(data) < 3:
        return data
    first, last = _signed(data[0]), _signed(data[-1])
    start, end = int(first / 2), 3 * last  # truncated toward zero
    plain = bytearray(data)
    for index in range(1, len(data) - 1):
        change = 0
        if index & 1:
            change += index + start + end
        if index & 2:
            change -= 3 * index + start
        if index & 4:
            change += index // 2 + end
        plain[index] = data[index] + change & 0xFF
    return bytes(plain)


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _plain_text(data: bytes) -> str:
    text = decoded(unscrambled(data).rstrip(b"\0")).replace("\r\n", "\n").replace("\r", "\n").replace("\0", "")
    return text.removeprefix("--lua\n")
