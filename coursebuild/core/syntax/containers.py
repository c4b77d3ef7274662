r"""Quotations, callouts, tables and lists, each part with its place, and marks that they lost.

markdown-it finds the tables and their rows. A row is split here, at each `|` without a backslash
before it; `\|` is a `|` in the cell.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import pairwise
from typing import Literal

from markdown_it.common.utils import MD_TRIM_CHARS
from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model import Cell, Inline, Table
from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.syntax.spans import PositionedToken, trim
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Note,
    Parsed,
    diagnose,
    did_you_mean,
    misspelt,
)
from coursebuild.core.text.source import Excerpt, Source, Span

_HEAD = re.compile(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
_BROKEN_HEAD = re.compile(
    r"(?:\w?[^\w\s\\]{0,2}![^\w\s\\]?[ ]?([A-Za-z][\w-]*)[^\w\s(]?+"  # `!note`, `[!note`, `![note]`
    r"|\[([A-Za-z]!\w[\w-]*)\]"  # `[n!ote]`
    r"|\[[^\w\s\\]?([A-Za-z][\w-]*)[!\])}]{1,2}+)-?+(?![(\[:])([^\n]*)(?:\n|$)"  # `[note]`
)
"""A line that was surely meant to be the first of a callout if the word is a kind."""
FALLBACK = "note"
"""The kind that a callout of an unknown kind gets, so that its content is still checked."""


class Head(Struct, frozen=True):
    """The first line of a callout, and what follows it in its paragraph."""

    kind: str
    kind_span: Span
    title: Excerpt
    folded: bool
    rest: Excerpt


def read_head(paragraph: Excerpt, kinds: Collection[str]) -> Parsed[Head] | None:
    """The head of a callout, if a quotation's first paragraph begins with one of `kinds`."""
    match = _HEAD.match(paragraph.text)
    if match is None:
        return _read_broken_head(paragraph, kinds)
    name, kind, diagnostic = trim(paragraph.slice(*match.span(1))), FALLBACK, None
    if match[3][:1].strip():
        start = match.start(3)
        message = f"`{match[3][0]}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
        help = Fix(help, "" if match[3][0] == "+" else None, safe=True)  # it starts unfolded
        place = paragraph.span(start, start + 1)
        diagnostic = diagnose("callout-unknown", place, message, help=help)
    elif name.text.lower() in kinds:
        kind = name.text.lower()
    else:
        choice = ", ".join(f"`{kind}`" for kind in sorted(kinds))
        message = "the kind of this callout is missing"
        message = f"no callout kind `{name.text}`" if name.text else message
        help = did_you_mean(name.text.lower(), kinds) or f"known: {choice}"
        diagnostic = diagnose("callout-unknown", name.span(), message, help=help)
    title, rest = trim(paragraph.slice(*match.span(3))), trim(paragraph.slice(match.end()))
    head = Head(kind, name.span(), title, bool(match[2]), rest)
    return Parsed(head, () if diagnostic is None else (diagnostic,))


def _read_broken_head(paragraph: Excerpt, kinds: Collection[str]) -> Parsed[Head] | None:
    match = _BROKEN_HEAD.match(paragraph.text)
    if match is None:
        return None
    kind = (match[1] or match[2] or match[3]).replace("!", "").lower()
    if kind not in kinds:
        kind = misspelt(kind, [name for name in kinds if len(name) > 5]) or ""
    if not kind:
        return None
    title = trim(paragraph.slice(*match.span(4)))
    place = trim(paragraph.slice(0, match.start(4)))
    head = Head(kind, place.span(), title, False, trim(paragraph.slice(match.end())))
    help = f"write `> [!{kind}] Title`, or a backslash before the bracket that is meant to be seen"
    follows = paragraph.text[len(paragraph.text[: match.start(4)].rstrip()) :]
    blank = "" if not title.text or follows[:1].isspace() else " "
    fix = Fix(help, f"[!{kind}]{blank}")
    message = f"`{place.text}` does not begin a callout"
    return Parsed(head, (diagnose("callout-unknown", place.span(), message, help=fix),))


