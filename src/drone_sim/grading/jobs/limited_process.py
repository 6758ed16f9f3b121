"""A process of a flight (the judge's or the script's) that is forked, limited, watched and killed with its children."""

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

_BLOCK = 2**18  # bytes
_EXIT_TIMEOUT = 5.0  # s, for the kernel to end a process on a busy machine
_CHECK_INTERVAL = 0.1  # s, between two checks of the number of processes and of their memory
_KILL_ATTEMPTS = 10_000
_MAX_FILES = 20_000  # in the temporary folders of a submission: each takes 1 KiB of the kernel's memory
_MIB = 2**20
_RESERVED = 2048  # MiB of addresses beyond the used ones: libraries reserve more than they use
_GRACE = 1  # s of processor time after SIGXCPU, which a script may ignore
_LIBC = ctypes.CDLL(None, use_errno=True)
_MEMORY_FIELDS = ("RssAnon", "RssShmem", "VmSwap")  # in /proc/…/status
_CAPABILITY_VERSION = 0x20080522
_CAPABILITIES_OVER_OTHERS = (16, 17, 19, 21, 38, 39)  # CAP_SYS_MODULE, _RAWIO, _PTRACE, _ADMIN, CAP_PERFMON, CAP_BPF
_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_CHILD_SUBREAPER, _PR_SET_NO_NEW_PRIVS = 1, 4, 36, 38


def hide_memory() -> None:
    """Prevent other processes of the same user from reading this process's memory, or tracing it."""
    _prctl(_PR_SET_DUMPABLE, 0)


