"""The results of scripts: one runs again only if something that it depends on has changed.

1. What is known before a script runs determines a group of results; the one whose dependencies are
   all unchanged is its result. Groups that this machine lacks are sought in the shared cache.
2. After a run, the state of everything in its trace is read and stored with the result. If
   something changed while it ran, the script may have seen another state, and nothing is stored.
3. Of several processes that need the same result one runs the script, and the others get its
   result (`claim`). So `serve` and other commands can run scripts at the same time.
4. How a script's last run ended is noted under its path, whether it is remembered or not: for
   `explain`, and for the order in which scripts run.
"""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.engine import digests
from coursebuild.core.engine.store import Store
from coursebuild.core.files.locks import claim, unclaim
from coursebuild.core.files.trust import FOLDER
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import dependencies as needs
from coursebuild.core.run import run_record
from coursebuild.core.run.dependencies import Dependency, Inputs, Kind, Need
from coursebuild.core.run.run_record import STORABLE_OUTCOMES, RunRecord
from coursebuild.core.run.script_environment import (
    InstalledPackages,
    Interpreter,
    conditions,
    places,
)
from coursebuild.core.run.stat_tracing import existence, status

_RESULTS, _LAST = "scripts", "lastruns"
_MOST_SHARED = 32
"""The most results of one group that are fetched from the shared cache."""
_FETCHERS = 16
"""Requests to the shared cache at a time."""
_REASON = "{} changed while it ran"


class States:
    """The present states of needs, each read once, when it is first asked for."""

    def __init__(self, root: Path, store: Store, interpreter: Interpreter | None = None) -> None:
        self.root = root
        self._inside = f"{str(root).rstrip('/')}/"
        self.places = places(root, os.environ, interpreter)
        self.conditions = conditions(os.environ, interpreter)
        folders = None if interpreter is None else interpreter.packages
        self._installed = InstalledPackages(store, folders)
        self._states: dict[Need, str] = {}

    def __call__(self, need: Need) -> str:
        """The state of a need when it was first asked for."""
        if need not in self._states:
            self._states[need] = self.now(need)
        return self._states[need]

    def now(self, need: Need) -> str:
        """The state of a need at this moment."""
        match need.kind:
            case Kind.FILE:
                return digests.file_state(self._inside + need.name)
            case Kind.LISTING:
                return digests.folder_state(self._inside + need.name)
            case Kind.SOUGHT:
                folder, modules = needs.parse_sought(need.name)
                return digests.modules_in(self._inside + folder, modules)
            case Kind.EXISTENCE:
                return existence(self._inside + need.name)
            case Kind.STATUS:
                return status(self._inside + need.name)
            case Kind.OUTSIDE:
                return digests.file_state(need.name)
            case Kind.MODULE:
                return self._installed.version(need.name)
            case Kind.PLACE:
                return dict(self.places).get(need.name, "")


