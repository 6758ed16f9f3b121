"""Videos: what a camera saw, with what the drone did written over it; read back with a decoder."""

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


def decoded(path):
    reader = cv2.VideoCapture(str(path))
    rate = reader.get(cv2.CAP_PROP_FPS)
    pictures = []
    while True:
        there, picture = reader.read()
        if not there:
            return pictures, rate
        pictures.append(picture)


def grey(height=240, width=320):
    return np.full((height, width, 3), 128, np.uint8)


def differences(first, second):
    """Return the mean difference of each row of two pictures."""
    return abs(first.astype(int) - second).mean(axis=(1, 2))


# ---- the flight's


def test_a_flight_is_filmed_as_its_camera_saw_it(tmp_path, new_simulation):
    out, commands = tmp_path / "out.mp4", tmp_path / "commands.yaml"
    commands.write_text("[{at: 0, twist: {linear: [1, 0, 0.5]}}]")
    flight = ["--commands", str(commands), "--duration", "1.0"]
    small = ["cameras.track.width=320", "cameras.track.height=240", "cameras.track.every=2"]
    assert main([*flight, "--set", *small, "--video", str(out), "--camera", "track"]) == 0
    pictures, rate = decoded(out)
    assert (len(pictures), rate, pictures[0].shape) == (10, 10.0, (240, 320, 3))
    with av.open(str(out)) as made:
        codec = made.streams.video[0].codec_context
        assert (codec.name, codec.pix_fmt) == ("h264", "yuv420p"), "what browsers play"
    assert not list(tmp_path.glob(".*"))

    simulation = new_simulation({"cameras": {"track": {"width": 320, "height": 240}}})
    simulation.drone.commands.receive(Twist(Vector3(1, 0, 0.5)))
    for _ in range(19):
        simulation.step()
    track = simulation.drone.cameras["track"]
    track.viewers.add(lambda: True)
    simulation.step()
    seen = cv2.cvtColor(track.image, cv2.COLOR_RGB2BGR)
    rows = differences(pictures[-1], seen)
    assert rows[20:150].mean() < 6  # but for what the codec leaves out
    assert min(rows[:15].mean(), rows[-15:].mean()) > 40  # the strips of the display


def test_filming_changes_nothing_in_the_flight(tmp_path):
    for name, more in (("a", []), ("b", ["--video", str(tmp_path / "b.mp4")])):
        assert main(["--duration", "0.5", "--csv", str(tmp_path / f"{name}.csv"), *more]) == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_a_flight_that_fails_leaves_its_film_and_one_that_cannot_begin_the_last_one(tmp_path, capsys):
    out, script = tmp_path / "out.mp4", tmp_path / "script.py"
    script.write_text("def sysCall_actuation():\n    if sim.getSimulationTime() > 0.49:\n        undefined\n")
    arguments = ["--video", str(out), "--camera", "floor"]
    assert main(["--script", str(script), *arguments]) == 1
    pictures, _ = decoded(out)
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
def test_any_size_can_be_played(tmp_path, shape, made):
    path = tmp_path / "out.mp4"
    with video.writing_to(str(path), 20) as writing:
        writing.add(grey(*shape), LEVEL, times=2)
    pictures, _ = decoded(path)
    assert [picture.shape for picture in pictures] == [(*made, 3)] * 2


def test_depth_is_grey_and_colours_are_what_they_are():
    assert to_color(np.array([[0.0, 3.0, np.nan]], np.float32))[0, :, 0].tolist() == [255, 127, 0]
    assert to_color(np.full((1, 1, 3), (1, 2, 3), np.uint8)).tolist() == [[[3, 2, 1]]]


def test_a_film_that_cannot_be_written_whole_is_told(tmp_path):
    path = tmp_path / "out.mp4"
    said = r"out\.mp4: only 0 of 3 pictures were written"
    with pytest.raises(OSError, match=said), video.writing_to(str(path), 20) as film:
        film.add(grey(), None, times=3)
        film._path = str(tmp_path / "elsewhere.mp4")
    assert not list(tmp_path.iterdir())


def test_one_that_is_interrupted_can_be_played_as_far_as_it_goes(tmp_path):
    path = tmp_path / "out.mp4"
    with pytest.raises(KeyboardInterrupt), video.writing_to(str(path), 20) as film:
        film.add(grey(), None, times=3)
        raise KeyboardInterrupt
    before = path.read_bytes()
    assert len(decoded(path)[0]) == 3
    with pytest.raises(OSError, match=r"out\.mp4: interrupted"), video.writing_to(str(path), 20):
        raise KeyboardInterrupt
    assert path.read_bytes() == before


# ---- the display


def test_the_display_leaves_the_middle_of_the_picture_alone():
    shown = grey()
    hud.draw(shown, LEVEL)
    changed = (shown != grey()).any(axis=2)
    assert min(changed[:15].mean(), changed[-15:].mean()) > 0.95  # a letter's edge may have the picture's own colour
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
def test_the_horizon_turns_and_climbs(roll, pitch, sky, ground):
    shown = grey(480, 640)
    hud.draw(shown, LEVEL._replace(roll=roll, pitch=pitch))
    dial = hud.dial(shown)
    middle = len(dial) // 2
    near, far = middle // 2, len(dial) - middle // 2
    beside = middle + 6  # the wings
    places = {"up": (near, middle), "down": (far, middle), "left": (beside, near), "right": (beside, far)}
    assert [dial[places[name]].tolist() for name in sky.split()] == [SKY] * len(sky.split())
    assert [dial[places[name]].tolist() for name in ground.split()] == [GROUND] * len(ground.split())


def test_it_shows_what_a_row_of_a_recording_says():
    half = math.sqrt(0.5)
    row = (2.5, 1, 2, 3, 0, 0, half, half, 3, 4, 0, 0, 0, 0)
    shown = hud.HudState.of(row, "flying")
    assert shown[:4] == (2.5, "flying", 3, 5)
    assert shown[4:] == pytest.approx((0, 0, math.pi / 2))
