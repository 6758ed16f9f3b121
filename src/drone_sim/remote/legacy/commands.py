"""The commands of clients by code: each calls functions of the script API, or is refused with a reason."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from drone_sim.remote.legacy.request import Refused, Request, counted, floats, ints, raw, string, text, vector
from drone_sim.scripting.api.registry import CHILD, CUSTOMIZATION

_SCENE, _ALL, _PARENT, _WORLD = -12, -2, -11, -1  # sim.handle_...

# Returns the data of the reply; None if there is no reply yet.
HandlerFunction = Callable[[Request], bytes | None]


class Handler(NamedTuple):
    """A function of the client, and its handler."""

    name: str
    do: HandlerFunction


Table = dict[int, Handler]  # by command code


def nothing(_returned: Any) -> bytes:
    """Return the empty reply of a function without a result."""
    return b""


def _client_name(function: str) -> str:
    return f"simx{function[0].upper()}{function[1:]}"


def direct(function: str, encode: Callable[[Any], bytes] = nothing, layout: str = "", name: str = "") -> Handler:
    """Return the handler of a command that is one call of the script API.

    Arguments are the command's key, then the numbers in its data with a struct `layout`; `encode` writes the result.
    Without a `name`, the client's function has the API's name, with the prefix simx.
    """

    def call(request: Request) -> bytes:
        return encode(request.sim(function, *request.key, *(request.take(layout) if layout else ())))

    return Handler(name or _client_name(function), call)


def _set_list(function: str, layout: str) -> Handler:
    """Return the handler of a command whose data are integers, if any, and the floats of one list."""
    whole = layout.count("i")

    def call(request: Request) -> bytes:
        numbers = request.take(layout)
        return nothing(request.sim(function, *request.key, *numbers[:whole], list(numbers[whole:])))

    return Handler(_client_name(function), call)


# ---- objects and joints


def _parameter(function: str, encode: Callable[[Any], bytes]) -> Handler:
    def read(request: Request) -> bytes:
        is_supported, value = request.sim(function, *request.key)
        if not is_supported:
            raise request.refused(f"the parameter {request.key[1]} is not supported")
        return encode(value)

    return Handler(_client_name(function), read)


def _select(request: Request) -> bytes:
    request.selected[:] = request.handles()
    return b""


_OBJECTS: Table = {
    0x3001: direct("getObjectHandle", ints),
    0x3019: direct("getCollectionHandle", ints),
    0x102A: Handler("simxGetObjects", lambda request: counted(request.sim("getObjectsInTree", _SCENE, *request.key))),
    0x1012: direct("getObjectParent", ints),
    0x101C: direct("setObjectParent", nothing, "i?"),
    0x200B: direct("getObjectChild", ints),
    0x200E: direct("getObjectPosition", vector),
    0x200D: direct("getObjectOrientation", vector),
    0x2801: direct("getObjectQuaternion", vector),
    0x1019: direct("getObjectPosition", vector, "i"),  # older: the handle of the reference object is in the data
    0x1018: direct("getObjectOrientation", vector, "i"),
    0x101B: _set_list("setObjectPosition", "i3f"),
    0x101A: _set_list("setObjectOrientation", "i3f"),
    0x1801: _set_list("setObjectQuaternion", "i4f"),
    0x1036: direct("getObjectVelocity", lambda velocity: floats(*velocity[0], *velocity[1])),
    0x2007: _parameter("getObjectFloatParameter", floats),
    0x2008: _parameter("getObjectIntParameter", ints),
    0x2009: direct("setObjectFloatParameter", nothing, "f"),
    0x200A: direct("setObjectIntParameter", nothing, "i"),
    0x1034: direct("getModelProperty", ints),
    0x1035: direct("setModelProperty", nothing, "i"),
    0x102E: Handler(
        "simxCopyPasteObjects", lambda request: counted(request.sim("copyPasteObjects", request.handles()))
    ),
    0x1028: direct("removeObject"),
    0x1037: direct("removeModel"),
    0x0006: Handler("simxGetObjectSelection", lambda request: counted(request.selected)),
    0x102F: Handler("simxSetObjectSelection", _select),
    0x0009: direct("createDummy", ints, "f13x"),  # its size, then colors
    # Joints.
    0x1001: direct("getJointPosition", floats),
    0x1002: direct("setJointPosition", nothing, "f"),
    0x1008: direct("setJointTargetVelocity", nothing, "f"),
    0x100C: direct("setJointTargetPosition", nothing, "f"),
    0x100D: direct("getJointForce", floats),
    0x100E: direct("setJointForce", nothing, "f"),
    0x1038: direct("getJointMaxForce", floats),
    0x100A: direct("getJointMatrix", vector),
    0x100B: _set_list("setSphericalJointMatrix", "12f"),
}


# ---- simxGetObjectGroupData: one kind of data about all objects of a type, or of a collection

_ANY, _OBJECT_TYPES = 109, 20  # sim_appobj_object_type; object types are below 20
_CYCLIC = -1.0  # sent as the range of a cyclic joint


class _Data(NamedTuple):
    """The data of an object: integers, floats and strings."""

    whole: Sequence[float] = ()
    real: Sequence[float] = ()
    texts: Sequence[str] = ()


_GroupFunction = Callable[[Request, int], _Data]  # of a request and an object's handle


def _pose(frame: int, *functions: str) -> _GroupFunction:
    return lambda request, handle: _Data(
        real=[value for name in functions for value in request.sim(name, handle, frame)]
    )


def _velocity(*which: int) -> _GroupFunction:
    def read(request: Request, handle: int) -> _Data:
        linear_and_angular = request.sim("getObjectVelocity", handle)
        return _Data(real=[number for index in which for number in linear_and_angular[index]])

    return read


def _group_proximity(request: Request, handle: int) -> _Data:
    state, _, point, detected, normal = request.sim("readProximitySensor", handle)
    return _Data([max(0, state), detected], [*point, *normal])


def _group_force(request: Request, handle: int) -> _Data:
    state, force, torque = request.sim("readForceSensor", handle)
    return _Data([state], [*force, *torque])


def _group_joint(request: Request, handle: int) -> _Data:
    return _Data(real=[request.sim("getJointPosition", handle), request.sim("getJointForce", handle)])


def _group_joint_kind(request: Request, handle: int) -> _Data:
    cyclic, (low, extent) = request.sim("getJointInterval", handle)
    whole = request.sim("getJointType", handle), request.sim("getJointMode", handle)[0]
    return _Data(whole, [low, _CYCLIC if cyclic else extent])


_POSITION, _EULER, _QUATERNION = "getObjectPosition", "getObjectOrientation", "getObjectQuaternion"
_KINDS: Sequence[_GroupFunction] = (
    lambda request, handle: _Data(texts=[request.sim("getObjectName", handle)]),
    lambda request, handle: _Data([request.sim("getObjectType", handle)]),
    lambda request, handle: _Data([request.sim("getObjectParent", handle)]),
    _pose(_WORLD, _POSITION),
    _pose(_PARENT, _POSITION),
    _pose(_WORLD, _EULER),
    _pose(_PARENT, _EULER),
    _pose(_WORLD, _QUATERNION),
    _pose(_PARENT, _QUATERNION),
    _pose(_WORLD, _POSITION, _EULER),
    _pose(_PARENT, _POSITION, _EULER),
    _pose(_WORLD, _POSITION, _QUATERNION),
    _pose(_PARENT, _POSITION, _QUATERNION),
    _group_proximity,
    _group_force,
    _group_joint,
    _group_joint_kind,
    _velocity(0),
    _velocity(1),
    _velocity(0, 1),
)


def _group(request: Request) -> bytes:
    kind, what = request.key
    if not 0 <= what < len(_KINDS):
        raise request.refused(f"kind of data {what}: must be from 0 to {len(_KINDS) - 1}")
    if kind == _ANY or 0 <= kind < _OBJECT_TYPES:
        handles = request.sim("getObjectsInTree", _SCENE, _ALL if kind == _ANY else kind)
    else:
        handles = request.sim("getCollectionObjects", kind)
    data = [_KINDS[what](request, handle) for handle in handles]
    whole, real, texts = ([value for item in data for value in item[part]] for part in range(3))
    counts = ints(len(handles), len(whole), len(real), len(texts))
    return counts + ints(*handles, *whole) + floats(*real) + b"".join(map(text, texts))


# ---- sensors

_GREY = 1  # option of getVisionSensorImg


def _pixels(result: tuple[bytes, tuple[int, int]]) -> bytes:
    picture, (width, height) = result
    return ints(width, height) + picture


def _image(options: int) -> Handler:
    return Handler(
        "simxGetVisionSensorImage",
        lambda request: _pixels(request.sim("getVisionSensorImg", *request.key, options)),
    )


def _show(request: Request) -> bytes:
    return nothing(request.sim("setVisionSensorCharImage", *request.key, request.data))


def _vision(result: Sequence[Any]) -> bytes:
    triggers, *packets = result
    packets = [packet for packet in packets if packet != ()]  # () is a packet that the sensor does not have
    sizes = ints(len(packets), *map(len, packets))
    return bytes([bool(triggers)]) + sizes + b"".join(floats(*packet) for packet in packets)


def _proximity(result: Sequence[Any]) -> bytes:
    state, _, point, handle, normal = result
    return bytes([state > 0]) + floats(*point) + ints(handle) + floats(*normal)


def _distance(request: Request) -> bytes:
    is_measured, segment, _ = request.sim("checkDistance", *request.key)
    if not is_measured:
        raise request.refused("the distance between the two objects cannot be measured")
    return floats(segment[6])


_SENSORS: Table = {
    0x1004: _image(0),
    0x1003: _image(_GREY),
    0x1017: direct("getVisionSensorDepth", _pixels, name="simxGetVisionSensorDepthBuffer"),
    0x1005: Handler("simxSetVisionSensorImage", _show),
    0x1006: Handler("simxSetVisionSensorImage", _show),
    0x1011: direct("readVisionSensor", _vision),
    0x1009: direct("readProximitySensor", _proximity),
    0x100F: direct("readForceSensor", lambda result: bytes([result[0]]) + floats(*result[1], *result[2])),
    0x1010: direct("breakForceSensor"),
    0x200F: direct("checkCollision", lambda result: ints(result[0])),
    0x2010: Handler("simxCheckDistance", _distance),
}


# ---- the simulator: start, pause and stop, scenes and models, parameters

_TOOLBAR = ("startSimulation", "pauseSimulation", "stopSimulation")  # by key


def _press_button(request: Request) -> bytes:
    (which,) = request.key
    if not 0 <= which < len(_TOOLBAR):
        raise request.refused(f"{which}: must be 0 (start), 1 (pause) or 2 (stop)")
    return nothing(request.sim(_TOOLBAR[which]))


_SIMULATOR: Table = {
    0x1007: Handler("simxStartSimulation", _press_button),
    0x3002: direct("loadScene"),
    0x3003: direct("loadModel", ints),
    0x101D: direct("getArrayParameter", lambda values: floats(*values[:3])),
    0x101E: _set_list("setArrayParameter", "3f"),
    0x101F: direct("getBoolParameter", ints, name="simxGetBooleanParameter"),
    0x1020: direct("setBooleanParameter", nothing, "i"),
    0x1021: direct("getIntegerParameter", ints),
    0x1022: direct("setIntegerParameter", nothing, "i"),
    0x1023: direct("getFloatingParameter", floats),
    0x1024: direct("setFloatingParameter", nothing, "f"),
    0x1025: direct("getStringParameter", text),
}


# ---- windows: status bar, consoles, dialogs, and V-REP 3.x's custom user interfaces

_NO_BUTTON = -1
_SKIPPED = 0  # clients skip a number, because they expect a key of two numbers
_COLORS = 48  # bytes, of a dialog's title and text


def _print(request: Request) -> bytes:
    printed = request.data.rstrip(b"\0").decode("utf-8", "replace") if request.data else None
    return nothing(request.sim("auxiliaryConsolePrint", *request.key, printed))


def _open_dialog(request: Request) -> bytes:
    message, end, rest = request.data.partition(b"\0")
    if not end or len(rest) < struct.calcsize("<i") + 1 + _COLORS:
        raise request.refused(f"{len(request.data)} bytes of data are not a valid dialog")
    (style,) = struct.unpack_from("<i", rest)
    initial = rest[4:-_COLORS].rstrip(b"\0")
    texts = message.decode("utf-8", "replace"), initial.decode("utf-8", "replace")
    handle = request.sim("displayDialog", *request.key, texts[0], style, False, texts[1])
    return ints(handle, handle)


def _close_dialog(request: Request) -> bytes:
    if not request.sim("endDialog", *request.key):
        raise request.refused(f"there is no dialog with the handle {request.key[0]}")
    return b""


_WINDOWS: Table = {
    0x3008: direct("addStatusbarMessage"),
    0x3009: direct("auxiliaryConsoleOpen", ints, "i44x"),  # its lines, then mode, place, size and colors
    0x1014: direct("auxiliaryConsoleClose"),
    0x1015: Handler("simxAuxiliaryConsolePrint", _print),
    0x1016: direct("auxiliaryConsoleShow", nothing, "i"),
    0x300C: Handler("simxDisplayDialog", _open_dialog),
    0x102B: Handler("simxEndDialog", _close_dialog),
    0x102C: direct("getDialogInput", text),
    0x102D: direct("getDialogResult", ints),
    0x3007: direct("getUIHandle", ints),
    0x2001: direct("getUISlider", ints),
    0x2002: direct("setUISlider"),
    0x1029: direct("removeUI"),
    0x2003: Handler("simxGetUIEventButton", lambda request: ints(_SKIPPED, _NO_BUTTON, 0, 0)),
    0x2004: direct("getUIButtonProperty", ints),
    0x2005: direct("setUIButtonProperty"),
    0x2006: direct("setUIButtonLabel"),
}


# ---- signals


def _value(request: Request, function: str) -> Any:
    """Return the value of a signal. Raises Refused, without a text, if it is not set."""
    value = request.sim(function, *request.key)
    if value is None:
        raise Refused("")
    return value


def _set_string(request: Request) -> bytes:
    return nothing(request.sim("setStringSignal", *request.key, string(request.data)))


def _append(request: Request) -> bytes:
    before = request.sim("getStringSignal", *request.key)
    return nothing(request.sim("setStringSignal", *request.key, string(raw(before or "") + request.data)))


def _take(request: Request) -> bytes:
    value = raw(_value(request, "getStringSignal"))
    request.sim("clearStringSignal", *request.key)
    return value


def _read_stream(request: Request) -> bytes | None:
    """Return what was written since the last call; the client appends it to its unread data."""
    return _take(request) if request.sim("getStringSignal", *request.key) else None


def _clear(function: str) -> Handler:
    return Handler(_client_name(function), lambda request: nothing(request.sim(function, request.key[0] or None)))


TAKE_STRING = 0x3017
_SIGNALS: Table = {
    0x3010: Handler("simxGetFloatSignal", lambda request: floats(_value(request, "getFloatSignal"))),
    0x3011: Handler("simxGetIntegerSignal", lambda request: ints(_value(request, "getIntegerSignal"))),
    0x3012: Handler("simxGetStringSignal", lambda request: raw(_value(request, "getStringSignal"))),
    0x3013: direct("setFloatSignal", nothing, "f"),
    0x3014: direct("setIntegerSignal", nothing, "i"),
    0x3015: Handler("simxSetStringSignal", _set_string),
    0x3016: Handler("simxAppendStringSignal", _append),
    TAKE_STRING: Handler("simxGetAndClearStringSignal", _take),
    0x3018: Handler("simxReadStringStream", _read_stream),
    0x300D: _clear("clearFloatSignal"),
    0x300E: _clear("clearIntegerSignal"),
    0x300F: _clear("clearStringSignal"),
}


# ---- simxCallScriptFunction: a call of a script with four lists of arguments and results

_COUNTS = struct.Struct("<4i")


def _call_script(request: Request) -> bytes:
    kind, name, function = request.key
    function_name, _, object_name = function.partition("@")  # older programs append the object's name to the function's
    owner = name or object_name
    if kind & 0xF == CUSTOMIZATION:
        called: tuple[str, int] = f"{function_name}@{owner}", CUSTOMIZATION
    elif kind & 0xF == CHILD:
        called = function_name, request.sim("getScriptHandle", owner)
    else:
        allowed = f"sim_scripttype_childscript ({CHILD}) or sim_scripttype_customizationscript ({CUSTOMIZATION})"
        raise request.refused(f"type of script {kind}: must be {allowed}")
    returned = request.sim("callScriptFunction", *called, *_arguments(request))
    return _results(request, list(returned) if isinstance(returned, tuple) else [returned])


def _arguments(request: Request) -> list[Any]:
    """Return integers, floats, strings and a buffer. Raises Refused if the data does not match their counts."""
    if len(request.data) < _COUNTS.size:
        raise request.refused(f"{len(request.data)} bytes of data are too few for the arguments")
    counts = whole, real, strings, size = _COUNTS.unpack_from(request.data)
    texts_at = _COUNTS.size + 4 * (whole + real)
    *texts, buffer = request.data[texts_at:].split(b"\0", strings) if min(counts) >= 0 else [b""]
    if min(counts) < 0 or texts_at > len(request.data) or len(texts) != strings or len(buffer) != size:
        raise request.refused(f"{len(request.data)} bytes of data are not {whole}, {real}, {strings} and {size} values")
    numbers = struct.unpack_from(f"<{whole}i{real}f", request.data, _COUNTS.size)
    return [list(numbers[:whole]), list(numbers[whole:]), [string(value) for value in texts], string(buffer)]


def _results(request: Request, returned: Sequence[Any]) -> bytes:
    """Return the encoded results of a script. Raises Refused if they are not such lists."""
    whole, real, strings, buffer = [part if part is not None else "" for part in [*returned, *[None] * 4][:4]]
    try:
        texts = [text(value) for value in strings]
        values = ints(*whole) + floats(*real) + b"".join(texts) + raw(buffer)
        return ints(len(whole), len(real), len(texts), len(raw(buffer))) + values
    except (TypeError, ValueError, struct.error, OverflowError):
        expected = "whole numbers, numbers, strings, and one string, as lists"
        raise request.refused(f"{request.key[2]} returned something else than {expected}") from None


# ---- all commands


def _refused(name: str, why: str) -> Handler:
    def refuse(request: Request) -> bytes:
        raise request.refused(why)

    return Handler(name, refuse)


_FILES = (
    "files are not transferred: put it into the folder of the scene, and do not set the option for a client-side file"
)
_PAIRS = "collision and distance objects are not supported; pass two objects to simxCheckCollision or simxCheckDistance"

FUNCTIONS: Table = {
    **_OBJECTS,
    0x200C: Handler("simxGetObjectGroupData", _group),
    **_SENSORS,
    **_SIMULATOR,
    **_WINDOWS,
    **_SIGNALS,
    0x3401: Handler("simxCallScriptFunction", _call_script),
    0x3004: _refused("simxTransferFile", _FILES),
    0x3006: _refused("simxEraseFile", _FILES),
    0x300A: _refused("simxGetCollisionHandle", _PAIRS),
    0x300B: _refused("simxGetDistanceHandle", _PAIRS),
    0x1026: _refused("simxReadCollision", _PAIRS),
    0x1027: _refused("simxReadDistance", _PAIRS),
    0x3005: _refused("simxLoadUI", "user interfaces of V-REP 3.x are not supported"),
    0x0005: _refused("simxCloseScene", "there is always exactly one scene: simxLoadScene replaces it"),
}


def handler_of(code: int) -> Handler:
    """Return the handler of a command; for an unknown one, a handler that refuses it."""
    return FUNCTIONS.get(code) or _refused(f"command {code:#06x}", "there is no such command")
