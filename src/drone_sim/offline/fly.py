"""`rosrun drone_sim fly`: run the simulation without ROS and without a master, as fast as possible."""

from __future__ import annotations

import argparse
import contextlib
import io
import itertools
import logging
import math
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tqdm import tqdm

from drone_sim.command_line import SIGNALLED, Parser, status_of
from drone_sim.config.types import ParameterError, nested
from drone_sim.files import writing, yaml_files
from drone_sim.mechanics.frames import to_euler
from drone_sim.message_text import near_names, shown
from drone_sim.offline import dataset
from drone_sim.offline import timeline as timeline_module
from drone_sim.offline.recording import OutputError, Recording
from drone_sim.offline.timeline import MAX_TIME, Timeline, first_step
from drone_sim.run import parameters as parameters_module
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.run.watchdog import Watchdog
from drone_sim.scripting.api.control import STOP
from drone_sim.scripting.script_log import LOG as SCRIPT_LOG
from drone_sim.vrep_files.model import SUFFIXES

if TYPE_CHECKING:
    from drone_sim.offline.video import CameraRecorder

    _CameraWriter = CameraRecorder | dataset.TruthRecorder

_EXTRA_TIME = 5.0  # s of flight after the last command
_IDLE_TIME = 10.0  # s
_MAX_PLOTTED_STEPS = 500_000
_BAR_DELAY = 2.0  # s of real time; a shorter flight shows no progress bar
_YAML, _OUTPUTS = (".yaml", ".yml"), ("csv", "plot", "video", "truth")
_FILES = ("script", "scene", "config", "commands", *_OUTPUTS)
_ENDINGS = {
    "scene": (*_YAML, *SUFFIXES),
    "config": _YAML,
    "commands": _YAML,
    "csv": (".csv", ".txt", ""),
    "video": (".mp4",),
}


def main(arguments: Sequence[str] | None = None, watchdog: Watchdog | None = None) -> int:
    """Fly; return 0, 1 after an error line on stderr for a wrong input or script, or 130 after Ctrl-C.

    With a watchdog, a signal ends the flight between two steps; without one, signals are left to the caller.
    """
    options = _parser().parse_args(arguments)
    if watchdog is not None:
        watchdog.ready()
    with _shown_on_stdout(SCRIPT_LOG):
        return status_of("fly", lambda: _run(options, watchdog))


def settings(assignments: Sequence[str]) -> dict[str, Any]:
    """Return `a.b=VALUE` assignments as the nested mapping for parameters.load; VALUE is YAML.

    The last assignment of a key wins. Raises ParameterError.
    """
    values: list[tuple[str, Any]] = []
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals or not all(key.split(".")):
            raise ParameterError(f"--set {_shown(assignment)}: must be KEY=VALUE, such as control.Kzref=4")
        try:
            values.append((key, yaml_files.parse(text)))
        except yaml_files.YamlError as error:
            raise ParameterError(f"--set {_shown(assignment)}: {error}") from None
    return nested(values)


def _shown(assignment: str) -> str:
    return assignment if assignment.isprintable() and len(assignment) < 200 else shown(assignment)


