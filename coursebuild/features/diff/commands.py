"""`coursebuild diff`: say what a change does to the course, as Markdown for those who review it."""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from itertools import zip_longest
from pathlib import Path
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    CLEAN,
    Course,
    EffectError,
    Excerpt,
    Place,
    Recording,
    UsageError,
    find_blocks,
    gate,
    load_course,
    options_of,
    temporary_folder,
    write,
)
from coursebuild.core.files.course_root import MAP
from coursebuild.core.files.errors import reason
from coursebuild.core.model import Comparison
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.pages.html_xml import elements_with
from coursebuild.core.pages.marks import code_span, escape_text, fence, table
from coursebuild.core.registry import feature_trials
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import text_diff
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.figures import ReadFile, describe_difference
from coursebuild.core.scripts.findings import classes
from coursebuild.features.truth.claims import unbound_results
from coursebuild.pipeline.load import Code
from coursebuild.pipeline.recordings import read_recorded

_ROWS = 40
"""Rows of a table: GitHub shows a summary of up to a mebibyte."""
_SHORT = 40
"""Characters of a value that is short enough to be shown."""

Row = tuple[str, ...]
K = TypeVar("K")
V = TypeVar("V")


class CourseState(Struct, frozen=True):
    """A course, and a function that reads its files."""

    course: Course
    read: ReadFile


class ScriptState(Struct, frozen=True):
    """A script with its recorded outputs."""

    owner: str
    code: str
    outputs: tuple[Recording, ...]
    """Each with its comparison; tables as their text."""


class LabState(Struct, frozen=True):
    """A lab, or another block that `check` tries."""

    text: str
    data: Mapping[str, object]
    """The values in its text, if that is JSON."""
    models: Mapping[str, str]


def report(base: str, old: CourseState, new: CourseState) -> str:
    """Return a report on the changes of a course since `base`."""
    before, now = (
        {owner.id: document.source.text for owner, document in state.course.owned_documents}
        for state in (old, new)
    )
    texts = (
        ", ".join(f"{escape_text(id)} {change}" for id, change in _changes(before, now))
        or "no change"
    )
    figures = _changes(
        _figures(old),
        _figures(new),
        lambda a, b: describe_difference(*a, b[1]) or "less than can be seen",
    )
    labs = _changes(_labs(old.course), _labs(new.course), _describe_lab_change)
    parts = (
        f"## What this change does\n\nCompared with {base}. Lessons and pages: {texts}.\n",
        _outputs_section(_scripts(old.course), _scripts(new.course)),
        section(
            "Figures",
            "What scripts draw, as recorded.",
            ("figure", "change"),
            [(code_span(path), change) for path, change in figures],
        ),
        section(
            "Labs",
            "What readers run. `check` tells whether each does what it promises.",
            ("in", "lab", "change"),
            [(*map(escape_text, lab), change) for lab, change in labs],
        ),
        _results_section(old.course, new.course),
    )
    return "\n".join(parts)


def section(title: str, meaning: str, header: Row, rows: Sequence[Row]) -> str:
    """Return a heading, an explanation and a table; one line if nothing changed."""
    if not rows:
        return f"### {title}\n\nNo change.\n"
    cells = [[" ".join(cell.replace("|", "\\|").split()) for cell in row] for row in rows[:_ROWS]]
    cells += [[f"and {len(rows) - _ROWS} more"]] if len(rows) > _ROWS else []
    return f"### {title}\n\n{meaning}\n\n{table(header, cells)}\n"


def _changes(
    before: Mapping[K, V],
    now: Mapping[K, V],
    describe: Callable[[V, V], str] = lambda a, b: "edited",
) -> Iterator[tuple[K, str]]:
    """Yield each key with a different value, and the change; `describe` is for keys in both."""
    for key in dict.fromkeys((*before, *now)):
        if key not in before or key not in now:
            yield key, "new" if key in now else "removed"
        elif before[key] != now[key] and (change := describe(before[key], now[key])):
            yield key, change


