"""Edits that put a new output, or an edited script, into the lesson.

1. A recording that matches the run stays as it is. A volatile one takes the text of the run if
   that differs in more than its numbers.
2. The new lines of a fence are those of the run. Lines with `...`, and lines that match only after
   a filter, stay as the author wrote them. Line ends and what stands before each line (`> `,
   indentation) are those of the lesson.
3. A table is brought up to date number by number, in place; under `digits` a number keeps as many
   decimals as the author showed. A row that may be no line, or several, is refused.
4. The new text is compared with the run: an output that the lesson's text cannot hold is refused.

Code that lessons show from the project's files is what these hold, or gets the edit that makes it
so. A part is a function, a class or a method with its decorators, some lines, or the whole file;
indentation and white space at the ends of lines do not count.
"""

from __future__ import annotations

import ast
import contextlib
import difflib
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, groupby, pairwise, zip_longest
from typing import TypeVar

from coursebuild.core import model
from coursebuild.core.scripts.align import StepKind, align, same_lines
from coursebuild.core.scripts.bound_numbers import BoundText
from coursebuild.core.scripts.failures import without_indentation
from coursebuild.core.scripts.fill_table import fill_table
from coursebuild.core.scripts.lines import (
    ELLIPSIS,
    LineMatcher,
    Side,
    replace_ranges,
)
from coursebuild.core.scripts.module_code import DEFINITIONS, first_line
from coursebuild.core.scripts.table_cells import (
    HEADER_HELP,
    ROW_HELP,
    cell_matches,
    number_text,
    refusal,
    table_rows,
)
from coursebuild.core.scripts.tables import RowAddresses, TableMatcher
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Fix, diagnose, did_you_mean
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Source, Span

_T = TypeVar("_T")
_FENCE = regex(r"`{3,}|~{3,}")


def apply_edits(text: str, edits: Iterable[Edit]) -> str:
    """The text with edits applied by offset.

    `ValueError` for edits that overlap, stand at the same place, or belong to another text.
    """
    places: list[tuple[int, int, str]] = []
    for edit in sorted(edits, key=lambda edit: (edit.span.start, edit.span.end)):
        start, end = edit.span.start, edit.span.end
        if edit.span.source.text != text:
            raise ValueError(f"an edit of another text than {edit.span.path} is now")
        if places and (start < places[-1][1] or (start, end) == places[-1][:2]):
            raise ValueError(f"edits overlap at offset {start} of {edit.span.path}")
        places.append((start, end, edit.text))
    return replace_ranges(text, places)


def edited_texts(edits: Iterable[Edit]) -> dict[Source, str]:
    """The texts that are edited, each as it becomes; the same edit may be there twice."""
    by_source: dict[Source, dict[Edit, None]] = {}
    for edit in edits:
        by_source.setdefault(edit.span.source, {})[edit] = None
    return {source: apply_edits(source.text, changes) for source, changes in by_source.items()}


def select_harmless(
    changes: Sequence[_T], is_harmless: Callable[[Sequence[_T]], bool], selection: Sequence[_T] = ()
) -> list[_T]:
    """As many of these changes as do no harm together, beside those that are chosen already.

    Where they do harm, each half is tried by itself, down to single ones.
    """
    if not changes or is_harmless([*selection, *changes]):
        return [*selection, *changes]
    if len(changes) == 1:
        return [*selection]
    half = len(changes) // 2
    selection = select_harmless(changes[:half], is_harmless, selection)
    return select_harmless(changes[half:], is_harmless, selection)


def update_body(
    recording: model.Recording,
    comparison: model.Comparison,
    stdout: str,
    addresses: RowAddresses = (),
) -> Edit | Diagnostic | None:
    """What to write into a recording whose script printed this; `None` where it matches already."""
    if not stdout.strip():
        return refusal(recording.caption_span, "the script printed nothing to record", "")
    if isinstance(recording.body, model.Table):
        if not table_rows(recording.body):
            return fill_table(recording.body, stdout)
        return _update_table(recording.body, comparison, stdout, addresses)
    body, filters = recording.body, comparison.filters
    if comparison.mode is model.Mode.VOLATILE:
        before, now = Side.of(body.text).lines, Side.of(stdout).lines
        pairs = map(LineMatcher(comparison).pairs, before, now)
        if len(before) == len(now) and None not in pairs:
            return None
        return _fence_edit(recording, now)
    recorded, printed = (Side.of(text, filters) for text in (body.text, stdout))
    if same_lines(recorded, printed, comparison):
        return None
    candidates: list[list[str]] = []
    if comparison.filters or comparison.ellipsis:
        updated_lines = _update_lines(body, recorded, printed, LineMatcher(comparison))
        if isinstance(updated_lines, Diagnostic):
            return updated_lines
        candidates.append(updated_lines)
    if not comparison.ellipsis:
        candidates.append(list(Side.of(printed.raw).lines))
    for lines in candidates:
        if same_lines(Side.of("\n".join(lines), filters), printed, comparison):
            return _fence_edit(recording, lines)
    return refusal(
        body.span().first_line(),
        "no text was found that matches what the script prints",
        "bring it up to date by hand: a `...` or a filter is in the way",
    )


