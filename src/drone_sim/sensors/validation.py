"""Checks for conflicting objects, topics and frames among the cameras and sensors of a vehicle."""

from __future__ import annotations

from collections.abc import Mapping

from drone_sim.config.types import Location, ParameterError
from drone_sim.sensors.camera_parameters import MAX_PIXELS, CameraParameters
from drone_sim.sensors.sensor import SensorParameters

# Topics in a vehicle's namespace, other than those of its sensors.
RESERVED_TOPICS = (
    *("cmd_vel", "set_pose", "initialpose", "push", "target_pose", "odom", "propellers", "joint_states"),
    *("set_wind", "weather", "faults", "takeoff", "land", "emergency", "reset", "home", "goto", "state"),
    *("hears_commands", "cmd_vel_stamped", "parameter_descriptions", "parameter_updates"),
    *("command", "scene", "drawing", "markers/update", "markers/update_full", "markers/feedback"),
    *("objects/update", "objects/update_full", "objects/feedback"),
    *(f"view/{what}" for what in ("surroundings", "bodies", "path", "height", "command", "forces", "state")),
)


def check_sensors(cameras: Mapping[str, CameraParameters], sensors: Mapping[str, SensorParameters]) -> None:
    """Raise ParameterError if two sensors claim one object, topic or frame, or one claims a topic of the vehicle."""
    pixels = sum(camera.width * camera.height for camera in cameras.values())
    if pixels > MAX_PIXELS:
        raise ParameterError(f"{pixels} pixels in total; at most {MAX_PIXELS} are allowed", ("cameras",))
    for name, camera in cameras.items():
        if camera.near >= camera.far:
            raise ParameterError(f"must be less than far = {camera.far}", ("cameras", name, "near"), str(camera.near))
    _check_names(cameras, sensors)
    _check_frames(cameras, sensors)


def check_rates(sensors: Mapping[str, SensorParameters], sub_step: float, above: Location = ()) -> None:
    """Raise ParameterError for a sensor whose period or latency is not a multiple of `sub_step` (s).

    `above` is the path of keys to the key `sensors`.
    """
    for name, sensor in sensors.items():
        try:
            sensor.check(sub_step)
        except ParameterError as error:
            raise error.below(*above, "sensors", name) from None


def _check_names(cameras: Mapping[str, CameraParameters], sensors: Mapping[str, SensorParameters]) -> None:
    """Raise ParameterError if an object or a topic would be that of two sensors, or of the vehicle."""
    topics = {topic: "the drone's own topic" for topic in RESERVED_TOPICS}
    objects: dict[str, str] = {}
    for kind, group in (("cameras", cameras), ("sensors", sensors)):
        for name, sensor in group.items():
            path, found = f"{kind}/{name}", sensor.object or name
            if found in objects:
                raise ParameterError(f"is the object of {objects[found]} already", (kind, name, "object"), f"'{found}'")
            objects[found] = path
            for topic, content in sensor.topics():
                if topic in topics:
                    raise ParameterError(
                        f"its {content} would be {topic}, which is {topics[topic]}; "
                        "give it a namespace of its own, such as rear/image",
                        (kind, name, "topic"),
                        f"'{sensor.topic}'",
                    )
                topics[topic] = f"the {content} of {path}"


def _check_frames(cameras: Mapping[str, CameraParameters], sensors: Mapping[str, SensorParameters]) -> None:
    """Raise ParameterError if a frame would have two poses; the vehicle checks the URDF's links."""
    taken = {camera.frame: f"cameras/{name}" for name, camera in cameras.items() if camera.mount is not None}
    taken.update({"Track_base": "the vehicle", "world": "the scene"})
    first_users: dict[str, tuple[str, SensorParameters]] = {}
    for name, sensor in sensors.items():
        other, before = first_users.setdefault(sensor.frame, (name, sensor))
        owner = taken.get(sensor.frame)
        if (before.mount, before.default_mount) != (sensor.mount, sensor.default_mount):
            owner = f"sensors/{other}, which has another mount"
        if owner:
            raise ParameterError(f"is already the frame of {owner}", ("sensors", name, "frame"), f"'{sensor.frame}'")
