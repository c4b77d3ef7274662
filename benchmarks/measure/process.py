"""A command, and what it took.

Entry points: `timed`, `peak_memory`, `stop`. Figures are of whole process trees.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

SAMPLE = 0.02
"""Seconds between two looks at the memory."""
LIMIT = 900.0
"""Seconds that any command may take."""


class CommandError(Exception):
    """A command did not do what it was to do."""


def timed(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> float:
    """Seconds that a command takes, from its start to its end.

    Raises:
        CommandError: it failed; with the end of what it said.
    """
    with tempfile.TemporaryFile() as said:
        began = time.perf_counter()
        done = subprocess.run(
            command,
            cwd=folder,
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            check=False,
            timeout=LIMIT,
        )
        took = time.perf_counter() - began
        if done.returncode:
            said.seek(0)
            text = said.read().decode(errors="replace")[-2000:]
            raise CommandError(f"{' '.join(command)}: status {done.returncode}\n{text}")
    return took


def peak_memory(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> float:
    """The most memory that a command and its children hold at once, MB.

    It is sampled, and pages that several processes share count once (Linux: proportional set size).
    """
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=dict(environment),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    peak = 0.0
    ended = threading.Event()

    def watch() -> None:
        nonlocal peak
        while not ended.wait(SAMPLE):
            peak = max(peak, sum(map(proportional_size, session(process.pid))))

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        status = process.wait()
    finally:
        ended.set()
        watcher.join()
    if status:
        raise CommandError(f"{' '.join(command)}: status {status}")
    return peak / 1e6


def session(leader: int) -> list[int]:
    """The processes of a session."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError, IndexError):
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == leader:
                    found.append(int(folder.name))
    return found


def proportional_size(pid: int) -> int:
    """Bytes of a process in memory; of what n processes share, an n-th part."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return 1024 * int(line.split()[1])
    return 0


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a process that leads a session, and all that it has started."""
    for signal_ in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal_)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(3)
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