# ------------------------------------------------------------------------------------ new lines


def _update_lines(
    body: Excerpt, recorded: Side, printed: Side, matcher: LineMatcher
) -> list[str] | Diagnostic:
    """New lines that keep what the author wrote on purpose: ellipses and filtered text."""

    def refuse(line: int, label: str) -> Diagnostic:
        span = body.span(*recorded.origin(line, 0, len(recorded.lines[line])))
        message = f"an output with `{ELLIPSIS}` cannot be brought up to date here"
        help = f"write the line anew by hand, or remove the `{ELLIPSIS}` and update again"
        return refusal(span, message, help, label)

    lines: list[str] = []
    pair_kinds = (StepKind.SAME, StepKind.DIFFERS)
    for _, group in groupby(
        align(recorded, printed, matcher), lambda step: step.kind in pair_kinds
    ):
        steps = tuple(group)
        for step in steps:
            text = recorded.lines[step.recorded] if step.recorded < len(recorded.lines) else ""
            match step.kind:
                case StepKind.MISSING if any(s.kind is StepKind.ELIDED for s in steps):
                    return refuse(step.recorded, "this line was not printed where `...` is")
                case StepKind.DIFFERS if matcher.elides(text):
                    pairs = matcher.pairs(text, printed.lines[step.printed])
                    if pairs is None or recorded.raw_lines(step.recorded) != (text,):
                        label = "this line no longer fits what the script prints"
                        return refuse(step.recorded, label)
                    changed = [pair for pair in pairs if not matcher.numbers_match(*pair)]
                    places = ((old.start, old.end, new.text) for old, new in changed)
                    lines.append(replace_ranges(text, places))
                case StepKind.SAME | StepKind.ELLIPSIS:
                    lines += recorded.raw_lines(step.recorded)
                case StepKind.DIFFERS | StepKind.EXTRA:
                    lines += printed.raw_lines(step.printed)
                case StepKind.MISSING | StepKind.ELIDED:
                    pass
    return lines


# ---------------------------------------------------------------------------------------- fences


def _fence_edit(recording: model.Recording, lines: Sequence[str]) -> Edit | Diagnostic:
    """Replace the lines between the fences; refused where a fence cannot hold them."""
    fence = _opening_fence(recording.body_span)
    for number, line in enumerate(lines, start=1):
        if "\x00" in line:
            return refusal(
                fence,
                f"line {number} of the output has a NUL character, which Markdown cannot hold",
                "print text only",
            )
    longest = _longest_marks(lines, fence.text)
    if longest:
        marks = "backticks" if fence.text[0] == "`" else "tildes"
        return refusal(
            fence,
            "the output has a line that would close this fence, or begin another",
            f"open and close it with {longest + 1} {marks}, then update again",
        )
    return whole_lines(recording.body_span, recording.prefix, lines)


def adopt_file(script: model.Script, data: bytes) -> list[Edit] | Diagnostic:
    """What to write into the blocks of a script, so that they extract to `data`; or why not."""

    def refuse(reason: str) -> Diagnostic:
        message = f"{script.path} cannot be brought into the lesson: {reason}"
        return diagnose("example-edited", script.path_span, message, help="bring it over by hand")

    text = block_text(data)
    if text is None:
        return refuse("it is not UTF-8")
    if text == "\n":
        return refuse("it is empty")
    if "\0" in text:
        return refuse("it holds a NUL")
    lines_of_parts = _split_lines(script, text.removesuffix("\n").split("\n"))
    if lines_of_parts is None:
        return refuse("a change goes from one of its parts into the next")
    edits: list[Edit] = []
    for block, lines in zip(script.parts or (script,), lines_of_parts, strict=True):
        if _longest_marks(lines, _opening_fence(block.body_span).text):
            return refuse("one of its lines would close the fence, or begin another")
        edits.append(whole_lines(block.body_span, block.prefix, lines))
    return [edit for edit in edits if edit.text != edit.span.text]


