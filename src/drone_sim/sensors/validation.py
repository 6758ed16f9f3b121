"""What cameras and other sensors may be beside each other, and beside the vehicle's own topics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from drone_sim.config.types import Location, ParameterError
from drone_sim.sensors.camera_parameters import MAX_PIXELS, CameraParameters
from drone_sim.sensors.sensor import SensorParameters

# What a vehicle publishes and hears in its namespace, beside its sensors.
RESERVED_TOPICS = (
    *("cmd_vel", "set_pose", "initialpose", "push", "target_pose", "odom", "propellers", "joint_states"),
    *("set_wind", "weather", "faults", "takeoff", "land", "reset", "home", "goto", "state", "hears_commands"),
    *("parameter_descriptions", "parameter_updates"),
    *("command", "scene", "drawing", "markers/update", "markers/update_full", "markers/feedback"),
    *("objects/update", "objects/update_full", "objects/feedback"),
    *(f"view/{what}" for what in ("surroundings", "bodies", "path", "height", "command", "forces", "state")),
)


def check_sensors(cameras: Mapping[str, CameraParameters], sensors: Mapping[str, SensorParameters]) -> None:
    """Raise ParameterError where two claim the same object, topic or frame, or one claims the drone's own topic."""
    _check_cameras(cameras)
    topics = {topic: "the drone's own" for topic in RESERVED_TOPICS}
    objects: dict[str, str] = {}
    for kind, several in (("cameras", cameras), ("sensors", sensors)):
        for name, one in several.items():
            _claim_object(objects, (kind, name), one.object or name)
            _claim_topics(topics, (kind, name), one.topic, one.topics())
    _check_frames(cameras, sensors)


def check_rates(sensors: Mapping[str, SensorParameters], sub_step: float, above: Location = ()) -> None:
    """Raise ParameterError for a sensor of which `sub_step` (s) does not divide the period.

    `above` is where the key `sensors` stands among the parameters.
    """
    for name, one in sensors.items():
        try:
            one.check(sub_step)
        except ParameterError as error:
            raise error.below(*above, "sensors", name) from None


def _check_cameras(cameras: Mapping[str, CameraParameters]) -> None:
    pixels = sum(camera.width * camera.height for camera in cameras.values())
    if pixels > MAX_PIXELS:
        raise ParameterError(f"{pixels} pixels in all; at most {MAX_PIXELS} are allowed", ("cameras",))
    for name, camera in cameras.items():
        if camera.near >= camera.far:
            raise ParameterError(f"must be less than far = {camera.far}", ("cameras", name, "near"), str(camera.near))


def _claim_object(taken: dict[str, str], who: tuple[str, str], name: str) -> None:
    here = "/".join(who)
    if name in taken:
        raise ParameterError(f"is also the name of {taken[name]}", (*who, "object"), f"'{name}'")
    taken[name] = here


def _claim_topics(taken: dict[str, str], who: tuple[str, str], given: str, topics: Iterable[tuple[str, str]]) -> None:
    here = "/".join(who)
    for topic, what in topics:
        if topic in taken:
            raise ParameterError(
                f"its {what} would be {topic}, which is {taken[topic]}; "
                "use a topic with a namespace, such as rear/image",
                (*who, "topic"),
                f"'{given}'",
            )
        taken[topic] = f"the {what} of {here}"


def _check_frames(cameras: Mapping[str, CameraParameters], sensors: Mapping[str, SensorParameters]) -> None:
    """Raise ParameterError where one frame would be at two places; the URDF's links are looked at by the vehicle."""
    taken = {camera.frame: f"cameras/{name}" for name, camera in cameras.items() if camera.mount is not None}
    taken.update({"Track_base": "the vehicle", "world": "the scene"})
    first: dict[str, tuple[str, SensorParameters]] = {}
    for name, one in sensors.items():
        other, before = first.setdefault(one.frame, (name, one))
        owner = taken.get(one.frame)
        if (before.mount, before.default_mount) != (one.mount, one.default_mount):
            owner = f"sensors/{other}, which sits elsewhere"
        if owner:
            raise ParameterError(f"is that of {owner}", ("sensors", name, "frame"), f"'{one.frame}'")
