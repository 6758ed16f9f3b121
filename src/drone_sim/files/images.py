"""Image files for textures. The size is checked in the header, before the image is decoded."""

from __future__ import annotations

import io
import warnings

import cv2
import numpy as np
from PIL import Image

from drone_sim.files.resources import MEBIBYTE, FileCache, ReadFile, read_bytes

MAX_SIZE = 32 * MEBIBYTE  # bytes of a file
MAX_SIDE = 4096  # px
FORMATS = ("BMP", "JPEG", "PNG", "PPM", "TIFF", "WEBP")


def read(path: str) -> np.ndarray:
    """Return an 8-bit image (h, w, 3 or 4), RGB or RGBA, top row first. The array is read-only.

    Raises ValueError, in one line with the file's name.
    """
    return _CACHE.get(path)


def check(content: bytes) -> None:
    """Raise ValueError, in one line without a file name, if the header says that an image is too large."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            with Image.open(io.BytesIO(content), formats=FORMATS) as image:
                width, height = image.size
        except Image.DecompressionBombError:
            raise ValueError(f"too large: at most {MAX_SIDE} x {MAX_SIDE} px are allowed") from None
    if width > MAX_SIDE or height > MAX_SIDE:
        raise ValueError(f"{width} x {height} px: at most {MAX_SIDE} x {MAX_SIDE} px are allowed")


def png(image: np.ndarray) -> bytes:
    """Return the PNG file of an 8-bit image (h, w, 3 or 4), top row first."""
    content = io.BytesIO()
    Image.fromarray(image).save(content, "PNG")
    return content.getvalue()


def _read(path: str) -> ReadFile:
    try:
        content = read_bytes(path, MAX_SIZE)
        check(content)
    except Image.UnidentifiedImageError:
        raise ValueError(f"texture {path}: cannot be read as an 8-bit image ({', '.join(FORMATS)})") from None
    except OSError as error:
        raise ValueError(f"texture {path}: cannot be read ({error.strerror or error})") from None
    except Exception as error:  # for a broken header, PIL's readers raise exceptions of any type
        raise ValueError(f"texture {path}: {' '.join(str(error).split()):.200}") from None
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint8:
        raise ValueError(f"texture {path}: cannot be read as an 8-bit image")
    if max(image.shape[:2]) > MAX_SIDE:
        raise ValueError(f"texture {path}: at most {MAX_SIDE} x {MAX_SIDE} px are allowed")
    if image.ndim == 2:
        image = cv2.cvtColor(image, cv2.COLOR_GRAY2RGB)
    else:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGB)
    image.setflags(write=False)
    return ReadFile(image, image.nbytes)


_CACHE: FileCache[np.ndarray] = FileCache(_read, 256 * MEBIBYTE)
