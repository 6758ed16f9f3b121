"""Draw the line of tasks/line and the tags of tasks/pad: .venv/bin/python docs/make_textures.py"""

from pathlib import Path

import cv2
import numpy as np

TASKS = Path(__file__).resolve().parents[1] / "tasks"
SHEET, PER_METRE = (8.0, 6.0), 64  # m; px
WIDTH = 0.08  # m, of the line
LINE = [(-3, -2), (0, -2), (1.5, -1.5), (2, 0), (1.2, 1.2), (0, 1.2), (-1, 1.6), (-2, 2.2), (-3, 2.2)]  # m
TAGS, TAG_SIDE = (7, 23), 80  # px; of 6 x 6 cells, a frame of one and a margin of one around that


def main():
    """Write every texture."""
    write("line/line.png", line())
    for tag in TAGS:
        write(f"pad/tag_{tag}.png", marker(tag))


def write(name, picture):
    """Write a PNG file, as small as it goes."""
    cv2.imwrite(str(TASKS / name), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_BILEVEL, 1])


def line():
    """Return the sheet with the line, seen from above: x to the right, y up."""
    width, height = (round(side * PER_METRE) for side in SHEET)
    sheet = np.full((height, width), 255, np.uint8)
    pixels = [(round(width / 2 + x * PER_METRE), round(height / 2 - y * PER_METRE)) for x, y in LINE]
    cv2.polylines(sheet, [np.array(pixels)], False, 0, round(WIDTH * PER_METRE))
    return sheet


def marker(tag):
    """Return an ArUco tag of the dictionary 4x4_50 on white paper."""
    cells = 8
    side = TAG_SIDE // cells * (cells - 2)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    drawn = cv2.aruco.generateImageMarker(dictionary, tag, side)
    return cv2.copyMakeBorder(drawn, *[TAG_SIDE // cells] * 4, cv2.BORDER_CONSTANT, value=255)


if __name__ == "__main__":
    main()
