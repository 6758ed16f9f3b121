"""Films the cockpit, in chromium: docs/film_cockpit.py OUT.webp. A script is edited and flown, the drone is dragged.

The simulation goes slower than real time, so that a browser without a GPU draws every step of it. Three minutes.
"""

import shutil
import sys
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from PIL import Image, ImageDraw
from playwright.sync_api import Error, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "web"))
from cockpit_page import ready
from launched import launched

SIZE = {"width": 1120, "height": 660}  # px of the page
WIDTH = 800  # px of the film
STEP = 0.05  # s, of the simulation and of the film
SLOWER = 0.08  # real-time factor
SHOWN = 120  # ms after which a step has come to the page
PATIENCE = 60_000  # ms
STANDS = 1500  # ms, the last picture
QUALITY = 55  # of WebP
SCRIPT, OLD, NEW = "tutorial/6_ros.py", "sim.getObjectPosition(self.d, -1)[2]", "1.4"  # m: climb to that
BLUE = (32, 128, 255)  # of the handle's arrow upwards
POINTER = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]  # px
HELD = """([key, on]) => document.querySelectorAll("kbd").forEach((one) => {
  if (one.textContent.trim() === key) one.style.cssText = on ? "background: #e8590c; color: #fff" : "";
})"""


def main(path: str) -> None:
    """Film it."""
    scene = "scene:=" + str(Path(__file__).resolve().parents[1] / "config/scenes/gates.yaml")
    with launched(scene, f"real_time_factor:={SLOWER}") as cockpit, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"))
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(PATIENCE)
        page.goto(cockpit.address)
        ready(page)
        film = Film(page)
        for act in (open_script, edit, run, drag, switch_camera, fly):
            act(film)
        browser.close()
    film.save(Path(path))


class Film:
    """A page with a pointer that can be seen, and its pictures."""

    def __init__(self, page):
        """Film from the next picture on."""
        self.page, self.pictures = page, []
        self.scene = page.frame_locator("#scene")
        self.at = np.array([SIZE["width"] * 0.3, SIZE["height"] * 0.6])
        self.steps = 0
        rospy.init_node("film", anonymous=True, disable_signals=True)
        rospy.Subscriber("/drone/odom", Odometry, self._on_step, queue_size=1)

    def _on_step(self, _message):
        self.steps += 1

    def look(self):
        """Return what the page looks like now."""
        return Image.open(BytesIO(self.page.screenshot(type="jpeg", quality=95))).convert("RGB")

    def take(self, count=1, fly=False):
        """Take pictures; one for every step of the simulation, where it is to fly."""
        for _ in range(count):
            before, until = self.steps, time.monotonic() + 4 * STEP / SLOWER
            while fly and self.steps == before and time.monotonic() < until:
                self.page.wait_for_timeout(10)
            self.page.wait_for_timeout(SHOWN if fly else 1)
            picture = self.look()
            ImageDraw.Draw(picture).polygon([tuple(self.at + one) for one in POINTER], fill="white", outline="black")
            self.pictures.append(picture.resize((WIDTH, WIDTH * picture.height // picture.width), Image.LANCZOS))

    def move(self, to, count, fly=False):
        """Move the pointer to a place in so many pictures."""
        begin = self.at
        for part in np.arange(1, count + 1) / count:
            self.at = begin + (np.array(to) - begin) * (3 - 2 * part) * part**2
            self.page.mouse.move(*self.at)
            self.take(fly=fly)

    def click(self, element, count=8):
        """Move to an element, and click."""
        box = element.bounding_box(timeout=5000)
        self.move((box["x"] + min(box["width"], 80) / 2, box["y"] + box["height"] / 2), count)
        self.page.mouse.click(*self.at)
        self.take()

    def hold(self, key, count):
        """Fly with a key held."""
        self.page.keyboard.down(key.lower())
        self.page.evaluate(HELD, [key, True])
        self.take(count, fly=True)
        self.page.keyboard.up(key.lower())
        self.page.evaluate(HELD, [key, False])

    def save(self, path):
        """Write all pictures."""
        times = [round(1000 * STEP)] * (len(self.pictures) - 1) + [STANDS]
        first, *others = self.pictures
        first.save(path, save_all=True, append_images=others, duration=times, loop=0, quality=QUALITY, method=4)
        print(f"{path}: {len(self.pictures)} pictures, {path.stat().st_size / 1000:.0f} kB")


def open_script(film):
    """Have the script in the editor, and nothing before the scene, when the film begins."""
    page = film.page
    page.select_option("#script", SCRIPT)
    page.wait_for_function("text => document.querySelector('.cm-content').innerText.includes(text)", arg=OLD)
    for note in film.scene.locator("[class*=Notification-closeButton]").all():
        note.click()
    while not film.steps:
        page.wait_for_timeout(100)


def edit(film):
    """Change the height that is held."""
    keyboard = film.page.keyboard
    line = film.page.locator(".cm-line", has_text=OLD)
    film.take(6)
    film.click(line)
    keyboard.press("End")
    keyboard.press("Home")  # to the first letter, from wherever behind it
    for _ in range(line.inner_text().strip().index(OLD)):
        keyboard.press("ArrowRight")
    for _ in range(len(OLD)):
        keyboard.press("Shift+ArrowRight")
    film.take(4)
    for letter in NEW:
        keyboard.type(letter)
        film.take(4)


def run(film):
    """Fly the script."""
    film.click(film.page.locator("#run"))
    film.page.wait_for_function("document.querySelector('#said').textContent.includes('started')")
    film.take(35, fly=True)


def drag(film):
    """Pull the drone up by its arrow, and sideways by nothing: it flies on."""
    arrow = tip(film)
    if arrow is None:
        print("the handle's arrow is not seen: nothing is dragged")
        return
    film.move(arrow, 8, fly=True)
    arrow = tip(film)
    film.at = np.array(arrow)
    film.page.mouse.move(*arrow)
    film.page.mouse.down()
    film.move(film.at - (0, 90), 14, fly=True)
    film.page.mouse.up()
    film.take(16, fly=True)


def tip(film):
    """Return where the blue arrow of the drone's handle is in the page, None where it is not seen."""
    box = film.page.locator("#scene").bounding_box()
    colors = np.asarray(film.look(), dtype=int)
    y, x = np.nonzero(np.abs(colors - BLUE).max(axis=2) < 30)
    inside = (x > box["x"]) & (x < box["x"] + box["width"] / 2) & (y > box["y"] + box["height"] / 4)
    if inside.sum() < 10:
        return None
    x, y = x[inside], y[inside]
    top = y < y.min() + 8
    return float(x[top].mean()), float(y[top].mean())


def switch_camera(film):
    """Look through the front camera."""
    try:
        film.click(film.scene.get_by_role("tab", name="Cameras"))
        film.click(film.scene.get_by_label("drone/front"))
    except Error as error:
        print(f"the camera is not switched on: {str(error).splitlines()[0]}")
    film.take(6, fly=True)


def fly(film):
    """Fly through the gate."""
    film.hold("W", 34)
    film.hold("Q", 12)
    film.hold("W", 20)
    film.take(6, fly=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
