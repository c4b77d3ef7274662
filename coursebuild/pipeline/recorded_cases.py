"""`coursebuild stability --record` and `--check`: the hard cases as recorded in the course.

Entry points: `record_stability`, `check_stability`.

1. All cases are in one file. Where some are named, only these are measured: recording them leaves
   the others as they are, and checking them says nothing of the others.
2. What is held against a record is measured again, whatever is kept.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.model.scenarios import Bands
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.departures import Checked, case_departures
from coursebuild.numerics.reports.records import (
    STABILITY_PATH,
    Failure,
    decode_stability,
    encode_stability,
)
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reports import command, read_record, write_record
from coursebuild.pipeline.stability import stability


class Cases(Struct, frozen=True):
    """What a run found."""

    cases: tuple[CaseReport, ...]
    """Those that were measured."""
    checked: tuple[Checked, ...] = ()
    failures: tuple[Failure, ...] = ()
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
    if isinstance(said, Failure):
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


def _recorded(options: Options) -> tuple[tuple[CaseReport, ...] | None, Failure | None]:
    make = command("stability", (), "--record")
    return read_record(options.root, STABILITY_PATH, decode_stability, make)
