"""`coursebuild stability`: measure MuJoCo on the hard cases, beside what theory says.

Entry points: `stability(options, names)`; `record_stability`, `check_stability`.

1. Names mean problems, or families of them: `damped-spring` is all of its damping ratios.
2. What was measured is kept under the engine's version, the kind of machine and the code that
   measures; what is kept is not measured again, but where it is held against a record.
3. All cases are recorded in one file. Where some are named, recording them leaves the others as
   they are, and checking them says nothing of the others.
"""

from __future__ import annotations

import platform

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
from coursebuild.pipeline.reports import (
    Measurement,
    MeasuringRun,
    command,
    digest_of,
    read_record,
    write_records,
)

_KIND = "stability"
_CODE = ("coursebuild/numerics", "mjcourse/spatial")
"""What measures and says what was measured."""


def stability(options: Options, names: tuple[str, ...] = ()) -> Measurement[CaseReport]:
    """What was measured on the problems that the names mean; on all where there are none.

    Raises:
        UsageError: no problem is called so.
    """
    return Measurement(_measured(options, names))


def _measured(
    options: Options, names: tuple[str, ...], *, again: bool = False
) -> tuple[CaseReport, ...]:
    """`again`: measured now, whatever is kept."""
    from coursebuild.numerics.cases import measure_case
    from coursebuild.numerics.problems import problem_named, problem_names

    run, store, state = MeasuringRun(options), options.store, _state()

    def one(name: str) -> CaseReport | None:
        key = digest_of((name, *state))

        def measure() -> CaseReport:
            report = measure_case(problem_named(name))
            store.put_value(_KIND, key, report)
            return report

        def kept() -> CaseReport | None:
            return None if again else store.get_value(_KIND, key, CaseReport)

        return run.one(name, kept, measure)

    return run.each("measuring", _chosen(names, problem_names()), one)


def _state() -> tuple[str, ...]:
    """All that a figure depends on beside the problem's name."""
    versions = (engine_version(), package_version("numpy"), python_version())
    return (*versions, platform.system(), platform.machine(), code_digest(*_CODE))


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


def record_stability(options: Options, names: tuple[str, ...] = ()) -> Measurement[CaseReport]:
    """Measure the cases that the names mean, and write them into the course; all without names.

    Raises:
        UsageError: no case is called so.
    """
    from coursebuild.numerics.problems import problem_names

    measured = _measured(options, names)
    known = frozenset(problem_names())
    others: list[CaseReport] = []
    if names and (options.root / STABILITY_PATH).exists():
        found, failure = _recorded(options)
        if failure is not None:
            return Measurement(measured, failures=(failure,))
        new = {case.name for case in measured}
        others = [case for case in found or () if case.name in known - new]
    record = STABILITY_PATH, encode_stability([*others, *measured])
    failures, remarks = write_records(options.root, [record])
    return Measurement(measured, failures=failures, remarks=remarks)


def check_stability(options: Options, names: tuple[str, ...] = ()) -> Measurement[CaseReport]:
    """Measure again, and hold it against what is recorded.

    Nothing is measured where there is no record to hold it against.

    Raises:
        UsageError: no case is called so.
    """
    recorded, failure = _recorded(options)
    if recorded is None:
        return Measurement((), failures=() if failure is None else (failure,))
    measured = _measured(options, names, again=True)
    new = {case.name for case in measured}
    old = [case for case in recorded if not names or case.name in new]
    engines = sorted({case.engine for case in old} - {case.engine for case in measured})
    here = ", ".join(sorted({case.engine for case in measured}))
    remarks = tuple(f"recorded with MuJoCo {one}, measured with {here}" for one in engines)
    departures = case_departures(old, measured, Bands())
    checked = Checked("stability", STABILITY_PATH, departures, remarks)
    return Measurement(measured, checked=(checked,))


def _recorded(options: Options) -> tuple[tuple[CaseReport, ...] | None, ReportFailure | None]:
    make = command("stability", (), "--record")
    return read_record(options.root, STABILITY_PATH, decode_stability, make)
