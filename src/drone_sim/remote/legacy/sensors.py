"""Commands for vision, proximity and force sensors, distances and collisions."""

from __future__ import annotations

from drone_sim.remote.legacy.request import Handler, Request, Table, direct, floats, ints, nothing

_GREY = 1  # option of getVisionSensorImg


def _image(options: int) -> Handler:
    def image(request: Request) -> bytes:
        picture, (width, height) = request.sim("getVisionSensorImg", *request.key, options)
        return ints(width, height) + picture

    return Handler("simxGetVisionSensorImage", image)


def _depths(request: Request) -> bytes:
    depths, (width, height) = request.sim("getVisionSensorDepth", *request.key)
    return ints(width, height) + depths


def _show(request: Request) -> bytes:
    return nothing(request.sim("setVisionSensorCharImage", *request.key, request.data))


def _read_vision(request: Request) -> bytes:
    triggers, *packets = request.sim("readVisionSensor", *request.key)
    packets = [packet for packet in packets if packet != ()]  # () is a packet that the sensor does not have
    sizes = ints(len(packets), *map(len, packets))
    return bytes([bool(triggers)]) + sizes + b"".join(floats(*packet) for packet in packets)


def _proximity(request: Request) -> bytes:
    state, _, point, handle, normal = request.sim("readProximitySensor", *request.key)
    return bytes([state > 0]) + floats(*point) + ints(handle) + floats(*normal)


def _force(request: Request) -> bytes:
    state, force, torque = request.sim("readForceSensor", *request.key)
    return bytes([state]) + floats(*force, *torque)


def _distance(request: Request) -> bytes:
    is_measured, segment, _ = request.sim("checkDistance", *request.key)
    if not is_measured:
        raise request.refused("the distance between the two objects cannot be measured")
    return floats(segment[6])


SENSORS: Table = {
    0x1004: _image(0),
    0x1003: _image(_GREY),
    0x1017: Handler("simxGetVisionSensorDepthBuffer", _depths),
    0x1005: Handler("simxSetVisionSensorImage", _show),
    0x1006: Handler("simxSetVisionSensorImage", _show),
    0x1011: Handler("simxReadVisionSensor", _read_vision),
    0x1009: Handler("simxReadProximitySensor", _proximity),
    0x100F: Handler("simxReadForceSensor", _force),
    0x1010: direct("breakForceSensor", nothing),
    0x200F: direct("checkCollision", lambda result: ints(result[0])),
    0x2010: Handler("simxCheckDistance", _distance),
}
