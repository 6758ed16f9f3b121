"""Topics of a camera as in image_transport, and of its ground truth; messages are made only for subscribers."""

from __future__ import annotations

import json
import threading
import traceback
from collections import deque
from collections.abc import Callable
from typing import Any

import cv2
import genpy
import numpy as np
import rospy
from dynamic_reconfigure.server import Server
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header, String
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.config.fields import ParameterField
from drone_sim.render.outputs import COLOR
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.image_messages import draw_mask, image
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.ros.vehicle.tuning_server import described
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.truth import Detection, PictureTruth, quaternion_of
from drone_sim.sensors.truth import described as describe_boxes
from drone_sim.vehicles.parameters import VehicleParameters

try:
    from vision_msgs.msg import (
        BoundingBox2D,
        BoundingBox3D,
        Detection2D,
        Detection2DArray,
        Detection3D,
        Detection3DArray,
        ObjectHypothesisWithPose,
    )
except ImportError:  # Debian has no package of it
    Detection2DArray = Detection3DArray = None

MAX_LEFT_OUT = 3  # pictures, or messages for displays, in a row, while steps are late
_ERROR_PERIOD = 5.0  # s, between two errors in the log
_ENCODINGS = {"color": "rgb8", "depth": "32FC1"}
_COMPRESSION = {
    "format": ParameterField(("format",), str, choices=("jpeg", "png"), description="compression format"),
    "jpeg_quality": ParameterField(("jpeg_quality",), int, low=1, high=100, description="JPEG quality in percent"),
    "png_level": ParameterField(("png_level",), int, low=1, high=9, description="PNG compression level"),
}
_DEFAULTS = {"format": "jpeg", "jpeg_quality": 80, "png_level": 9}
_FLOOR = "Floor"  # its box would contain everything
_LINE = 0.01  # m, by which the boxes in rviz are larger
_BOX_COLOR = ColorRGBA(1.0, 0.55, 0.1, 0.35)


class CameraOutput:
    """One camera: `<topic>`, `<topic>/compressed` (colour), and camera_info in the same namespace."""

    def __init__(
        self, vehicle: VehicleParameters, camera: Camera, parameters: CameraParameters, new_subscribers: NewSubscribers
    ):
        """Advertise in the vehicle's namespace; `new_subscribers` collects new subscribers to pictures.

        The camera takes pictures only while there are subscribers.
        """
        topic = message_conversion.full_name(vehicle.name, parameters.topic)
        self._frame = message_conversion.frame(vehicle, parameters.frame)
        folder, slash, _ = topic.rpartition("/")
        info_topic = f"{folder}{slash}camera_info"  # image_transport's rule
        self._image = rospy.Publisher(topic, Image, subscriber_listener=new_subscribers, queue_size=1)
        self._compressed = CompressedPublisher(topic, new_subscribers) if parameters.kind == "color" else None
        self._info_publisher = rospy.Publisher(info_topic, CameraInfo, queue_size=1)
        self._truth = TruthOutput(topic, self._frame, new_subscribers) if parameters.truth else None
        self.late_step: int | None = None  # number of the present step, if it is late
        self.follow(camera)

    def follow(self, camera: Camera) -> None:
        """Use this camera, which replaces the last one, from now on."""
        self._camera = camera
        self._describe()
        camera.viewers.add(self._has_viewers)

    def _describe(self) -> None:
        self._intrinsics = self._camera.intrinsics
        self._info = message_conversion.camera_info(self._intrinsics, self._frame)

    def close(self) -> None:
        for publisher in (self._image, self._compressed, self._info_publisher):
            if publisher is not None:
                publisher.unregister()
        if self._truth is not None:
            self._truth.close()

    def _has_viewers(self) -> bool:
        """Return whether anybody wants the present picture. Who takes it compressed does not need all of them."""
        if self._image.get_num_connections():
            return True
        if self._compressed is None or not self._compressed.publisher.get_num_connections():
            return False
        last = self._camera.latest
        if self.late_step is None or last is None or self._camera.is_linked:  # a link delivers in every step
            return True
        return self.late_step - last.at > MAX_LEFT_OUT * self._camera.period

    def publish(self, stamp: Stamp) -> None:
        """Publish the picture and its camera_info, stamped with the time of the picture.

        A radio link delays or loses both together; a silent camera publishes nothing.
        """
        camera = self._camera
        if self._truth is not None:
            self._truth.publish(camera, stamp)
        is_there = camera.image is not None or (not camera.is_linked and camera.failure != "silent")
        if is_there and self._info_publisher.get_num_connections():
            if self._intrinsics is not camera.intrinsics:
                self._describe()
            self._info.header.stamp = stamp(camera.age)
            self._info_publisher.publish(self._info)
        if camera.image is None:
            return
        header = Header(stamp=stamp(camera.age), frame_id=self._frame)
        if self._image.get_num_connections():
            self._image.publish(image(camera.image, _ENCODINGS[camera.kind], header))
        if self._compressed is not None:
            self._compressed.publish(header, camera.image)


