"""`coursebuild stability`: measure MuJoCo on the hard cases, beside what theory says.

Entry points: `stability(options, names)`; `record_stability`, `check_stability`.

1. Names mean problems, or families of them: `damped-spring` is all of its damping ratios.
2. What was measured is kept under the engine's version, the kind of machine and the code that
   measures; what is kept is not measured again, but where it is held against a record.
3. All cases are recorded in one file. Where some are named, recording them leaves the others as
   they are, and checking them says nothing of the others.
"""

from __future__ import annotations

import hashlib
import platform
import time

from msgspec import Struct

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.model.scenarios import Bands
from coursebuild.core.run.versions import engine_version, package_version, python_version
from coursebuild.core.text.diagnostics import nearest
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.departures import Checked, case_departures
from coursebuild.numerics.reports.records import (
    STABILITY_PATH,
    ReportFailure,
    decode_stability,
    encode_stability,
)
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.reports import command, read_record, write_record

_KIND = "stability"
_CODE = ("coursebuild/numerics", "mjcourse/spatial")
"""What measures and says what was measured."""


def stability(
    options: Options, names: tuple[str, ...] = (), *, again: bool = False
) -> tuple[CaseReport, ...]:
    """What was measured on the problems that the names mean; on all where there are none.

    `again`: measured now, whatever is kept.

    Raises:
        UsageError: no problem is called so.
    """
    from coursebuild.numerics.cases import measure_case
    from coursebuild.numerics.problems import problem_named, problem_names

    chosen = _chosen(names, problem_names())
    progress = Progress(quiet=options.quiet)
    options.store.listen(progress.say)
    state = _state()
    reports = []
    with progress.stage("measuring", len(chosen)):
        for name in chosen:
            key = hashlib.sha256(f"{name}\0{state}".encode()).hexdigest()
            report = None if again else options.store.get_value(_KIND, key, CaseReport)
            if report is not None:
                progress.known()
            else:
                progress.started(name)
                began = time.monotonic()
                report = measure_case(problem_named(name))
                options.store.put_value(_KIND, key, report)
                progress.finished(name, "measured", time.monotonic() - began)
            reports.append(report)
    return tuple(reports)


def _state() -> str:
    """All that a figure depends on beside the problem's name."""
    versions = (engine_version(), package_version("numpy"), python_version())
    return "\0".join((*versions, platform.system(), platform.machine(), code_digest(*_CODE)))


def _chosen(names: tuple[str, ...], known: tuple[str, ...]) -> list[str]:
    if not names:
        return list(known)
    wanted: set[str] = set()
    for name in names:
        found = {one for one in known if one == name or one.startswith(f"{name}-")}
        if not found:
            near = nearest(name, known)
            all_of_them = "known: " + ", ".join(known)
            help = all_of_them if near is None else f"did you mean `{near}`?"
            raise UsageError(f"no hard case is called `{name}`; {help}")
        wanted |= found
    return [one for one in known if one in wanted]


# ------------------------------------------------------------------------------------- the record


class Cases(Struct, frozen=True):
    """What a run found."""

    cases: tuple[CaseReport, ...]
    """Those that were measured."""
    checked: tuple[Checked, ...] = ()
    failures: tuple[ReportFailure, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether all is as it was recorded, or could be recorded."""
        return not self.failures and not any(one.departures for one in self.checked)


def record_stability(options: Options, names: tuple[str, ...] = ()) -> Cases:
    """Measure the cases that the names mean, and write them into the course; all without names.

    Raises:
        UsageError: no case is called so.
    """
    from coursebuild.numerics.problems import problem_names

    measured = stability(options, names)
    known = frozenset(problem_names())
    others: list[CaseReport] = []
    if names and (options.root / STABILITY_PATH).exists():
        found, failure = _recorded(options)
        if failure is not None:
            return Cases(measured, failures=(failure,))
        new = {case.name for case in measured}
        others = [case for case in found or () if case.name in known - new]
    said = write_record(options.root, STABILITY_PATH, encode_stability([*others, *measured]))
    if isinstance(said, ReportFailure):
        return Cases(measured, failures=(said,))
    return Cases(measured, remarks=(said,))


def check_stability(options: Options, names: tuple[str, ...] = ()) -> Cases:
    """Measure again, and hold it against what is recorded.

    Nothing is measured where there is no record to hold it against.

    Raises:
        UsageError: no case is called so.
    """
    recorded, failure = _recorded(options)
    if recorded is None:
        return Cases((), failures=() if failure is None else (failure,))
    measured = stability(options, names, again=True)
    new = {case.name for case in measured}
    old = [case for case in recorded if not names or case.name in new]
    engines = sorted({case.engine for case in old} - {case.engine for case in measured})
    here = ", ".join(sorted({case.engine for case in measured}))
    remarks = tuple(f"recorded with MuJoCo {one}, measured with {here}" for one in engines)
    departures = case_departures(old, measured, Bands())
    return Cases(measured, (Checked("stability", STABILITY_PATH, departures, remarks),))


def _recorded(options: Options) -> tuple[tuple[CaseReport, ...] | None, ReportFailure | None]:
    make = command("stability", (), "--record")
    return read_record(options.root, STABILITY_PATH, decode_stability, make)