def adopt_orphans() -> None:
    """Make this process the parent of the processes that its ended descendants leave."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


class LimitedProcess:
    """A function that runs in a forked process with limits."""

    def __init__(
        self,
        limits: Mapping[str, Any],
        function: Callable[[Mapping[str, int]], None],
        outputs: Mapping[str, int],
        inherited: Sequence[int] = (),
        sandbox_folders: Sequence[str] = (),
    ):
        """Fork the process, which calls `function` with a descriptor to write to for each name in `outputs`.

        `limits` are those of config/grading.yaml, with `real_time` and `seconds` for this flight. The values of
        `outputs` are the largest numbers of bytes. The process inherits only the descriptors `inherited`.
        `sandbox_folders` are the writable folders of the sandbox around this process, in which there are no processes
        of others; () if there is no sandbox.
        """
        self._limits, self._output_limits = limits, outputs
        self._sandbox_folders = sandbox_folders
        self._pipes: dict[int, str] = {}  # names of outputs, by descriptor
        self._outputs = {name: bytearray() for name in outputs}
        self._exceeded = ""  # the limit that was exceeded, in words
        self._status = 0
        self._processor_time = 0.0  # s
        pipes = {name: os.pipe() for name in outputs}
        self._process = os.fork()
        if not self._process:
            _run_child(limits, function, {name: write for name, (_, write) in pipes.items()}, inherited)
        for name, (read, write) in pipes.items():
            os.close(write)
            os.set_blocking(read, False)
            self._pipes[read] = name
        self._pidfd = os.pidfd_open(self._process)

    def __enter__(self) -> LimitedProcess:
        return self

    def __exit__(self, *_exception: object) -> None:
        """Kill the process and all its descendants, and wait until they have ended."""
        self._kill()
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self._status = os.waitpid(self._process, 0)[1]
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self._processor_time = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self._kill_orphans()
        for descriptor in (*self._pipes, self._pidfd):
            os.close(descriptor)

    def watch(self, lifeline: int) -> bool:
        """Read outputs until the process ends or exceeds a limit; return False if `lifeline` becomes readable first."""
        poll = select.poll()
        for descriptor in self._pipes:
            poll.register(descriptor, select.POLLIN)
        poll.register(self._pidfd, select.POLLIN)
        poll.register(lifeline, select.POLLIN)
        deadline = time.monotonic() + self._limits["real_time"]
        while not self._exceeded:
            ready = dict(poll.poll(1000 * _CHECK_INTERVAL))
            if self._pidfd in ready:
                break
            if lifeline in ready:
                return False
            for descriptor in ready:
                if not self._read_block(descriptor):
                    poll.unregister(descriptor)
            if time.monotonic() > deadline:
                self._exceeded = f"did not end within {self._limits['real_time']:g} s of real time"
            elif not ready and self._sandbox_folders:
                self._exceeded = self._exceeded_in_sandbox()
        for descriptor in self._pipes:
            while self._read_block(descriptor):
                pass
        return True

    def wait_for_exit(self) -> bool:
        """Wait some seconds, and return whether the process has ended: the kernel closes its descriptors earlier."""
        return bool(select.select([self._pidfd], [], [], _EXIT_TIMEOUT)[0])

    def _read_block(self, descriptor: int) -> bool:
        """Read a block of an output; return whether there was one."""
        name = self._pipes[descriptor]
        try:
            block = os.read(descriptor, _BLOCK)
        except BlockingIOError:
            return False
        self._outputs[name] += block
        if len(self._outputs[name]) > self._output_limits[name]:
            self._exceeded = f"its {name} is larger than {self._output_limits[name] // _MIB} MiB"
            return False
        return bool(block)

    def _exceeded_in_sandbox(self) -> str:
        """Return the limit that all processes in the sandbox together exceed, in words; '' for none."""
        allowed, memory, sockets = (self._limits[name] for name in ("processes", "memory", "open_files"))
        processes = [int(name) for name in os.listdir("/proc") if name.isdigit()]
        most = allowed + 2  # this process, and the flight's own
        # Threads are counted only if there are few processes: counting those of a fork bomb would take too long.
        if len(processes) > most or sum(map(_thread_count, processes)) > most:
            return f"began more than {allowed} processes and threads"
        # A fork of this process starts with as much memory as this process has, which does not count. Further forks
        # count in full, even if they share the pages: telling shared pages needs a lock that a submission can hold.
        if sum(map(_memory_of, processes)) - 2 * _memory_of(os.getpid()) > memory * _MIB:
            return f"took more than {memory} MiB of memory"
        # The kernel lists all sockets of the sandbox's network, even those inside messages that were not received.
        if len(Path("/proc/self/net/unix").read_text().splitlines()) > sockets:  # with a line of titles
            return f"opened more than {sockets} sockets"
        file_systems = [os.statvfs(folder) for folder in self._sandbox_folders]
        if sum(file_system.f_files - file_system.f_ffree for file_system in file_systems) > _MAX_FILES:
            return f"made more than {_MAX_FILES} files"
        return ""

    def _kill(self) -> None:
        """Kill the process, its group and, in a sandbox, all other processes."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)  # it may not have its own group yet
        if self._sandbox_folders:
            with contextlib.suppress(ProcessLookupError):
                os.kill(-1, signal.SIGKILL)

    def _kill_orphans(self) -> None:
        """Kill the descendants outside the group, which have become children of this process."""
        for _ in range(_KILL_ATTEMPTS):
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
        return bytes(self._outputs[name])

    @property
    def end(self) -> str:
        if self._exceeded:
            return self._exceeded
        number = -os.waitstatus_to_exitcode(self._status)
        seconds = self._limits["seconds"]
        if number == signal.SIGXCPU or (number == signal.SIGKILL and self._processor_time >= seconds):
            return f"took more than {seconds:g} s of processor time"
        if number > 0:
            try:
                name = signal.Signals(number).name
            except ValueError:
                name = f"signal {number}"
            return f"crashed: its process was ended by {name}"
        return f"ended its process, with status {-number}, before the flight was over"


