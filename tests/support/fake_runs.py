"""A course folder with real files, on which runs of scripts are made up."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.engine.shared_place import shared_place
from coursebuild.core.engine.store import Store
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun, Trace
from coursebuild.core.run.run_store import RunStore

SCRIPT = b"print('hello')\n"
PATH = "examples/a.py"
JOB = ScriptJob(PATH, (), 10.0, ())
EMPTY_TRACE = Trace((), (), (), (), "")
MODEL_TRACE = Trace(("models/a.xml", "models/none.xml"), (), (), (), "")


@dataclass
class Desk:
    """A course folder, and commands on it one after the other."""

    root: Path
    fresh: bool = False
    shared: str | None = None
    messages: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.write(PATH, SCRIPT)
        self.write("models/a.xml", b"<mujoco/>")
        self.settle()

    def write(self, path: str, data: bytes) -> None:
        full = self.root / path
        full.parent.mkdir(parents=True, exist_ok=True)
        full.write_bytes(data)

    def settle(self) -> None:
        """Wait until the file system's clock has advanced past all earlier writes."""
        probe = self.root.with_name(f"{self.root.name}, clock")
        probe.touch()
        before = probe.stat().st_mtime_ns
        while probe.stat().st_mtime_ns <= before:
            time.sleep(0.001)
            probe.touch()

    def run_store(self) -> RunStore:
        """Return the results of a new command."""
        shared = None if self.shared is None else shared_place(self.shared)
        store = Store(self.root, fresh=self.fresh, shared=shared)
        store.listen(self.messages.append)
        return RunStore(self.root, store)

    def find_run(self, job: ScriptJob = JOB, text: bytes = SCRIPT) -> ScriptRun | None:
        run_store = self.run_store()
        return run_store.get_runs([run_store.inputs(job, text)]).get(job.path)

    def run(
        self,
        trace: Trace | None = EMPTY_TRACE,
        job: ScriptJob = JOB,
        text: bytes = SCRIPT,
        during: object = None,
        **fields: object,
    ) -> RunStore:
        """Record a run with this trace; return the store that has it."""
        run_store = self.run_store()
        run_store.begin()
        run_store.note_start(job.path)
        if callable(during):
            self.settle()
            during()
        run = ScriptRun(job.path, Outcome.OK, 0, "hello\n", "", 0.5, trace=trace)
        run_store.put_run(run_store.inputs(job, text), replace(run, **fields))
        run_store.store.close()
        return run_store

    def rerun_reason(self) -> str:
        last = self.run_store().last_record(PATH)
        assert last is not None
        return last.reason_forgotten
