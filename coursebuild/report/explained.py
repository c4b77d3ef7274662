"""Explanations of why something would run again and what depends on it, and of rules, as text.

Entry points: `Explanation`, `explanation_text`; `rule_text`.
"""

from __future__ import annotations

import re
import time
from typing import Literal

from msgspec import Struct

from coursebuild.core.text.rules import Rule
from coursebuild.report.text import BOLD, FAINT, GREEN, YELLOW, Style, visible
from coursebuild.report.values import plural

State = Literal["remembered", "would run", "norun"]


class RunExplanation(Struct, frozen=True):
    """Whether a script or a lab would run now, and why."""

    kind: Literal["script", "lab"]
    name: str
    """A script's path, or a lab's name."""
    owner: str
    """Id of its lesson or page."""
    state: State
    reasons: tuple[str, ...] = ()
    """Why it would run, each a clause."""
    depends: tuple[str, ...] = ()
    """What its last result depends on, a line for each."""
    made: int | None = None
    """When its last result was made, in seconds since 1970."""
    seconds: float | None = None
    outcome: str = ""
    """How its last run ended; empty where there was none."""


class Explanation(Struct, frozen=True):
    """What is known of a path."""

    path: str
    kind: Literal["script", "lab", "lesson", "page", "model", "file"]
    runs: tuple[RunExplanation, ...]
    """Those of the script or lab, or of all scripts and labs of a lesson or page."""
    dependents: tuple[RunExplanation, ...] = ()
    """Scripts and labs whose results depend on it."""
    files: tuple[str, ...] = ()
    """The other files of which a model consists."""
    part_of: tuple[str, ...] = ()
    """The models that include it."""
    shown_in: tuple[str, ...] = ()
    """Files of the lessons and pages that show it, link to it or quote its output."""


def rule_text(rule: Rule, page: str) -> str:
    """What a rule means: its section of the page of rules, or else its summary."""
    section = re.search(rf"^## {rule.name}\n+(.*?)\s*(?=^## |\Z)", page, re.DOTALL | re.MULTILINE)
    text = section[1] if section else f"{rule.severity.capitalize()}. {rule.summary}"
    return f"{rule.name}\n\n{text}\n"


def explanation_text(explanation: Explanation, style: Style) -> str:
    """Return an explanation as text for people."""
    e = explanation
    parts: list[str] = []
    if e.kind in ("script", "lab"):
        parts += ["\n".join(_full_text(run, style)) for run in e.runs]
    else:
        parts.append(style.paint(_heading(e), BOLD))
        parts += ["\n".join(_short_text(run, style)) for run in e.runs]
    if e.files:
        parts.append(_block("consists also of", e.files))
    if e.part_of:
        parts.append(_block("is a part of", e.part_of))
    if e.dependents:
        lines = [line for run in e.dependents for line in _short_text(run, style)]
        parts.append("\n".join(["depending on it:", *(f"  {line}" for line in lines)]))
    elif e.kind in ("model", "file"):
        parts.append("no result of a script or lab depends on it")
    if e.shown_in:
        parts.append(_block("shown, linked or quoted in", e.shown_in))
    return "\n\n".join(parts) + "\n"


def _heading(e: Explanation) -> str:
    if e.kind in ("model", "file"):
        return visible(e.path)
    count = sum(run.state == "would run" for run in e.runs)
    if not e.runs:
        return f"{visible(e.path)} has no scripts and no labs"
    verdict = "none would run" if not count else f"{count} would run"
    scripts = sum(run.kind == "script" for run in e.runs)
    labs = len(e.runs) - scripts
    counts = [plural(scripts, "script")] if scripts else []
    counts += [plural(labs, "lab")] if labs else []
    return f"{visible(e.path)}: {' and '.join(counts)}, of which {verdict}"


def _block(head: str, lines: tuple[str, ...]) -> str:
    return "\n".join([f"{head}:", *(f"  {visible(line)}" for line in lines)])


def _verdict(run: RunExplanation, style: Style) -> str:
    match run.state:
        case "remembered":
            return style.paint("is remembered", GREEN)
        case "norun":
            return "is never run: its lesson says `norun`"
        case "would run":
            suffix = " again" if run.made is not None else ""
            verb = "run" if run.kind == "script" else "be tried"
            return style.paint(f"would {verb}{suffix}", YELLOW)


def _full_text(run: RunExplanation, style: Style) -> list[str]:
    lines = [f"{style.paint(visible(run.name), BOLD)} {_verdict(run, style)}"]
    lines += [f"  because {visible(reason)}" for reason in run.reasons]
    last = "not run yet on this machine"
    if run.made is not None and run.seconds is not None:
        time_text = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(run.made))
        last = f"last run {time_text}, {run.seconds:.2f} s: {run.outcome}"
    lines.append(style.paint(f"  of {run.owner}, {last}", FAINT))
    if run.depends:
        lines += ["", "its last result depends on:"]
        lines += [f"  {visible(line)}" for line in run.depends]
    return lines


def _short_text(run: RunExplanation, style: Style) -> list[str]:
    line = f"{visible(run.name)} {_verdict(run, style)}"
    return [line, *(f"  because {visible(reason)}" for reason in run.reasons)]
