"""Pool of workers that fly jobs: threads of this process, or the workers of a Dask scheduler.

Threads suffice because each flight runs in its own processes (see `flyer`). Dask gives the flights of a lost worker to
another one.
"""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Any

from drone_sim.command_line import format_error
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs.flyer import Cancelled, Flyer
from drone_sim.grading.jobs.job import Job, JobResult, contents_of, key_of, lost_flight
from drone_sim.grading.jobs.settings import BatchSettings, FlightLimits
from drone_sim.message_text import shown

_CONNECT_TIMEOUT = 10.0  # s
_LOST = "the workers that flew the script were lost, one after the other"


class PoolError(RuntimeError):
    """The pool cannot fly jobs; one line says why."""


@dataclass(frozen=True)
class FlightOptions:
    """Options for all flights of a pool."""

    limits: FlightLimits
    batches: BatchSettings
    sandboxed: bool = True
    tables: bool = False  # whether to return the flights' tables
    patience: float = 60.0  # s that a scheduler may be without a worker


Fly = Callable[[Sequence[Job]], Iterator[JobResult]]


@contextlib.contextmanager
def open_pool(options: FlightOptions, workers: int = 1, scheduler: str = "") -> Iterator[Fly]:
    """Yield a function that flies jobs and yields one result for each job, in the order in which flights finish.

    The pool has `workers` threads, or the workers of the Dask scheduler at the address `scheduler`. Leaving the context
    ends the flights in progress. Raises PoolError; the function raises PoolError and the errors of Flyer.fly.
    """
    if scheduler:
        with _connect(scheduler, options.patience) as client:
            yield lambda jobs: _fly_with_dask(jobs, options, client)
    elif workers == 1:
        with contextlib.closing(Flyer(options.limits, options.sandboxed)) as flyer:
            yield lambda jobs: (flyer.fly(job, options.tables) for job in jobs)
    else:
        with contextlib.closing(_FLYERS), ThreadPoolExecutor(workers) as executor:
            try:
                yield lambda jobs: _fly_in_batches(jobs, options, executor, workers)
            finally:
                executor.shutdown(wait=False, cancel_futures=True)
                _FLYERS.stop()


def _fly_in_batches(
    jobs: Sequence[Job],
    options: FlightOptions,
    executor: Executor,
    workers: int,
    lost_errors: tuple[type[Exception], ...] = (),
) -> Iterator[JobResult]:
    """Fly in batches; if a batch's worker is lost (an error in `lost_errors`), fly its jobs again, one by one."""
    size = options.batches.size(len(jobs), max(1, workers))
    retries: list[Job] = []  # one of them may have ended the worker
    batches = {
        executor.submit(fly_batch, batch, options): batch
        for batch in (jobs[first : first + size] for first in range(0, len(jobs), size))
    }
    for future in as_completed(batches):
        batch = batches.pop(future)
        if future.cancelled():
            raise PoolError("the connection to the scheduler is lost; the results so far are kept")
        error = future.exception()
        if error is None:
            yield from future.result()
        elif not isinstance(error, lost_errors):
            raise error
        elif size == 1:
            yield lost_flight(batch[0], plans.read(batch[0].plan), _LOST)
        else:
            retries += batch
    if retries:
        single = options.batches.model_copy(update={"largest": 1})
        yield from _fly_in_batches(retries, replace(options, batches=single), executor, workers, lost_errors)


def _fly_with_dask(jobs: Sequence[Job], options: FlightOptions, client: Any) -> Iterator[JobResult]:
    from distributed import KilledWorker

    workers = sum(client.nthreads().values())
    return _fly_in_batches(jobs, options, client.get_executor(pure=False), workers, (KilledWorker,))


@contextlib.contextmanager
def _connect(address: str, patience: float) -> Iterator[Any]:
    """Yield a client of a scheduler with at least one worker. Raises PoolError."""
    from distributed import Client  # takes as long to import as five flights

    for name in [logger for logger in logging.root.manager.loggerDict if logger.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # no tracebacks if the scheduler is lost
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT)
    except (OSError, ValueError, ImportError) as error:
        reason = format_error(error)
        raise PoolError(f"--scheduler {shown(address)}: no scheduler answers there ({reason:.200})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise PoolError(f"--scheduler {shown(address)}: has had no worker for {patience:g} s") from None
        yield client


# ---- in the worker


class _Flyers:
    """One flyer for each thread of this process that flies."""

    def __init__(self) -> None:
        self._local = threading.local()
        self._all: list[Flyer] = []
        self._lock = threading.Lock()

    def of_thread(self, options: FlightOptions) -> Flyer:
        arguments, local = (options.limits, options.sandboxed), self._local
        if getattr(local, "arguments", None) != arguments or local.flyer not in self._all:
            local.arguments, local.flyer = arguments, Flyer(*arguments)
            with self._lock:
                self._all.append(local.flyer)
        return local.flyer

    def stop(self) -> None:
        for flyer in self._all:
            flyer.stop()

    def close(self) -> None:
        """Close all flyers; no thread may fly any more."""
        with self._lock:
            while self._all:
                self._all.pop().close()


_FLYERS = _Flyers()


def fly_batch(jobs: Sequence[Job], options: FlightOptions) -> list[JobResult]:
    """Fly a batch in a worker. Raises PoolError if the worker's files differ from those of the jobs' sender."""
    for job in {(job.plan, job.script): job for job in jobs}.values():
        try:
            contents = contents_of(plans.read(job.plan), job.script)
        except (OSError, ValueError) as error:
            raise PoolError(f"worker on {socket.gethostname()}: {' '.join(str(error).split())}") from None
        if key_of(contents, job.seed, job.changes) != job.key:
            raise PoolError(
                f"worker on {socket.gethostname()}: {job.plan}, {job.script or 'the built-in script'}, what they name, "
                "drone_sim, Python, NumPy or PyBullet are not the same as here"
            )
    flyer = _FLYERS.of_thread(options)
    try:
        return [flyer.fly(job, options.tables) for job in jobs]
    except Cancelled:
        return []
