"""Diagnostics and verdicts as text, JSON, JUnit, SARIF and CI annotations.

Entry points: `Report`, `render_report(report, format, style)`.
"""

from __future__ import annotations

from coursebuild.report.terminal import Style as Style
from coursebuild.report.text import diagnostic_text as diagnostic_text
from coursebuild.report.text import to_text
from coursebuild.report.values import Report as Report
from coursebuild.report.values import ScriptLine as ScriptLine
from coursebuild.report.values import Summary as Summary
from coursebuild.report.values import summary_line as summary_line
from coursebuild.report.values import unchanged_report as unchanged_report


def render_report(report: Report, form: str, style: Style) -> str:
    """Return the report as `text` or in a format of `machine`; ends in a newline, or is empty."""
    if form == "text":
        return to_text(report, style)
    from coursebuild.report.machine import FORMATS

    return FORMATS[form](report)
