"""Results that are recalled together: the same as one by one, and without looking at each."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from coursebuild.effects.store import Store
from coursebuild.pipeline import recalled
from coursebuild.pipeline.remember import Memory
from coursebuild.results import Outcome, ScriptJob, ScriptRun, Trace
from coursebuild.values import replace

JOBS = tuple(ScriptJob(f"examples/{name}.py", (), 10.0, ()) for name in "abcdefghij")
TRACE = Trace(("models/part.xml",), (), (), (), "")


class Course:
    """Ten scripts that look at one file."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.looked_up = 0
        (root / "models").mkdir(parents=True)
        self.write("one")

    def write(self, text: str) -> None:
        (self.root / "models/part.xml").write_text(text)

    def keep(self, stdout: str, jobs: tuple[ScriptJob, ...] = JOBS) -> None:
        """Have the scripts run."""
        memory = Memory(self.root, self.store())
        for job in jobs:
            (self.root / job.path).parent.mkdir(exist_ok=True)
            (self.root / job.path).write_bytes(b"#")
            memory.started(job.path)
        memory.begin()
        for job in jobs:
            run = ScriptRun(job.path, Outcome.OK, 0, stdout, "", 0.5, trace=TRACE)
            memory._started[job.path] = time.time_ns()
            memory.keep(memory.inputs(job, b"#"), run)
        memory.close()

    def store(self) -> Store:
        return Store(self.root)

    def recall(self) -> dict[str, str]:
        """What they printed, as it is remembered."""
        memory = Memory(self.root, store := self.store())
        group = store.group

        def counted(kind: str, key: str, *, newest: int = 8) -> list[str]:
            self.looked_up += 1
            return group(kind, key, newest=newest)

        store.group = counted  # type: ignore[method-assign]
        self.looked_up = 0
        found = memory.recall([memory.inputs(job, b"#") for job in JOBS])
        store.close()
        return {path: run.stdout for path, run in found.items()}