def quote_admonition(head: Span, kind: str) -> tuple[Edit, ...]:
    """The edits that make a quotation of an admonition of MkDocs, whose lines are indented."""
    source, number = head.source, head.line
    start, text = source.line_start(number), source.line_text(number)
    match = re.fullmatch(r'(!!!|\?\?\?\+?)[ \t]*[\w-]+(?:[ \t]+"([^"]*)")?[ \t]*', text)
    if match is None or kind not in CALLOUTS:
        return ()
    title = f"> [!{kind}]{'-' if match[1] == '???' else ''} {match[2] or ''}".rstrip()
    edits, empty_lines = [Edit(source.span(start, start + len(text)), title)], list[Span]()
    for line in range(number + 1, len(source.line_starts) + 1):
        start, text = source.line_start(line), source.line_text(line)
        indentation = re.match(r" {4}|\t", text)
        if not text.strip():
            empty_lines.append(source.span(start, start + len(text)))
        elif indentation is None:
            break
        else:
            edits += [Edit(empty, ">") for empty in empty_lines]
            edits.append(Edit(source.span(start, start + indentation.end()), "> "))
            empty_lines = []
    return tuple(edits) if len(edits) > 1 else ()


_PIPE = re.compile(r"\\?\|")
_ALIGN: dict[object, Literal["left", "right", "center"]] = {
    "text-align:left": "left",
    "text-align:right": "right",
    "text-align:center": "center",
}


def read_table(
    tokens: Sequence[PositionedToken],
    at: int,
    base: Excerpt,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Table, int]:
    """The table whose opening token has the index `at`, and the index after its closing one."""
    opening = tokens[at]
    align: list[Literal["left", "right", "center"] | None] = []
    rows: list[PositionedToken] = []
    while (token := tokens[at]).type != "table_close":
        at += 1
        if token.type == "tr_open":
            rows.append(token)
        elif token.type == "th_open":
            align.append(_ALIGN.get(token.attrs.get("style")))
    cells = [_read_cells(base, row, len(align), inlines, report) for row in rows]
    for above, row in pairwise(rows[1:]):
        line = base.text[row.start : row.end].strip()
        if line == base.text[above.start : above.end].strip() and re.search(r"[^\W\d_]{2}", line):
            place, message = base.span(row.start, row.end), "this row is repeated here"
            source, number = place.source, place.line
            whole_line = source.span(source.line_start(number), source.line_start(number + 1))
            fix = Fix("delete one of the two", edits=(Edit(whole_line, ""),))
            report(diagnose("text-repeated", place, message, help=fix))
    span = base.span(opening.start, opening.end)
    return Table(span, tuple(align), cells[0], tuple(cells[1:])), at + 1


def _read_cells(
    base: Excerpt,
    row: PositionedToken,
    columns: int,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Cell, ...]:
    line = base.text[row.start : row.end]
    at = row.start + len(line) - len(line.lstrip(MD_TRIM_CHARS))
    end = row.start + len(line.rstrip(MD_TRIM_CHARS))
    parts: list[list[Excerpt]] = [[]]
    for pipe in _PIPE.finditer(base.text, at, end):
        parts[-1].append(base.slice(at, pipe.start()))
        if pipe[0] == "|":
            parts.append([])
            at = pipe.end()
        else:  # the pipe is text, without its backslash
            at = pipe.end() - 1
    parts[-1].append(base.slice(at, end))
    cells = [Excerpt.join(cell_parts) for cell_parts in parts]
    if not cells[0].text:
        del cells[0]
    if cells and not cells[-1].text:
        del cells[-1]
    cells = [trim(cell) for cell in cells]
    if any(cell.text for cell in cells[columns:]):
        message = f"this row has {len(cells)} cells and the header {columns}, so this is not shown"
        help = "write `\\|` for a `|` that is part of a cell, and `\\vert` for one in a formula"
        span = cells[columns].span().to(cells[-1].span())
        report(diagnose("table-cells", span, message, help=help))
    elif len(cells) < columns:
        count = "1 cell" if len(cells) == 1 else f"{len(cells)} cells"
        message = f"this row has {count} and the header {columns}"
        help = "write `|` between cells, and `| |` for a cell with nothing in it"
        report(diagnose("table-cells", base.span(row.start, row.end), message, help=help))
    empty = Excerpt(base.source, "", ((0, base.offset(row.end)),))
    cells = [*cells, *[empty] * columns][:columns]
    return tuple([Cell(cell.span(), cell, inlines(cell)) for cell in cells])


_EMPTY_QUOTED = re.compile(r"^[ >]*>[ \t]*$", re.MULTILINE)
_QUOTE_MARKS = re.compile(r"[ >]*")
_SLIP_OF_MARK = re.compile(r" {0,3}([<.?/,;:|])(?= |$)")