# --- outputs


def _scripts(course: Course) -> dict[str, ScriptState]:
    outputs: dict[str | None, list[Recording]] = {}
    for document in course.documents:
        for block in find_blocks(document, Recording):
            body = block.body if isinstance(block.body, Excerpt) else None
            text = body or Excerpt.of_span(block.body_span)
            comparison = block.comparison or course.comparison
            output = replace(block, body=text, comparison=comparison)
            outputs.setdefault(block.script, []).append(output)
    return {
        script.path: ScriptState(script.owner, script.text, tuple(outputs.get(script.path, ())))
        for script in extract(course).value
    }


def _outputs_section(before: Mapping[str, ScriptState], now: Mapping[str, ScriptState]) -> str:
    changes = dict(_changes(before, now, _describe_script_change))
    rows = [
        (code_span(path), escape_text((now.get(path) or before[path]).owner), changes[path])
        for path in changes
    ]
    meaning = "What scripts print, as recorded. `check` tells whether they still print it."
    parts = [section("Outputs", meaning, ("script", "in", "change"), rows)]
    for path in [path for path in changes if path in before and path in now][:_ROWS]:
        pairs = zip_longest(before[path].outputs, now[path].outputs)
        lines = "\n".join(filter(None, (text_diff(_text(old), _text(new)) for old, new in pairs)))
        if lines:
            summary = f"<summary><code>{escape(path)}</code></summary>"
            parts.append(f"<details>{summary}\n\n{fence('diff', lines)}\n\n</details>\n")
    return "\n".join(parts)


def _describe_script_change(before: ScriptState, now: ScriptState) -> str:
    parts = ["code edited"] if before.code != now.code else []
    for old, new in zip_longest(before.outputs, now.outputs):
        if old is None or new is None:
            parts.append("an output removed" if new is None else "an output added")
            continue
        changes = compare(old, Comparison(), _text(new)).changes
        largest = max((change.relative_error or 0.0 for change in changes), default=0.0)
        suffix = f" (relative, up to {largest:.1e})" if largest else ""
        parts += [classes(changes) + suffix] if changes else []
        if old.comparison != new.comparison:
            comparisons = (output.comparison for output in (old, new) if output.comparison)
            modes = dict.fromkeys(comparison.mode.value for comparison in comparisons)
            parts.append(f"**compared in another way** ({' → '.join(modes)})")
    return "; ".join(parts)


def _text(recording: Recording | None) -> str:
    return recording.body.text if recording and isinstance(recording.body, Excerpt) else ""


# --- figures and labs


def _figures(state: CourseState) -> dict[str, tuple[str, bytes]]:
    documents = state.course.documents
    paths = (figure.path for document in documents for figure in recorded_figures(document))
    return {path: (path, data) for path in paths if (data := state.read(path)) is not None}


def _labs(course: Course) -> dict[tuple[str, str], LabState]:
    texts = {model.name: model.source.text for model in course.models}
    labs: dict[tuple[str, str], LabState] = {}
    for _, trial in feature_trials(course).values():
        text = trial.block.span.text
        if trial.block.span.path.startswith("models/"):  # the trial of a model that no text shows
            continue
        try:
            value = json.loads(text.partition("\n")[2].rpartition("\n")[0])
        except ValueError:
            value = None
        data: dict[str, object] = value if isinstance(value, dict) else {}
        key = trial.owner, str(data.get("title") or trial.name)
        models = {name: texts.get(name, "") for name in trial.block.models()}
        labs[(trial.owner, trial.name) if key in labs else key] = LabState(text, data, models)
    return labs


def _describe_lab_change(before: LabState, now: LabState) -> str:
    parts = []
    for name in dict.fromkeys((*before.data, *now.data)):
        values = [json.dumps(lab.data.get(name), ensure_ascii=False) for lab in (before, now)]
        if values[0] != values[1]:
            is_short = max(map(len, values)) <= _SHORT
            values_text = f" {' → '.join(map(code_span, values))}" if is_short else ""
            parts.append(code_span(name) + values_text)
    if before.text != now.text and not parts:
        parts.append("its text")
    models = _changes(before.models, now.models)
    return ", ".join((*parts, *(f"model {code_span(name)} {change}" for name, change in models)))


