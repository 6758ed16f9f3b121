"""The process of one flight: forked, limited, watched, and cleared away with all that it has begun."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import secrets
import select
import signal
import time
from pathlib import Path
from typing import Any, NoReturn

from drone_sim.command_line import format_error
from drone_sim.grading.flight import grade, ungraded
from drone_sim.grading.plan import Plan

_MOST = {"result": 2**22, "table": 2**28}  # bytes
_BLOCK = 2**18
_LOOKS = 0.1  # s between two looks at how many processes there are, and what they take
_ROUNDS = 10_000  # of killing what is left
_NONCE = 16  # bytes
_MIB = 2**20
_RESERVED = 2048  # MiB of addresses beyond what is written to: libraries reserve more than they use
_LIFETIME = 1  # s of processor time after SIGXCPU, which a script may ignore
_LIBC = ctypes.CDLL(None, use_errno=True)
_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_CHILD_SUBREAPER, _PR_SET_NO_NEW_PRIVS = 1, 4, 36, 38


def guard() -> None:
    """Let nobody of the same user look into this process, and give it what its children leave behind."""
    _prctl(_PR_SET_DUMPABLE, 0)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


class FlightProcess:
    """Flies one request in a process of its own; `reply` says how it ended.

    The result comes through a pipe, behind a number that was drawn for it: what a script prints, or writes into
    whatever it finds open, is no result.
    """

    def __init__(self, plan: Plan, request: dict[str, Any], is_alone: bool):
        """Fork it, to fly a `request` for a `plan`. `is_alone`: no others are in sight."""
        self._request = request
        self._is_alone = is_alone
        self._nonce = secrets.token_bytes(_NONCE)
        self._read: dict[int, str] = {}
        self._got = {name: bytearray() for name in _MOST}
        self._lost = ""
        self._status = 0
        self._used = 0.0  # s of processor time
        ends = {name: os.pipe() for name in _MOST}
        self._process = os.fork()
        if not self._process:
            _fly(plan, request, {name: write for name, (_, write) in ends.items()}, self._nonce)
        for name, (read, write) in ends.items():
            os.close(write)
            os.set_blocking(read, False)
            self._read[read] = name
        self._end = os.pidfd_open(self._process)

    def __enter__(self) -> FlightProcess:
        """Return this."""
        return self

    def __exit__(self, *_exception: object) -> None:
        """Kill it, and whatever it has left, and wait for their ends."""
        self._kill()
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self._status = os.waitpid(self._process, 0)[1]
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self._used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self._clear_away()
        for descriptor in (*self._read, self._end):
            os.close(descriptor)

    def watch(self, lifeline: int) -> bool:
        """Read what comes until the process ends, or has to; return False where the pipe `lifeline` has ended."""
        poll = select.poll()
        for descriptor in self._read:
            poll.register(descriptor, select.POLLIN)
        poll.register(self._end, select.POLLIN)
        poll.register(lifeline, 0)
        deadline = time.monotonic() + self._request["real_time"]
        while not self._lost:
            ready = dict(poll.poll(1000 * _LOOKS))
            if lifeline in ready:
                return False
            if self._end in ready:
                break
            for descriptor in ready:
                if not self._take(descriptor):
                    poll.unregister(descriptor)
            self._look(deadline, not ready)
        self._take_all()
        return True

    def _take_all(self) -> None:
        for descriptor in self._read:
            while self._take(descriptor):
                pass

    def _take(self, descriptor: int) -> bool:
        """Read a block; return whether there was one."""
        name = self._read[descriptor]
        try:
            block = os.read(descriptor, _BLOCK)
        except BlockingIOError:
            return False
        self._got[name] += block
        if len(self._got[name]) > _MOST[name]:
            self._lost = f"its {name} is larger than {_MOST[name] // _MIB} MiB"
            return False
        return bool(block)

    def _look(self, deadline: float, is_silent: bool) -> None:
        """See whether its time is over; while it is silent, whether there are too many processes, or too large ones."""
        if time.monotonic() > deadline:
            self._lost = f"did not end within {self._request['real_time']:g} s of real time"
        if not (is_silent and self._is_alone):
            return
        allowed, memory = self._request["processes"], self._request["memory"]
        processes = [int(name) for name in os.listdir("/proc") if name.isdigit()]
        own = _resident(os.getpid())
        taken = sum(max(0, _resident(one) - own) for one in processes) / _MIB
        if sum(map(_threads, processes)) > allowed + 2:  # this one, and the flight's own
            self._lost = f"began more than {allowed} processes and threads"
        elif taken > memory:
            self._lost = f"took more than {memory} MiB of memory"

    def _kill(self) -> None:
        """Kill all of it that there is now."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)  # which may have no group of its own yet
        if self._is_alone:
            with contextlib.suppress(ProcessLookupError):
                os.kill(-1, signal.SIGKILL)

    def _clear_away(self) -> None:
        """Kill what has left its group: orphans become children of this process."""
        for _ in range(_ROUNDS):
            try:
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
            except ChildProcessError:
                return
            self._kill()
            for child in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(child), signal.SIGKILL)
            time.sleep(1e-4)
        raise RuntimeError("a script's processes cannot be killed")

    def reply(self) -> tuple[dict[str, Any], bytes]:
        """Return `result` as JSON, or `lost`: why there is none, in one line; and the table."""
        got = bytes(self._got["result"])
        if not self._lost and got.startswith(self._nonce):
            with contextlib.suppress(ValueError):
                return {"result": json.loads(got[_NONCE:])}, bytes(self._got["table"])
        return {"lost": self._lost or self._end_of_process()}, b""

    def _end_of_process(self) -> str:
        number = -os.waitstatus_to_exitcode(self._status)
        seconds = self._request["seconds"]
        if number == signal.SIGXCPU or (number == signal.SIGKILL and self._used >= seconds):
            return f"took more than {seconds:g} s of processor time"
        if number > 0:
            return f"crashed: its process was ended by {_name_of(number)}"
        return f"ended its process, with status {-number}, before the flight was over"


