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
from cockpit_page import PROJECT, STARTED, TIP, ready, wait_for
from launched import launched

SIZE = {"width": 960, "height": 560}  # px of the page
WIDTH = 800  # px of the film
STEP = 0.05  # s, of the simulation and of the film
SLOWER = 0.08  # real-time factor
SHOWN = 120  # ms after which a step has come to the page
PATIENCE = 60_000  # ms
STANDS = 1500  # ms, the last picture
QUALITY = 55  # of WebP
SCRIPT, OLD, NEW = "tutorial/6_ros.py", "sim.getObjectPosition(self.d, -1)[2]", "1.4"  # m: climb to that
UP, ARROW = 2, (0.0, 0.0, 0.95)  # a part of the handle, and the tip of its arrow
PULL = 0.15  # m
POINTER = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]  # px
LEFT = "document.querySelector('.cm-scroller').scrollLeft = 0"  # a long line moves it
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
        page.add_init_script(STARTED)
        page.goto(cockpit.address)
        ready(page)
        film = Film(page)
        for act in (open_script, edit, run, widen, drag, switch_camera, fly):
            act(film)
        browser.close()
    film.save(Path(path))


class Film:
    """A page with a pointer that can be seen, and its pictures."""

    def __init__(self, page):
        """Film from the next picture on."""
        self.page, self.pictures = page, []
        self.at = np.array([SIZE["width"] * 0.3, SIZE["height"] * 0.6])
        self.steps, self.place = 0, (0.0, 0.0, 0.0)
        rospy.init_node("film", anonymous=True, disable_signals=True)
        rospy.Subscriber("/drone/odom", Odometry, self._on_step, queue_size=1)

    def _on_step(self, message):
        self.steps += 1
        at = message.pose.pose.position
        self.place = at.x, at.y, at.z

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
        box = element.bounding_box(timeout=PATIENCE / 2)
        inside = {"x": min(box["width"], 80) / 2, "y": box["height"] / 2}
        self.move((box["x"] + inside["x"], box["y"] + inside["y"]), count)
        element.click(position=inside)
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
    """Have the script in the editor, and nothing before it or the scene, when the film begins."""
    page = film.page
    page.select_option("#script", SCRIPT)
    wait_for(page, "text => document.querySelector('.cm-content').innerText.includes(text)", OLD)
    page.wait_for_timeout(2000)
    if page.locator("#lesson-body").is_visible():
        page.locator("#fold").click()
    while not film.steps:
        page.wait_for_timeout(100)


def edit(film):
    """Change the height that is held."""
    keyboard = film.page.keyboard
    line = film.page.locator(".cm-line", has_text=OLD)
    line.evaluate("one => one.scrollIntoView({ block: 'center', inline: 'nearest' })")
    film.page.evaluate(LEFT)
    film.page.wait_for_timeout(1000)
    film.take(6)
    film.click(line)
    keyboard.press("End")
    keyboard.press("Home")  # to the first letter, from wherever behind it
    for _ in range(line.inner_text().strip().index(OLD)):
        keyboard.press("ArrowRight")
    for _ in range(len(OLD)):
        keyboard.press("Shift+ArrowRight")
    film.page.evaluate(LEFT)
    film.take(4)
    for letter in NEW:
        keyboard.type(letter)
        film.page.evaluate(LEFT)
        film.take(4)


def run(film):
    """Fly the script."""
    film.click(film.page.locator("#run"))
    wait_for(film.page, "document.querySelector('#said').textContent.includes('started')")
    film.take(35, fly=True)


def widen(film):
    """Fold the editor away."""
    film.click(film.page.locator("#toggle"), count=12)
    film.take(3, fly=True)


def drag(film):
    """Pull the drone up by the arrow of its handle, which is there while the pointer is on the drone."""
    film.move(seen(film, film.place), 12, fly=True)
    film.take(2, fly=True)
    tip = np.array(film.page.evaluate(TIP, [UP, ARROW]))
    film.move(seen(film, tip), 8, fly=True)
    film.page.mouse.down()
    film.move(seen(film, np.add(tip, (0, 0, PULL))), 16, fly=True)
    film.page.mouse.up()
    film.take(12, fly=True)


def seen(film, point):
    """Return where a point of the world is in the page."""
    return np.array(film.page.evaluate(PROJECT, list(map(float, point))))


def switch_camera(film):
    """Look through the front camera."""
    try:
        film.click(film.page.locator("#rail").get_by_role("button", name="Cameras"))
        film.click(film.page.get_by_label("front", exact=True))
    except Error as error:
        print(f"the camera is not switched on: {str(error).splitlines()[0]}")
    film.take(6, fly=True)


def fly(film):
    """Fly through the gate; a click beside the keys lets them count."""
    film.click(film.page.locator("#command"))
    film.hold("W", 34)
    film.hold("Q", 12)
    film.hold("W", 20)
    film.take(6, fly=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