def _run(options: argparse.Namespace, watchdog: Watchdog | None) -> int:
    _check_names(options)
    files = {"config": options.config, "scene_file": options.scene}
    parameters = parameters_module.load({**settings(options.set), **{key: name for key, name in files.items() if name}})
    vehicle = _vehicle(options.vehicle, parameters)
    timeline = Timeline((), parameters.time_step)
    if options.commands:
        timeline = timeline_module.read(options.commands, parameters)
    steps = first_step(_duration(options, timeline), parameters.time_step)
    camera = _camera(options, parameters, vehicle)
    _check_outputs(options, steps)
    simulation = Simulation(parameters, script=options.script or parameters.script, gui=parameters.gui)
    start = time.perf_counter()
    try:
        with contextlib.ExitStack() as stack:
            file = stack.enter_context(writing.replacing(options.csv)) if options.csv else None
            managers = _camera_writers(options, simulation, vehicle, camera)
            writers = {name: stack.enter_context(writer) for name, writer in managers.items()}
            recording = Recording(file, keep=bool(options.plot), vehicle=vehicle)
            status = status_of(
                "fly",
                lambda: _fly(simulation, timeline, steps, (recording, *writers.values()), watchdog),
                passed_on=OutputError,  # handled by the context manager that writes the file
            )
            wall_time = time.perf_counter() - start
            status = status or int(bool(simulation.failed_scripts))
    finally:
        # The part flown before a failure is useful, too: cleanup, summary and plot follow in any case.
        close_status = status_of("fly", simulation.close)
    if watchdog is not None:
        watchdog.stand_down()  # no script runs any more, and drawing a plot takes long
    print(_summary(recording, wall_time), flush=True)
    for name, writer in writers.items():
        print(f"wrote {name}: {writer}", flush=True)
    plot_status = 0
    if options.plot and recording.rows:
        from drone_sim.offline import plot

        plot_status = status_of("fly", lambda: plot.save(options.plot, recording, timeline.of(vehicle)))
    return status or close_status or plot_status


def _check_outputs(options: argparse.Namespace, steps: int) -> None:
    """Raise OSError or ValueError for an output that cannot be written."""
    if options.plot:
        from drone_sim.offline import plot  # matplotlib takes as long to import as a short flight

        plot.check(options.plot)
        if steps > _MAX_PLOTTED_STEPS:
            raise ValueError(f"--plot: {steps} steps are too many; at most {_MAX_PLOTTED_STEPS} can be drawn")
    for output in filter(None, (options.csv, options.video)):
        writing.check_writable(output)
    if options.truth:
        dataset.check(options.truth)


def _check_names(options: argparse.Namespace) -> None:
    """Raise ValueError for a file name with a wrong ending, or an output that is also another option's file."""
    for option, endings in _ENDINGS.items():
        name = getattr(options, option)
        if name is not None and Path(name).suffix.lower() not in endings:
            raise ValueError(f"--{option} {_shown(name)}: must end in {' or '.join(filter(None, endings))}")
    files = {option: os.path.realpath(getattr(options, option)) for option in _FILES if getattr(options, option)}
    for output, other in itertools.permutations(files, 2):
        if output in _OUTPUTS and files[output] == files[other]:
            raise ValueError(
                f"--{output} {_shown(getattr(options, output))}: must not be the same file as that of --{other}"
            )


def _vehicle(name: str | None, parameters: Parameters) -> str:
    """Return the name of the vehicle to record. Raises ValueError."""
    names = [vehicle.name for vehicle in parameters.fleet]
    if name is not None and name not in names:
        raise ValueError(f"--vehicle {_shown(name)}: no such vehicle; {near_names(name, names)}")
    return parameters.first.name if name is None else name


def _camera(options: argparse.Namespace, parameters: Parameters, vehicle: str) -> str:
    """Return the camera for video and ground truth, '' if neither is written. Raises ValueError."""
    option = "--video" if options.video else "--truth"
    if not (options.video or options.truth):
        if options.camera is not None:
            raise ValueError(f"--camera {_shown(options.camera)}: only works with --video or --truth")
        return ""
    cameras = next(item for item in parameters.fleet if item.name == vehicle).cameras
    if not cameras:
        raise ValueError(f"{option}: the vehicle has no camera")
    if options.camera is not None and options.camera not in cameras:
        raise ValueError(f"--camera {shown(options.camera)}: no such camera; {near_names(options.camera, cameras)}")
    camera = next(iter(cameras)) if options.camera is None else options.camera
    if options.video:
        from drone_sim.offline import video  # needs PyAV, an optional dependency

        video.rate_of(cameras[camera], parameters.time_step)
    return camera


def _camera_writers(
    options: argparse.Namespace, simulation: Simulation, vehicle: str, camera: str
) -> dict[str, AbstractContextManager[_CameraWriter]]:
    """Return the writers of the camera's images, by output path."""
    writers: dict[str, AbstractContextManager[_CameraWriter]] = {}
    if options.video:
        from drone_sim.offline import video

        writers[options.video] = video.filming(options.video, simulation, vehicle, camera)
    if options.truth:
        writers[options.truth] = dataset.recording_to(options.truth, simulation, vehicle, camera)
    return writers