def _name_of(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _resident(process: int) -> int:
    """Return how many bytes of memory a process has that are no file's; 0 where it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    return sum(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith(("RssAnon", "RssShmem")))


def _threads(process: int) -> int:
    try:
        return len(os.listdir(f"/proc/{process}/task"))
    except OSError:
        return 0


# ---- in the process of the flight


def _fly(plan: Plan, request: dict[str, Any], pipes: dict[str, int], nonce: bytes) -> NoReturn:
    script, seed, changes = request["script"], request["seed"], request["changes"]
    try:
        _keep_only(pipes)
        _end_with_parent()
        _limit(*(request[name] for name in ("seconds", "memory", "files", "processes", "open_files")))
        table = f"/proc/self/fd/{pipes['table']}" if request["table"] else None
        try:
            result = grade(plan, script, seed, changes, table)
        except BaseException as error:
            result = ungraded(plan, script, seed, changes, _format_error(error))
        with open(pipes["result"], "wb") as file:
            file.write(nonce + json.dumps(result.to_json()).encode())
    finally:
        os._exit(0)  # no exit handlers, neither a script's nor this package's


def _keep_only(pipes: dict[str, int]) -> None:
    """Be in a session of its own, with nothing open but the pipes, and nothing where a script prints to."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(nothing, number)
    kept = sorted((2, *pipes.values()))
    for low, high in zip(kept, (*kept[1:], 2**16)):
        os.closerange(low + 1, high)


def _format_error(error: BaseException) -> str:
    """Return one line for what no flight should raise: memory that ran out, a script that exits."""
    try:
        said = format_error(error)
    except Exception:
        said = ""
    return f"{type(error).__name__}: {said:.300}".removesuffix(": ")


# ---- what it takes upon itself before a script runs in it, and cannot lift again


def _limit(seconds: float, memory: int, files: int, processes: int, open_files: int) -> None:
    """Limit this process, and what it begins, for good: s of processor time, MiB, MiB of a file, numbers.

    Memory is counted from what the process has now. Not the addresses (RLIMIT_AS) are what is limited first, of which
    OpenGL reserves many and uses few, but the pages that are its own (RLIMIT_DATA); addresses are limited to more
    than that, for memory that is shared is not counted among the pages. A crash leaves no core.
    """
    own, addresses = _memory()
    seconds = max(1, round(seconds))
    for what, limit in (
        (resource.RLIMIT_CPU, (seconds, seconds + _LIFETIME)),
        (resource.RLIMIT_DATA, own + memory * _MIB),
        (resource.RLIMIT_AS, addresses + (memory + _RESERVED) * _MIB),
        (resource.RLIMIT_NPROC, _tasks_of_user() + processes),
        (resource.RLIMIT_NOFILE, open_files),
        (resource.RLIMIT_FSIZE, files * _MIB),
        (resource.RLIMIT_CORE, 0),
    ):
        _set_limit(what, limit if isinstance(limit, tuple) else (limit, limit))


def _end_with_parent() -> None:
    """Let the kernel kill this process when the one that forked it ends, and gain no rights by set-user-ID programs."""
    _prctl(_PR_SET_DUMPABLE, 1)  # or its own /proc/self/fd is closed to it
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)


def _set_limit(what: int, limit: tuple[int, int]) -> None:
    hard = resource.getrlimit(what)[1]
    if hard != resource.RLIM_INFINITY:
        limit = (min(limit[0], hard), min(limit[1], hard))
    resource.setrlimit(what, limit)


def _memory() -> tuple[int, int]:
    """Return the bytes of this process's own pages and of its addresses, as the limits count them."""
    status = Path("/proc/self/status").read_text()
    own, addresses = (int(status.partition(f"{name}:")[2].split()[0]) for name in ("VmData", "VmSize"))
    return own * 1024, addresses * 1024


def _tasks_of_user() -> int:
    """Return how many threads of this user's processes there are, among which RLIMIT_NPROC counts new ones."""
    count, user = 0, os.getuid()
    for entry in os.scandir("/proc"):
        try:
            if entry.name.isdigit() and entry.stat().st_uid == user:
                count += len(os.listdir(f"/proc/{entry.name}/task"))
        except OSError:  # it has ended
            continue
    return count


def _prctl(option: int, value: int) -> None:
    if _LIBC.prctl(option, ctypes.c_ulong(value), *(ctypes.c_ulong(0),) * 3):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
