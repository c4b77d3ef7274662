"""Marks of lists and quotations that were lost, doubled or mistyped, and blocks that were doubled.

Entry points: `check_quotation`, `check_neighbours` of a block and those above it, `check_numbers`
and `check_item` of a list.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

from coursebuild.core import model
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Source, Span

_EMPTY_QUOTED = re.compile(r"^[ >]*>[ \t]*$", re.MULTILINE)
_QUOTE_MARKS = re.compile(r"[ >]*")
_SLIP_OF_MARK = re.compile(r" {0,3}([<.?/,;:|])(?= |$)")
"""What a line of a quotation may begin with if `>` was mistyped."""


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
    if is_in_text and ">>" in marks[0]:
        message = "a quotation begins in the middle of a paragraph"
        help = "take one `>` away, or leave a line with nothing but `>` above it"
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
            help = "begin the line with `> `"
            yield diagnose("markup-unread", place, message, help=help)


def check_neighbours(above: Sequence[model.Block], block: model.Block) -> Iterator[Diagnostic]:
    """Report a block that is repeated, a quotation torn from its callout, and lost list marks.

    A `>` is lost on the empty line between the two where one sentence goes on, or where other
    empty lines of theirs have it.
    """
    source, before = block.span.source, above[-1] if above else None
    if before is None:
        return
    gap = Span(source, before.span.end, block.span.start)
    text = block.span.text.strip()
    if isinstance(block, model.Heading | model.Paragraph) and text == before.span.text.strip():
        kind = "heading" if isinstance(block, model.Heading) else "paragraph"
        message, help = f"this {kind} stands here twice", "delete it once"
        yield diagnose("text-repeated", block.span.first_line(), message, help=help)
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
            yield diagnose("markup-unread", place, message, help=help)
        column, list_column = (
            part.start - source.line_start(part.line) for part in (before.span, block.span)
        )
        if column == list_column + 1 and gap.text.count("\n") == 1:
            yield _diagnose_lost_mark(source, before.span.start, "-")


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


def check_item(span: Span) -> Iterator[Diagnostic]:
    """Report lines of an item that may have begun others."""
    source = span.source
    prefix = source.text[source.line_start(span.line) : span.start]
    number = re.match(r"\d+", span.text)
    mark = "-" if number is None else f"{int(number[0]) + 1}."
    slip = r"--+(?= )" if number is None else rf"{mark[:-1]}(?= )"
    for line in range(span.line + 1, span.end_line + 1):
        text, start = source.line_text(line), source.line_start(line) + len(prefix)
        if number is None and re.match(re.escape(prefix) + r" [A-Z*`$\[]", text):
            yield _diagnose_lost_mark(source, start + 1, "-")
        elif match := re.match(rf"{re.escape(prefix)}({slip})", text):
            place = source.span(start, start + len(match[1]))
            message = f"`{match[1]}` would be shown as written: no item of a list begins here"
            help = f"begin the line with `{mark} `"
            yield diagnose("markup-unread", place, message, help=help)


def _diagnose_lost_mark(source: Source, at: int, mark: str) -> Diagnostic:
    place = source.span(at - 1, at + 1)
    container = "list" if mark == "-" else "quotation"
    message = f"a mark of a {container} may be lost here: only its blank is left"
    help = f"begin the line with `{mark} `, or take the blank away"
    return diagnose("markup-unread", place, message, help=help)
