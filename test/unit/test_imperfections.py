"""Camera imperfections against their formulas; equal flights give equal images."""

import math

import numpy as np
import pytest
from drawing import AHEAD, CAMERA, at, box

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.render.light import decoded, encoded
from drone_sim.render.shutter import Shutter, moved
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.imperfections.exposure import ExposureControl, ExposureParameters
from drone_sim.sensors.imperfections.imperfection import Shot
from drone_sim.sensors.imperfections.noise import PixelNoiseParameters
from drone_sim.sensors.imperfections.vignette import VignetteParameters
from drone_sim.sensors.vision import Vision

WHITE, BLACK = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0)
STILL = np.zeros(6)
ALL = {
    "shutter": {"readout": 0.02},
    "vignette": {"power": 4.0},
    "exposure": {"time": 0.01, "gain": 6.0, "automatic": True},
    "noise": {"full_well": 5000.0, "read": 5.0, "seed": 3},
}


class MovingBoard:
    """Scene of a white wall at 5 m and a black board in front of it that moves to the right."""

    changes = 1

    def __init__(self, velocity):
        self.velocity = velocity  # m/s

    def visuals(self):
        return [box("wall", (0.1, 20.0, 20.0), WHITE), box("board", (0.1, 8.0, 8.0), BLACK)]

    def visual_poses(self):
        return np.array([at(5, 0, 1), at(4.05, 4.0, 1)])

    def visual_velocities(self):
        return np.array([STILL, [0, -self.velocity, 0, 0, 0, 0]])


def edges(light):
    """Return the column (px) of the board's right edge in each row. It starts in the middle; its front is at 4 m."""
    return np.sum(1 - light.mean(axis=-1) / light[0, -1].mean(), axis=1) - 0.5


def render(subject, shutter, velocity=STILL):
    vision = Vision()
    vision.look_at(subject, [])
    light = vision.light(CAMERA, AHEAD, velocity, shutter)
    vision.close()
    return light


@pytest.mark.parametrize("who", ["board", "camera"])
def test_a_rolling_shutter_shears_by_speed_times_readout(who):
    speed, readout = 100.0, 0.2  # px/s, s
    sideways = speed * 4.0 / CAMERA.fx  # m/s
    board, camera = (sideways, 0.0) if who == "board" else (0.0, sideways)
    places = edges(render(MovingBoard(board), Shutter(0.0, readout), np.array([0, camera, 0, 0, 0, 0])))
    rows = np.arange(CAMERA.height) - CAMERA.cy
    slope, middle = np.polyfit(rows, places, 1)
    assert slope * CAMERA.height == pytest.approx(speed * readout, rel=0.02)
    assert middle == pytest.approx(CAMERA.cx, abs=0.6)
    assert np.abs(places - np.polyval((slope, middle), rows)).max() < 0.75


def test_motion_blurs_by_speed_times_exposure():
    speed, exposure = 1000.0, 0.04
    light = render(MovingBoard(speed * 4.0 / CAMERA.fx), Shutter(exposure, 0.0))[120].mean(axis=-1)
    light = light / light[-1]
    expected_light = (np.arange(CAMERA.width) - CAMERA.cx) / (speed * exposure) + 0.5
    assert np.abs(light - np.clip(expected_light, 0, 1)).max() < 0.06


def test_decoding_and_encoding_light_restores_every_pixel_value():
    values = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
    np.testing.assert_array_equal(encoded(decoded(values)), values)
    assert decoded(values)[11, 12, 0] == pytest.approx(0.5, abs=0.003)  # pixel value 188 is half of the light


def shot(exposure=0.01, gain=1.0):
    return Shot(
        CAMERA, exposure, gain, lambda _seed: np.random.default_rng(7).standard_normal((300, 300, 3), np.float32)
    )


def test_noise_variance_follows_the_photon_transfer_curve():
    """By EMVA 1288, the variance in electrons is the mean plus the variance of the read noise."""
    noise, gain = PixelNoiseParameters(full_well=2000.0, read=12.0), 2.0
    for electrons in (50.0, 400.0, 1000.0):
        light = np.full((300, 300, 3), gain * electrons / noise.full_well, np.float32)
        measured = noise.apply(light, shot(gain=gain)) * noise.full_well / gain
        assert measured.mean() == pytest.approx(electrons, rel=0.01)
        assert measured.var() == pytest.approx(electrons + noise.read**2, rel=0.02)
    full = noise.apply(np.full((300, 300, 3), 10.0, np.float32), shot(gain=gain))
    assert full.mean() == pytest.approx(gain, rel=0.01), "saturated at the full well"


