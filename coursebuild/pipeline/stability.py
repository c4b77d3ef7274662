"""`coursebuild stability`: measure MuJoCo on the hard cases, beside what theory says.

Entry point: `stability(options, names)`; `recorded_cases` holds it against what is recorded.

1. Names mean problems, or families of them: `damped-spring` is all of its damping ratios.
2. What was measured is kept under the engine's version, the kind of machine and the code that
   measures; what is kept is not measured again.
"""

from __future__ import annotations

import hashlib
import math
import platform
import time

import msgspec

from coursebuild.diagnostics import nearest
from coursebuild.effects.code import code_digest
from coursebuild.effects.versions import engine_version, package_version, python_version
from coursebuild.numerics.reports.cases import (
    BoundaryLine,
    CaseReport,
    ErrorLine,
    FigureLine,
    OrderLine,
    ReferenceLine,
)
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress

_KIND = "stability"
_CODE = ("numerics", "pipeline/stability.py")
"""What measures and says what was measured."""


def stability(
    options: Options, names: tuple[str, ...] = (), *, again: bool = False
) -> tuple[CaseReport, ...]:
    """What was measured on the problems that the names mean; on all where there are none.

    `again`: measured now, whatever is kept.

    Raises:
        UsageError: no problem is called so.
    """
    from coursebuild.numerics.problems import problem_names

    chosen = _chosen(names, problem_names())
    progress = Progress(quiet=options.quiet)
    options.store.listen(progress.say)
    state = _state()
    reports = []
    with progress.stage("measuring", len(chosen)):
        for name in chosen:
            key = hashlib.sha256(f"{name}\0{state}".encode()).hexdigest()
            kept = None if again else options.store.load(_KIND, key)
            report = None if kept is None else _decoded(kept)
            if report is not None:
                progress.known()
            else:
                progress.started(name)
                began = time.monotonic()
                report = _measured(name)
                options.store.keep(_KIND, key, msgspec.json.encode(report))
                progress.finished(name, "measured", time.monotonic() - began)
            reports.append(report)
    return tuple(reports)


def _state() -> str:
    """All that a figure depends on beside the problem's name."""
    versions = (engine_version(), package_version("numpy"), python_version())
    return "\0".join((*versions, platform.system(), platform.machine(), code_digest(*_CODE)))


def _decoded(data: bytes) -> CaseReport | None:
    try:
        return msgspec.json.decode(data, type=CaseReport)
    except msgspec.DecodeError:  # by another version of this code
        return None


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


def _measured(name: str) -> CaseReport:
    """Everything that there is to measure on a problem."""
    from coursebuild.numerics import stability as limits
    from coursebuild.numerics.measure import Error, Errors, ladder, orders
    from coursebuild.numerics.problems import agreement, problem_named

    problem = problem_named(name)
    reference = None
    if problem.reference is not None:
        first, second = problem.reference, problem.second
        reference = ReferenceLine(
            first.kind,
            first.source,
            first.floor,
            "" if second is None else second.source,
            agreement(problem),
        )

    def both(error: Error | None) -> tuple[float, float] | None:
        return None if error is None else (error.largest, error.end)

    found = ladder(problem)
    nothing = Errors(None, None, None)
    error_lines = [
        ErrorLine(
            one.integrator.value,
            one.timestep,
            one.judgement.status.value,
            one.judgement.reasons,
            both((one.errors or nothing).position),
            both((one.errors or nothing).attitude),
            both((one.errors or nothing).velocity),
            _finite(one.energy_drift),
            _finite(one.momentum_drift),
            one.penetration,
            one.refsafe,
        )
        for rows in found.values()
        for one in rows
    ]
    order_lines = []
    for integrator, rows in found.items():
        fit = orders(problem, rows)
        parts = [None if one is None else one.value for one in (fit.position, fit.attitude)]
        last = None if fit.velocity is None else fit.velocity.value
        order_lines.append(OrderLine(integrator.value, parts[0], parts[1], last))
    return CaseReport(
        name=problem.name,
        title=problem.title,
        case=problem.case,
        engine=engine_version(),
        note=problem.note,
        reference=reference,
        boundaries=tuple(_boundary(one) for one in limits.survey(problem)),
        figures=tuple(
            FigureLine(
                figure.name,
                figure.unit,
                integrator.value,
                _finite(figure.measure(integrator)),
                _finite(figure.exact(integrator)),
                figure.source,
            )
            for figure in problem.figures
            for integrator in figure.integrators
        ),
        orders=tuple(order_lines),
        errors=tuple(error_lines),
    )


def _boundary(one: object) -> BoundaryLine:
    from coursebuild.numerics.stability import Boundary

    assert isinstance(one, Boundary)
    theory = one.theory
    return BoundaryLine(
        one.integrator.value,
        _finite(one.largest),
        None if theory is None else _finite(theory.timestep),
        "" if theory is None else theory.source,
        _finite(one.difference),
        one.monotone,
        one.islands,
        "" if one.beyond is None else one.beyond.status.value,
        None if one.beyond is None else _finite(one.beyond.growth),
        one.searched,
    )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
