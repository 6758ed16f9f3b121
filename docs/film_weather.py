"""Film what docs/weather.md says of a propeller that stops at hover: an animated GIF; needs neither ROS nor a display.

PYTHONPATH=src .venv/bin/python docs/film_weather.py [FOLDER]
"""

import itertools
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from drone_sim.mechanics import frames
from drone_sim.offline import hud
from drone_sim.offline.hud import HudState
from drone_sim.offline.pictures import to_color
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

DOCS = Path(__file__).resolve().parent
STEP, SLOWER = 0.05, 2.5  # s; so many times as slow as it was
FIRST, STOPS, LAST = 0.75, 1.0, 2.2  # s
START = (0.0, 0.0, 1.5)  # m
EYE, AIM = (-1.5, -1.1, 1.0), (0.15, 0.15, 0.86)  # m: where the camera is, and what is in the middle of its picture
SIZE = (400, 460)  # px
COLOURS, UNCHANGED = 160, np.uint8(255)
STANDS = 2000  # ms, the last picture


def main():
    """Film it."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    pictures = [Image.fromarray(one) for one in filmed()]
    # One palette, and no dithering, so that what stands still is the same in all pictures.
    palette = pictures[len(pictures) // 2].quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    first, *others = changes([one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures])
    times = [round(1000 * STEP * SLOWER)] * len(others) + [STANDS]
    path = folder / "weather_propeller.gif"
    kept = {"transparency": int(UNCHANGED), "disposal": 1, "optimize": False}
    first.save(path, save_all=True, append_images=others, duration=times, loop=0, **kept)
    print(f"{path}: {len(pictures)} pictures, {path.stat().st_size / 1000:.0f} kB")


def changes(pictures):
    """Yield the first of several pictures with one palette, then of each what is not as in the one before."""
    before = None
    for picture in pictures:
        colours = np.array(picture)
        shown = picture if before is None else Image.fromarray(np.where(colours == before, UNCHANGED, colours))
        shown.putpalette(picture.getpalette())
        yield shown
        before = colours


def filmed():
    """Yield the pictures, RGB, with the head-up display."""
    width, height = SIZE
    look = {"width": width, "height": height, "fov": 0.95, "position": EYE, "rpy": looking(EYE, AIM)}
    scene = {"objects": [{"name": "Eye", "kind": "vision_sensor", **look}]}
    simulation = Simulation(parameters.load({"scene": scene, "drone": {"position": START}}))
    drone, (eye,) = simulation.drone, simulation.scene.objects.values()
    for step in range(1, round(LAST / STEP) + 1):
        simulation.step()
        if step == round(STOPS / STEP):
            drone.change_faults({"propellers": [0, 1, 1, 1]})
        if step >= round(FIRST / STEP):
            drone.propulsion.blades.show()
            yield shown(eye, simulation)
    simulation.close()


def shown(eye, simulation):
    """Return what the camera sees, RGB, with what the drone does written over it."""
    drone = simulation.drone
    state = str(drone.flight_state)
    if simulation.time > STOPS and state == "flying":
        state = "front left stopped"
    picture = to_color(eye.picture("color"))
    hud.draw(picture, HudState.of((simulation.time, *itertools.chain(*drone.body.state)), state))
    return picture[:, :, ::-1]


def looking(eye, aim):
    """Return roll, pitch and yaw (rad) of a vision sensor, z ahead and y up, that looks from one place at another."""
    ahead = np.subtract(aim, eye) / np.linalg.norm(np.subtract(aim, eye))
    left = np.cross((0, 0, 1), ahead) / np.linalg.norm(np.cross((0, 0, 1), ahead))
    rotation = np.column_stack([left, np.cross(ahead, left), ahead])
    return frames.to_rpy(tuple(np.column_stack([rotation, (0, 0, 0)]).ravel().tolist()))


if __name__ == "__main__":
    main()
