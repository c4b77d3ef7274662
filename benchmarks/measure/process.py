"""The time and memory of commands.

Entry points: `time_command`, `peak_memory`, `stop`. Figures are of whole process trees.
"""

from __future__ import annotations

import contextlib
import os
import signal
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from coursebuild.core.run import gate

SAMPLE = 0.02
"""Seconds between two samples of the memory."""
LIMIT = 900.0
"""Seconds that any command may take."""


class CommandError(Exception):
    """A command failed."""


def time_command(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> float:
    """Seconds that a command takes, from its start to its end.

    Raises:
        CommandError: it failed; with the end of its output.
    """
    with tempfile.TemporaryFile() as output:
        start = time.perf_counter()
        process = gate.start(
            command, environment, folder=folder, stdout=output, stderr=output, bound=False
        )
        try:
            status = process.wait(LIMIT)
        finally:
            stop(process)
        seconds = time.perf_counter() - start
        if status:
            output.seek(0)
            text = output.read().decode(errors="replace")[-2000:]
            raise CommandError(f"{' '.join(command)}: status {status}\n{text}")
    return seconds


def peak_memory(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> float:
    """The peak memory of a command and its children, MB.

    It is sampled, and pages that several processes share count once (Linux: proportional set size).
    """
    process = gate.start(command, environment, folder=folder, bound=False)
    peak = 0.0
    has_ended = threading.Event()

    def watch() -> None:
        nonlocal peak
        while not has_ended.wait(SAMPLE):
            peak = max(peak, sum(map(proportional_size, session(process.pid))))

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        status = process.wait()
    finally:
        has_ended.set()
        watcher.join()
    if status:
        raise CommandError(f"{' '.join(command)}: status {status}")
    return peak / 1e6


def session(leader: int) -> list[int]:
    """The processes of a session."""
    pids = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError, IndexError):
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == leader:
                    pids.append(int(folder.name))
    return pids


def proportional_size(pid: int) -> int:
    """The proportional set size of a process, bytes: of what n processes share, an n-th part."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return 1024 * int(line.split()[1])
    return 0


def stop(process: gate.Process) -> None:
    """End a process that leads a session, and all its children."""
    for signal_ in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal_)
        with contextlib.suppress(gate.StillRunningError):
            process.wait(3)
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
