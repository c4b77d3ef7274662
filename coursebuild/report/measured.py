"""Everything that `bench` and `stability` print: what was measured, checked, recorded and is wrong.

Entry points: `bench_report`, `bench_values`; `cases_report`, `cases_values` (JSON).
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import msgspec

from coursebuild.diagnostics import Diagnostic
from coursebuild.numerics.reports.bench import SceneReport
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.departures import Checked
from coursebuild.numerics.reports.records import Failure
from coursebuild.report.bench import bench_text
from coursebuild.report.bench_json import bench_json
from coursebuild.report.checked import checked_text, failure_text
from coursebuild.report.stability import stability_json, stability_text
from coursebuild.report.text import Style, diagnostic_text, visible


def bench_report(
    scenes: Sequence[SceneReport],
    diagnostics: Sequence[Diagnostic],
    failures: Sequence[Failure],
    checked: Sequence[Checked],
    remarks: Sequence[str],
    style: Style,
) -> str:
    """As text: what is wrong first, then what was measured."""
    parts = [diagnostic_text(one, style) + "\n" for one in diagnostics]
    parts += _common(bench_text(scenes, style), failures, checked, remarks, style)
    return "\n".join(parts) or "there is no model to measure\n"


def bench_values(
    scenes: Sequence[SceneReport],
    diagnostics: Sequence[Diagnostic],
    failures: Sequence[Failure],
    checked: Sequence[Checked],
    remarks: Sequence[str],
) -> str:
    """As JSON."""
    return bench_json(scenes, diagnostics, failures, checked, remarks)


def cases_report(
    cases: Sequence[CaseReport],
    failures: Sequence[Failure],
    checked: Sequence[Checked],
    remarks: Sequence[str],
    style: Style,
) -> str:
    """As text."""
    return "\n".join(_common(stability_text(cases, style), failures, checked, remarks, style))


def cases_values(
    cases: Sequence[CaseReport],
    failures: Sequence[Failure],
    checked: Sequence[Checked],
    remarks: Sequence[str],
    *,
    recorded: bool,
) -> str:
    """As JSON: an array of cases, or an object where something was recorded or checked."""
    if not recorded:
        return stability_json(cases)
    value = {
        "cases": [msgspec.to_builtins(case) for case in cases],
        "checked": [msgspec.to_builtins(one) for one in checked],
        "failures": [msgspec.to_builtins(one) for one in failures],
        "remarks": list(remarks),
    }
    return json.dumps(value, ensure_ascii=True, indent=2, allow_nan=False) + "\n"


def _common(
    measured: str,
    failures: Sequence[Failure],
    checked: Sequence[Checked],
    remarks: Sequence[str],
    style: Style,
) -> list[str]:
    parts = ["".join(failure_text(one, style) for one in failures), measured]
    parts += [checked_text(checked, style), "".join(f"{visible(one)}\n" for one in remarks)]
    return [part for part in parts if part]