def check_quotation(span: Span) -> Iterator[Diagnostic]:
    """Report a mark too many in the middle of a paragraph, and another character for one."""
    source = span.source
    line = span.line
    lines = [source.line_text(n) if n else "" for n in range(line - 1, span.end_line + 1)]
    above = lines[0]
    outer, marks = (_QUOTE_MARKS.match(text) for text in lines[:2])
    assert outer is not None and marks is not None, "they match nothing as well"
    is_in_text = bool(above[outer.end() :].strip()) and not span.text.startswith("> [!")
    is_in_text = is_in_text and 0 < outer[0].count(">") < marks[0].count(">")
    if source.text[max(span.start - 1, 0)] == ">":  # a mark was typed twice
        fewer = (text.count(">", 0, marks.end()) < marks[0].count(">") for text in lines[2:])
        begins_inside = re.match(r">[ >]*(?:[a-z]|\$\$)", span.text)
        is_doubled = marks[0].count(">") == 2 and (any(fewer) or begins_inside is not None)
        is_in_text = is_in_text or is_doubled
        first = line  # of the quotation
        while first > 1 and source.line_text(first - 1).startswith(">"):
            first -= 1
        begins_callout = re.match(r"> ?\[!", source.line_text(first)) is not None
        if not is_in_text and marks[0].count(">") > 1 and begins_callout:
            place, message = span.first_line(), "a second quotation begins in this callout"
            help = "remove one `>`, or begin each line of it with `> > `"
            yield diagnose("markup-unread", place, message, help=help)
    if is_in_text and ">>" in marks[0]:
        message = "a quotation begins in the middle of a paragraph"
        help = "remove one `>`, or leave a line with nothing but `>` above it"
        place = source.span(at := source.line_start(line), at + len(marks[0].rstrip()))
        yield diagnose("markup-unread", place, message, help=help)
    lost = line - 1  # the line above, or one of those above it, of which only the blank is left
    while lost and re.match(r" [^\s>]", source.line_text(lost)):
        lost -= 1
    if lost and lost < line - 1 and source.line_text(lost).startswith(">"):
        yield _diagnose_lost_mark(source, source.line_start(lost + 1) + 1, ">")
    end_line = min(span.end_line + 1, len(source.line_starts))
    for line in range(span.line + 1, end_line + 1):
        slip = _SLIP_OF_MARK.match(source.line_text(line))
        if slip is not None and (line <= span.end_line or slip[1] != "|"):
            start = source.line_start(line)
            message = f"`{slip[1]}` would be shown as written: this line continues a quotation"
            place = source.span(start + slip.start(1), start + slip.end(1))
            help = Fix("begin the line with `> `", ">")
            yield diagnose("markup-unread", place, message, help=help)


def check_neighbours(above: Sequence[model.Block], block: model.Block) -> Iterator[Diagnostic]:
    """Report a heading that is repeated, a quotation torn from its callout, and lost list marks.

    Also an output below code that nothing runs, as readers would take it for what that code prints,
    unless the code names the script.
    A `>` is lost on the empty line between the two where one sentence goes on, or where other
    empty lines of theirs have it.
    """
    source, before = block.span.source, above[-1] if above else None
    if before is None:
        return
    gap = Span(source, before.span.end, block.span.start)
    if isinstance(block, model.Heading) and block.span.text.strip() == before.span.text.strip():
        place, message = block.span.first_line(), "this heading is repeated here"
        yield diagnose("text-repeated", place, message, help=Fix("delete one of the two", ""))
    if isinstance(block, model.Recording) and isinstance(before, model.CodeBlock | model.PlainCode):
        script = block.script
        if script is not None and posixpath.basename(script) not in before.code.text:
            message = "nothing runs the code above this output"
            help = (
                f"put it below `{script}`, which it is compared with, or make it a block of kind "
            )
            help += "`text illustration`, without a caption"
            yield diagnose("recording-orphan", block.caption_span, message, help=help)
    if isinstance(before, model.Callout) and isinstance(block, model.BlockQuote):
        last = before.span.text.rstrip(" \t\r\n>")[-1:]
        text = f"{before.span.text}\n{block.span.text}"
        is_torn = last.isalnum() or last in ",;:\u2013\u2014" or _EMPTY_QUOTED.search(text)
        is_torn = is_torn or re.match(r"[> \t]*[^\W\dA-Z_]", block.span.text)
        if is_torn and not gap.text.strip(" \t\r\n>") and gap.text.count("\n") <= 2:
            message = "a quotation begins directly below a callout"
            help = (
                "begin the empty line between them with `>`; a quotation of its own has a "
                "second empty line above it"
            )
            place = block.span.first_line()
            yield diagnose("markup-unread", place, message, help=help)
    elif isinstance(block, model.ListBlock) and isinstance(before, model.Paragraph):
        number = re.match(r"\d+(?= +\S)", before.span.text)
        if number is not None and block.start == int(number[0]) + 1:
            place = source.span(before.span.start, before.span.start + number.end())
            message = f"`{number[0]}` would be shown as written: no item of a list begins here"
            help = f"write `{number[0]}.`, as the list below goes on with {block.start}"
            help = Fix(help, f"{number[0]}.", safe=True)
            yield diagnose("markup-unread", place, message, help=help)
        column, list_column = (
            part.start - source.line_start(part.line) for part in (before.span, block.span)
        )
        last_line = source.line_text(block.span.line - 1)
        blanks = len(last_line) - len(last_line.lstrip(" >"))
        if gap.text.count("\n") != 1:
            pass
        elif column == list_column + 1:
            yield _diagnose_lost_mark(source, before.span.start, "-")
        elif blanks > list_column + 1:  # the rest of an item
            message = "the item that ends here may have lost its mark, or its first line"
            help = "begin the item again, or remove the blanks before the line above the list"
            yield diagnose("markup-unread", before.span, message, help=help)


