"""Everything that running the scripts of a course shows to be wrong.

Entry points: `script_findings`: each script that failed, each recorded output that is not what was
printed, each bound number that no output bears out; `binding_history`, by what those hold that do.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.model import Course
from coursebuild.core.model.results import Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.binding_memory import BindingHistory, BindingMemory
from coursebuild.core.scripts.bindings import Printed, check_bindings, leaning_on
from coursebuild.core.scripts.compare import is_silent
from coursebuild.core.scripts.divergence import divergence
from coursebuild.core.scripts.extract import Extraction, extract, owners
from coursebuild.core.text.diagnostics import Diagnostic

_ENDED_WELL = (Outcome.OK, Outcome.SKIPPED, Outcome.NORUN)
"""Or was not to be made: nothing is to be said of such a run itself."""


def script_findings(
    course: Course,
    extractions: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    verdicts: Sequence[Verdict],
    memory: BindingMemory | None = None,
    everything: Sequence[Extraction] | None = None,
) -> tuple[Diagnostic, ...]:
    """The diagnostics of the scripts that were run, and of all that leans on them.

    `extractions` are those that were run, maybe not all of the course; `everything` is what
    `extract` gives for it, where that is known. `memory` are bindings that were looked at before.
    """
    by_path = {run.path: run for run in runs}
    everything = extract(course).value if everything is None else everything
    found: list[Diagnostic] = []
    for extraction in extractions:
        run = by_path.get(extraction.path)
        if run is not None and run.outcome not in _ENDED_WELL:
            from coursebuild.core.scripts.failures import failure

            failed = failure(extraction, run, everything)
            if failed is not None:
                found.append(failed)
        if run is not None:
            found += divergence(extraction, run, everything)
    printed = Printed(verdicts, runs, [extraction.path for extraction in everything])
    owner_of = {document.source.path: owner for owner, document in owners(course)}
    for verdict in verdicts:
        recording = verdict.recording
        run = by_path.get(recording.script or "")
        if run is not None and run.outcome is Outcome.OK and is_silent(run.stdout):
            from coursebuild.core.scripts.failures import silence

            found.append(silence(recording, run.path))
        elif verdict.status == "drift":
            from coursebuild.core.scripts.drift import drift_diagnostic

            leaning = leaning_on(verdict, course.documents, printed)
            found.append(drift_diagnostic(verdict, owner_of[recording.span.path], leaning))
    for document in course.documents:
        found += check_bindings(document, printed, memory)
    return tuple(found)


def binding_history(
    course: Course, runs: Sequence[ScriptRun], verdicts: Sequence[Verdict]
) -> BindingHistory:
    """By which lines the bindings of a course hold."""
    memory = BindingHistory()
    printed = Printed(verdicts, runs)
    for document in course.documents:
        check_bindings(document, printed, memory)
    return memory