@contextlib.contextmanager
def _shown_on_stdout(log: logging.Logger) -> Iterator[None]:
    """Print scripts' log messages on stdout, with escapes for characters that the terminal cannot show."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    handler = logging.StreamHandler(sys.stdout)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


def _duration(options: argparse.Namespace, timeline: Timeline) -> float:
    if options.duration is not None:
        return float(options.duration)
    return timeline.end + _EXTRA_TIME if timeline.entries else _IDLE_TIME


def _fly(
    simulation: Simulation,
    timeline: Timeline,
    steps: int,
    observers: Iterable[Recording | _CameraWriter],
    watchdog: Watchdog | None,
) -> int:
    for observer in observers:
        observer.add(simulation)
    # disable=None: no bar where stderr is not a terminal.
    with tqdm(total=steps, unit=" steps", delay=_BAR_DELAY, disable=None, leave=False) as bar:
        for step in range(steps):
            if watchdog is not None and watchdog.asked:
                return SIGNALLED + watchdog.asked
            timeline.apply(step, simulation.vehicles)
            simulation.step()
            for observer in observers:
                observer.add(simulation)
            bar.update()
            if simulation.context.control.asked == STOP:
                break
    return 0


def _summary(recording: Recording, wall_time: float) -> str:
    if not recording.rows:
        return "flew 0.00 s"
    row = recording.rows[-1]
    # + 0.0 turns -0 into 0
    x, y, z, yaw = (round(value, 3) + 0.0 for value in (*row[1:4], to_euler(recording.matrix(-1))[2]))
    factor = row[0] / wall_time
    return (
        f"flew {row[0]:.2f} s in {wall_time:.2f} s ({factor:.{0 if factor >= 10 else 2}f} times real time); "
        f"ended at x {x:.3f} y {y:.3f} z {z:.3f} m, yaw {yaw:.3f} rad"
    )


# ---- arguments


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="fly", description="Fly the drone without ROS, as fast as possible.")
    parser.add_argument("--script", metavar="FILE", help="child script (default: the built-in script pilot)")
    parser.add_argument(
        "--scene",
        metavar="FILE",
        help="scene file (.yaml or .ttt) with floor, objects and the drone's pose, like scene:=",
    )
    parser.add_argument(
        "--config", metavar="FILE.yaml", help="YAML file with the parameters that you change, like config:="
    )
    parser.add_argument("--commands", metavar="FILE.yaml", help="YAML timeline of twists, poses and pushes")
    parser.add_argument(
        "--duration",
        metavar="S",
        type=_seconds,
        help=f"simulated seconds (default: {_EXTRA_TIME:g} after the last command, {_IDLE_TIME:g} without commands)",
    )
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="extend",
        nargs="+",
        default=[],
        help="set a key of config/drone.yaml, such as control.thrust_limits=null",
    )
    parser.add_argument("--vehicle", metavar="NAME", help="which of several vehicles to record (default: the first)")
    parser.add_argument("--csv", metavar="OUT.csv", help="write a row per step: state, command, propellers")
    parser.add_argument("--plot", metavar="OUT.png", help="draw path, velocities, height, attitude and propellers")
    parser.add_argument("--video", metavar="OUT.mp4", help="film a camera's pictures, with a head-up display")
    parser.add_argument(
        "--truth", metavar="DIR", help="write a camera's pictures, masks, depth, boxes (COCO) to a folder"
    )
    parser.add_argument(
        "--camera", metavar="NAME", help="the camera of --video and --truth, such as track (default: the first)"
    )
    return parser


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds <= MAX_TIME:
        raise argparse.ArgumentTypeError(f"{text:.60}: must be a number of seconds, from 0 to {MAX_TIME:g}")
    return seconds


if __name__ == "__main__":
    asked_to_end = Watchdog("fly")
    asked_to_end.end(main(watchdog=asked_to_end))
