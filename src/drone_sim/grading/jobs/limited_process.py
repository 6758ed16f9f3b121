"""A process of a flight, its judge's or its script's: forked, limited, watched, and ended with all its children."""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import select
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

_BLOCK = 2**18
_ENDING = 5.0  # s, for the kernel to take down a process, on a busy machine
_LOOKS = 0.1  # s between two looks at how many processes there are, and what they take
_ROUNDS = 10_000  # of killing what is left
_MOST_FILES = 20_000  # that a submission may have in its temporary folders: each takes 1 KiB of the kernel's memory
_MIB = 2**20
_RESERVED = 2048  # MiB of addresses beyond what is written to: libraries reserve more than they use
_LIFETIME = 1  # s of processor time after SIGXCPU, which a script may ignore
_LIBC = ctypes.CDLL(None, use_errno=True)
_RESIDENT = ("RssAnon", "RssShmem", "VmSwap")  # in /proc/…/status
_CAPABILITY_VERSION = 0x20080522
_OVER_OTHERS = (16, 17, 19, 21, 38, 39)  # CAP_SYS_MODULE, _RAWIO, _PTRACE, _ADMIN, CAP_PERFMON, CAP_BPF
_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_CHILD_SUBREAPER, _PR_SET_NO_NEW_PRIVS = 1, 4, 36, 38


def keep_to_itself() -> None:
    """Prevent other processes of the same user from reading this process's memory, or tracing it."""
    _prctl(_PR_SET_DUMPABLE, 0)


def guard() -> None:
    """Prevent others of the same user from reading this process's memory, and make it the parent of its orphans."""
    keep_to_itself()
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


class LimitedProcess:
    """Does one thing in a process of its own, with limits; says what came of it, and how it ended."""

    def __init__(
        self,
        limits: Mapping[str, Any],
        act: Callable[[Mapping[str, int]], None],
        outputs: Mapping[str, int],
        kept: Sequence[int] = (),
        sandbox_folders: Sequence[str] = (),
    ):
        """Fork it, to `act` with descriptors to write to, by the names of its `outputs`.

        `limits`: of a flight, as config/grading.yaml has them, with `real_time` and `seconds` for this one. `outputs`
        have the most bytes of each; descriptors that are `kept` stay open, too. `sandbox_folders`: the folders that
        can be written in the sandbox around this process, where there are no processes of others; () without one.
        """
        self._limits, self._most = limits, outputs
        self._sandbox_folders = sandbox_folders
        self._read: dict[int, str] = {}
        self._got = {name: bytearray() for name in outputs}
        self._lost = ""
        self._status = 0
        self._used = 0.0  # s of processor time
        ends = {name: os.pipe() for name in outputs}
        self._process = os.fork()
        if not self._process:
            _act(limits, act, {name: write for name, (_, write) in ends.items()}, kept)
        for name, (read, write) in ends.items():
            os.close(write)
            os.set_blocking(read, False)
            self._read[read] = name
        self._end = os.pidfd_open(self._process)

    def __enter__(self) -> LimitedProcess:
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
        """Read its output until it ends, or has to; return False if something comes by the pipe `lifeline` first."""
        poll = select.poll()
        for descriptor in self._read:
            poll.register(descriptor, select.POLLIN)
        poll.register(self._end, select.POLLIN)
        poll.register(lifeline, select.POLLIN)
        deadline = time.monotonic() + self._limits["real_time"]
        while not self._lost:
            ready = dict(poll.poll(1000 * _LOOKS))
            if self._end in ready:
                break
            if lifeline in ready:
                return False
            for descriptor in ready:
                if not self._take(descriptor):
                    poll.unregister(descriptor)
            self._look(deadline, not ready)
        self._take_all()
        return True

    def ends(self) -> bool:
        """Tell whether it ends by itself: the kernel closes its descriptors some time before it is gone."""
        return bool(select.select([self._end], [], [], _ENDING)[0])

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
        if len(self._got[name]) > self._most[name]:
            self._lost = f"its {name} is larger than {self._most[name] // _MIB} MiB"
            return False
        return bool(block)

    def _look(self, deadline: float, is_silent: bool) -> None:
        """End the watch when its time is over, or (while it is silent) when it takes more than is allowed."""
        if time.monotonic() > deadline:
            self._lost = f"did not end within {self._limits['real_time']:g} s of real time"
        elif is_silent and self._sandbox_folders:
            self._lost = self._excess()

    def _excess(self) -> str:
        """Return what all processes in the sandbox together have too much of; '' for nothing."""
        allowed, memory, sockets = (self._limits[name] for name in ("processes", "memory", "open_files"))
        processes = [int(name) for name in os.listdir("/proc") if name.isdigit()]
        most = allowed + 2  # this one, and the flight's own
        # Threads are counted only where the processes are few: to count those of a fork bomb would take too long.
        if len(processes) > most or sum(map(_threads, processes)) > most:
            return f"began more than {allowed} processes and threads"
        # Less what a fork of this process has from the start. More forks have the same again, whether or not they write
        # to it; only the lock of their memory would show which, and they can hold that.
        if sum(map(_resident, processes)) - 2 * _resident(os.getpid()) > memory * _MIB:
            return f"took more than {memory} MiB of memory"
        # The kernel lists all sockets of the sandbox's network, also those that wait in a message to be received.
        if len(Path("/proc/self/net/unix").read_text().splitlines()) > sockets:  # and a line of titles
            return f"opened more than {sockets} sockets"
        file_systems = [os.statvfs(folder) for folder in self._sandbox_folders]
        if sum(one.f_files - one.f_ffree for one in file_systems) > _MOST_FILES:
            return f"made more than {_MOST_FILES} files"
        return ""

    def _kill(self) -> None:
        """Kill all of it that there is now."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)  # which may have no group of its own yet
        if self._sandbox_folders:
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

    def output(self, name: str) -> bytes:
        """Return what it has written."""
        return bytes(self._got[name])

    @property
    def end(self) -> str:
        """How it ended, in one line."""
        return self._lost or self._end_of_process()

    def _end_of_process(self) -> str:
        number = -os.waitstatus_to_exitcode(self._status)
        seconds = self._limits["seconds"]
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
    return sum(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith(_RESIDENT))


def _threads(process: int) -> int:
    try:
        return len(os.listdir(f"/proc/{process}/task"))
    except OSError:
        return 0


# ---- in the process


def _act(
    limits: Mapping[str, Any], act: Callable[[Mapping[str, int]], None], outputs: Mapping[str, int], kept: Sequence[int]
) -> NoReturn:
    try:
        _keep_only((*outputs.values(), *kept))
        _end_with_parent()
        _limit(*(limits[name] for name in ("seconds", "memory", "files", "processes", "open_files")))
        act(outputs)
    finally:
        os._exit(0)  # no exit handlers, neither a script's nor this package's


def _keep_only(descriptors: Sequence[int]) -> None:
    """Be in a session of its own, with nothing open but some descriptors, and nothing where a script prints to."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(nothing, number)
    kept = sorted((2, *descriptors))
    for low, high in zip(kept, (*kept[1:], 2**16)):
        os.closerange(low + 1, high)