def _memory_of(process: int) -> int:
    """Return the bytes of memory of a process without those of files, 0 if it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    return sum(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith(_MEMORY_FIELDS))


def _thread_count(process: int) -> int:
    try:
        return len(os.listdir(f"/proc/{process}/task"))
    except OSError:
        return 0


# ---- in the forked process


def _run_child(
    limits: Mapping[str, Any],
    function: Callable[[Mapping[str, int]], None],
    outputs: Mapping[str, int],
    inherited: Sequence[int],
) -> NoReturn:
    try:
        _detach((*outputs.values(), *inherited))
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)  # the kernel kills this process when its parent ends
        _prctl(_PR_SET_NO_NEW_PRIVS, 1)  # set-user-ID programs give no rights
        _set_limits(*(limits[name] for name in ("seconds", "memory", "files", "processes", "open_files")))
        function(outputs)
    finally:
        os._exit(0)  # no exit handlers, neither a script's nor this package's


def _detach(descriptors: Sequence[int]) -> None:
    """Start a session, close all descriptors but some, and connect the standard streams to /dev/null."""
    os.setsid()
    null = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(null, number)
    kept = sorted((2, *descriptors))
    for low, high in zip(kept, (*kept[1:], 2**16)):
        os.closerange(low + 1, high)


def _set_limits(seconds: float, memory: int, files: int, processes: int | None, open_files: int) -> None:
    """Limit this process and its children permanently: s of processor time, MiB, MiB of each file, numbers.

    `processes` is None for a process that starts none, because setting the limit means to count all existing processes.

    `memory` is added to the memory that the process has now. The main limit is on the process's own pages
    (RLIMIT_DATA), not on its addresses (RLIMIT_AS), because OpenGL reserves many addresses and uses few. Addresses have
    a higher limit, because shared memory does not count among the pages. A crash leaves no core file.
    """
    status = Path("/proc/self/status").read_text()
    pages, addresses = (int(status.partition(f"{name}:")[2].split()[0]) * 1024 for name in ("VmData", "VmSize"))
    seconds = max(1, round(seconds))
    for kind, limit in (
        (resource.RLIMIT_CPU, (seconds, seconds + _GRACE)),
        (resource.RLIMIT_DATA, pages + memory * _MIB),
        (resource.RLIMIT_AS, addresses + (memory + _RESERVED) * _MIB),
        *([] if processes is None else [(resource.RLIMIT_NPROC, _user_thread_count() + processes)]),
        (resource.RLIMIT_NOFILE, open_files),
        (resource.RLIMIT_FSIZE, files * _MIB),
        (resource.RLIMIT_CORE, 0),
    ):
        soft, hard = limit if isinstance(limit, tuple) else (limit, limit)
        current = resource.getrlimit(kind)[1]
        if current != resource.RLIM_INFINITY:
            soft, hard = min(soft, current), min(hard, current)
        resource.setrlimit(kind, (soft, hard))


def stay_on_one_processor() -> int | None:
    """Pin this process to the processor on which it runs; return the processor, or None if that is not permitted."""
    number = _LIBC.sched_getcpu()
    try:
        os.sched_setaffinity(0, {number})
    except OSError:
        return None
    return int(number)


def drop_capabilities() -> None:
    """Give up root's rights over other processes, and let this process read its own files in /proc again."""
    _prctl(_PR_SET_DUMPABLE, 1)
    capabilities = (ctypes.c_uint32 * 6)()
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION, 0)
    if _LIBC.capget(header, capabilities) == 0:
        for number in _CAPABILITIES_OVER_OTHERS:
            for part in range(3):  # effective, permitted, inheritable
                capabilities[number // 32 * 3 + part] &= ~(1 << number % 32)
        _LIBC.capset(header, capabilities)


def _user_thread_count() -> int:
    """Return the number of threads of this user's processes, which RLIMIT_NPROC includes."""
    count, user = 0, os.getuid()
    for entry in os.scandir("/proc"):
        try:
            if entry.name.isdigit() and entry.stat().st_uid == user:
                count += len(os.listdir(f"/proc/{entry.name}/task"))
        except OSError:  # the process has ended
            continue
    return count


def _prctl(option: int, value: int) -> None:
    if _LIBC.prctl(option, ctypes.c_ulong(value), *(ctypes.c_ulong(0),) * 3):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
