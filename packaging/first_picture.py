#!/usr/bin/env python3
"""`first_picture.py START`: opens the cockpit on this machine as a browser does, and switches the front camera on.

It prints how long after START (seconds since 1970) the page, the 3D scene and the camera's picture came.
measure_image.sh runs it in a container.
"""

from __future__ import annotations

import json
import sys
import time
import urllib.request
from http.cookiejar import CookieJar
from pathlib import Path

import cv2
import numpy as np
from websockets.sync.client import ClientConnection, connect

ADDRESS = Path("~/.ros/drone_sim/cockpit_8080.txt").expanduser()
CAMERA = "/drone/front"
LIMIT = 120.0  # s, for each answer


def open_cockpit() -> ClientConnection:
    """Load the page, and connect to its WebSocket with the cookie that came with the page."""
    while not ADDRESS.is_file():
        time.sleep(0.05)
    cookies = CookieJar()
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(cookies))
    address = ADDRESS.read_text(encoding="utf-8").strip()
    opener.open(address, timeout=LIMIT).read()
    origin = address.partition("/?")[0]
    headers = {"Cookie": "; ".join(f"{cookie.name}={cookie.value}" for cookie in cookies)}
    url = origin.replace("http", "ws") + "/socket"
    return connect(url, origin=origin, subprotocols=["drone_sim"], additional_headers=headers, max_size=None)


def has_camera(message: dict) -> bool:
    """Return whether a message of the cockpit lists the camera."""
    return any(camera["topic"] == CAMERA for camera in message.get("panel", {}).get("cameras", []))


def describe(picture: bytes) -> str:
    """Return size and brightness of a JPEG, which tell a drawn picture from a black one."""
    pixels = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    return f"{pixels.shape[1]} x {pixels.shape[0]} pixels, from {pixels.min()} to {pixels.max()}"


def main() -> None:
    start = float(sys.argv[1])

    def report(what: str) -> None:
        print(f"start -> {what}: {time.time() - start:.1f} s", flush=True)

    socket = open_cockpit()
    report("the cockpit's page")
    socket.send(json.dumps({"ask": "panel"}))
    has_scene = False
    while True:
        message = socket.recv(timeout=LIMIT)
        if isinstance(message, str):
            if has_camera(json.loads(message)):
                socket.send(json.dumps({"ask": "camera", "topic": CAMERA, "on": True}))
            continue
        header, _, content = message.partition(b"\n")
        description = json.loads(header)
        if "picture" in description:
            report(f"the camera's picture ({describe(content)})")
            return
        if description["markers"] and not has_scene:
            has_scene = True
            report("the 3D scene")
        socket.send(json.dumps({"shown": "scene"}))


if __name__ == "__main__":
    main()
