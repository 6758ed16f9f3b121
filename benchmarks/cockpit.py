"""The cockpit with one browser on the same machine, the front camera on: what comes, what is late, what it costs."""

import contextlib
import gzip
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen
from xmlrpc.client import ServerProxy

from benchmarks import node

Row = dict[str, Any]
SIZE: Any = {"width": 1280, "height": 760}  # px
PATIENCE = 60.0  # s
SETTLED = 10.0  # s, after which the browser has compiled what it needs
NODES = {"cockpit": "/cockpit", "simulation": "/drone_sim"}
TICK = os.sysconf("SC_CLK_TCK")

# Counts messages in which a frame moves, and the pictures that are painted. The page has its scene when it is loaded.
SPY = """
() => {
  const seen = (window.seen = { moves: 0, drawn: 0 });
  const take = scene.take.bind(scene), paint = scene.canvas.paint;
  scene.take = (said, bytes) => { seen.moves += said.moved.length ? 1 : 0; take(said, bytes); };
  scene.canvas.paint = (...given) => { seen.drawn += 1; paint(...given); };
}
"""
PAGE = ("", "cockpit.css", "cockpit.js")


def measure(seconds: float = 30.0) -> list[Row]:
    """Return all rows; one that says so where there is no browser."""
    if not (shutil.which("chromium") and importlib.util.find_spec("playwright")):
        return [{"name": "left out: needs what ./dev.sh test-web installs"}]
    from playwright.sync_api import sync_playwright

    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "web"))
    rows = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"))
        for name in ("first", "second"):
            with _launched() as (address, served):
                page = browser.new_context(viewport=SIZE).new_page()
                page.set_default_timeout(1e3 * PATIENCE)
                rows.append({"name": f"launch -> page served, {name} time", "s": served})
                rows.append({"name": f"address opened -> page drawn, {name} time", "s": _opened(page, address)})
                if name == "second":
                    rows += _sizes(page, address) + _watched(page, seconds)
                page.context.close()
        browser.close()
    return rows


@contextlib.contextmanager
def _launched() -> Iterator[tuple[str, float]]:
    """Launch with a master of its own; yield the address, and after how many s it answered."""
    port = node.choose_port()
    began = time.monotonic()
    with node.launched("-p", port, "rviz:=false", "web:=true") as lines:
        while not (found := re.search(r"the cockpit is at (http\S+)", "".join(lines))):
            if time.monotonic() > began + PATIENCE:
                raise RuntimeError("the cockpit does not start:\n" + "".join(lines))
            time.sleep(0.01)
        with contextlib.suppress(OSError), urlopen(found[1]):  # 403 without a cookie is an answer, too
            pass
        yield found[1], time.monotonic() - began


def _opened(page: Any, address: str) -> float:
    """Open the page; return after how many s the first picture of the scene with the drone in it was drawn."""
    from cockpit_page import ready, wait_for

    began = time.monotonic()
    page.goto(address)
    ready(page)
    wait_for(page, "window.scene?.bodies?.has('drone')")
    drawn = page.evaluate("scene.canvas.frames")
    wait_for(page, "before => scene.canvas.frames > before", drawn)
    took = time.monotonic() - began
    page.evaluate(SPY)
    return took


def _sizes(page: Any, address: str) -> list[Row]:
    """Return how large the page's files are, as they are and as they are sent."""
    raw, sent = 0, 0
    headers = {"Cookie": "; ".join(f"{one['name']}={one['value']}" for one in page.context.cookies())}
    for name in PAGE:
        request = Request(address.partition("?")[0] + name, headers={**headers, "Accept-Encoding": "gzip"})
        with urlopen(request) as answer:
            packed = answer.read()
        sent += len(packed)
        raw += len(gzip.decompress(packed))
    return [{"name": "the page's files", "kB": raw / 1e3}, {"name": "the page's files, compressed", "kB": sent / 1e3}]


def _watched(page: Any, seconds: float) -> list[Row]:
    """Watch the page with its camera for so long, after a while."""
    from cockpit_page import switch_camera

    print(f"  front camera on, for {seconds:g} s of real time", file=sys.stderr, flush=True)
    page.get_by_role("button", name="Just fly").click()
    switch_camera(page)
    with _diagnoses() as heard:
        page.wait_for_timeout(1e3 * SETTLED)
        begun, before = len(heard), _state(page)
        page.wait_for_timeout(1e3 * seconds)
        after, said = _state(page), heard[begun:]
    passed = after.pop("at") - before.pop("at")
    rates = {name: (after[name] - before[name]) / passed for name in after}
    late, steps = (sum(one[number] for one in said[1:]) for number in (1, 2))
    return [
        {"name": "steps of the simulation", "per_s": steps / (said[-1][0] - said[0][0]), "late_steps": late},
        {"name": "updates that come to the page", "per_s": rates["moves"]},
        {"name": "pictures of the scene that the browser draws", "per_s": rates["drawn"]},
        *({"name": f"processor, {name}", "cores": rates[name]} for name in (*NODES, "browser")),
    ]


def _state(page: Any) -> dict[str, float]:
    """Return the time (s), what the page has counted, and the processor's time (s) of all."""
    master = ServerProxy(os.environ["ROS_MASTER_URI"])
    pids = {name: _pid(master, node_name) for name, node_name in NODES.items()}
    used = {name: _processor([pid]) for name, pid in pids.items()}
    seen = page.evaluate("window.seen")
    return {"at": time.monotonic(), **seen, **used, "browser": _processor(_named("chromium"))}


def _pid(master: Any, name: str) -> int:
    return int(ServerProxy(master.lookupNode("/benchmark", name)[2]).getPid("/benchmark")[2])  # type: ignore


def _named(name: str) -> list[int]:
    """Return the processes with this name that this one has started, or those that it has."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            pid, _, rest = path.read_text().partition(" (")
            command, _, values = rest.rpartition(") ")
            parents[int(pid)] = int(values.split()[1]), command
    ours = {os.getpid()}
    while found := {pid for pid, (parent, _) in parents.items() if parent in ours} - ours:
        ours |= found
    return [pid for pid in ours if parents.get(pid, (0, ""))[1].startswith(name)]


def _processor(pids: list[int]) -> float:
    """Return what processes have used of the processor (s)."""
    used = 0
    for pid in pids:
        with contextlib.suppress(OSError):
            values = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
            used += int(values[11]) + int(values[12])
    return used / TICK


# Says of each second how many steps there were, and how many of them late.
LISTENER = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray
def hear(message):
    for value in (one for status in message.status for one in status.values):
        if value.key == "late steps" and "of the last" in value.value:
            print(value.value, flush=True)
rospy.init_node("benchmark_listener", disable_signals=True)
rospy.Subscriber("/diagnostics", DiagnosticArray, hear)
rospy.spin()
"""


@contextlib.contextmanager
def _diagnoses() -> Iterator[list[tuple[float, int, int]]]:
    """Hear the diagnoses in a process of its own; yield the list of when one came (s), late steps and steps since."""
    heard: list[tuple[float, int, int]] = []
    with subprocess.Popen([sys.executable, "-c", LISTENER], stdout=subprocess.PIPE, text=True) as process:

        def read() -> None:
            for line in process.stdout or ():
                late, steps = map(int, re.findall(r"\d+", line)[:2])
                heard.append((time.monotonic(), late, steps))

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        try:
            yield heard
        finally:
            process.kill()
            reader.join()
