"""Tables of the measurements: for the terminal, as JSON, and for the documentation.

Entry points: `Report`, `markdown`, `put_into`. A figure is a median; beside it stands its ratio to
coursebuild's in the same run, above one where coursebuild is faster.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from benchmarks.measure.building import COLD_BUILD, EDIT_BUILD, PEAK_MEMORY, UNCHANGED_BUILD, Site
from benchmarks.measure.running import Scripts
from benchmarks.measure.serving import EDIT_TO_SERVED
from benchmarks.measure.tools import Tool
from coursebuild.core.run.script_environment import cpu_name

BASE = "coursebuild"
ROWS = (COLD_BUILD, UNCHANGED_BUILD, EDIT_BUILD, EDIT_TO_SERVED, PEAK_MEMORY)
BEGIN, END = "<!-- benchmarks: begin -->", "<!-- benchmarks: end -->"


@dataclass(frozen=True, slots=True)
class Figure:
    """One cell of a table."""

    row: str
    lessons: int
    tool: str
    values: list[float]
    """Seconds; MB in the row of memory."""

    @property
    def median(self) -> float:
        """The median, which is shown."""
        return statistics.median(self.values)


@dataclass(slots=True)
class Report:
    """All results of one run."""

    machine: dict[str, str]
    tools: list[dict[str, str]]
    absent: list[str]
    figures: list[Figure] = field(default_factory=list)
    scripts: dict[str, list[float]] = field(default_factory=dict)
    """Ratios to the time of computing, for each way of running."""
    compute: list[float] = field(default_factory=list)
    script_count: int = 0
    failed: list[str] = field(default_factory=list)

    def add_sites(self, sites: list[Site], lessons: int) -> None:
        """Take the figures of one size, in place of earlier ones."""
        self.figures = [figure for figure in self.figures if figure.lessons != lessons]
        self.failed = [text for text in self.failed if f" {lessons} lessons)" not in text]
        for site in sites:
            if site.failure:
                self.failed.append(f"{site.tool.title} ({site.failure}, {lessons} lessons)")
            for row, values in site.figures.items():
                self.figures.append(Figure(row, lessons, site.tool.title, values))

    def add_scripts(self, scripts: Scripts) -> None:
        """Take the figures of scripts."""
        self.scripts = {way: scripts.ratios(way) for way in scripts.figures}
        self.compute = scripts.compute
        self.script_count = len(scripts.paths)
        if scripts.failure:
            self.failed.append(scripts.failure)

    def as_json(self) -> dict[str, object]:
        """All figures, not only medians."""
        return asdict(self)


def describe(tools: list[Tool], jcache: str | None) -> Report:
    """An empty report with the machine and the tools."""
    installed = [
        {"title": t.title, "version": t.version, "math": t.math, "how": t.configuration}
        for t in tools
        if t.version is not None
    ]
    absent = [t.title for t in tools if t.version is None]
    if jcache is None:
        absent.append("jupyter-cache")
    else:
        installed.append(
            {"title": "jupyter-cache", "version": jcache, "math": "", "how": "local-parallel"}
        )
    return Report(machine(), installed, absent)


def machine() -> dict[str, str]:
    """The machine that the figures hold for."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "date": time.strftime("%Y-%m-%d %H:%M", time.gmtime()) + " UTC",
        "processor": cpu_name(),
        "cores": str(len(os.sched_getaffinity(0))),
        "memory": f"{memory:.0f} GiB",
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
    }


# --- text


def markdown(report: Report) -> str:
    """The tables, with the machine that they hold for."""
    facts = report.machine
    lines = [
        f"Measured on {facts['date']}: {facts['cores']} cores ({facts['processor']}), "
        f"{facts['memory']}, {facts['system']}, Python {facts['python']}.",
        "",
    ]
    for lessons in sorted({figure.lessons for figure in report.figures}):
        lines += [f"**{lessons} lessons**", "", *sizes_table(report, lessons), ""]
    if report.scripts:
        lines += [*scripts_table(report), ""]
    if report.absent:
        lines += ["", f"Not installed, and so not measured: {', '.join(report.absent)}."]
    if report.failed:
        lines += ["", f"Failed, so that its figures are incomplete: {', '.join(report.failed)}."]
    return "\n".join(lines)


def sizes_table(report: Report, lessons: int) -> list[str]:
    """A row for each tool, a column for each build; the ratio to coursebuild in brackets."""
    figures = {(f.tool, f.row): f for f in report.figures if f.lessons == lessons}
    rows = [row for row in ROWS if any(key[1] == row for key in figures)]
    heads = [row + (" (MB)" if row == PEAK_MEMORY else " (s)") for row in rows]
    lines = ["| | " + " | ".join(heads) + " |", "| --- |" + " --- |" * len(rows)]
    names = {
        tool["title"]: f"{tool['title']} {tool['version']}" + "*" * (tool["math"] == "reader")
        for tool in report.tools
    }
    for tool in dict.fromkeys(tool for tool, _ in figures):
        cells = [cell(figures.get((tool, row)), figures.get((BASE, row))) for row in rows]
        lines.append(f"| {names.get(tool, tool)} | " + " | ".join(cells) + " |")
    return lines


def cell(figure: Figure | None, base: Figure | None) -> str:
    """A median, and its ratio to the base."""
    if figure is None:
        return "–"
    text = significant(figure.median)
    if base is None or figure.tool == BASE:
        return text
    return f"{text} ({significant(figure.median / base.median, 2)}×)"


def significant(value: float, digits: int = 3) -> str:
    """A number with so many digits, without an exponent."""
    whole = len(str(int(abs(value)))) if abs(value) >= 1 else 0
    if whole == 0:
        return f"{value:.3f}" if digits > 2 else f"{value:.2f}"
    return f"{value:.{max(0, digits - whole)}f}"


def scripts_table(report: Report) -> list[str]:
    """Ways of running the scripts."""
    seconds = statistics.median(report.compute)
    lines = [
        f"**{report.script_count} MuJoCo scripts** that compute for {seconds:.2f} s in all",
        "",
        "| | ratio to the time of computing |",
        "| --- | --- |",
    ]
    for way, ratios in report.scripts.items():
        lines.append(f"| {way} | {statistics.median(ratios):.2f} |")
    return lines


def put_into(page: Path, text: str) -> None:
    """Replace what stands between the markers of a page of the documentation.

    Raises:
        ValueError: the page does not have both markers, each once.
    """
    before = page.read_text(encoding="utf-8")
    if before.count(BEGIN) != 1 or before.count(END) != 1:
        raise ValueError(f"{page} does not have the markers {BEGIN} and {END}, each once")
    head, _, rest = before.partition(BEGIN)
    _, _, tail = rest.partition(END)
    page.write_text(f"{head}{BEGIN}\n\n{text}\n\n{END}{tail}", encoding="utf-8")
