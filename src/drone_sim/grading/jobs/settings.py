"""The numbers of config/grading.yaml, checked."""

from __future__ import annotations

from typing import Annotated, Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked, Finite, Within, merged, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path


class FlightLimits(Checked):
    """What one flight may take; see docs/grading.md."""

    seconds: Annotated[Finite, Within(1, 1e5)]  # s of processor time
    seconds_per_second: Annotated[Finite, Within(0, 1000)]  # and for each simulated second
    patience: Annotated[Finite, Within(1, 100)]  # times as much real time
    memory: Annotated[int, Within(16, 2**20)]  # MiB
    files: Annotated[int, Within(1, 2**20)]  # MiB
    processes: Annotated[int, Within(1, 10000)]
    open_files: Annotated[int, Within(64, 10000)]

    def processor_time(self, duration: float) -> float:
        """Return how many s of processor time a flight of so many simulated s may take."""
        return self.seconds + self.seconds_per_second * duration

    def real_time(self, duration: float) -> float:
        """Return how many s it may last."""
        return self.patience * self.processor_time(duration)


class _Results(Checked):
    kept: Annotated[Finite, Within(0, 10000)]  # days


class BatchSettings(Checked):
    """How many flights a worker gets at a time."""

    largest: Annotated[int, Within(1, 1000)]
    of_a_worker: Annotated[int, Within(1, 1000)]

    def size(self, flights: int, workers: int) -> int:
        """Return the size of a batch for so many flights."""
        return max(1, min(self.largest, flights // (workers * self.of_a_worker)))


class _Workers(Checked):
    patience: Annotated[Finite, Within(1, 1e5)]  # s


class Settings(Checked):
    """All of them."""

    limits: FlightLimits
    results: _Results
    batches: BatchSettings
    workers: _Workers


def load(overrides: dict[str, Any] | None = None) -> Settings:
    """Return config/grading.yaml with `overrides`, of the same shape, laid over it. Raises ParameterError."""
    path = package_path() / "config" / "grading.yaml"
    return checked(Settings, merged(read_yaml(path), overrides or {}), yaml_files.lines(path), str(path))
