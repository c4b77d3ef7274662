"""Why something would run again, or not, and what depends on it: values, and as text; rules.

Entry points: `Explanation`, `explained_text`; `rule_text`.
"""

from __future__ import annotations

import re
import time
from typing import Literal

from msgspec import Struct

from coursebuild.core.text.rules import Rule
from coursebuild.report.terminal import BOLD, FAINT, GREEN, YELLOW, Style, visible
from coursebuild.report.values import plural

State = Literal["remembered", "would run", "norun"]


class Explained(Struct, frozen=True):
    """A script or a lab: whether it would run now, and why."""

    kind: Literal["script", "lab"]
    name: str
    """A script's path, a lab's name."""
    owner: str
    """Id of its lesson or page."""
    state: State
    reasons: tuple[str, ...] = ()
    """Why it would run, each a clause."""
    depends: tuple[str, ...] = ()
    """What its last result depends on, a line each."""
    made: int | None = None
    """When that was made, in seconds since 1970."""
    seconds: float | None = None
    outcome: str = ""
    """How its last run ended; empty where there was none."""


class Explanation(Struct, frozen=True):
    """What is known of a path."""

    path: str
    kind: Literal["script", "lab", "lesson", "page", "model", "file"]
    own: tuple[Explained, ...]
    """The script itself, or those of a lesson or page with its labs."""
    dependents: tuple[Explained, ...] = ()
    """Scripts and labs whose results depend on it."""
    files: tuple[str, ...] = ()
    """Of a model: the other files that it consists of."""
    part_of: tuple[str, ...] = ()
    """Models that it is a part of."""
    shown: tuple[str, ...] = ()
    """Files of the lessons and pages that show it, link to it or quote its output."""


def rule_text(rule: Rule, page: str) -> str:
    """What a rule means: its section of a page of rules, else what is known of it."""
    section = re.search(rf"^## {rule.name}\n+(.*?)\s*(?=^## |\Z)", page, re.DOTALL | re.MULTILINE)
    text = section[1] if section else f"{rule.severity.capitalize()}. {rule.summary}"
    return f"{rule.name}\n\n{text}\n"


def explained_text(explanation: Explanation, style: Style) -> str:
    """As text for people."""
    e = explanation
    parts: list[str] = []
    if e.kind in ("script", "lab"):
        parts += ["\n".join(_whole(one, style)) for one in e.own]
    else:
        parts.append(style.paint(_head(e), BOLD))
        parts += ["\n".join(_brief(one, style)) for one in e.own]
    if e.files:
        parts.append(_block("consists also of", e.files))
    if e.part_of:
        parts.append(_block("is a part of", e.part_of))
    if e.dependents:
        lines = [line for one in e.dependents for line in _brief(one, style)]
        parts.append("\n".join(["depending on it:", *(f"  {line}" for line in lines)]))
    elif e.kind in ("model", "file"):
        parts.append("no result of a script or lab depends on it")
    if e.shown:
        parts.append(_block("shown, linked or quoted in", e.shown))
    return "\n\n".join(parts) + "\n"


def _head(e: Explanation) -> str:
    if e.kind in ("model", "file"):
        return visible(e.path)
    again = sum(one.state == "would run" for one in e.own)
    if not e.own:
        return f"{visible(e.path)} has no scripts and no labs"
    rest = "none would run" if not again else f"{again} would run"
    scripts = sum(one.kind == "script" for one in e.own)
    labs = len(e.own) - scripts
    counted = [plural(scripts, "script")] if scripts else []
    counted += [plural(labs, "lab")] if labs else []
    return f"{visible(e.path)}: {' and '.join(counted)}, of which {rest}"


def _block(head: str, lines: tuple[str, ...]) -> str:
    return "\n".join([f"{head}:", *(f"  {visible(line)}" for line in lines)])


def _verdict(one: Explained, style: Style) -> str:
    match one.state:
        case "remembered":
            return style.paint("is remembered", GREEN)
        case "norun":
            return "is never run: its lesson says `norun`"
        case "would run":
            again = " again" if one.made is not None else ""
            verb = "run" if one.kind == "script" else "be tried"
            return style.paint(f"would {verb}{again}", YELLOW)


def _whole(one: Explained, style: Style) -> list[str]:
    lines = [f"{style.paint(visible(one.name), BOLD)} {_verdict(one, style)}"]
    lines += [f"  because {visible(reason)}" for reason in one.reasons]
    lines.append(style.paint(f"  {_last(one)}", FAINT))
    if one.depends:
        lines += ["", "its last result depends on:"]
        lines += [f"  {visible(line)}" for line in one.depends]
    return lines


def _brief(one: Explained, style: Style) -> list[str]:
    line = f"{visible(one.name)} {_verdict(one, style)}"
    return [line, *(f"  because {visible(reason)}" for reason in one.reasons)]


def _last(one: Explained) -> str:
    owner = f"of {one.owner}"
    if one.made is None or one.seconds is None:
        return f"{owner}, not run yet on this machine"
    when = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(one.made))
    return f"{owner}, last run {when}, {one.seconds:.2f} s: {one.outcome}"
