"""Checks of the packages in package.xml: imports, drawing, and a test flight, in a process that may crash."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree as Xml

from drone_sim.command_line import SEPARATE, installation_of
from drone_sim.files.resources import package_path, python_path
from drone_sim.ros.doctor import HINT, OK, WRONG, Line
from drone_sim.ros.doctor.probe import FLIGHT, RENDERER

TIMEOUT = 60.0  # s, for one run of the probe, which usually takes 2 s
_MODULES = {"python3-opencv": "cv2", "python3-pil": "PIL", "python3-pycollada-pip": "collada", "python3-tk": "tkinter"}
_NO_MODULES = {"rviz"}
_NEEDS_DISPLAY = {"tkinter"}  # `./dev.sh setup` installs it only where there is a display
_EFFECTS = {  # of a missing module
    "tkinter": "`view` writes files instead of opening a window",
    "matplotlib": "plots cannot be drawn",
    "av": "videos cannot be made",
    "jinja2": "`grade --html` writes no report",
    "distributed": "`--scheduler` does not work",
    "scipy": "`sweep --optimize` does not work",
    "tqdm": "`fly` does not work",
}
_SLOW = "PyBullet's TinyRenderer draws pictures instead, at a few frames per second"
_VERSIONS = {"numpy": "numpy", "cv2": "OpenCV", "pybullet": "PyBullet", "pydantic": "pydantic", "lupa": "lupa"}


def modules() -> dict[str, str]:
    """Return the importable modules of package.xml's dependencies, each with its key in package.xml."""
    keys = [str(element.text) for element in Xml.parse(package_path() / "package.xml").iter("exec_depend")]
    by_module = {_MODULES.get(key, key.removeprefix("python3-").removesuffix("-pip")): key for key in keys}
    return {module: key for module, key in by_module.items() if key not in _NO_MODULES}


def packages() -> Iterator[Line]:
    """Import all modules, draw, and fly, in another process."""
    keys = modules()
    probed = probe_all([*sorted(keys), RENDERER, FLIGHT])
    failed = {name: text for name, (state, text) in probed.items() if state != "ok" and name in keys}
    for name, text in failed.items():
        yield _import_error(name, keys[name], text)
    if not failed:
        versions = ", ".join(f"{title} {_version(name, probed[name][1])}" for name, title in _VERSIONS.items())
        yield Line(OK, "packages", f"all {len(keys)} of package.xml can be imported; {versions}")
    state, text = probed[RENDERER]
    cure = f"{_SLOW}; `apt install libegl1 libgl1-mesa-dri`, or a graphics driver with EGL, helps"
    yield Line(OK, "pictures", text) if state == "ok" else Line(HINT, "pictures", f"{text}; {cure}")
    state, text = probed[FLIGHT]
    yield Line(OK, "flight", text) if state == "ok" else Line(WRONG, "flight", f"the test flight failed: {text}")


def _import_error(module: str, key: str, reason: str) -> Line:
    has_setup = (package_path() / "dev.sh").is_file() and module not in _NEEDS_DISPLAY
    debian = key if key.startswith("python3-") else f"python3-{key.replace('_', '-')}"
    cure = "`./dev.sh setup` installs it" if has_setup else f"`apt install {debian}`, or reinstall drone_sim"
    if module in SEPARATE:
        cure = installation_of(module)
    if module in _EFFECTS:
        return Line(HINT, "packages", f"no {module} ({reason}): {_EFFECTS[module]}; {cure}")
    return Line(WRONG, "packages", f"{module} cannot be imported ({reason}): {cure}")


def _version(module: str, attribute: str) -> str:
    """Return a module's `__version__`, which is `attribute`, or, if that is '', the version of its distribution."""
    from importlib import metadata

    distribution = metadata.packages_distributions().get(module, [module])[0] if not attribute else module
    try:
        return attribute or metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "(unknown version)"


def probe_all(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return the probe's results by name: "ok" or "failed", and a text. A name that crashes the probe has failed."""
    results: dict[str, tuple[str, str]] = {}
    while len(results) < len(names):
        remaining = [name for name in names if name not in results]
        output, end = _run_probe(remaining)
        current = ""
        for line in output.splitlines():
            name, state, text = (*line.split("\t"), "", "")[:3]
            if name in remaining and state == "begins":
                current = name
            elif name in remaining and state in ("ok", "failed"):
                results[name], current = (state, text), ""
        if len(results) < len(names):  # the probe has crashed
            results[current or next(name for name in names if name not in results)] = ("failed", end)
    return results


def _run_probe(names: Sequence[str]) -> tuple[str, str]:
    """Return the probe's output, and a text that says how it ended."""
    # With this PYTHONPATH the probe imports this package, even if a devel space has another one.
    environment = {**os.environ, "PYTHONPATH": python_path(os.environ.get("PYTHONPATH", ""))}
    command = [sys.executable, "-m", "drone_sim.ros.doctor.probe", *names]
    try:
        probe = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as timeout:
        return (timeout.stdout or b"").decode(errors="replace"), f"did not end within {TIMEOUT:g} s"
    last = probe.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return probe.stdout.decode(errors="replace"), f"ended with {probe.returncode}{': ' if last else ''}{''.join(last)}"