class CompressedPublisher:
    """Publishes `<base>/compressed` with the formats and parameters of image_transport's C++ plugin.

    It encodes in its own thread, because PNG at the plugin's default level takes longer than a step. If pictures arrive
    while the thread is busy, only the latest is encoded. A picture that cannot be encoded is logged and skipped.
    """

    def __init__(self, base: str, new_subscribers: NewSubscribers):
        """Advertise the topic and its dynamic_reconfigure server; `new_subscribers` collects new subscribers."""
        topic = rospy.resolve_name(f"{base}/compressed")
        self.publisher = rospy.Publisher(topic, CompressedImage, subscriber_listener=new_subscribers, queue_size=1)
        self._settings: dict[str, Any] = {}
        self._server = Server(described(_COMPRESSION, _DEFAULTS), self._store_settings, topic)
        self._pending: deque[tuple[Header, np.ndarray]] = deque(maxlen=1)
        self._has_pending = threading.Event()
        self._is_open = True
        threading.Thread(target=self._work, name=f"{topic} encoder", daemon=True).start()

    def _store_settings(self, settings: dict[str, Any], _level: int) -> dict[str, Any]:
        if settings["format"] not in ("jpeg", "png"):
            rospy.logwarn(f"compressed/format = '{settings['format']}': must be jpeg or png; jpeg is used")
            settings["format"] = "jpeg"
        self._settings = settings
        return settings

    def unregister(self) -> None:
        self._is_open = False
        self._has_pending.set()
        for publisher in (self.publisher, self._server.descr_topic, self._server.update_topic):
            publisher.unregister()
        self._server.set_service.shutdown()

    def publish(self, header: Header, picture: np.ndarray) -> None:
        """Encode and publish an RGB picture (height, width, 3), which must not change, if there are subscribers."""
        if self.publisher.get_num_connections():
            self._pending.append((header, picture))
            self._has_pending.set()

    def _work(self) -> None:
        while self._is_open:
            self._has_pending.wait()
            self._has_pending.clear()
            while self._pending:
                try:
                    self.publisher.publish(_encoded(*self._pending.popleft(), self._settings))
                except rospy.ROSException:  # the node ends
                    return
                except Exception as error:  # the thread must survive one bad picture
                    rospy.logerr_throttle(
                        _ERROR_PERIOD, f"{self.publisher.name}: a picture could not be encoded: {error}"
                    )
                    rospy.logdebug(traceback.format_exc())


def _encoded(header: Header, picture: np.ndarray, settings: dict[str, Any]) -> CompressedImage:
    message = CompressedImage(header=header, format=f"rgb8; {settings['format']} compressed bgr8")
    if settings["format"] == "png":
        extension, options = ".png", (cv2.IMWRITE_PNG_COMPRESSION, settings["png_level"])
    else:
        extension, options = ".jpg", (cv2.IMWRITE_JPEG_QUALITY, settings["jpeg_quality"])
    message.data = cv2.imencode(extension, cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), options)[1].tobytes()
    return message


