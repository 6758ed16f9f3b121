"""Examples of simVision, in the form of api_examples.py; the camera has two pixels, one above the other."""

from api_examples import ANY, Example, approx

WORK = "simVision.sensorImgToWorkImg(CAMERA)"


def _grey(at_least: float) -> Example:
    """Return an example whose value is the share of the work image's pixels with at least this brightness."""
    share = 1.0 if at_least < 0.5 else 0.0
    call = f"sim.unpackFloatTable(SECOND(simVision.binaryWorkImg(CAMERA, {at_least}, 0, 0)))"
    return Example(f"{call} [FIRST]", [share])


def _done(*more: Example) -> list[Example]:
    return [Example(WORK, []), Example("NAME(CAMERA)", []), *more]


VISION: dict[str, list[Example]] = {
    "sensorImgToWorkImg": [Example("NAME(CAMERA)", [])],
    "workImgToBuffer1": _done(),
    "workImgToBuffer2": _done(),
    "buffer1ToWorkImg": _done(),
    "buffer2ToWorkImg": _done(),
    "swapBuffers": _done(),
    "swapWorkImgWithBuffer1": _done(),
    "addBuffer1ToWorkImg": _done(),
    "addWorkImgToBuffer1": _done(),
    "subtractBuffer1FromWorkImg": _done(_grey(0.001)._replace(returns=[0.0])),
    "subtractWorkImgFromBuffer1": _done(),
    "multiplyWorkImgWithBuffer1": _done(),
    "horizontalFlipWorkImg": _done(),
    "verticalFlipWorkImg": _done(),
    "normalizeWorkImg": _done(),
    "workImgToSensorImg": _done(),
    "sensorDepthMapToWorkImg": [Example("NAME(DEPTH)", [])],
    "uniformImgToWorkImg": [Example("NAME(CAMERA, {0.4,0.4,0.4})", []), _grey(0.39)],
    "intensityScaleOnWorkImg": [Example("NAME(CAMERA, 0.6, 1, true)", []), _grey(0.45)],
    "selectiveColorOnWorkImg": [Example("NAME(CAMERA, {1,0,0}, {0.1,0.1,0.1}, true, true, false)", []), _grey(0.9)],
    "edgeDetectionOnWorkImg": [Example(WORK, []), Example("NAME(CAMERA, 0.9)", []), _grey(0.9)],
    "binaryWorkImg": [
        Example("simVision.uniformImgToWorkImg(CAMERA, {1,1,1})", []),
        Example("NAME(CAMERA, 0.5, 1, 0.1, 0.5, 1, 0.5, 1, 0, 4, 1, true)", [True, ANY]),
    ],
    "blobDetectionOnWorkImg": [
        Example("simVision.uniformImgToWorkImg(CAMERA, {1,1,1})", []),
        Example(
            "sim.unpackFloatTable(SECOND(NAME(CAMERA, 0.5, 0.1, false)))", [approx([1, 6, 1, 0, 0.5, 0.5, 0, 0.5])]
        ),
    ],
    "changedPixelsOnWorkImg": [Example(WORK, []), Example("NAME(CAMERA, 0.5)", [ANY, ANY])],
    "coordinatesFromWorkImg": [Example("REFUSED(NAME, CAMERA, {1,1}, true)", [ANY])],
}