def check_numbers(spans: Sequence[Span]) -> Iterator[Diagnostic]:
    """Report an item whose number is not the one that readers will see."""
    numbers = [int(span.text.partition(".")[0].partition(")")[0]) for span in spans]
    if len(set(numbers)) == 1:
        return  # all are 1, and counted by the browser
    for before, after in pairwise(range(len(spans))):
        if numbers[after] != numbers[before] + 1:
            message = f"{numbers[after]} does not follow {numbers[before]} in this list"
            help = "number the items in order, or all of them with 1"
            notes = (Note("the item before", spans[before].first_line()),)
            place = spans[after].first_line()
            yield diagnose("markup-unread", place, message, help=help, notes=notes)
            return


_NUMBERED_LINE = re.compile(r"^[ >]*(\d{1,2}[.)])(?= +\S)", re.MULTILINE)


def check_numbered_lines(content: Excerpt) -> Iterator[Diagnostic]:
    """Report lines of a paragraph that were meant for a list, which begins with 1 there."""
    marks = list(_NUMBERED_LINE.finditer(content.text))
    if len(marks) > 1:
        message = f"`{marks[0][1]}` would be shown as written: no item of a list begins here"
        help = "begin the list with 1, or leave an empty line above it"
        yield diagnose("markup-unread", content.span(*marks[0].span(1)), message, help=help)


def check_item(span: Span) -> Iterator[Diagnostic]:
    """Report lines of an item that may have begun others."""
    source = span.source
    prefix = source.text[source.line_start(span.line) : span.start]
    number = re.match(r"\d+", span.text)
    if double := re.match(r"(?:[-*+]|\d+[.)]) +([-*+]|\d+[.)]) +\S", span.text):
        message = f"`{double[1]}` begins a list in an item that has no text"
        help = "write the text before it, or delete one of the two marks"
        place = source.span(span.start + double.start(1), span.start + double.end(1))
        yield diagnose("markup-unread", place, message, help=help)
    mark = "-" if number is None else f"{int(number[0]) + 1}."
    slip = r"--+(?= )" if number is None else rf"{mark[:-1]}(?= )"
    for line in range(span.line + 1, span.end_line + 1):
        text, start = source.line_text(line), source.line_start(line) + len(prefix)
        if number is None and re.match(re.escape(prefix) + r" [A-Z*`$\[]", text):
            yield _diagnose_lost_mark(source, start + 1, "-")
        elif match := re.match(rf"{re.escape(prefix)}({slip})", text):
            place = source.span(start, start + len(match[1]))
            message = f"`{match[1]}` would be shown as written: no item of a list begins here"
            help = Fix(f"begin the line with `{mark} `", mark)
            yield diagnose("markup-unread", place, message, help=help)


def _diagnose_lost_mark(source: Source, at: int, mark: str) -> Diagnostic:
    place = source.span(at - 1, at + 1)
    container = "list" if mark == "-" else "quotation"
    message = f"a mark of a {container} may be lost here: only its blank is left"
    help = f"begin the line with `{mark} `, or remove the blank"
    return diagnose("markup-unread", place, message, help=help)