class TruthOutput:
    """The topics of one camera's ground truth."""

    def __init__(self, topic: str, frame: str, new_subscribers: NewSubscribers):
        """Advertise below `topic`, in the frame `frame`; `new_subscribers` collects new subscribers."""
        self._frame = frame
        self._depth_before: np.ndarray | None = None
        self._labels = rospy.Publisher(f"{topic}/truth/labels", String, queue_size=1, latch=True)
        self._published_labels = ""
        kinds: dict[str, tuple[type[genpy.Message], Callable[[PictureTruth, Header], genpy.Message]]] = {
            "instances": (Image, lambda truth, header: image(truth.output("instance"), "mono16", header)),
            "categories": (Image, lambda truth, header: image(truth.categories, "mono16", header)),
            "depth": (Image, lambda truth, header: image(truth.output("depth"), "32FC1", header)),
            "normals": (Image, lambda truth, header: image(truth.output("normal"), "32FC3", header)),
            "points": (PointCloud2, lambda truth, header: _cloud(truth.points, header)),
            "boxes": (String, lambda truth, header: _boxes(truth.seen(), header)),
            "box_markers": (MarkerArray, lambda truth, header: _markers(truth.seen(), header)),
        }
        if Detection2DArray is not None:
            kinds["detections"] = Detection2DArray, lambda truth, header: _detections(truth.seen(), header)
            kinds["detections_3d"] = Detection3DArray, lambda truth, header: _detections_3d(truth.seen(), header)
        self._made = {
            rospy.Publisher(f"{topic}/truth/{name}", kind, subscriber_listener=new_subscribers, queue_size=1): make
            for name, (kind, make) in kinds.items()
        }
        self._flow, self._flow_known, self._overlay = (
            rospy.Publisher(f"{topic}/truth/{name}", Image, subscriber_listener=new_subscribers, queue_size=1)
            for name in ("flow", "flow_known", "overlay")
        )

    def publish(self, camera: Camera, stamp: Stamp) -> None:
        """Publish the truth of the present picture on the topics that have subscribers."""
        heard = [publisher for publisher in self._made if publisher.get_num_connections()]
        flows = any(publisher.get_num_connections() for publisher in (self._flow, self._flow_known))
        overlays = self._overlay.get_num_connections() > 0
        if not (heard or flows or overlays or self._labels.get_num_connections()):
            self._depth_before = None
            return
        picture = camera.look(COLOR) if overlays else None  # before the truth, which is rendered with it
        truth = camera.truth()
        if truth is None:
            return
        header = Header(stamp=stamp(), frame_id=self._frame)
        self._publish_labels(truth)
        if flows:
            self._publish_flow(truth, header)
        if picture is not None:
            self._overlay.publish(image(draw_mask(picture, truth.categories), "rgb8", header))
        for publisher in heard:
            publisher.publish(self._made[publisher](truth, header))

    def _publish_labels(self, truth: PictureTruth) -> None:
        numbered = truth.numbered
        text = json.dumps({
            "instances": {number: identity._asdict() for number, identity in enumerate(numbered.identities, 1)},
            "categories": dict(enumerate(numbered.categories, 1)),
        })  # fmt: skip
        if text != self._published_labels:
            self._published_labels = text
            self._labels.publish(text)

    def _publish_flow(self, truth: PictureTruth, header: Header) -> None:
        before = truth.output("depth") if self._depth_before is None else self._depth_before
        flow, known = truth.flow(before)
        if self._depth_before is None:  # there is no previous picture
            known[:] = False
        self._depth_before = truth.output("depth")
        self._flow.publish(image(flow, "32FC2", header))
        self._flow_known.publish(image(255 * known.astype(np.uint8), "mono8", header))

    def close(self) -> None:
        for publisher in (self._labels, *self._made, self._flow, self._flow_known, self._overlay):
            publisher.unregister()


def _cloud(points: np.ndarray, header: Header) -> PointCloud2:
    height, width = points.shape[:2]
    fields = [PointField(name, 4 * place, PointField.FLOAT32, 1) for place, name in enumerate("xyz")]
    size = {"height": height, "width": width, "point_step": 12, "row_step": 12 * width}
    return PointCloud2(header=header, fields=fields, is_dense=False, data=points.tobytes(), **size)


def _boxes(objects: list[Detection], header: Header) -> String:
    content = {"stamp": header.stamp.to_sec(), "frame": header.frame_id, "objects": describe_boxes(objects)}
    return String(json.dumps(content))


def _pose(box: Detection) -> Pose:
    return Pose(Point(*box.pose[:3, 3]), Quaternion(*quaternion_of(box)))


def _markers(objects: list[Detection], header: Header) -> MarkerArray:
    """Return 3D boxes with names for rviz, except the floor's; those of the last picture are deleted."""
    made = [Marker(header=header, action=Marker.DELETEALL)]
    for detection in [each for each in objects if each.identity.name != _FLOOR]:
        shared = {"header": header, "id": detection.number, "pose": _pose(detection)}
        made.append(
            Marker(ns="boxes", type=Marker.CUBE, scale=Vector3(*(detection.size + _LINE)), color=_BOX_COLOR, **shared)
        )
        text = {"text": detection.identity.name, "color": ColorRGBA(1, 1, 1, 1), "scale": Vector3(0, 0, 0.1)}
        made.append(Marker(ns="names", type=Marker.TEXT_VIEW_FACING, **text, **shared))
    return MarkerArray(made)


def _number_of(detection: Detection) -> list[Any]:
    return [ObjectHypothesisWithPose(id=detection.number, score=1.0)]


def _detections(objects: list[Detection], header: Header) -> Any:
    made = []
    for detection in objects:
        left, top, right, bottom = detection.visible
        box = BoundingBox2D(size_x=right - left, size_y=bottom - top)
        box.center.x, box.center.y = (left + right) / 2, (top + bottom) / 2
        made.append(Detection2D(header=header, bbox=box, results=_number_of(detection)))
    return Detection2DArray(header=header, detections=made)


def _detections_3d(objects: list[Detection], header: Header) -> Any:
    made = []
    for detection in objects:
        box = BoundingBox3D(center=_pose(detection), size=Vector3(*detection.size))
        made.append(Detection3D(header=header, bbox=box, results=_number_of(detection)))
    return Detection3DArray(header=header, detections=made)
