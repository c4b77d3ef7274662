"""Two states of a course beside each other, as Markdown.

Entry points: `CourseState`, `report(base, old, new)`; `section`, a part of such a report.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Course, Recording, document_blocks
from coursebuild.core.model.figures import recorded_figures
from coursebuild.core.pages.marks import fence, table
from coursebuild.core.registry import feature_trials
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import text_diff
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.figures import ReadFile, describe_difference
from coursebuild.core.scripts.findings import classes
from coursebuild.core.text.source import Excerpt
from coursebuild.features.truth.claims import Claims, claims_of, documents_of, total

_ROWS = 40
"""Rows of a table: GitHub shows a summary of up to a mebibyte."""
_SHORT = 40
"""Characters of a value, up to which it is shown."""

Row = tuple[str, ...]
K = TypeVar("K")
V = TypeVar("V")


class CourseState(Struct, frozen=True):
    """A course, and what reads its files."""

    course: Course
    read: ReadFile


class ScriptState(Struct, frozen=True):
    """A script, and what is recorded of it."""

    owner: str
    """Id of its lesson or page."""
    code: str
    outputs: tuple[Recording, ...]
    """Tables as their text, and each with how it is compared."""


class LabState(Struct, frozen=True):
    """A lab, or whatever else is tried."""

    text: str
    data: Mapping[str, object]
    """What the text says, of one in JSON."""
    models: Mapping[str, str]
    """The texts of its models, by name."""


def report(base: str, old: CourseState, new: CourseState) -> str:
    """What became of a course since `base`."""
    before, now = (
        {owner.id: one.source.text for owner, one in state.course.owned_documents}
        for state in (old, new)
    )
    edited = ", ".join(f"{id} {what}" for id, what in _changes(before, now)) or "no change"
    figures = _changes(_figures(old), _figures(new), _redrawn)
    labs = _changes(_labs(old.course), _labs(new.course), _fields)
    parts = (
        f"## What this change does\n\nCompared with {base}. Lessons and pages: {edited}.\n",
        _outputs(_scripts(old.course), _scripts(new.course)),
        section(
            "Figures",
            "What scripts draw, as it is recorded.",
            ("figure", "change"),
            [(f"`{path}`", said) for path, said in figures],
        ),
        section(
            "Labs",
            "What readers run. Whether each does what it promises is what `check` says.",
            ("in", "lab", "change"),
            [(*lab, said) for lab, said in labs],
        ),
        _truth(old.course, new.course),
    )
    return "\n".join(parts)


def section(title: str, meaning: str, header: Row, rows: Sequence[Row]) -> str:
    """A heading, what the numbers mean, and a table; one line where nothing changed."""
    if not rows:
        return f"### {title}\n\nNo change.\n"
    shown = [[" ".join(cell.replace("|", "\\|").split()) for cell in row] for row in rows[:_ROWS]]
    shown += [[f"and {len(rows) - _ROWS} more"]] if len(rows) > _ROWS else []
    return f"### {title}\n\n{meaning}\n\n{table(header, shown)}\n"


def _changes(
    before: Mapping[K, V], now: Mapping[K, V], how: Callable[[V, V], str] = lambda a, b: "edited"
) -> Iterator[tuple[K, str]]:
    """What became of each thing that is not as it was; `how` says it, of one that both have."""
    for key in dict.fromkeys((*before, *now)):
        if key not in before or key not in now:
            yield key, "new" if key in now else "removed"
        elif before[key] != now[key] and (said := how(before[key], now[key])):
            yield key, said


# --- outputs


def _scripts(course: Course) -> dict[str, ScriptState]:
    recorded: dict[str | None, list[Recording]] = {}
    for document in course.documents:
        for block in document_blocks(document):
            if isinstance(block, Recording):
                body = block.body if isinstance(block.body, Excerpt) else None
                text = body or Excerpt.of_span(block.body_span)
                how = block.comparison or course.comparison
                whole = replace(block, body=text, comparison=how)
                recorded.setdefault(block.script, []).append(whole)
    return {
        one.path: ScriptState(one.owner, one.text, tuple(recorded.get(one.path, ())))
        for one in extract(course).value
    }


def _outputs(before: Mapping[str, ScriptState], now: Mapping[str, ScriptState]) -> str:
    changes = dict(_changes(before, now, _recorded))
    rows = [(f"`{path}`", (now.get(path) or before[path]).owner, changes[path]) for path in changes]
    meaning = "What scripts print, as it is recorded. Whether they print it is what `check` says."
    parts = [section("Outputs", meaning, ("script", "in", "change"), rows)]
    for path in [path for path in changes if path in before and path in now][:_ROWS]:
        pairs = zip_longest(before[path].outputs, now[path].outputs)
        lines = "\n".join(filter(None, (text_diff(_text(one), _text(two)) for one, two in pairs)))
        if lines:
            summary = f"<summary><code>{path}</code></summary>"
            parts.append(f"<details>{summary}\n\n{fence('diff', lines)}\n\n</details>\n")
    return "\n".join(parts)


def _recorded(before: ScriptState, now: ScriptState) -> str:
    """How a script and what is recorded of it differ, in words."""
    said = ["code edited"] if before.code != now.code else []
    for old, new in zip_longest(before.outputs, now.outputs):
        if old is None or new is None:
            said.append("an output removed" if new is None else "an output added")
            continue
        changes = compare(old, Comparison(), (), _text(new)).changes
        largest = max((change.relative_error or 0.0 for change in changes), default=0.0)
        more = f" (relative, up to {largest:.1e})" if largest else ""
        said += [classes(changes) + more] if changes else []
        if old.comparison != new.comparison:
            modes = dict.fromkeys(one.comparison.mode.value for one in (old, new) if one.comparison)
            said.append(f"**compared in another way** ({' → '.join(modes)})")
    return "; ".join(said)


def _text(recording: Recording | None) -> str:
    return recording.body.text if recording and isinstance(recording.body, Excerpt) else ""


# --- figures and labs


def _figures(state: CourseState) -> dict[str, tuple[str, bytes]]:
    """Paths and bytes of recorded figures and their data, by path."""
    paths = (figure.path for one in state.course.documents for figure in recorded_figures(one))
    return {path: (path, data) for path in paths if (data := state.read(path)) is not None}


def _redrawn(before: tuple[str, bytes], now: tuple[str, bytes]) -> str:
    return describe_difference(*before, now[1]) or "less than can be seen"


def _labs(course: Course) -> dict[tuple[str, str], LabState]:
    """Labs in texts, by the id of the lesson or page and the title, else the name."""
    texts = {model.name: model.source.text for model in course.models}
    found: dict[tuple[str, str], LabState] = {}
    for _, trial in feature_trials(course).values():
        text = trial.block.span.text
        if trial.block.span.path.startswith("models/"):  # of a model that no text shows
            continue
        data = _json(text.partition("\n")[2].rpartition("\n")[0])
        key = trial.owner, str(data.get("title") or trial.name)
        models = {name: texts.get(name, "") for name in trial.block.models()}
        found[(trial.owner, trial.name) if key in found else key] = LabState(text, data, models)
    return found


def _json(text: str) -> dict[str, object]:
    """An object; empty where the text is none."""
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _fields(before: LabState, now: LabState) -> str:
    """Which fields of a lab differ, with their values where these are short, and which models."""
    said = []
    for name in dict.fromkeys((*before.data, *now.data)):
        values = [json.dumps(lab.data.get(name), ensure_ascii=False) for lab in (before, now)]
        if values[0] != values[1]:
            short = max(map(len, values)) <= _SHORT
            said.append(f"`{name}`" + (" `{}` → `{}`".format(*values) if short else ""))
    if before.text != now.text and not said:
        said.append("its text")
    models = _changes(before.models, now.models)
    return ", ".join((*said, *(f"model `{name}` {what}" for name, what in models)))


# --- truth


def _truth(old: Course, new: Course) -> str:
    before, now = (
        {owner.id: claims_of(document) for owner, document in documents_of(course)}
        for course in (old, new)
    )
    nothing = Claims(0, 0, 0, ())
    pairs = {id: (before.get(id, nothing), now.get(id, nothing)) for id in {**before, **now}}
    pairs["all"] = total(before.values()), total(now.values())
    counted = {
        id: [(*claims.counts, claims.share) for claims in pair] for id, pair in pairs.items()
    }
    return section(
        "Truth",
        "Numbers in the text, and those that a script prints, a formula computes, or the author"
        " gives as known. Whether they hold is what `check` says.",
        ("in", "numbers", "printed", "computed", "given", "unproven", "proven"),
        [
            (id, *(a if a == b else f"{a} → {b}" for a, b in zip(one, two, strict=True)))
            for id, (one, two) in counted.items()
            if one != two
        ],
    )
