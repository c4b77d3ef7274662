"""Inputs of a target, tried one after the other, with limits of time and memory for each."""

from __future__ import annotations

import hashlib
import json
import resource
import signal
import sys
import time
import traceback
from pathlib import Path

from fuzz.targets import Target

SECONDS, PER_CHARACTER = 1.0, 0.002
"""Processor time that an input may take; instrumented code is some four times as slow."""
MOST_SECONDS = 10
"""Processor time that no input may take: after it the attempt is broken off."""
MOST_MEMORY = 1024
"""MiB by which an input may increase what the process holds."""
REPEAT_INTERVAL = 150
SIZE, GROWTH = 4000, 24
"""Characters of a repeated input, and how often the time of eight times them may be theirs."""
WORST = "worst.json"
"""The file with the most seconds and MiB that an input took."""


class SlownessError(BaseException):
    """An input takes too long. No code under test catches it."""


class HungerError(Exception):
    """An input takes too much memory."""


class Attempts:
    """The inputs that are tried, and what was wrong with some, in a folder."""

    def __init__(self, target: Target, folder: Path, interval: int = REPEAT_INTERVAL) -> None:
        """`interval`: of so many inputs one is repeated."""
        self.target = target
        self.folder = folder
        self.interval = interval
        self.count = 0
        self.signatures: set[str] = set()
        self.worst = [0.0, 0.0]
        for path in folder.glob("found-*.json"):  # by a worker that was ended
            self.signatures.add(json.loads(path.read_text())[0])
        if (folder / WORST).exists():
            self.worst = json.loads((folder / WORST).read_text())
        signal.signal(signal.SIGPROF, self.stop)
        target.attempt(next(target.seeds()))  # imports what it needs, and fills caches

    def __call__(self, data: bytes) -> None:
        """Try an input, and note what is wrong."""
        try:
            self.judge(data)
        except (Exception, SlownessError) as error:
            self.note(data, error)

    def judge(self, data: bytes) -> None:
        """Try an input; raise what is wrong."""
        self.count += 1
        seconds = self.seconds(data)
        if seconds > SECONDS + PER_CHARACTER * len(data):
            raise SlownessError(f"{len(data)} bytes take {seconds:.1f} s")
        if self.target.repeatable and data and self.count % self.interval == 0:
            self.repeat(data)

    def seconds(self, data: bytes) -> float:
        before, peak = resident(), peak_memory()
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
        start = time.process_time()
        try:
            self.target.attempt(data)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        seconds = time.process_time() - start
        if seconds > MOST_SECONDS:
            raise SlownessError(f"{len(data)} bytes take {seconds:.1f} s")
        memory = peak_memory() - before if peak_memory() > peak else 0.0
        if seconds > self.worst[0] or memory > self.worst[1]:
            self.worst = [max(seconds, self.worst[0]), max(memory, self.worst[1])]
            (self.folder / WORST).write_text(json.dumps(self.worst))
        if memory > MOST_MEMORY:
            Path("/proc/self/clear_refs").write_text("5")  # the peak is what is held now
            raise HungerError(f"{len(data)} bytes take {memory:.0f} MiB")
        return seconds

    def stop(self, *_: object) -> None:
        raise SlownessError(f"an input takes more than {MOST_SECONDS} s")

    def repeat(self, data: bytes) -> None:
        """Time grows with the text, and no faster."""
        few = data * (SIZE // len(data) + 1)
        for _ in range(3):  # whatever else the machine does
            before = self.seconds(few)
            after = self.seconds(few * 8)
            if after < 1 or after < GROWTH * before:
                return
        raise SlownessError(
            f"repeated, eight times the text takes {after / before:.0f} times as long"
        )

    def note(self, data: bytes, error: BaseException) -> None:
        """Keep the input of a mistake that was not found yet."""
        frames = traceback.extract_tb(error.__traceback__)
        place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}"
        if isinstance(error, SlownessError | HungerError):
            place = str(error).split()[0]
        signature = f"{type(error).__name__} {place}"
        if signature not in self.signatures:
            self.signatures.add(signature)
            name = f"found-{hashlib.sha256(data).hexdigest()[:12]}"
            (self.folder / name).write_bytes(data)
            lines = traceback.format_exception(error)
            (self.folder / f"{name}.json").write_text(json.dumps([signature, "".join(lines)]))


def peak_memory() -> float:
    """The most MiB that the process has held."""
    units = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / units


def resident() -> float:
    """The MiB that the process holds; where the system does not say it, what it held at most."""
    try:
        pages = int(Path("/proc/self/statm").read_bytes().split()[1])
    except FileNotFoundError:
        return peak_memory()
    return pages * resource.getpagesize() / (1 << 20)
