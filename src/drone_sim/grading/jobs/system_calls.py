"""A seccomp filter for the process of a submission, with bubblewrap or without it.

The filter refuses calls for memory that the resource limits do not count, for objects that outlive a flight (System V
objects, message queues, keys), and for access to other processes and the network. In Python a refused call raises
PermissionError.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
from collections.abc import Iterator

# The numbers of each call on x86-64 and on arm64, from the kernel's headers asm/unistd_64.h and asm-generic/unistd.h.
_FORBIDDEN = {
    # System V objects and POSIX message queues stay in the kernel when a process ends.
    **{"shmget": (29, 194), "shmat": (30, 196), "shmctl": (31, 195)},
    **{"semget": (64, 190), "semop": (65, 193), "semctl": (66, 191), "semtimedop": (220, 192)},
    **{"msgget": (68, 186), "msgsnd": (69, 189), "msgrcv": (70, 188), "msgctl": (71, 187)},
    **{"mq_open": (240, 180), "mq_unlink": (241, 181)},
    # Keys, and extended attributes of a folder, stay in the kernel, too.
    **{"add_key": (248, 217), "request_key": (249, 218), "keyctl": (250, 219)},
    **{"setxattr": (188, 5), "lsetxattr": (189, 6), "fsetxattr": (190, 7), "setxattrat": (463, 463)},
    # Memory that does not count for any process.
    **{"memfd_create": (319, 279), "memfd_secret": (447, 447), "vmsplice": (278, 75), "userfaultfd": (323, 282)},
    # The network; io_uring can make any of the calls here.
    "socket": (41, 198),
    **{"io_uring_setup": (425, 425), "io_uring_enter": (426, 426), "io_uring_register": (427, 427)},
    # Rights over namespaces and the kernel.
    **{"unshare": (272, 97), "setns": (308, 268), "bpf": (321, 280), "perf_event_open": (298, 241)},
    # Another process: its memory, its descriptors, and how fast it runs.
    **{"ptrace": (101, 117), "process_vm_readv": (310, 270), "process_vm_writev": (311, 271), "kcmp": (312, 272)},
    **{"process_madvise": (440, 440), "pidfd_getfd": (438, 438), "setpriority": (141, 140), "ioprio_set": (251, 30)},
    **{"sched_setparam": (142, 118), "sched_setscheduler": (144, 119), "sched_setattr": (314, 274)},
}
_CLONE3 = (435, 435)  # The filter cannot see its flags; after ENOSYS the C library calls clone.
_ANY = 0xFFFFFFFF
_NEW_NAMESPACES = 0x7E020000  # all the flags CLONE_NEW…
_SHARED, _ANONYMOUS = 0x01, 0x20
_SO_RCVTIMEO, _SO_SNDTIMEO = 20, 21
# Calls that are allowed only with some values of an argument: its index, a mask, and the values after the mask.
_RESTRICTED = {
    "clone": ((56, 220), 0, _NEW_NAMESPACES, (0,)),
    # Shared anonymous memory counts for a process only as long as this process has its pages mapped.
    "mmap": ((9, 222), 3, _SHARED | _ANONYMOUS, (0, _SHARED, _ANONYMOUS)),
    "prlimit64": ((302, 261), 0, _ANY, (0,)),  # 0: the calling process
    "sched_setaffinity": ((203, 122), 0, _ANY, (0,)),
    "setsockopt": ((54, 208), 2, _ANY, (_SO_RCVTIMEO, _SO_SNDTIMEO)),  # not larger buffers
}
# By the machine: the index of its numbers above, AUDIT_ARCH_…, and the number of seccomp(2).
_MACHINES = {"x86_64": (0, 0xC000003E, 317), "aarch64": (1, 0xC00000B7, 277)}
_X32 = 0x40000000  # On x86-64, calls of the x32 ABI have numbers from here on.
_EPERM, _ENOSYS = 1, 38
_NUMBER_AT, _ARCHITECTURE_AT, _ARGUMENTS_AT = 0, 4, 16  # bytes, in struct seccomp_data
_LOAD, _AND, _IF_EQUAL, _IF_AT_LEAST, _RETURN = 0x20, 0x54, 0x15, 0x35, 0x06
_ALLOW, _FAIL = 0x7FFF0000, 0x00050000
_SET_MODE_FILTER, _SPECULATION_ALLOWED = 1, 4  # Without the second one, an older kernel slows the process down.
_PR_SET_NO_NEW_PRIVS = 38


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


def forbid() -> None:
    """Install the filter permanently in this process and its children; on other processors do nothing.

    Raises OSError.
    """
    machine = _MACHINES.get(platform.machine())
    if machine is None or struct.calcsize("P") != 8:
        return
    index, architecture, seccomp = machine
    code = b"".join(_instructions(index, architecture))
    program = _Program(len(code) // 8, code)
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_PR_SET_NO_NEW_PRIVS, *map(ctypes.c_ulong, (1, 0, 0, 0)))
    for flags in (_SPECULATION_ALLOWED, 0):  # an old kernel does not know the flag
        words = map(ctypes.c_ulong, (seccomp, _SET_MODE_FILTER, flags))
        if library.syscall(*words, ctypes.byref(program)) == 0:
            return
    number = ctypes.get_errno()
    raise OSError(number, f"the kernel accepts no seccomp filter: {os.strerror(number)}")


def _instructions(index: int, architecture: int) -> Iterator[bytes]:
    """Yield the filter's instructions; a jump skips 0 instructions or the number given for the other case."""
    yield _code(_LOAD, _ARCHITECTURE_AT)
    yield _code(_IF_EQUAL, architecture, 1, 0)
    yield _code(_RETURN, _FAIL | _EPERM)
    yield _code(_LOAD, _NUMBER_AT)
    yield _code(_IF_AT_LEAST, _X32, 0, 1)
    yield _code(_RETURN, _FAIL | _EPERM)
    yield _code(_IF_EQUAL, _CLONE3[index], 0, 1)
    yield _code(_RETURN, _FAIL | _ENOSYS)
    for numbers in _FORBIDDEN.values():
        yield _code(_IF_EQUAL, numbers[index], 0, 1)
        yield _code(_RETURN, _FAIL | _EPERM)
    for numbers, argument, mask, values in _RESTRICTED.values():
        yield _code(_IF_EQUAL, numbers[index], 0, 2 * len(values) + 3)
        yield _code(_LOAD, _ARGUMENTS_AT + 8 * argument)  # the lower half
        yield _code(_AND, mask)
        for value in values:
            yield _code(_IF_EQUAL, value, 0, 1)
            yield _code(_RETURN, _ALLOW)
        yield _code(_RETURN, _FAIL | _EPERM)
    yield _code(_RETURN, _ALLOW)


def _code(operation: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("=HBBI", operation, if_true, if_false, value)
