"""The entry point of this package: a Markdown file of a course becomes a `Document`.

Entry point: `parse_document`. It never raises, whatever the text:

1. Line ends, NUL and a byte order mark are normalized; front matter is reported and left out.
2. `tree` reads the blocks and, with `inlines`, their content; other modules read our fences.
3. Footnotes are read last, in the order of their numbers.
4. Terms and labels in wrong places are found in the whole document (`_check_placement`). Where a
   merge conflict was left, that is all there is to say.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core.model import (
    Document,
    Heading,
    Paragraph,
    Term,
    block_formulas,
    block_inlines,
    document_blocks,
    find_blocks,
    find_inlines,
    walk_inlines,
)
from coursebuild.core.model.blocks import title_line
from coursebuild.core.model.equations import feature_block_ids
from coursebuild.core.syntax.headings import slug
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.spans import read_markdown
from coursebuild.core.syntax.tree import TextReader
from coursebuild.core.text.conflicts import find_conflict
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, sort_diagnostics
from coursebuild.core.text.source import Excerpt, Source

_YAML = re.compile(
    r"---[ \t]*\n(?:#[ \t].*\n)*"  # the first line, comments
    r"[\w-]+[ \t]*:(?:[ \t].*)?\n"  # the first field
    r"(?:.*\n)*?(?:---|\.\.\.)[ \t]*(?:\n|\Z)"
)
_TOML = re.compile(r"\+\+\+[ \t]*\n(?:.*\n)*?\+\+\+[ \t]*(?:\n|\Z)")


def parse_document(source: Source, callouts: frozenset[str], *, lesson: bool) -> Parsed[Document]:
    """Parse a lesson or a page.

    `callouts` are the known kinds. A lesson, unlike a page, has no heading of level 1. The title
    with which a page may begin is not in the document. Mistakes become diagnostics, in the order of
    their places; the document holds all that could be read.
    """
    state = ParsingState(callouts, lesson)
    base = _remove_front_matter(read_markdown(source), state)
    title = None if lesson else title_line(source)
    if title is not None:
        base = base.slice(len(base.text.partition("\n")[0]))
    reader = TextReader(base, state, state.references, nested=False)
    blocks = reader.read()
    anchor = "" if title is None else slug(title.text)
    is_free = not state.anchors.has(anchor)
    document = Document(source, blocks, state.notes.finish(), anchor if is_free else "")
    conflict = find_conflict(source)
    if conflict is not None:  # the rest follows from it
        return Parsed(document, (conflict,))
    state.diagnostics += _check_placement(document)
    if (at := source.text.find("\0")) >= 0:
        message, help = "a NUL character stands here", "delete it; readers would see `\ufffd`"
        state.report(diagnose("control-character", source.span(at, at + 1), message, help=help))
    return Parsed(document, sort_diagnostics(state.diagnostics))


def _remove_front_matter(text: Excerpt, state: ParsingState) -> Excerpt:
    match = _YAML.match(text.text) or _TOML.match(text.text)
    if match is None:
        return text
    subject = "lesson" if state.lesson else "page"
    message = f"a {subject} has no front matter"
    help = "its title and everything else about it are in content/course.toml; begin with the text"
    state.report(diagnose("front-matter", text.span(0, 3), message, help=help))
    return text.slice(match.end())


_MARKS = ("]{", "{#eq:")


def _check_placement(document: Document) -> tuple[Diagnostic, ...]:
    """Report terms and labels in places where no link could lead to them.

    The glossary shows the sentence around a term, so it is defined in a paragraph. The texts of
    quizzes, labs and headings are shown in several places, so no link can name one of them.
    """
    if not any(mark in document.source.text for mark in _MARKS):
        return ()
    elsewhere = feature_block_ids(document)
    diagnostics = [*_check_ids_of_terms(document)]
    for block in document_blocks(document):
        is_elsewhere = id(block) in elsewhere
        if is_elsewhere or not isinstance(block, Paragraph):
            message = "a term is not defined here"
            help = "define it in a paragraph of the text, whose sentence the glossary can show"
            inlines = walk_inlines(block_inlines(block))
            terms = (term.span for term in inlines if isinstance(term, Term))
            diagnostics += [diagnose("term-place", span, message, help=help) for span in terms]
        if is_elsewhere or isinstance(block, Heading):
            message = "a formula has no label here"
            help = "label formulas of the text, but not those of quizzes, labs and headings"
            formulas = block_formulas(block)
            labels = (formula.label.span for formula in formulas if formula.label is not None)
            diagnostics += [diagnose("equation-label", span, message, help=help) for span in labels]
    return tuple(diagnostics)


def _check_ids_of_terms(document: Document) -> Iterator[Diagnostic]:
    """Report headings whose explicit ids are those of terms."""
    terms = {term.anchor: term.span for term in find_inlines(document, Term)}
    for heading in find_blocks(document, Heading):
        if heading.anchor in terms:
            notes = [Note("it is that of this term", terms[heading.anchor])]
            message = f"the id `{heading.anchor}` is already used"
            yield diagnose("anchor-repeated", heading.span, message, notes=notes)
