"""A Markdown file of a course becomes a `Document`; merge conflicts that are left in a file."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.blocks import title_line
from coursebuild.core.model.course import ENGLISH, Words
from coursebuild.core.model.walk import DisplayFormula, feature_block_ids
from coursebuild.core.syntax.attributes import slug
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.python_syntax import check_syntax, find_windows
from coursebuild.core.syntax.recording import ILLUSTRATION
from coursebuild.core.syntax.spans import read_markdown
from coursebuild.core.syntax.tree import TextReader
from coursebuild.core.text.characters import ISOLATING, REORDERING
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Note,
    Parsed,
    diagnose,
    sort_diagnostics,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Source, Span

_YAML = regex(
    r"---[ \t]*\n(?:#[ \t].*\n)*"  # the first line, comments
    r"[\w-]+[ \t]*:(?:[ \t].*)?\n"  # the first field
    r"(?:.*\n)*?(?:---|\.\.\.)[ \t]*(?:\n|\Z)"
)
_TOML = regex(r"\+\+\+[ \t]*\n(?:.*\n)*?\+\+\+[ \t]*(?:\n|\Z)")


def parse_document(
    source: Source, callouts: frozenset[str], *, lesson: bool, words: Words = ENGLISH
) -> Parsed[model.Document]:
    """Parse a lesson or a page, whatever its text; the document holds all that could be read.

    A lesson, unlike a page, has no heading of level 1. The title with which a page may begin is
    not in the document.
    """
    state = ParsingState(callouts, lesson, words)
    base = read_markdown(source)
    if (front := _YAML.match(base.text) or _TOML.match(base.text)) is not None:
        message = f"a {'lesson' if lesson else 'page'} cannot have front matter"
        help = "its title and everything else about it are in content/course.toml; "
        help += "begin with the text"
        help = Fix(help, edits=(Edit(base.span(0, front.end()), ""),))
        state.report(diagnose("front-matter", base.span(0, 3), message, help=help))
        base = base.slice(front.end())
    title = None if lesson else title_line(source, base.span().start)
    if title is not None:
        below = base.text.lstrip().partition("\n")[2]
        base = base.slice(len(base.text) - len(below))
    reader = TextReader(base, state, state.references, nested=False)
    blocks = reader.read()
    anchor = "" if title is None else slug(title.text)
    is_free = not state.anchors.has(anchor)
    document = model.Document(source, blocks, state.notes.finish(), anchor if is_free else "")
    # Quizzes show what is wrong as well, and what has a mistake in its first line is mended first.
    mistakes, in_features = (
        {d.span.line for d in state.diagnostics if d.is_error},
        feature_block_ids(document),
    )
    all_blocks = tuple(model.document_blocks(document))
    scripts = (at for at, block in enumerate(all_blocks) if isinstance(block, model.Script))
    unclaimed = tuple(
        block
        for block in all_blocks[next(scripts, len(all_blocks)) :]
        if isinstance(block, model.CodeBlock)
        and block.language in _TEXTS
        and ILLUSTRATION not in block.info.split()
        and id(block) not in in_features
        and block.span.line not in mistakes
    )
    document = replace(document, unclaimed=unclaimed, comma=state.has_decimal_comma)
    conflict = find_conflict(source)
    if conflict is not None:  # the rest follows from it
        return Parsed(document, (conflict,))
    state.diagnostics += (*_check_placement(document), *_check_ids(document))
    syntax_errors = [d.span for d in state.diagnostics if d.rule == "python-syntax"]
    for script in model.document_scripts(document):  # that their parts parse is known
        parts = script.parts
        if parts and not any(part.span.contains(span) for part in parts for span in syntax_errors):
            state.diagnostics += check_syntax(script.code)
        if script.is_python and not (script.figures or script.norun):
            state.diagnostics += find_windows(script.code)
    if (at := source.text.find("\0")) >= 0:
        message = "the text contains a NUL character"
        places = [match.start() for match in re.finditer("\0", source.text)]
        edits = tuple(Edit(source.span(place, place + 1), "") for place in places)
        help = Fix("delete it; readers would see `\ufffd`", edits=edits, safe=True)
        state.report(diagnose("control-character", source.span(at, at + 1), message, help=help))
    for block in all_blocks:  # readers would see it otherwise than it runs
        match block:
            case model.Recording():
                state.diagnostics += find_reordering(block.body_span, is_code=True)
            case model.Script() | model.ScriptPart() | model.PlainCode():
                state.diagnostics += find_reordering(block.span, is_code=True)
            case model.CodeBlock() | model.Mjcf():
                state.diagnostics += find_reordering(block.span, is_code=True)
            case _:
                pass
    return Parsed(document, sort_diagnostics(state.diagnostics))


def read_again(course: model.Course, owner: model.Owner, summary: model.Document) -> model.Document:
    """The whole document of a lesson or page, of whose text a course has a summary."""
    return parse_document(
        summary.source,
        course.callout_names,
        lesson=isinstance(owner, model.Lesson),
        words=course.words_of(owner),
    ).value


def find_reordering(place: Span, *, is_code: bool) -> Iterator[Diagnostic]:
    """Report the first character of a text by which a browser shows others in another order."""
    if character := (ISOLATING if is_code else REORDERING).search(place.text):
        at = place.start + character.start()
        message = f"U+{ord(character[0]):04X} shows the line in another order than it is read"
        help = "delete it"
        help += "; scripts can write an escape, and print `ascii(text)`" if is_code else ""
        yield diagnose("control-character", place.source.span(at, at + 1), message, help=help)


_TEXTS = frozenset(
    """
    ansi console log none out plain plaintext pycon raw result results shell-session stdout
    terminal text txt
    """.split()
) | {""}
"""Kinds of code blocks that may show an output."""


_FORMULAS = (model.Math, model.MathBlock)


def _check_placement(document: model.Document) -> Iterator[Diagnostic]:
    """Report terms and labels in places where no link could lead to them.

    The glossary shows the sentence around a term, so it is defined in a paragraph. The texts of
    quizzes, labs and headings are shown in several places, so no link can name one of them.
    """
    if not any(mark in document.source.text for mark in ("]{", "{#eq:")):
        return
    elsewhere = feature_block_ids(document)
    for block, inlines in model.inlines_by_block(document):
        is_elsewhere = id(block) in elsewhere
        if is_elsewhere or not isinstance(block, model.Paragraph):
            message = "a term cannot be defined here"
            help = "define it in a paragraph of the text, whose sentence the glossary can show"
            for inline in inlines:
                if isinstance(inline, model.Term):
                    yield diagnose("term-place", inline.span, message, help=help)
        if is_elsewhere or isinstance(block, model.Heading):
            message = "a formula has no label here"
            help = "label formulas of the text, but not those of quizzes, labs and headings"
            formulas = (part for part in (block, *inlines) if isinstance(part, _FORMULAS))
            for formula in formulas:
                if formula.label is not None:
                    yield diagnose("label-attribute", formula.label.span, message, help=help)


def _check_ids(document: model.Document) -> Iterator[Diagnostic]:
    headings = model.heading_anchors(document)
    owners: dict[str, tuple[model.AnchorOwner, Span]] = {}
    reported_places: set[int] = set()
    anchors = sorted(model.document_anchors(document), key=lambda anchor: anchor[2].start)
    for name, node, span in anchors:
        keys = node.progress_keys() if isinstance(node, model.FeatureBlock) else None
        if keys is not None and name == keys[0] and name in headings:
            continue
        entry = node, span
        first, first_span = owners.setdefault(name, entry)
        if owners[name] is entry or _is_reported(first, node) or span.start in reported_places:
            continue
        reported_places.add(span.start)
        message, help = f"the id `{name}` is already used", "give one of the two another id"
        notes = [Note("first used here", first_span.first_line())]
        yield diagnose("anchor-repeated", span.first_line(), message, help=help, notes=notes)


def _is_reported(first: model.AnchorOwner, second: model.AnchorOwner) -> bool:
    """Whether it is a mistake by another rule, or found already, that two nodes have one id."""
    if isinstance(first, model.FeatureBlock) and isinstance(second, model.FeatureBlock):
        keys, other_keys = first.progress_keys(), second.progress_keys()
        return keys is not None and other_keys is not None and keys[0] == other_keys[0]
    labelled_types = model.Heading | model.Label | DisplayFormula  # see `attributes.Anchors`
    return (isinstance(first, labelled_types) and isinstance(second, labelled_types)) or (
        isinstance(first, model.Script | model.Term) and type(first) is type(second)
    )


# --- merge conflicts that git left in a file


_CONFLICT_MARK = regex(r"^(?:<{7}|\|{7}|={7}|>{7})(?:[ \t][^\r\n]*)?(?=\r?$)", re.MULTILINE)
_FENCED = regex(
    r"^ {0,3}(`{3,}|~{3,})[ \t]*(?P<info>[^`\n]*)\n(?:.*\n)*? {0,3}\1[`~]*[ \t]*\r?$",
    re.MULTILINE,
)
"""A block of code as a whole."""


def find_conflict(source: Source) -> Diagnostic | None:
    """The diagnostic of the first merge conflict in a file, or of a mark that is left of one.

    Git writes its marks at the start of a line, so a conflict can be shown on purpose: in a block
    that is only shown, whose first line names at most a kind, or indented in a list or a quotation.
    """
    text, is_markdown = source.text, source.path.endswith(".md")
    if "<<<<<<<" not in text and ">>>>>>>" not in text:
        return None  # a line of `=` alone may be anything
    blocks = _FENCED.finditer(text) if is_markdown else ()
    examples = [block.span() for block in blocks if len(block["info"].split()) < 2]
    marks = [
        Span(source, *match.span())
        for match in _CONFLICT_MARK.finditer(text)
        if not any(start <= match.start() < end for start, end in examples)
    ]
    # A line of `=` above the first one of the others is that of a heading.
    marks = [*itertools.dropwhile(lambda mark: mark.text[0] not in "<>", marks)]
    if not marks:
        return None
    lines = ", ".join(str(mark.line) for mark in marks)
    message = f"a merge conflict was left here: its marks are in lines {lines}"
    if len(marks) == 1:
        message = "this line was left behind by a merge conflict"
    help = "keep one of the versions, or join them, and delete the marks"
    if is_markdown:
        help += "; to show a conflict to readers, put all of it into a block of code"
    return diagnose("merge-conflict", marks[0], message, help=help)