# ---- what it takes upon itself before a script runs in it, and cannot lift again


def _limit(seconds: float, memory: int, files: int, processes: int | None, open_files: int) -> None:
    """Limit this process, and what it begins, for good: s of processor time, MiB, MiB of a file, numbers.

    The limit of processes is None for a process that starts none: to set it, all existing ones have to be counted.

    Memory is counted from what the process has now. The main limit is on the process's own pages (RLIMIT_DATA), not on
    its addresses (RLIMIT_AS), because OpenGL reserves many addresses and uses few. Addresses have a higher limit,
    because shared memory does not count among the pages. A crash leaves no core file.
    """
    own, addresses = _memory()
    seconds = max(1, round(seconds))
    for what, limit in (
        (resource.RLIMIT_CPU, (seconds, seconds + _LIFETIME)),
        (resource.RLIMIT_DATA, own + memory * _MIB),
        (resource.RLIMIT_AS, addresses + (memory + _RESERVED) * _MIB),
        *([] if processes is None else [(resource.RLIMIT_NPROC, _tasks_of_user() + processes)]),
        (resource.RLIMIT_NOFILE, open_files),
        (resource.RLIMIT_FSIZE, files * _MIB),
        (resource.RLIMIT_CORE, 0),
    ):
        _set_limit(what, limit if isinstance(limit, tuple) else (limit, limit))


def _end_with_parent() -> None:
    """Let the kernel kill this process when the one that forked it ends, and gain no rights by set-user-ID programs."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)


def stay_on_one_processor() -> int | None:
    """Let this process run where it runs now, and nowhere else; return the processor, None where it may not."""
    number = _LIBC.sched_getcpu()
    try:
        os.sched_setaffinity(0, {number})
    except OSError:
        return None
    return int(number)


def open_to_itself() -> None:
    """Let this process see its own files in /proc, as any, but hold nothing of what root may do to other processes."""
    _prctl(_PR_SET_DUMPABLE, 1)
    capabilities = (ctypes.c_uint32 * 6)()
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION, 0)
    if _LIBC.capget(header, capabilities) == 0:
        for index, number in ((number // 32 * 3 + part, number % 32) for number in _OVER_OTHERS for part in range(3)):
            capabilities[index] &= ~(1 << number)
        _LIBC.capset(header, capabilities)


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
