"""Take the pictures of docs/tutorial.md and README.md with the drone's own cameras; needs neither ROS nor a display.

PYTHONPATH=src .venv/bin/python docs/take_pictures.py [FOLDER]
"""

import itertools
import sys
from pathlib import Path

import cv2
import numpy as np
from matplotlib import image

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.offline import hud
from drone_sim.offline.hud import HudState
from drone_sim.offline.pictures import to_color
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

DOCS = Path(__file__).resolve().parent
GATES = {"Red": (255, 140, 40), "Green": (60, 220, 255)}  # the colors of their masks
LEANING = (Twist(Vector3(2, 1.5, 0)), 0.45)  # m/s, s: the body leans forward and to the left


def main():
    """Take every picture."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    image.imsave(folder / "tutorial_scene.png", scene())
    image.imsave(folder / "tutorial_track_base.png", leaning({}))
    on_body = parameters.read_yaml(DOCS / "tutorial" / "track_on_body.yaml")
    image.imsave(folder / "tutorial_track_body.png", leaning(on_body))
    image.imsave(folder / "tutorial_7_camera.png", published())
    image.imsave(folder / "tutorial_8_gate.png", found())
    image.imsave(folder / "cameras.png", cameras())
    image.imsave(folder / "display.png", display())


def scene():
    """Return the drone at its starting place, from behind."""
    simulation = Simulation(parameters.load())
    fly(simulation, 1)
    return take(simulation, "track")


def leaning(overrides):
    """Return what the tracking camera sees when the drone sets off forward and to the left."""
    simulation = Simulation(parameters.load(overrides))
    command, seconds = LEANING
    simulation.drone.commands.receive(command)
    fly(simulation, seconds)
    return take(simulation, "track")


class Last:
    """A backend of one topic, the picture; it keeps the last one."""

    def subscribe(self, _topic, _kind, _take):
        """Hear nothing; return what ends that."""
        return lambda: None

    def advertise_image(self, _topic, _queue):
        """Return what takes the pictures."""
        return self

    def subscribers(self):
        """Return that there is one who listens."""
        return 1

    def publish(self, picture):
        """Keep a picture."""
        self.picture = picture

    def shutdown(self):
        """Keep the last one."""


def published():
    """Return the picture that the last stage of the tutorial publishes, among the posts of its scene."""
    values = parameters.load({"scene_file": str(DOCS / "tutorial" / "7_scene.yaml")})
    backend = Last()
    simulation = Simulation(values, script=str(DOCS / "tutorial" / "7_camera.py"), backend=backend)
    fly(simulation, 1)
    simulation.close()
    return backend.picture.pixels


def found():
    """Return what stage 8 of the tutorial sees, where there is red in it, and whose each pixel is, with boxes."""
    small = {"vehicles": {"drone": {"cameras": {"front": {"width": 320, "height": 240}}}}}
    simulation = Simulation(parameters.load({"scene_file": str(DOCS / "tutorial" / "8_scene.yaml"), **small}))
    fly(simulation, 0.5)
    camera = simulation.drone.cameras["front"]
    picture, truth = camera.take(), camera.truth()
    red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
    is_red = np.repeat(255 * np.uint8((red > 2 * green) & (red > 2 * blue))[:, :, None], 3, axis=2)
    masks = picture // 3
    for one in truth.seen():
        if one.identity.name in GATES:
            masks[truth.output("instance") == one.number] = GATES[one.identity.name]
            left, top, right, bottom = (round(float(edge)) for edge in one.visible)
            cv2.rectangle(masks, (left, top), (right, bottom), GATES[one.identity.name])
    simulation.close()
    return np.hstack([picture, is_red, masks])


def cameras():
    """Return what front, track and depth camera see at one moment, side by side; the farther, the darker."""
    simulation = Simulation(parameters.load({"scene_file": "package://drone_sim/config/scenes/gates.yaml"}))
    simulation.drone.commands.receive(Twist(Vector3(0.6, 0, 0)))
    fly(simulation, 1.5)
    simulation.drone.propulsion.blades.show()
    front, track, depth = (simulation.drone.cameras[name].take() for name in ("front", "track", "depth"))
    simulation.close()
    near = np.uint8(255 / (1 + np.nan_to_num(depth, nan=np.inf) / 2))
    return np.hstack([front, track, np.dstack([near] * 3)])


def display():
    """Return a picture of the video that `fly --video` makes: the tracking camera's, with the head-up display."""
    simulation = Simulation(parameters.load({"scene_file": "package://drone_sim/config/scenes/gates.yaml"}))
    simulation.drone.commands.receive(Twist(Vector3(1, 0.6, 0.2)))
    fly(simulation, 0.6)
    flight = HudState.of((simulation.time, *itertools.chain(*simulation.drone.body.state)), "flying")
    picture = to_color(take(simulation, "track"))
    hud.draw(picture, flight)
    return picture[:, :, ::-1]


def fly(simulation, seconds):
    """Run the steps of so many seconds."""
    for _ in range(round(seconds / simulation.parameters.time_step)):
        simulation.step()


def take(simulation, camera):
    """Return a camera's picture of now, and end the simulation."""
    simulation.drone.propulsion.blades.show()
    picture = simulation.drone.cameras[camera].take()
    simulation.close()
    return picture


if __name__ == "__main__":
    main()
