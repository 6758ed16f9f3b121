"""Many flights on Dask: its cluster in this process by default, or any scheduler.

A worker's thread flies one job after the other, each in a process of its own (see `process`): that a worker is only a
thread here costs nothing, and it starts in no time. What a lost worker was flying, Dask gives to another.
"""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from drone_sim.grading import plan as plans
from drone_sim.grading.flight import ungraded
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.jobs.process import Flight, Stopped, Warm
from drone_sim.grading.jobs.settings import Batches, Limits
from drone_sim.wording import shown

_CONNECTING = 10.0  # s
_LOST = "the workers that flew the script were lost, one after the other"


class PoolError(RuntimeError):
    """Flights cannot be flown; one line says why."""


@dataclass(frozen=True)
class Orders:
    """How flights are flown."""

    limits: Limits
    batches: Batches
    sandboxed: bool = True
    tables: bool = False  # whether each flight's table is wanted
    patience: float = 60.0  # s that a scheduler may be without a worker


Fly = Callable[[Sequence[Job]], Iterator[Flight]]


@contextlib.contextmanager
def opened(orders: Orders, workers: int = 1, scheduler: str = "") -> Iterator[Fly]:
    """Give a function that flies: it gives the flights as they come, in any order, each job's once.

    On `workers` threads here, or by the scheduler at an address. At the end what is still flown is ended. Raises
    PoolError; the function that, too, and what Warm.fly raises.
    """
    if scheduler:
        with _connected(scheduler, orders.patience) as client:
            yield lambda jobs: _by_dask(jobs, orders, client)
    elif workers == 1:
        with contextlib.closing(Warm(orders.limits, orders.sandboxed)) as warm:
            yield lambda jobs: (warm.fly(job, orders.tables) for job in jobs)
    else:
        with _here(workers) as client:
            yield lambda jobs: _by_dask(jobs, orders, client)


# ---- with Dask


def _by_dask(jobs: Sequence[Job], orders: Orders, client: Any) -> Iterator[Flight]:
    from distributed import KilledWorker, as_completed  # takes as long to import as five flights

    workers = sum(client.nthreads().values())
    size = orders.batches.size(len(jobs), max(1, workers))
    batches = {
        client.submit(fly_batch, batch, orders, pure=False): batch
        for batch in (jobs[first : first + size] for first in range(0, len(jobs), size))
    }
    completed = as_completed(batches, raise_errors=False)
    for future in completed:
        batch = batches.pop(future)
        error = future.exception()
        if error is None:
            yield from future.result()
        elif not isinstance(error, KilledWorker):
            raise error
        elif len(batch) == 1:
            yield _lost(batch[0])
        else:  # one of them may be to blame: each for itself
            alone = {client.submit(fly_batch, [job], orders, pure=False): [job] for job in batch}
            batches.update(alone)
            completed.update(alone)
        future.release()


def _lost(job: Job) -> Flight:
    return Flight(job, ungraded(plans.read(job.plan), job.script, job.seed, job.changes, _LOST), is_lost=True)


@contextlib.contextmanager
def _here(workers: int) -> Iterator[Any]:
    """Give a client of a cluster in this process; at the end its flights are ended."""
    from distributed import Client, LocalCluster

    with (
        _CREW,
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=False,
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
        _CREW.ended(),
    ):
        yield client


@contextlib.contextmanager
def _connected(address: str, patience: float) -> Iterator[Any]:
    """Give a client of a scheduler that has a worker. Raises PoolError."""
    from distributed import Client

    try:
        client = Client(address, timeout=_CONNECTING)
    except (OSError, ValueError, ImportError) as error:
        said = " ".join(str(error).split())
        raise PoolError(f"--scheduler {shown(address)}: no scheduler answers there ({said:.200})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise PoolError(f"--scheduler {shown(address)}: has had no worker for {patience:g} s") from None
        yield client


# ---- in the worker


@dataclass
class _Crew:
    """The warm processes of this process's threads."""

    own: threading.local = field(default_factory=threading.local)
    all: list[Warm] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def warm(self, orders: Orders) -> Warm:
        """Return the warm process of this thread."""
        wanted = (orders.limits, orders.sandboxed)
        if getattr(self.own, "wanted", None) != wanted or self.own.warm not in self.all:
            self.own.wanted, self.own.warm = wanted, Warm(*wanted)
            with self.lock:
                self.all.append(self.own.warm)
        return self.own.warm

    @contextlib.contextmanager
    def ended(self) -> Iterator[None]:
        """At the end, let those who fly stop."""
        try:
            yield
        finally:
            for warm in self.all:
                warm.stop()

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, *_exception: object) -> None:
        """End all; nobody flies any more."""
        with self.lock:
            while self.all:
                self.all.pop().close()


_CREW = _Crew()


def fly_batch(jobs: Sequence[Job], orders: Orders) -> list[Flight]:
    """Fly, in a worker. Raises PoolError where its files are others than those of whoever has sent the jobs."""
    _check(jobs)
    warm = _CREW.warm(orders)
    try:
        return [warm.fly(job, orders.tables) for job in jobs]
    except Stopped:
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
