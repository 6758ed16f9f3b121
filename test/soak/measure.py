"""Evaluation of samples of the node's process, of its output, and of the clients' diaries."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

MOST_MORE = 8  # threads, descriptors, registrations
_VARIABLE_PARTS = re.compile(r"\d[\d.e+-]*|'[^']*'|/\S+")


class Sample(NamedTuple):
    """State of a node at a time (s): memory in MB, threads, open descriptors, and its registrations with the master."""

    at: float
    memory: float
    threads: int
    descriptors: int
    registrations: int = 0


def slope(samples: Sequence[Sample]) -> float:
    """Return the growth of memory (MB/min): the median slope between two samples (Theil-Sen estimator)."""
    at, memory = np.array([[s.at, s.memory] for s in samples]).T
    first, second = np.triu_indices(len(at), 1)
    far = at[second] - at[first] > 0.2 * (at[-1] - at[0])
    slopes = (memory[second] - memory[first])[far] / (at[second] - at[first])[far]
    return float(np.median(slopes) * 60.0) if len(slopes) else 0.0


def last_half(samples: Sequence[Sample]) -> Sequence[Sample]:
    """Return the later half: in the first half, the allocator's caches for dozens of threads fill."""
    return samples[len(samples) // 2 :]


def growth(
    samples: list[Sample], most_slope: float = 1.0, least_memory: float = 15.0, judged: float = 90.0
) -> list[str]:
    """Return what grew over the last half, if that lasted `judged` seconds.

    Memory counts as growing above a slope of `most_slope` (MB/min) and a total of `least_memory` (MB).
    """
    rest = last_half(samples)
    if not rest or rest[-1].at - rest[0].at < judged:
        return []
    found = []
    third = len(rest) // 3
    early, late = rest[:third], rest[-third:]
    risen = min(s.memory for s in late) - min(s.memory for s in early)
    if slope(rest) > most_slope and risen > least_memory:
        found.append(f"memory grows by {slope(rest):.2f} MB a minute")
    for name in ("threads", "descriptors", "registrations"):
        more = min(getattr(s, name) for s in late) - min(getattr(s, name) for s in early)
        if more > MOST_MORE:
            found.append(f"{name} grow: {more} more")
    return found


def late_steps(lines: list[str]) -> int:
    """Return the number of late steps that the node has reported."""
    counts = [
        int(n) for line in lines for n in re.findall(r"\((\d+) so far\)|(\d+) late steps", line)[0:1] for n in n if n
    ]
    return max(counts, default=0)


def answers(diary: list[Any]) -> dict[str, Counter]:
    """Count the services' replies, with numbers and names replaced."""
    replies: dict[str, Counter] = {}
    for what, _, succeeded, text in diary:
        if what != "odom":
            key = "well" if succeeded else _VARIABLE_PARTS.sub("_", text)[:110]
            replies.setdefault(what, Counter())[key] += 1
    return replies


def faults(lines: list[str], diary: list[Any], samples: list[Sample]) -> list[str]:
    """Return what went wrong."""
    found = [
        f"{what}: {text} after {seconds:.1f} s"
        for what, seconds, _, text in diary
        if text[:4] in ("HUNG", "NOT ", "NO A")
    ]
    found += [f"the node printed: {line[:200]}" for line in lines if "Traceback" in line]
    return [*found[:10], *growth(samples)]


def report(samples: list[Sample], lines: list[str], diary: list[Any], began: float) -> str:
    now, calls = samples[-1], [entry for entry in diary if entry[0] != "odom"]
    odometry = [int(text) for what, _, succeeded, text in diary if what == "odom" and succeeded][-10:]
    refused = sum(not succeeded for _, _, succeeded, _ in calls)
    slowest = max((seconds for _, seconds, _, _ in calls), default=0.0)
    return (
        f"{now.at - began:6.0f} s  {now.memory:6.1f} MB {slope(last_half(samples)):+6.2f} MB/min  "
        f"{now.threads:3d} threads {now.descriptors:4d} descriptors  {late_steps(lines):4d} late  "
        f"{len(calls):5d} calls {refused:4d} refused, slowest {slowest:.1f} s  "
        f"{np.mean(odometry) if odometry else 0:5.1f} odom/s"
    )