def test_noise_in_the_dark_is_clipped_at_black():
    noise = PixelNoiseParameters(full_well=2000.0, read=math.sqrt(141.0))
    mean, deviation = 3.0 / 2000, 12.0 / 2000  # 3 electrons, with a variance of 3 + 141
    light = noise.apply(np.full((300, 300, 3), mean, np.float32), shot())
    assert (light.mean(), light.std()) == pytest.approx((mean, deviation), rel=0.02)
    seen = decoded(encoded(light))
    density = math.exp(-((mean / deviation) ** 2) / 2) / math.sqrt(2 * math.pi)
    share = (1 + math.erf(mean / deviation / math.sqrt(2))) / 2
    cut_mean = mean * share + deviation * density
    cut_variance = (mean**2 + deviation**2) * share + mean * deviation * density - cut_mean**2
    assert (cut_mean, math.sqrt(cut_variance)) == pytest.approx((0.0032, 0.0040), abs=5e-5)
    assert (seen.mean(), seen.std()) == pytest.approx((cut_mean, math.sqrt(cut_variance)), rel=0.01)


def test_the_vignette_follows_the_cosine_fourth_power_law():
    light = VignetteParameters(power=4.0).apply(np.ones((CAMERA.height, CAMERA.width, 3), np.float32), shot())
    tangent = np.hypot(CAMERA.cx, CAMERA.cy) / CAMERA.fx
    assert light[0, 0] == pytest.approx(math.cos(math.atan(tangent)) ** 4, rel=1e-5)
    assert light[120, 160] == pytest.approx(1.0, abs=1e-4)


def test_exposure_time_and_gain_scale_the_light():
    own = ExposureParameters(time=0.005, gain=20.0)
    assert own.settings(own.most) == pytest.approx((0.005, 10.0))
    light = own.apply(np.full((2, 2, 3), 0.1, np.float32), shot(*own.settings(own.most)))
    assert light == pytest.approx(0.1 * 0.5 * 10.0)


def test_automatic_exposure_settles_with_its_time_constant_within_its_limits():
    own, control = ExposureParameters(time=0.02, gain=12.0, automatic=True, settling=0.5), ExposureControl()
    control.meter(np.full((4, 4, 3), 0.18, np.float32), None, 0.0)
    assert own.settings(control.brightness(own, 0.0)) == pytest.approx((0.01, 1.0))
    dark = np.full((4, 4, 3), 0.06, np.float32)
    control.meter(dark, 1.0, 1.0)
    assert control.brightness(own, 1.0) == pytest.approx(1.0), "the first dark image is still exposed as before"
    assert math.log(3 / control.brightness(own, 1.5)) == pytest.approx(math.log(3) / math.e)
    control.meter(dark, control.brightness(own, 1.5), 1.5)
    assert own.settings(control.brightness(own, 60.0)) == pytest.approx((0.02, 1.5))
    control.meter(dark / 1000, 3.0, 60.0)
    assert control.brightness(own, 120.0) == pytest.approx(2 * 10**0.6), "limited by exposure time and gain"


def fly(front, steps=6, first=0):
    """Return the images of a flight with a viewer from step `first` on, and the image after a restored snapshot."""
    simulation = Simulation(parameters.load({"cameras": {"front": {"width": 80, "height": 60, **front}}}))
    camera = simulation.drone.cameras["front"]
    camera.viewers.add(lambda: len(pictures) >= first)
    simulation.drone.commands.receive(Twist(Vector3(1.0, 0.0, 0.0), Vector3(0.0, 0.0, 2.0)))
    pictures = []
    for step in range(steps):
        simulation.step()
        pictures.append(camera.image)
        if step == 2:
            snapshot = simulation.snapshot()
    simulation.restore(snapshot)
    simulation.step()
    again = camera.image
    simulation.close()
    return pictures, again