class RunStore:
    """The results of the scripts of a course in its store.

    With `fresh`, all is to be run again. Last runs are noted only for the course's own interpreter.
    """

    def __init__(
        self,
        root: Path,
        store: Store,
        *,
        fresh: bool = False,
        interpreter: Interpreter | None = None,
    ) -> None:
        self.is_elsewhere = interpreter is not None and interpreter.name != ""
        self.store = store
        self.fresh = fresh or store.fresh
        """Whether all is to be run, whatever is remembered."""
        self.states = States(root, store, interpreter)
        self.differing_runs: list[tuple[ScriptRun, ScriptRun]] = []
        """The remembered and the new run of scripts that differ though nothing changed."""
        self.edited_paths: set[str] = set()
        """The scripts that ran with another text than before."""
        self._clock = digests.Clock(store)
        self._started: dict[str, int] = {}

    def inputs(self, job: ScriptJob, text: bytes) -> Inputs:
        """The inputs of a script, which are known before it runs."""
        return needs.inputs_of(job, text, self.states.conditions)

    def get_runs(self, all_inputs: Sequence[Inputs]) -> dict[str, ScriptRun]:
        """The results that hold, by path; none where everything is to run."""
        if self.fresh:
            return {}
        local_records = [(inputs, self.get_record(inputs)) for inputs in all_inputs]
        records = [record for _, record in local_records if record is not None]
        records += self._fetch([inputs for inputs, record in local_records if record is None])
        return {record.inputs.path: record.restore(self.states.places) for record in records}

    def get_record(self, inputs: Inputs) -> RunRecord | None:
        """The result kept on this machine that holds now."""
        records = (record for record in self.records(inputs) if self._holds(record))
        record = next(records, None)
        if record is not None:
            self._note(record)
        return record

    def claim(self, inputs: Inputs) -> ScriptRun | bool:
        """Claim a run: its result if it has just ended, `False` while another process has it."""
        if not claim(self.store.folder, needs.group_key(inputs)):
            return False
        record = None if self.fresh else self.get_record(inputs)
        if record is None:
            return True
        self.unclaim(inputs)
        return record.restore(self.states.places)

    def unclaim(self, inputs: Inputs) -> None:
        """Let other processes run a script."""
        unclaim(self.store.folder, needs.group_key(inputs))

    def records(self, inputs: Inputs) -> Iterator[RunRecord]:
        """All results kept on this machine for these inputs, newest first."""
        for key in self.store.group(_RESULTS, needs.group_key(inputs)):
            record = self.store.peek(_RESULTS, key, run_record.from_bytes)
            if record is not None and _fits(record, inputs):
                yield record

    def last_record(self, path: str) -> RunRecord | None:
        """The record of a script's last run, without what it printed."""
        record = self.store.peek(_LAST, _last_key(path), run_record.from_bytes)
        return record if record is not None and record.inputs.path == path else None

    def reasons(self, inputs: Inputs) -> list[str]:
        """Why a result of these inputs is not used."""
        if self.fresh:
            return ["everything was asked to run again"]
        last = self.last_record(inputs.path)
        if last is None:
            aside = self.store.set_aside
            reasons = [f"{FOLDER} is not used: it {aside}"] if aside else []
            return ["there is no result of it on this machine", *reasons]
        clauses = needs.input_changes(last.inputs, inputs)
        clauses += needs.state_changes(last.dependencies, self.states)
        if last.reason_forgotten:
            clauses.append(f"its last result is not remembered: {last.reason_forgotten}")
        return clauses or ["its result is no longer kept"]

    def note_trial(
        self,
        inputs: Inputs,
        files: Iterable[str],
        *,
        ok: bool,
        lasting: bool,
        seconds: float,
        timestamp: int,
    ) -> None:
        """Note what a trial depends on besides its inputs: files of the course.

        `lasting`: whether its result can be used again. `timestamp`: in seconds since 1970.
        """
        states = ((path, self.states(Need(Kind.FILE, path))) for path in sorted(files))
        dependencies = tuple(Dependency(Kind.FILE, path, state) for path, state in states)
        reason = "" if lasting else "it may end differently next time"
        outcome = Outcome.OK if ok else Outcome.FAILED
        run = ScriptRun(inputs.path, outcome, 0, "", "", seconds)
        self._note(run_record.record_of(inputs, dependencies, timestamp, reason, run))

    def note_start(self, path: str) -> None:
        """Note that a script is about to run."""
        self._started[path] = self._clock.now()

    def begin(self) -> None:
        """Mark the moment before scripts run: any file written until now is older than they."""
        self._clock.tick()

    def put_run(self, inputs: Inputs, run: ScriptRun) -> None:
        """Remember the result of a run, or why it is not remembered."""
        states = self.states
        dependencies = needs.dependencies_of(run, inputs.requires, states.places, states.now)
        reason = needs.reason_forgotten(run) or self._reason_disturbed(inputs, dependencies)
        varies = ""
        for before in self.records(inputs) if self.fresh and not reason else ():
            if before.dependencies == dependencies:
                old = before.restore(states.places)
                is_same = old.outcome == run.outcome and old.status == run.status
                if not is_same or old.stdout != run.stdout:
                    self.differing_runs.append((old, run))
                    if run.unrepeated:  # else the lesson says what varies
                        varies = "two runs of it differed"
        record = run_record.record_of(inputs, dependencies, int(time.time()), reason or varies, run)
        if not reason:  # one that varies takes the place of the one that is kept
            assert run.outcome in STORABLE_OUTCOMES
            key = f"{needs.group_key(inputs)}/{needs.result_key(dependencies)}"
            data = run_record.to_bytes(record, states.places)
            self.store.put(_RESULTS, key, data, shared=True)
        last = self.last_record(inputs.path)
        if last is not None and last.inputs.text != inputs.text:
            self.edited_paths.add(inputs.path)
        self._note(record)

    def _reason_disturbed(self, inputs: Inputs, dependencies: Iterable[Dependency]) -> str:
        """Why the states read now may differ from what the script saw, in words; else empty."""
        if self.states.now(Need(Kind.FILE, inputs.path)) != inputs.text:
            return _REASON.format("its file")
        since = self._started.get(inputs.path)
        if since is None:
            return "its starting time is unknown"
        if self._clock.now() < since:
            return "the clock was set back while it ran"
        for dependency in dependencies:
            match dependency.kind:
                case Kind.FILE | Kind.LISTING:
                    path = str(self.states.root / dependency.name)
                case Kind.OUTSIDE:
                    path = dependency.name
                case Kind.EXISTENCE | Kind.STATUS:
                    if self.states.now(dependency.need) != dependency.state:
                        return _REASON.format(dependency.name)
                    continue
                case Kind.SOUGHT | Kind.MODULE | Kind.PLACE:
                    continue
            if digests.changed_since(path, since):
                return _REASON.format(path.removeprefix(f"{self.states.root}/"))
        return ""

    def _holds(self, record: RunRecord) -> bool:
        return next(needs.state_changes(record.dependencies, self.states), None) is None

    def _fetch(self, all_inputs: Sequence[Inputs]) -> list[RunRecord]:
        if self.store.shared is None or not all_inputs:
            return []

        def fetch(inputs: Inputs) -> list[RunRecord]:
            group = needs.group_key(inputs)
            local_keys = set(self.store.group(_RESULTS, group))
            all_keys = self.store.shared_group(_RESULTS, group)
            new_keys = [key for key in all_keys if key not in local_keys]
            records = (
                self.store.get(_RESULTS, key, run_record.from_bytes, shared=True)
                for key in new_keys[:_MOST_SHARED]
            )
            return [record for record in records if record is not None and _fits(record, inputs)]

        with ThreadPoolExecutor(_FETCHERS, "cache") as pool:
            groups = [filter(self._holds, group) for group in pool.map(fetch, all_inputs)]
        records = [record for group in groups if (record := next(group, None)) is not None]
        for record in records:
            self._note(record)
        return records

    def _note(self, record: RunRecord) -> None:
        if self.is_elsewhere or needs.is_perturbed(record.inputs):
            return
        key = _last_key(record.inputs.path)
        run = replace(record.stored_run, stdout="", stderr="", trace=None, figures=())
        data = run_record.to_bytes(replace(record, stored_run=run), ())
        if self.store.peek(_LAST, key, bytes) != data:
            self.store.put(_LAST, key, data)


def _fits(record: RunRecord, inputs: Inputs) -> bool:
    return (
        record.inputs == inputs
        and record.stored_run.path == inputs.path
        and record.stored_run.outcome in STORABLE_OUTCOMES
        and not record.reason_forgotten
    )


def longest_first(jobs: Sequence[ScriptJob], seconds: Mapping[str, float]) -> list[ScriptJob]:
    """Jobs in the order that takes the least time in parallel; an unknown one may be long."""
    return sorted(jobs, key=lambda job: -seconds.get(job.path, math.inf))


def _last_key(path: str) -> str:
    return hashlib.sha256(path.encode("utf-8", "surrogateescape")).hexdigest()
