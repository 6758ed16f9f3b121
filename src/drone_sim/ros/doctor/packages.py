"""Checks of the packages in package.xml: imports, drawing, and a test flight, in a process that may crash.

This process, the probe, runs this module as a program. For each name it prints `NAME begins`, then `NAME ok TEXT` or
`NAME failed TEXT`, separated by tabs.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree as Xml

from drone_sim.command_line import SEPARATE, installation_of
from drone_sim.files.resources import package_path, python_path
from drone_sim.ros.doctor import HINT, OK, WRONG, Line

_RENDERER, _FLIGHT = "renderer", "flight"
_HEIGHT, _TOLERANCE = 0.8, 0.05  # m; the height is that of config/drone.yaml
_STEPS = 20
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
    "ompl": "scripts have no simOMPL",
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
    probed = probe_all([*sorted(keys), _RENDERER, _FLIGHT])
    failed = {name: text for name, (state, text) in probed.items() if state != "ok" and name in keys}
    for name, text in failed.items():
        yield _import_error(name, keys[name], text)
    if not failed:
        versions = ", ".join(f"{title} {_version(name, probed[name][1])}" for name, title in _VERSIONS.items())
        yield Line(OK, "packages", f"all {len(keys)} of package.xml can be imported; {versions}")
    state, text = probed[_RENDERER]
    cure = f"{_SLOW}; `apt install libegl1 libgl1-mesa-dri`, or a graphics driver with EGL, helps"
    yield Line(OK, "pictures", text) if state == "ok" else Line(HINT, "pictures", f"{text}; {cure}")
    state, text = probed[_FLIGHT]
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
    command = [sys.executable, "-m", "drone_sim.ros.doctor.packages", *names]
    try:
        probe = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as timeout:
        return (timeout.stdout or b"").decode(errors="replace"), f"did not end within {TIMEOUT:g} s"
    last = probe.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return probe.stdout.decode(errors="replace"), f"ended with {probe.returncode}{': ' if last else ''}{''.join(last)}"


# ---- in the probe


def _import(name: str) -> str:
    version = getattr(importlib.import_module(name), "__version__", "")
    return version if isinstance(version, str) else ""


def _create_renderer() -> str:
    from drone_sim.render import context

    with context.create(0) as gl:
        processor = "the processor draws" if context.is_software(gl) else "a graphics card draws"
        return f"{gl.info['GL_RENDERER']}: {processor}"


def _fly() -> str:
    from drone_sim.run import parameters
    from drone_sim.run.simulation import Simulation

    simulation = Simulation(parameters.load())
    try:
        for _ in range(_STEPS):
            simulation.step()
        height, seconds = simulation.drone.body.state.position[2], simulation.time
    finally:
        simulation.close()
    if not abs(height - _HEIGHT) < _TOLERANCE:
        raise RuntimeError(f"after {seconds:g} s its height was {height:.2f} m, not {_HEIGHT} m")
    return f"hovers at {height:.2f} m"


_PROBES = {_RENDERER: _create_renderer, _FLIGHT: _fly}


@contextlib.contextmanager
def _no_output() -> Iterator[None]:
    """Discard the output of Python and C code, which would mix with the results."""
    sys.stdout.flush()
    stdout, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(stdout, 1)
        os.close(stdout)
        os.close(null)


def main(names: list[str]) -> None:
    """Print the results for these names: modules, _RENDERER and _FLIGHT."""
    for name in names:
        print(name, "begins", "", sep="\t", flush=True)
        state = "failed"
        try:
            with _no_output():
                text = _PROBES[name]() if name in _PROBES else _import(name)
            state = "ok"
        except BaseException as error:  # an import may raise SystemExit or KeyboardInterrupt
            text = f"{type(error).__name__}: {error}"
        print(name, state, " ".join(text.split()), sep="\t", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