# --- results


def _results_section(old: Course, new: Course) -> str:
    before, now = (
        {owner.id: Counter(c.text for c in claims) for owner, claims in unbound_results(course)}
        for course in (old, new)
    )
    changes = ((id, results - before.get(id, Counter())) for id, results in now.items())
    return section(
        "Results",
        "What the text states anew, and no script, formula or source gives.",
        ("in", "result"),
        [
            (escape_text(id), ", ".join(map(code_span, results)))
            for id, results in changes
            if results
        ],
    )


_SHARE = 0.01
"""Pages that change by less are not listed."""
_WHOLE = "the whole site"


def weight_section(old: Path, new: Path) -> str:
    """Report how the weight of pages changed; `old` and `new` are folders of sites."""
    for folder in (old, new):
        if not (folder / "index.html").is_file():
            return f"### Page weight\n\nNot compared: there is no site in `{folder.name}`.\n"
    before, now = _weights(old), _weights(new)
    sizes = {name: (before.get(name, 0), now.get(name, 0)) for name in {**before, **now}}
    rows = []
    by_change = sorted(sizes.items(), key=lambda item: -abs(item[1][1] - item[1][0]))
    for name, (a, b) in sorted(by_change, key=lambda item: item[0] != _WHOLE):
        if abs(b - a) >= _SHARE * max(a, b) or (name == _WHOLE and a != b):
            change = f"{b / a - 1:+.1%}" if a and b else "new" if b else "removed"
            rows.append((name, f"{a / 1000:.1f} kB", f"{b / 1000:.1f} kB", change))
    return section(
        "Page weight",
        "A page with the styles, scripts and pictures that it names, as stored on disk; a "
        f"server sends less. Pages that change by less than {_SHARE:.0%} are not listed.",
        ("page", "before", "now", "change"),
        rows,
    )


def _weights(site: Path) -> dict[str, int]:
    """Return the bytes of each page with the files that its HTML loads, and of all files."""
    files = [path for path in site.rglob("*") if path.is_file()]
    sizes = {path.relative_to(site).as_posix(): path.stat().st_size for path in files}
    weights: dict[str, int] = {}
    for page in (path for path in sizes if path.endswith(".html")):
        html = (site / page).read_text(encoding="utf-8", errors="replace")
        addresses = {
            attributes.get("src") or attributes.get("href") or ""
            for name, attributes in elements_with(html, ("src", "href"))
            if name in ("script", "img") or attributes.get("rel") == "stylesheet"
        }
        paths = {page, *(Place(page).target(address)[0] for address in addresses)}
        weights[page] = sum(sizes.get(path, 0) for path in paths if path is not None)
    return {**weights, _WHOLE: sum(sizes.values())}


EXAMPLES = """\
examples:
  coursebuild diff main              since this branch left main
  coursebuild diff ../before         another copy of the course
  coursebuild diff main --base-site ../before/public --site public
  coursebuild diff main --sandbox    somebody else's branch
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("base", metavar="BASE", help="a Git revision, or a folder with a course")
    help = "run no code of the course: what its own features would tell is left out"
    parser.add_argument("--sandbox", dest="confined", action="store_true", help=help)
    for name, subject in (("--base-site", "BASE"), ("--site", "this course")):
        help = f"where `build` published {subject}, for the weight of pages"
        parser.add_argument(name, metavar="FOLDER", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print the report; the exit status does not depend on differences."""
    root, sites = options_of(arguments).root, (arguments.base_site, arguments.site)
    if sites.count(None) == 1:
        raise UsageError("--site and --base-site need each other: one is compared with the other")
    code: Code = "none" if arguments.confined else "run"
    with _open_base(root, arguments.base) as (name, folder):
        old, new = (
            CourseState(load_course(place, code=code), functools.partial(read_recorded, place))
            for place in (folder, root)
        )
        text = report(name, old, new)
    if arguments.confined:
        text += _features_section(old.course, new.course)
    if None not in sites:
        text += f"\n{weight_section(*(root / site for site in sites))}"
    return write(text, CLEAN)