def test_equal_flights_and_restored_snapshots_give_identical_images():
    first, again = fly(ALL)
    second, _ = fly(ALL)
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(again, first[3])
    other, _ = fly({**ALL, "noise": {**ALL["noise"], "seed": 4}})
    assert all((one != two).mean() > 0.3 for one, two in zip(first, other))


def test_automatic_exposure_does_not_depend_on_the_first_requested_image():
    always, _ = fly(ALL)
    late, _ = fly(ALL, first=4)
    assert late[:4] == [None] * 4
    np.testing.assert_array_equal(late[4:], always[4:])
    steady = {**ALL, "exposure": {**ALL["exposure"], "automatic": False}}
    assert (decoded(fly(steady)[0][5]).mean() / decoded(always[5]).mean()) > 1.5, "automatic exposure darkens the scene"


def test_the_motion_blur_of_blades_matches_their_visible_rotation(new_simulation):
    simulation = new_simulation({})
    drone, shutter = simulation.drone, Shutter(0.03, 0.0)
    track = drone.cameras["track"]
    for _ in range(10):
        simulation.step()

    def light(exposed):
        pose = np.reshape((*track.pose(), 0, 0, 0, 1), (4, 4))
        return simulation.vision.light(track.intrinsics, pose, STILL, exposed)

    def count_blurred_pixels():
        return (np.abs(light(shutter) - light(Shutter(0.0, 0.0))) > 0.02).any(axis=-1).sum()

    assert count_blurred_pixels() > 20
    pictures, time_step = simulation.world.pictures, simulation.parameters.time_step
    before, velocities = pictures.visual_poses(), pictures.visual_velocities()
    simulation.step()
    light(shutter)  # the blades turn only when an image is rendered
    turned, expected = pictures.visual_poses()[:, :3, :3], moved(before, velocities, time_step)[:, :3, :3]
    assert np.abs(turned - before[:, :3, :3]).max() > 0.1
    np.testing.assert_allclose(turned, expected, atol=0.01)
    for number in range(1, 5):
        drone.propulsion.blades.turn(f"Quadricopter_propeller_joint{number}", 0.3)
    assert count_blurred_pixels() == 0


def test_camera_imperfections_can_be_tuned_and_combined_with_faults(new_simulation):
    simulation = new_simulation({"cameras": {"front": {"width": 80, "height": 60}}})
    camera, tuning = simulation.drone.cameras["front"], simulation.child_scripts["drone"].tuning
    perfect = camera.take()
    tuning.change({"cameras/front/exposure/time": 0.0025, "cameras/front/noise/full_well": 1e6})
    dark = decoded(camera.take()).mean() / decoded(perfect).mean()
    assert dark == pytest.approx(0.25, rel=0.02)
    tuning.change({"cameras/front/exposure/time": 0.0, "cameras/front/noise/full_well": 0.0})
    np.testing.assert_array_equal(camera.take(), perfect)
    tuning.change({"cameras/front/noise/full_well": 1e4})
    with pytest.raises(ParameterError, match="cameras/front/noise/read = 3: needs `full_well`"):
        tuning.change({"cameras/front/noise/full_well": 0.0, "cameras/front/noise/read": 3.0})
    frozen_image = camera.look()
    simulation.drone.change_faults({"sensors": {"front": "frozen"}})
    simulation.step()
    np.testing.assert_array_equal(camera.look(), frozen_image)
    simulation.drone.change_faults({"sensors": {"front": "ok"}})
    assert not np.array_equal(camera.look(), frozen_image), "noise differs at another time"
    simulation.drone.change_faults({"sensors": {"front": "silent"}})
    assert not camera.look().any()


@pytest.mark.parametrize(
    ("front", "said"),
    [
        ({"noise": {"read": 3}}, "cameras/front/noise/read = 3: needs `full_well`"),
        ({"exposure": {"automatic": True}}, "exposure/automatic = true: needs time"),
        (
            {"kind": "depth", "shutter": {"readout": 0.01}},
            "cameras/front/shutter: is allowed only for cameras of kind color",
        ),
    ],
)
def test_invalid_imperfections_are_refused(front, said):
    with pytest.raises(ParameterError, match=said):
        parameters.load({"cameras": {"front": front}})
