"""Many flights at a time: on threads of this process, or by any scheduler of Dask.

A worker's thread flies one job after the other, each in a process of its own (see `flyer`): that a worker
is only a thread here costs nothing, and it starts in no time. What a lost worker was flying, Dask gives to another.
"""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from typing import Any

from drone_sim.command_line import format_error
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs.flyer import Cancelled, Flyer
from drone_sim.grading.jobs.job import Job, JobResult, contents_of, key_of, lost
from drone_sim.grading.jobs.settings import BatchSettings, FlightLimits
from drone_sim.message_text import shown

_CONNECTING = 10.0  # s
_LOST = "the workers that flew the script were lost, one after the other"


class PoolError(RuntimeError):
    """Flights cannot be flown; one line says why."""


@dataclass(frozen=True)
class FlightOptions:
    """How flights are flown."""

    limits: FlightLimits
    batches: BatchSettings
    sandboxed: bool = True
    tables: bool = False  # whether each flight's table is wanted
    patience: float = 60.0  # s that a scheduler may be without a worker


Fly = Callable[[Sequence[Job]], Iterator[JobResult]]


@contextlib.contextmanager
def opened(options: FlightOptions, workers: int = 1, scheduler: str = "") -> Iterator[Fly]:
    """Yield a function that flies jobs: it yields the flights as they finish, in any order, one for each job.

    They are flown on `workers` threads here, or by the scheduler at an address. At the end, flights in progress are
    ended. Raises PoolError; the function raises that, too, and what Flyer.fly raises.
    """
    if scheduler:
        with _connected(scheduler, options.patience) as client:
            yield lambda jobs: _flown_by_dask(jobs, options, client)
    elif workers == 1:
        with contextlib.closing(Flyer(options.limits, options.sandboxed)) as server:
            yield lambda jobs: (server.fly(job, options.tables) for job in jobs)
    else:
        with _CLIENTS, ThreadPoolExecutor(workers) as executor:
            try:
                yield lambda jobs: _flown(jobs, options, executor, workers)
            finally:
                executor.shutdown(wait=False, cancel_futures=True)
                _CLIENTS.stop()


def _flown(
    jobs: Sequence[Job],
    options: FlightOptions,
    executor: Executor,
    workers: int,
    killed: tuple[type[Exception], ...] = (),
) -> Iterator[JobResult]:
    """Fly in batches; a batch whose worker was lost (an error of a type in `killed`) is flown again, job by job."""
    size = options.batches.size(len(jobs), max(1, workers))
    alone: list[Job] = []  # one of them may be to blame
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
        elif not isinstance(error, killed):
            raise error
        elif size == 1:
            yield lost(batch[0], plans.read(batch[0].plan), _LOST)
        else:
            alone += batch
    if alone:
        each = options.batches.model_copy(update={"largest": 1})
        yield from _flown(alone, replace(options, batches=each), executor, workers, killed)


# ---- with Dask


def _flown_by_dask(jobs: Sequence[Job], options: FlightOptions, client: Any) -> Iterator[JobResult]:
    from distributed import KilledWorker

    return _flown(jobs, options, client.get_executor(pure=False), sum(client.nthreads().values()), (KilledWorker,))


@contextlib.contextmanager
def _connected(address: str, patience: float) -> Iterator[Any]:
    """Give a client of a scheduler that has a worker. Raises PoolError."""
    from distributed import Client  # takes as long to import as five flights

    for name in [one for one in logging.root.manager.loggerDict if one.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # a lost scheduler would be told by tracebacks
    try:
        client = Client(address, timeout=_CONNECTING)
    except (OSError, ValueError, ImportError) as error:
        said = format_error(error)
        raise PoolError(f"--scheduler {shown(address)}: no scheduler answers there ({said:.200})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise PoolError(f"--scheduler {shown(address)}: has had no worker for {patience:g} s") from None
        yield client


# ---- in the worker


@dataclass
class _Clients:
    """The clients of the fork servers: one for each thread of this process that flies."""

    own: threading.local = field(default_factory=threading.local)
    all: list[Flyer] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def of_thread(self, options: FlightOptions) -> Flyer:
        """Return that of this thread."""
        wanted = (options.limits, options.sandboxed)
        if getattr(self.own, "wanted", None) != wanted or self.own.client not in self.all:
            self.own.wanted, self.own.client = wanted, Flyer(*wanted)
            with self.lock:
                self.all.append(self.own.client)
        return self.own.client

    def stop(self) -> None:
        """Let those who fly stop."""
        for client in self.all:
            client.stop()

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, *_exception: object) -> None:
        """End all; nobody flies any more."""
        with self.lock:
            while self.all:
                self.all.pop().close()


_CLIENTS = _Clients()


def fly_batch(jobs: Sequence[Job], options: FlightOptions) -> list[JobResult]:
    """Fly a batch, in a worker. Raises PoolError where the worker's files differ from those of the jobs' sender."""
    _check(jobs)
    client = _CLIENTS.of_thread(options)
    try:
        return [client.fly(job, options.tables) for job in jobs]
    except Cancelled:
        return []


def _check(jobs: Sequence[Job]) -> None:
    for plan_path, script in {(job.plan, job.script) for job in jobs}:
        job = next(one for one in jobs if (one.plan, one.script) == (plan_path, script))
        try:
            contents = contents_of(plans.read(plan_path), script)
        except (OSError, ValueError) as error:
            raise PoolError(f"worker on {socket.gethostname()}: {' '.join(str(error).split())}") from None
        if key_of(contents, job.seed, job.changes) != job.key:
            raise PoolError(
                f"worker on {socket.gethostname()}: {plan_path}, {script or 'the built-in script'}, what they name, "
                "drone_sim, Python, NumPy or PyBullet are not the same as here"
            )
