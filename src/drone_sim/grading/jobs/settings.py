"""The checked values of config/grading.yaml."""

from __future__ import annotations

from typing import Annotated, Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked, Finite, Within, merged, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path


class FlightLimits(Checked):
    """Limits of one flight; see docs/grading.md."""

    seconds: Annotated[Finite, Within(1, 1e5)]  # s of processor time
    seconds_per_second: Annotated[Finite, Within(0, 1000)]  # s of processor time for each simulated second
    patience: Annotated[Finite, Within(1, 100)]  # real time divided by processor time
    memory: Annotated[int, Within(16, 2**20)]  # MiB
    files: Annotated[int, Within(1, 2**20)]  # MiB
    processes: Annotated[int, Within(1, 10000)]
    open_files: Annotated[int, Within(64, 10000)]

    def of_flight(self, duration: float) -> dict[str, Any]:
        """Return the limits of a flight with a simulated duration (s), for LimitedProcess."""
        processor_time = self.seconds + self.seconds_per_second * duration
        plain = self.model_dump(include={"memory", "files", "processes", "open_files"})
        return {**plain, "seconds": processor_time, "real_time": self.patience * processor_time}


class _Results(Checked):
    kept: Annotated[Finite, Within(0, 10000)]  # days


class BatchSettings(Checked):
    """The number of flights that a worker gets at a time."""

    largest: Annotated[int, Within(1, 1000)]
    of_a_worker: Annotated[int, Within(1, 1000)]

    def size(self, flights: int, workers: int) -> int:
        return max(1, min(self.largest, flights // (workers * self.of_a_worker)))


class _Workers(Checked):
    patience: Annotated[Finite, Within(1, 1e5)]  # s


class Settings(Checked):
    limits: FlightLimits
    results: _Results
    batches: BatchSettings
    workers: _Workers


def load(overrides: dict[str, Any] | None = None) -> Settings:
    """Return config/grading.yaml with some values replaced by `overrides`. Raises ParameterError."""
    path = package_path() / "config" / "grading.yaml"
    return checked(Settings, merged(read_yaml(path), overrides or {}), yaml_files.lines(path), str(path))
