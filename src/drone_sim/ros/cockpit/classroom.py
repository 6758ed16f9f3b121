"""The cockpit's part in a course: teachers see how its student's drone is, and the student sees what they tell all."""

from __future__ import annotations

import base64
import contextlib
import time
from collections.abc import Callable
from pathlib import Path

import rospy
from sensor_msgs.msg import CompressedImage

from drone_sim.grading import classroom
from drone_sim.ros.cockpit.panel.board import NO_SIMULATION, Board

_PERIOD = 5.0  # s between two reports
_PICTURE_TIMEOUT = 1.0  # s, for a picture of the camera; there is none while the simulation is paused
_MAX_PICTURE = 100_000  # bytes


class Classroom:
    """Reports to the folder of the course while a page is open, and shows the message to all on the board."""

    def __init__(
        self,
        board: Board,
        is_open: Callable[[], bool],
        camera: Callable[[], str],
        others: Callable[[], dict[str, str]],
    ):
        """`camera` returns the topic of the camera with JPEG pictures, '' for none; `others` returns more texts."""
        self._board, self._is_open, self._camera, self._others = board, is_open, camera, others

    def run(self) -> None:
        """Report until the node ends; return at once if there is no course."""
        room = classroom.folder()
        if room is None:
            return
        path = classroom.report_path(room)
        message: classroom.Message | None = None
        while not rospy.is_shutdown():
            before, message = message, classroom.message_to_all(room)
            if message != before:
                self._board.show("to_all", _offered(room, message))
            if self._is_open() and self._board.get("status", NO_SIMULATION) != NO_SIMULATION:
                self._report(path)
            time.sleep(_PERIOD)
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)

    def _report(self, path: Path) -> None:
        status, flight = self._board.get("status", ""), self._board.get("flight", "")
        is_told = status == "flying" and flight and not flight.startswith("unknown")
        status = flight if is_told or flight == "script failed" else status
        texts = {"status": status, "scene": self._board.get("scenes", {}).get("now", ""), **self._others()}
        try:
            classroom.report(path, texts, self._picture())
        except OSError as error:
            rospy.logwarn_throttle(600, f"the course's folder: {' '.join(str(error).split())}")

    def _picture(self) -> str:
        topic = self._camera()
        if not topic or self._board.get("status") != "flying":
            return ""
        try:
            picture = rospy.wait_for_message(topic, CompressedImage, _PICTURE_TIMEOUT).data
        except rospy.ROSException:  # none came in time, or the node ends
            return ""
        return base64.b64encode(picture).decode() if len(picture) <= _MAX_PICTURE else ""


def _offered(room: Path, message: classroom.Message | None) -> dict[str, str] | None:
    """Return a message for the page, without a scene that the simulator would refuse."""
    if message is None or not message.scene:
        return message and message._asdict()
    try:
        classroom.check_scene(classroom.scenes_folder(room) / message.scene)
    except ValueError as error:
        rospy.logwarn(f"the course's scene cannot be opened: {error}")
        message = message._replace(scene="")
    return message._asdict()
