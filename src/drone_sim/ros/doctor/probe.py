"""Program that imports modules, creates a renderer and flies, in a process that may crash.

For each name it prints `NAME begins`, then `NAME ok TEXT` or `NAME failed TEXT`, separated by tabs.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Iterator

RENDERER, FLIGHT = "renderer", "flight"
_HEIGHT, _TOLERANCE = 0.8, 0.05  # m; the height is that of config/drone.yaml
_STEPS = 20


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


_PROBES = {RENDERER: _create_renderer, FLIGHT: _fly}


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
    """Print the results for these names: modules, RENDERER and FLIGHT."""
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
