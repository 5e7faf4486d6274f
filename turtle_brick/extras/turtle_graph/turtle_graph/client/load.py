# SPDX-License-Identifier: Apache-2.0
"""
Measure how much other programs delay a graph on this machine.

Linux counts how long each thread runs and how long it waits for a processor although it could run.
In a window of a fifth of a second, the delay of a graph is the longest wait of its threads,
multiplied by the share of other programs in the used processor time. This product is small if the
threads of the graph wait only for one another, or if a processor is free whenever they need one.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import psutil

WINDOW_NS = 200_000_000
"""Duration (ns) of a window."""
SEARCH_NS = 3_000_000_000
"""Time (ns) after which the processes of the graph are searched for again."""
MAX_DELAY, MAX_WINDOW_NS = 0.1, 1_000_000_000
"""Maximum delay in a calm window, as a fraction of its duration, and its maximum duration (ns)."""


class Window(NamedTuple):
    """A time span (ns) with the delay of the graph, as a fraction of the time span."""

    begin: int
    end: int
    delay: float

    @property
    def calm(self) -> bool:
        """Return whether the delay is so short that it cannot explain a failure."""
        # If this program itself is late, the window does not show short delays of the graph.
        return self.delay <= MAX_DELAY and self.end - self.begin <= MAX_WINDOW_NS


class LoadMeter:
    """A meter for the delay of a graph. Each call of `measure` ends a window."""

    def __init__(self, processes: Callable[[], Iterable[int]]) -> None:
        """Measure the delay of processes. The function `processes` returns their IDs."""
        self._processes = processes
        self._searched_at = 0
        self._found: list[int] = []
        self._begin, self._busy, self._times = 0, 0.0, dict[Path, tuple[float, float]]()

    def measure(self, now: int) -> Window | None:
        """Return the window that ends now (ns), or None if it is too short."""
        if now - self._begin < WINDOW_NS:
            return None
        if now - self._searched_at > SEARCH_NS:
            self._searched_at, self._found = now, list(self._processes())
        begin, busy, times = self._begin, self._busy, self._times
        self._begin, self._busy, self._times = now, used_time(), thread_times(self._found)
        # A thread that did not exist at the beginning of the window is not measured.
        changes = [(ran - times[thread][0], waited - times[thread][1])
                   for thread, (ran, waited) in self._times.items() if thread in times]
        used = self._busy - busy
        if not (begin and changes and used > 0.0):
            return Window(begin, now, 0.0) if begin else None
        others = max(1.0 - sum(ran for ran, _ in changes) / used, 0.0)
        waited = max(waited for _, waited in changes)
        return Window(begin, now, others * waited / ((now - begin) * 1e-9))


def used_time() -> float:
    """Return the time (s) for which the processors were in use, including by other machines."""
    times = psutil.cpu_times()
    return float(sum(times[:8]) - times.idle - times.iowait)


def thread_times(processes: Iterable[int]) -> dict[Path, tuple[float, float]]:
    """Return the times (s) for which the threads of processes have run and waited."""
    times = {}
    for process in processes:
        for path in Path('/proc', str(process), 'task').glob('*/schedstat'):
            with suppress(OSError):  # The thread has ended.
                ran, waited, _ = path.read_text().split()
                times[path] = int(ran) * 1e-9, int(waited) * 1e-9
    return times
