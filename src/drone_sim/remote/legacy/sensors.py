"""Commands for vision, proximity and force sensors, distances and collisions."""

from __future__ import annotations

from drone_sim.remote.legacy.asked import Asked, Served, Table, nothing
from drone_sim.remote.legacy.values import floats, ints

_GREY = 1  # option of getVisionSensorImg


def _image(options: int) -> Served:
    def image(ask: Asked) -> bytes:
        picture, (width, height) = ask.sim("getVisionSensorImg", *ask.key, options)
        return ints(width, height) + picture

    return Served("simxGetVisionSensorImage", image)


def _depths(ask: Asked) -> bytes:
    depths, (width, height) = ask.sim("getVisionSensorDepth", *ask.key)
    return ints(width, height) + depths


def _show(ask: Asked) -> bytes:
    return nothing(ask.sim("setVisionSensorCharImage", *ask.key, ask.data))


def _read_vision(ask: Asked) -> bytes:
    triggers, *packets = ask.sim("readVisionSensor", *ask.key)
    packets = [packet for packet in packets if packet != ()]  # () is a packet that the sensor does not have
    sizes = ints(len(packets), *map(len, packets))
    return bytes([bool(triggers)]) + sizes + b"".join(floats(*packet) for packet in packets)


def _proximity(ask: Asked) -> bytes:
    state, _, point, handle, normal = ask.sim("readProximitySensor", *ask.key)
    return bytes([state > 0]) + floats(*point) + ints(handle) + floats(*normal)


def _force(ask: Asked) -> bytes:
    state, force, torque = ask.sim("readForceSensor", *ask.key)
    return bytes([state]) + floats(*force, *torque)


def _distance(ask: Asked) -> bytes:
    is_measured, segment, _ = ask.sim("checkDistance", *ask.key)
    if not is_measured:
        raise ask.refused("the distance between the two objects cannot be measured")
    return floats(segment[6])


SENSORS: Table = {
    0x1004: _image(0),
    0x1003: _image(_GREY),
    0x1017: Served("simxGetVisionSensorDepthBuffer", _depths),
    0x1005: Served("simxSetVisionSensorImage", _show),
    0x1006: Served("simxSetVisionSensorImage", _show),
    0x1011: Served("simxReadVisionSensor", _read_vision),
    0x1009: Served("simxReadProximitySensor", _proximity),
    0x100F: Served("simxReadForceSensor", _force),
    0x1010: Served("simxBreakForceSensor", lambda ask: nothing(ask.sim("breakForceSensor", *ask.key))),
    0x200F: Served("simxCheckCollision", lambda ask: ints(ask.sim("checkCollision", *ask.key)[0])),
    0x2010: Served("simxCheckDistance", _distance),
}
