"""Scripts that run behind a preview.

Entry points: `Scripts.extract`, then `Scripts.run`. Both may be broken off at any moment by a
`SupersededError`, and called again: what is known by then stays known.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence

from msgspec.structs import replace

from coursebuild.core.features import check_runs
from coursebuild.effects.runner import RunStoppedError, ScriptServer
from coursebuild.model import Course
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.preview.parts import Ran, extraction
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.remember import Memory
from coursebuild.pipeline.verify import extract_scripts, run
from coursebuild.results import Outcome, ScriptRun
from coursebuild.scripts.binding_memory import BindingHistory
from coursebuild.scripts.extract import Extraction, jobs
from coursebuild.scripts.findings import script_findings

_BATCH = 16
"""Scripts whose results are waited for before they are shown."""
_HELD = 500_000
"""Bindings that held, and lines by which they did, that are remembered: some 50 MB at most."""


class SupersededError(Exception):
    """Something was saved in the meantime."""


class Scripts:
    """See the module."""

    def __init__(
        self,
        live: LiveCourse,
        options: Options,
        progress: Progress,
        busy: Callable[[str], None],
    ) -> None:
        """`busy` is told what is done, and raises `SupersededError` where that is in vain."""
        self._live = live
        self._options = options
        self._progress = progress
        self._busy = busy
        self._extracted: tuple[tuple[str, str], ...] | None = None
        self._runnable: set[str] = set()
        self._others = False
        """Whether scripts that did not change lean on something that did."""
        self._held = BindingHistory()
        """Bindings that held, also before an output was accepted; see `check_bindings`."""
        self._server = ScriptServer()

    def close(self) -> None:
        """End the process of scripts."""
        self._server.close()

    def extract(self, course: Course, everything: bool) -> None:
        """Write the scripts to their files, where one changed, or maybe more than documents."""
        live = self._live
        listed = tuple(
            (path, script.code.text)
            for path, (script, _) in (live.library.scripts if live.library else {}).items()
        )
        if listed == self._extracted and not everything:
            return
        self._busy("running scripts")
        extracted = extract_scripts(course, self._options)
        live.behind["extract"] = extracted.diagnostics
        self._runnable = {extraction.path for extraction in extracted.runnable}
        left = {e.path for e in extracted.all} - {e.path for e in extracted.runnable}
        live.take_runs((), forget=left)
        self._others |= everything or self._extracted is not None
        self._extracted = listed

    def run(self, course: Course) -> None:
        """Run those that changed, and those that may do something else now; say what is wrong."""
        runnable = self._extractions()
        fresh = [e for e in runnable if self._current(e) is None]
        for batch in _batches(fresh):
            self._run(batch)
        if self._others and len(fresh) < len(runnable):
            self._run([e for e in runnable if e not in fresh])
        self._others = False
        self._verdicts(course, runnable)

    def _extractions(self) -> list[Extraction]:
        """The scripts that may run, as they stand now."""
        library = self._live.library
        scripts = {} if library is None else library.scripts
        return [
            extraction(script, owner)
            for path, (script, owner) in scripts.items()
            if path in self._runnable
        ]

    def _current(self, now: Extraction) -> ScriptRun | None:
        ran = self._live.parts.runs.get(now.path)
        same = ran is not None and (ran.text, (ran.job,)) == (now.text, jobs([now]))
        return ran.run if same and ran is not None else None

    def _run(self, batch: Sequence[Extraction], *, again: bool = False) -> None:
        """Run scripts, as far as their results are not remembered, and take what they did."""
        self._busy("running scripts again" if again else "running scripts")
        options = self._options
        memory = Memory(options.root, options.store, fresh=True) if again else None
        stage = "running scripts again" if again else "running scripts"
        run_all = functools.partial(self._server.run, unwanted=self._unwanted(batch))
        try:
            runs = run(batch, options, self._progress, stage, memory, run_all)
        except RunStoppedError:
            raise SupersededError from None
        taken: list[Ran] = []
        for ran, done in zip(batch, runs, strict=True):
            new = Ran(jobs([ran])[0], ran.text, done)
            old = self._live.parts.runs.get(ran.path)
            if again and old is not None:
                printed = done.stdout if done.outcome is Outcome.OK else ""
                taken.append(replace(old, again=printed))
            elif old is None or not _same_run(old, new):
                taken.append(new)
        self._live.take_runs(taken)

    def _unwanted(self, batch: Sequence[Extraction]) -> Callable[[frozenset[str]], bool]:
        """Whether a script that runs is another by now, so that nobody waits for its output."""
        begun = {extraction.path: (extraction.text, jobs([extraction])) for extraction in batch}
        edits = -1

        def unwanted(running: frozenset[str]) -> bool:
            nonlocal edits
            with self._live.changed:
                if self._live.edits == edits:
                    return False
                edits = self._live.edits
                now = {e.path: (e.text, jobs([e])) for e in self._extractions()}
            return any(begun[path] != now.get(path) for path in running)

        return unwanted

    def _verdicts(self, course: Course, runnable: Sequence[Extraction]) -> None:
        """What running the scripts shows to be wrong."""
        live = self._live
        with live.changed:
            runs = live.parts.current(course)
            verdicts = live.parts.verdicts(course, runs)
        chosen = [e for e in runnable if e.path in runs]
        if len(self._held) > _HELD:
            self._held.clear()
        found = script_findings(course, chosen, tuple(runs.values()), verdicts, self._held)
        live.behind["scripts"] = (*found, *check_runs(course, runs.values()))
        live.tell()
        drifted = {verdict.recording.script for verdict in verdicts if verdict.status == "drift"}
        once = {path for path, ran in live.parts.runs.items() if ran.again is None}
        unsure = [e for e in runnable if e.path in drifted & once]
        for batch in _batches(unsure):
            self._run(batch, again=True)


def _batches(extractions: Sequence[Extraction]) -> Iterable[Sequence[Extraction]]:
    return (extractions[at : at + _BATCH] for at in range(0, len(extractions), _BATCH))


def _same_run(one: Ran, two: Ran) -> bool:
    """Whether nothing that a page or a report may show is another."""
    a, b = one.run, two.run
    return (one.job, one.text) == (two.job, two.text) and (
        (a.outcome, a.status, a.stdout, a.stderr, a.missing)
        == (b.outcome, b.status, b.stdout, b.stderr, b.missing)
    )