def _features_section(*courses: Course) -> str:
    """Name the features that were not run."""
    paths = sorted({feature.path for course in courses for feature in course.features})
    if not paths:
        return ""
    names = ", ".join(map(code_span, paths))
    return f"\n### Features\n\nNot run, so that what they tell is left out: {names}.\n"


@contextlib.contextmanager
def _open_base(root: Path, name: str) -> Iterator[tuple[str, Path]]:
    if (Path(name) / MAP).is_file():
        yield f"`{name}`", Path(name).resolve()
        return
    git = _Git(root)
    commit = git.ask("rev-parse", "--verify", "--quiet", "--end-of-options", name + "^{commit}")
    if not commit:
        raise UsageError(f"`{name}` is neither a folder with a course nor a Git revision here")
    since = git.ask("merge-base", commit.decode().strip(), "HEAD") or commit
    revision = since.decode().strip()
    with temporary_folder() as folder:
        git.copy_tree(revision, Path(folder))
        yield f"`{name}` ({revision[:7]})", Path(folder).resolve()


class _Git:
    """Reads objects of a repository.

    What its configuration could run has no part in that: no filter, hook, pager or transport.
    """

    def __init__(self, root: Path) -> None:
        program = gate.find_program("git")
        if program is None:
            raise EffectError("git cannot be run: there is no such program")
        self._command = [program, "--no-pager", "-c", "core.fsmonitor=false", "-C", str(root)]

    def ask(self, *arguments: str, stdin: bytes = b"") -> bytes | None:
        """What git prints; `None` if it fails."""
        # A repository that holds only a part of its objects would fetch the others.
        alone = {"GIT_NO_LAZY_FETCH": "1", "GIT_ALLOW_PROTOCOL": "none", "GIT_OPTIONAL_LOCKS": "0"}
        environment = gate.environment(**alone)
        try:
            answer = gate.finish([*self._command, *arguments], environment, stdin=stdin)
        except OSError as error:
            raise EffectError(f"git cannot be run: {reason(error)}") from None
        return answer.output if answer.status == 0 else None

    def copy_tree(self, revision: str, folder: Path) -> None:
        """Write the files of a revision, of the course's folder alone, into a folder."""
        partial = EffectError(
            f"{revision[:7]} cannot be copied: this repository does not hold all of it",
            help="in a partial clone, `git fetch --refetch --no-filter` brings the rest",
        )
        tree, files = self.ask("ls-tree", "-r", "-z", revision), []
        if tree is None:
            raise partial
        for entry in tree.split(b"\0")[:-1]:
            head, _, name = entry.partition(b"\t")
            mode, kind, digest = head.split()
            path = os.fsdecode(name)
            if kind == b"blob" and not {"", ".", "..", ".git"} & {*path.split("/")}:
                files.append((mode == b"120000", path, digest))
        files.sort()  # links come last, so that no file is written through one
        names = b"".join(b"%s\n" % digest for *_, digest in files)
        contents = io.BytesIO(self.ask("cat-file", "--batch", stdin=names) or b"")
        try:
            for is_link, path, _ in files:
                *fields, size = contents.readline().split() or [b""]
                if len(fields) != 2:
                    raise partial
                data = contents.read(int(size) + 1)[:-1]
                target = folder / path
                target.parent.mkdir(parents=True, exist_ok=True)
                if not target.parent.resolve().is_relative_to(folder.resolve()):
                    continue  # no repository holds that of itself
                if is_link:
                    target.symlink_to(os.fsdecode(data))
                else:
                    target.write_bytes(data)
        except OSError as error:
            raise EffectError(f"{revision[:7]} cannot be copied: {reason(error)}") from None