def _split_lines(script: model.Script, lines: Sequence[str]) -> list[Sequence[str]] | None:
    """The lines of each part of an edited script; `None` where it is not clear which are whose."""
    old_lines = script.code.text.split("\n")
    matcher = difflib.SequenceMatcher(None, old_lines, lines, autojunk=False)
    blocks = [block for block in matcher.get_matching_blocks() if block.size]
    edges = [0]
    for line in script.part_lines:
        offsets = (
            block.b + line - 1 - block.a
            for block in blocks
            if 0 <= line - 1 - block.a <= block.size
        )
        if (edge := next(offsets, None)) is None:
            return None
        edges.append(edge)
    parts = [lines[start:end] for start, end in pairwise([*edges, len(lines)])]
    # An empty line after a part is that which the file has and the lesson has not.
    return [p[:-1] if p[-1:] == [""] and p[-2:] != ["", ""] else p for p in parts]


def block_text(data: bytes) -> str | None:
    """A file as a block can hold it: no byte order mark, LF; `None` where it is not UTF-8."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n") + "\n"


def _opening_fence(body: Span) -> Span:
    """The marks that open the fence with this body."""
    line = body.source.position(body.start - 1)[0]
    match = _FENCE.search(body.source.text, body.source.line_starts[line - 1], body.start)
    assert match is not None
    return Span(body.source, *match.span())


def _longest_marks(lines: Sequence[str], fence: str) -> int:
    """The number of marks of the longest line that would close a fence, or begin another in it."""
    marks = re.compile(rf" {{0,3}}({re.escape(fence[0])}{{{len(fence)},}})(?:[ \t]*| *\w[^`]*)")
    matches = (marks.fullmatch(line) for line in lines)
    return max((len(match[1]) for match in matches if match), default=0)


def whole_lines(body: Span, prefix: str, lines: Sequence[str]) -> Edit:
    """New lines in a fence, with the line ends of the lesson and what stands before each line."""
    before = body.source.text[: body.start]
    line_end = "\r\n" if before.endswith("\r\n") else "\r" if before.endswith("\r") else "\n"
    texts = (prefix + line if line else prefix.rstrip() for line in lines)
    return Edit(body, "".join(line + line_end for line in texts))


MINUS = "\u2212"


def _update_table(
    table: model.Table, comparison: model.Comparison, stdout: str, addresses: RowAddresses
) -> Edit | Diagnostic | None:
    if comparison.mode is model.Mode.VOLATILE:
        comparison = model.Comparison()
    matcher = TableMatcher(table, comparison, stdout, addresses)
    match = matcher.match()
    if match.rivals and not all(row.certain for row in match.rows):
        lines = " or ".join(f"`{line}`" for line in match.rivals)
        message, help = f"its rows may be lines such as {lines}", "show what tells them apart"
        return refusal(table.span.first_line(), message, f"{help}: words or units in the header")
    texts: dict[tuple[int, int], str] = {}
    for row in match.rows:
        if row.line < 0 or not row.certain:
            span = row.row[0].cell.span.to(row.row[-1].cell.span)
            if row.line < 0:
                return refusal(span, "no line of this run has the cells of this row", ROW_HELP)
            return refusal(span, "several lines of this run have the cells of this row in order")
        for cell, old, new in row.pairs:
            span = cell.span(old)
            text: str | None = span.text
            if not cell_matches(old, new, comparison):
                number = BoundText.of(span.text, table.comma, may_join=True)
                text = _rewrite(number, span.text, old.text, number_text(old, new, comparison))
            # A macro may show a number more than once.
            if text is None or texts.setdefault((span.start, span.end), text) != text:
                reason = "a number written with an entity, an escape or a macro cannot be replaced"
                return refusal(span, reason)
    changes = (*matcher.header_changes(match), *chain(*map(matcher.unit_changes, match.rows)))
    for change in changes:
        message = f"`{change.recorded}` is not what is printed here"
        return refusal(change.span, message, HEADER_HELP)
    source = table.span.source
    edits = [(*at, text) for at, text in sorted(texts.items()) if text != source.text[slice(*at)]]
    if not edits:
        return None
    for title, _, _ in matcher.misplaced_titles(match):
        return refusal(title.span, "another number is printed with this title", HEADER_HELP)
    whole = source.span(edits[0][0], edits[-1][1])
    ranges = ((start - whole.start, end - whole.start, text) for start, end, text in edits)
    return Edit(whole, replace_ranges(whole.text, ranges))


def _rewrite(number: BoundText, source_text: str, old: str, new: str) -> str | None:
    """A new number as the old one is written; `None` if that is not how it would be written."""
    if number.text.replace(MINUS, "-") != old:
        return None
    # The minus signs of the old number stay: before it, and in its exponent.
    halves = (re.split("(?=[eE])", half) for half in (source_text, number.as_written(new)))
    parts = zip_longest(*halves, fillvalue="")
    return "".join(part.replace("-", MINUS) if MINUS in like else part for like, part in parts)


ReadText = Callable[[str], str | None]


def shown_files(course: model.Course) -> frozenset[str]:
    """The files of which lessons show parts, but for the scripts of lessons."""
    paths = {source.path for _, source in _source_parts(course)}
    return frozenset(paths.difference(_script_texts(course)))


def check_source_parts(course: model.Course, read: ReadText) -> Iterator[Diagnostic]:
    """A diagnostic, with an edit, for each part that differs from its file."""
    scripts = _script_texts(course)
    for block, source in _source_parts(course):
        text = scripts.get(source.path) or read(source.path)
        if text is None:
            yield diagnose("source-part", source.place, f"there is no text file `{source.path}`")
            continue
        parts = _read_parts(text)
        if (match := _LINES.fullmatch(source.part)) is not None:
            rows, first = text.rstrip("\n").split("\n"), int(match[1])
            last = int(match[2] or first)
            if not 1 <= first <= last <= len(rows):
                message = f"`{source.path}` has no lines {first} to {last}"
                help = f"its last line is {len(rows)}"
                yield diagnose("source-part", source.place, message, help=help)
                continue
            parts[source.part] = _lines("\n".join(rows[first - 1 : last]))
        if source.part not in parts:
            message = f"`{source.path}` has no function or class `{source.part}`"
            help = did_you_mean(source.part, [name for name in parts if name])
            yield diagnose("source-part", source.place, message, help=help)
        elif parts[source.part] != (lesson_lines := _lines(block.code.text)):
            file_lines = parts[source.part]
            equalities = (a == b for a, b in zip(file_lines, lesson_lines, strict=False))
            first = next((i for i, equal in enumerate(equalities) if not equal), len(lesson_lines))
            code_lines = block.code.lines()
            span = (
                without_indentation(code_lines[first].span())
                if first < len(code_lines)
                else source.place
            )
            has_line = first < len(file_lines)
            label = f"it has `{file_lines[first].strip()}` here" if has_line else ""
            edits = (whole_lines(source.body_span, source.prefix, file_lines),)
            help = Fix("run `coursebuild update`, which copies it here", edits=edits, safe=True)
            message = f"this differs from what `{source.path}` holds"
            yield diagnose("source-part", span, message, label=label, help=help)


_LINES = regex(r"L(\d{1,9})(?:-L(\d{1,9}))?")


def _script_texts(course: model.Course) -> dict[str, str]:
    return {
        script.path: script.code.text
        for document in course.documents
        for script in model.document_scripts(document)
    }


def _source_parts(course: model.Course) -> Iterator[tuple[model.PlainCode, model.SourcePart]]:
    for document in course.documents:
        for code in model.find_blocks(document, model.PlainCode):
            if code.source is not None:
                yield code, code.source


def _read_parts(text: str) -> dict[str, list[str]]:
    """The lines of each part of a file by name; the whole file has an empty name."""
    parts = {"": _lines(text)}
    rows = text.split("\n")

    def add_parts(nodes: list[ast.stmt], prefix: str) -> None:
        for node in nodes:
            if isinstance(node, DEFINITIONS):
                name = f"{prefix}{node.name}"
                parts[name] = _lines("\n".join(rows[first_line(node) - 1 : node.end_lineno]))
                add_parts(node.body, f"{name}.")

    with contextlib.suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        add_parts(ast.parse(text, "").body, "")
    return parts


def _lines(text: str) -> list[str]:
    return [line.rstrip() for line in textwrap.dedent(text).rstrip().split("\n")]
