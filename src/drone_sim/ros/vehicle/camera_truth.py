"""Topics with the ground truth of a camera's picture, below `<topic>/truth`; messages are made only for subscribers."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header, String
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.render.outputs import COLOR
from drone_sim.ros.core.image_messages import draw_mask, image
from drone_sim.ros.core.publishing import NewSubscribers, Stamp
from drone_sim.sensors.camera import Camera
from drone_sim.sensors.truth import Detection, PictureTruth, described, quaternion_of

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

_FLOOR = "Floor"  # its box would contain everything
_LINE = 0.01  # m, of the boxes in rviz
_COLOR = ColorRGBA(1.0, 0.55, 0.1, 0.35)


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

    @property
    def _publishers(self) -> list[Any]:
        return [self._labels, *self._made, self._flow, self._flow_known, self._overlay]

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
        """Unregister the topics."""
        for publisher in self._publishers:
            publisher.unregister()


def _cloud(points: np.ndarray, header: Header) -> PointCloud2:
    height, width = points.shape[:2]
    fields = [PointField(name, 4 * place, PointField.FLOAT32, 1) for place, name in enumerate("xyz")]
    size = {"height": height, "width": width, "point_step": 12, "row_step": 12 * width}
    return PointCloud2(header=header, fields=fields, is_dense=False, data=points.tobytes(), **size)


def _boxes(objects: list[Detection], header: Header) -> String:
    content = {"stamp": header.stamp.to_sec(), "frame": header.frame_id, "objects": described(objects)}
    return String(json.dumps(content))


def _pose(one: Detection) -> Pose:
    return Pose(Point(*one.pose[:3, 3]), Quaternion(*quaternion_of(one)))


def _markers(objects: list[Detection], header: Header) -> MarkerArray:
    """Return 3D boxes with names for rviz, except the floor's; those of the last picture are deleted."""
    made = [Marker(header=header, action=Marker.DELETEALL)]
    for one in (each for each in objects if each.identity.name != _FLOOR):
        shared = {"header": header, "id": one.number, "pose": _pose(one)}
        made.append(Marker(ns="boxes", type=Marker.CUBE, scale=Vector3(*(one.size + _LINE)), color=_COLOR, **shared))
        text = {"text": one.identity.name, "color": ColorRGBA(1, 1, 1, 1), "scale": Vector3(0, 0, 0.1)}
        made.append(Marker(ns="names", type=Marker.TEXT_VIEW_FACING, **text, **shared))
    return MarkerArray(made)


def _detections(objects: list[Detection], header: Header) -> Any:
    made = []
    for one in objects:
        left, top, right, bottom = one.visible
        box = BoundingBox2D(size_x=right - left, size_y=bottom - top)
        box.center.x, box.center.y = (left + right) / 2, (top + bottom) / 2
        made.append(Detection2D(header=header, bbox=box, results=[ObjectHypothesisWithPose(id=one.number, score=1.0)]))
    return Detection2DArray(header=header, detections=made)


def _detections_3d(objects: list[Detection], header: Header) -> Any:
    made = []
    for one in objects:
        box = BoundingBox3D(center=_pose(one), size=Vector3(*one.size))
        made.append(Detection3D(header=header, bbox=box, results=[ObjectHypothesisWithPose(id=one.number, score=1.0)]))
    return Detection3DArray(header=header, detections=made)
