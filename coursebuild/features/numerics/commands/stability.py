"""`coursebuild stability`: measure MuJoCo on the hard cases, beside what theory says.

Entry points: `stability(options, names)`, `check_stability`.

1. Names mean problems, or families of them (`damped-spring` is all of its damping ratios).
2. What was measured is kept under the machine, its versions and the code that measures; what is
   kept is not measured again, but where it is held against a record.
3. All problems are recorded in one file. Where some are named, recording them leaves the others as
   they are, and checking them says nothing of the others.
4. Where the two references of a case are further apart than they may be, it is an error, and
   nothing is recorded.
"""

from __future__ import annotations

import time

from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.run.machine import machine, one_processor
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.diagnostics import nearest
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.features.bench.commands.runs import MeasuringRun, with_records
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.departures import RecordCheck, case_departures
from coursebuild.numerics.reports.records import STABILITY, ReportFailure
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.shown_reports import read_record

_CODE = ("coursebuild/numerics", "mjcourse/spatial")
"""What measures and says what was measured."""


def stability(
    options: Options, names: tuple[str, ...] = (), *, record: bool = False
) -> Measurement[CaseReport]:
    """What was measured on the cases that the names mean; on all where there are none.

    `record`: it is also written into the course.

    Raises:
        UsageError: no case is called so.
    """
    found = _CaseRun(options).all(_chosen(names))
    if record and not found.failures:
        found = _recorded(options, found, whole=not names)
    return found


def _recorded(
    options: Options, found: Measurement[CaseReport], *, whole: bool
) -> Measurement[CaseReport]:
    others: list[CaseReport] = []
    if not whole and (options.root / STABILITY.path()).exists():
        old = read_record(options.root, STABILITY)
        if isinstance(old, ReportFailure):
            return replace(found, failures=(old,))
        new = {case.name for case in found.reports}
        others = [case for case in old if case.name in _known() and case.name not in new]
    cases = sorted([*others, *found.reports], key=lambda case: (case.case, case.name))
    records = [(STABILITY.path(), STABILITY.encode(tuple(cases)))]
    return with_records(options.root, found, records)


def check_stability(options: Options, names: tuple[str, ...] = ()) -> Measurement[CaseReport]:
    """Measure again, and hold it against what is recorded.

    Nothing is measured where there is no record to hold it against.

    Raises:
        UsageError: no case is called so.
    """
    problems = _chosen(names)
    recorded = read_record(options.root, STABILITY)
    if isinstance(recorded, ReportFailure):
        return Measurement((), failures=(recorded,))
    found = _CaseRun(options, again=True).all(problems)
    new = {case.name for case in found.reports}
    old = [case for case in recorded if not names or case.name in new]
    here = engine_version()
    others = sorted({case.machine.engine for case in old} - {here})
    remarks = tuple(f"recorded with MuJoCo {one}, measured with {here}" for one in others)
    departures = case_departures(old, found.reports)
    return replace(
        found, checked=(RecordCheck("stability", STABILITY.path(), departures, remarks),)
    )


class _CaseRun(MeasuringRun):
    """Measures hard cases one after the other."""

    def all(self, problems: list[str]) -> Measurement[CaseReport]:
        """Those of these names."""
        self.here, self.code = machine(pinned=True), code_digest(*_CODE)
        with one_processor():
            return self.each(problems, self._one)

    def _one(self, name: str) -> CaseReport | None:
        parts = (name, self.code, self.here)
        return self.once(name, "stability", parts, CaseReport, lambda: self._measured(name))

    def _measured(self, name: str) -> CaseReport | None:
        from coursebuild.numerics.cases import DisagreementError, measure_case
        from coursebuild.numerics.problems import all_problems

        try:
            return measure_case(all_problems()[name], self.here, time.thread_time_ns)
        except DisagreementError as error:
            why = "neither can be told to be right: no error against them means anything"
            self.failures.append(ReportFailure(str(error), why))
            return None


def _known() -> tuple[str, ...]:
    from coursebuild.numerics.problems import all_problems

    return tuple(all_problems())


def _chosen(names: tuple[str, ...]) -> list[str]:
    """The problems that names mean; all where there are none."""
    known = _known()
    wanted = set() if names else set(known)
    for name in names:
        found = {one for one in known if one == name or one.startswith(f"{name}-")}
        if not found:
            near = nearest(name, known)
            all_of_them = "known: " + ", ".join(known)
            help = all_of_them if near is None else f"did you mean `{near}`?"
            raise UsageError(f"no hard case is called `{name}`", help=help)
        wanted |= found
    return [one for one in known if one in wanted]
