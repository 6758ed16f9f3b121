"""Tries one thing after the other, in a process of its own that may die: what cannot be imported, EGL, a flight.

Prints `NAME begins`, then `NAME ok TEXT` or `NAME failed TEXT`, with tabs in between.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Iterator

RENDERER, FLIGHT = "renderer", "flight"
_HEIGHT, _ERROR = 0.8, 0.05  # m: config/drone.yaml's, and what is near enough
_STEPS = 20


def _module(name: str) -> str:
    made = importlib.import_module(name)
    version = getattr(made, "__version__", "")
    return str(version) if isinstance(version, str) else ""


def _renderer() -> str:
    from drone_sim.render import context

    with context.create(0) as gl:
        by = "the processor draws" if context.is_software(gl) else "a graphics card draws"
        return f"{gl.info['GL_RENDERER']}: {by}"


def _flight() -> str:
    from drone_sim.run import parameters
    from drone_sim.run.simulation import Simulation

    simulation = Simulation(parameters.load())
    try:
        for _ in range(_STEPS):
            simulation.step()
        height, seconds = simulation.drone.body.state.position[2], simulation.time
    finally:
        simulation.close()
    if not abs(height - _HEIGHT) < _ERROR:
        raise RuntimeError(f"after {seconds:g} s its height was {height:.2f} m, not {_HEIGHT} m")
    return f"hovers at {height:.2f} m"


_SPECIAL = {RENDERER: _renderer, FLIGHT: _flight}


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what C code prints while it is imported away from what is printed here."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def _tried(name: str) -> tuple[str, str]:
    try:
        with _quiet():
            return "ok", _SPECIAL[name]() if name in _SPECIAL else _module(name)
    except BaseException as error:  # an import may end the process, or be interrupted
        return "failed", f"{type(error).__name__}: {error}"


def main(names: list[str]) -> None:
    """Try all of them."""
    for name in names:
        print(name, "begins", "", sep="\t", flush=True)
        state, text = _tried(name)
        print(name, state, " ".join(text.split()), sep="\t", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
