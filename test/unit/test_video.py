"""Videos of a flight: the pictures of a camera with an overlay of the drone's state, read with a decoder."""

import math

import av
import cv2
import numpy as np
import pytest

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.offline import hud, video
from drone_sim.offline.fly import main
from drone_sim.offline.pictures import to_color

LEVEL = hud.HudState(time=1.0, state="flying", height=0.8, speed=0.0, roll=0.0, pitch=0.0, yaw=0.0)
SKY, GROUND = [200, 130, 60], [50, 90, 130]  # BGR


def read_video(path):
    reader = cv2.VideoCapture(str(path))
    rate = reader.get(cv2.CAP_PROP_FPS)
    pictures = []
    while True:
        has_picture, picture = reader.read()
        if not has_picture:
            return pictures, rate
        pictures.append(picture)


def grey(height=240, width=320):
    return np.full((height, width, 3), 128, np.uint8)


def differences(first, second):
    """Return the mean difference of each row of two pictures."""
    return abs(first.astype(int) - second).mean(axis=(1, 2))


# ---- video of a flight


def test_video_shows_the_pictures_of_the_camera(tmp_path, new_simulation):
    out, commands = tmp_path / "out.mp4", tmp_path / "commands.yaml"
    commands.write_text("[{at: 0, twist: {linear: [1, 0, 0.5]}}]")
    flight = ["--commands", str(commands), "--duration", "1.0"]
    small = ["cameras.track.width=320", "cameras.track.height=240", "cameras.track.every=2"]
    assert main([*flight, "--set", *small, "--video", str(out), "--camera", "track"]) == 0
    pictures, rate = read_video(out)
    assert (len(pictures), rate, pictures[0].shape) == (10, 10.0, (240, 320, 3))
    with av.open(str(out)) as made:
        codec = made.streams.video[0].codec_context
        assert (codec.name, codec.pix_fmt) == ("h264", "yuv420p"), "the format that browsers play"
    assert not list(tmp_path.glob(".*"))

    simulation = new_simulation({"cameras": {"track": {"width": 320, "height": 240}}})
    simulation.drone.commands.receive(Twist(Vector3(1, 0, 0.5)))
    for _ in range(19):
        simulation.step()
    track = simulation.drone.cameras["track"]
    track.viewers.add(lambda: True)
    simulation.step()
    last_picture = cv2.cvtColor(track.image, cv2.COLOR_RGB2BGR)
    rows = differences(pictures[-1], last_picture)
    assert rows[20:150].mean() < 6  # except for the losses of the codec
    assert min(rows[:15].mean(), rows[-15:].mean()) > 40  # the strips of the display


def test_recording_a_video_does_not_change_the_flight(tmp_path):
    for name, more in (("a", []), ("b", ["--video", str(tmp_path / "b.mp4")])):
        assert main(["--duration", "0.5", "--csv", str(tmp_path / f"{name}.csv"), *more]) == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_failed_flight_leaves_its_video_and_failed_start_keeps_the_previous_one(tmp_path, capsys):
    out, script = tmp_path / "out.mp4", tmp_path / "script.py"
    script.write_text("def sysCall_actuation():\n    if sim.getSimulationTime() > 0.49:\n        undefined\n")
    arguments = ["--video", str(out), "--camera", "floor"]
    assert main(["--script", str(script), *arguments]) == 1
    pictures, _ = read_video(out)
    assert (len(pictures), pictures[0].shape) == (10, (256, 256, 3))
    assert "wrote" in capsys.readouterr().out
    before = out.read_bytes()
    for wrong in (["--script", "nowhere.py"], ["--duration", "0"]):
        assert main([*wrong, *arguments]) == 1
        assert out.read_bytes() == before
    assert "no picture was received" in capsys.readouterr().err


# ---- pictures of any kind


@pytest.mark.parametrize(
    ("shape", "made"),
    [((1, 1), (240, 240)), ((100, 161), (300, 484)), ((479, 641), (480, 642)), ((1, 4096), (240, 4096))],
)
def test_video_of_any_picture_size_can_be_played(tmp_path, shape, made):
    path = tmp_path / "out.mp4"
    with video.writing_to(str(path), 20) as writing:
        writing.add(grey(*shape), LEVEL, times=2)
    pictures, _ = read_video(path)
    assert [picture.shape for picture in pictures] == [(*made, 3)] * 2


def test_depth_becomes_grey_and_colours_are_unchanged():
    assert to_color(np.array([[0.0, 3.0, np.nan]], np.float32))[0, :, 0].tolist() == [255, 127, 0]
    assert to_color(np.full((1, 1, 3), (1, 2, 3), np.uint8)).tolist() == [[[3, 2, 1]]]


def test_incomplete_video_is_reported_and_removed(tmp_path):
    path = tmp_path / "out.mp4"
    error_pattern = r"out\.mp4: only 0 of 3 pictures were written"
    with pytest.raises(OSError, match=error_pattern), video.writing_to(str(path), 20) as film:
        film.add(grey(), None, times=3)
        film._path = str(tmp_path / "elsewhere.mp4")
    assert not list(tmp_path.iterdir())


def test_interrupted_video_can_be_played(tmp_path):
    path = tmp_path / "out.mp4"
    with pytest.raises(KeyboardInterrupt), video.writing_to(str(path), 20) as film:
        film.add(grey(), None, times=3)
        raise KeyboardInterrupt
    before = path.read_bytes()
    assert len(read_video(path)[0]) == 3
    with pytest.raises(OSError, match=r"out\.mp4: interrupted"), video.writing_to(str(path), 20):
        raise KeyboardInterrupt
    assert path.read_bytes() == before


# ---- the display


def test_overlay_does_not_cover_the_middle_of_the_picture():
    shown = grey()
    hud.draw(shown, LEVEL)
    changed = (shown != grey()).any(axis=2)
    assert min(changed[:15].mean(), changed[-15:].mean()) > 0.95  # a letter's edge may have the colour of the picture
    assert not changed[20:160].any()
    assert (shown[:15] > 150).any(), "there is text"


@pytest.mark.parametrize(
    ("roll", "pitch", "sky", "ground"),
    [
        (0.0, 0.0, "up", "down"),
        (math.pi, 0.0, "down", "up"),
        (math.pi / 2, 0.0, "left", "right"),  # right side down: the ground is seen to the right
        (0.0, 1.5, "", "up down left right"),  # straight down
        (0.0, -1.5, "up down left right", ""),
    ],
)
def test_artificial_horizon_shows_roll_and_pitch(roll, pitch, sky, ground):
    shown = grey(480, 640)
    hud.draw(shown, LEVEL._replace(roll=roll, pitch=pitch))
    dial = hud.dial(shown)
    middle = len(dial) // 2
    near, far = middle // 2, len(dial) - middle // 2
    beside = middle + 6  # the wings
    places = {"up": (near, middle), "down": (far, middle), "left": (beside, near), "right": (beside, far)}
    assert [dial[places[name]].tolist() for name in sky.split()] == [SKY] * len(sky.split())
    assert [dial[places[name]].tolist() for name in ground.split()] == [GROUND] * len(ground.split())


def test_overlay_shows_the_values_of_a_recorded_row():
    half = math.sqrt(0.5)
    row = (2.5, 1, 2, 3, 0, 0, half, half, 3, 4, 0, 0, 0, 0)
    shown = hud.HudState.of(row, "flying")
    assert shown[:4] == (2.5, "flying", 3, 5)
    assert shown[4:] == pytest.approx((0, 0, math.pi / 2))
