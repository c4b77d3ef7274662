"""The entry point of this package: a Markdown file of a course becomes a `Document`.

Entry point: `parse_document`. It never raises, whatever the text:

1. Line ends, NUL and a byte order mark are dealt with; front matter is reported and left out.
2. `tree` reads the blocks and, with `inlines`, what is in them; fences of ours go to their own
   modules.
3. Footnotes are read last, in the order of their numbers.
4. What stands where it must not is found in the whole (`_misplaced`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core.model import (
    Document,
    Heading,
    Math,
    MathBlock,
    Paragraph,
    Term,
    block_inlines,
    document_blocks,
    document_inlines,
    walk_inlines,
)
from coursebuild.core.model.blocks import title_line
from coursebuild.core.model.equations import blocks_elsewhere
from coursebuild.core.syntax.headings import slug
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.spans import read_markdown
from coursebuild.core.syntax.tree import TextReader
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

    `callouts` are the known kinds; a lesson, unlike a page, has no heading of level 1. A page's
    title, if it opens with it, is not in the document. All mistakes are diagnostics, in the order
    of their places; the document holds all that could be read.
    """
    session = ParsingState(callouts, lesson)
    base = _without_front_matter(read_markdown(source), session)
    title = None if lesson else title_line(source)
    if title is not None:
        base = base.slice(len(base.text.partition("\n")[0]))
    reader = TextReader(base, session, session.references, nested=False)
    blocks = reader.read()
    anchor = "" if title is None else slug(title.text)
    free = not session.anchors.has(anchor)
    document = Document(source, blocks, session.notes.finish(), anchor if free else "")
    session.diagnostics += _misplaced(document)
    return Parsed(document, sort_diagnostics(session.diagnostics))


def _without_front_matter(text: Excerpt, session: ParsingState) -> Excerpt:
    found = _YAML.match(text.text) or _TOML.match(text.text)
    if found is None:
        return text
    what = "lesson" if session.lesson else "page"
    message = f"a {what} has no front matter"
    help = "its title and everything else about it are in content/course.toml; begin with the text"
    session.report(diagnose("front-matter", text.span(0, 3), message, help=help))
    return text.slice(found.end())


_MARKS = ("]{", "{#eq:")


def _misplaced(document: Document) -> tuple[Diagnostic, ...]:
    """Terms and labels that stand where a reader would not find them.

    The glossary shows the sentence around a term, so it is defined in a paragraph. What stands in a
    quiz, a lab or a heading is shown elsewhere too, so nothing can lead to it.
    """
    if not any(mark in document.source.text for mark in _MARKS):
        return ()
    elsewhere = blocks_elsewhere(document)
    found = [*_taken(document)]
    for block in document_blocks(document):
        away = id(block) in elsewhere
        inlines = [*walk_inlines(block_inlines(block))]
        if away or not isinstance(block, Paragraph):
            message = "a term is not defined here"
            help = "define it in a paragraph of the text, whose sentence the glossary can show"
            terms = (term.span for term in inlines if isinstance(term, Term))
            found += [diagnose("term-place", span, message, help=help) for span in terms]
        if away or isinstance(block, Heading):
            message = "a formula has no label here"
            help = "label formulas of the text, but not those of quizzes, labs and headings"
            formulas = (one for one in (block, *inlines) if isinstance(one, Math | MathBlock))
            labels = (formula.label.span for formula in formulas if formula.label is not None)
            found += [diagnose("equation-label", span, message, help=help) for span in labels]
    return tuple(found)


def _taken(document: Document) -> Iterator[Diagnostic]:
    """Headings whose explicit ids are those of terms."""
    terms = {
        inline.anchor: inline.span
        for inline in document_inlines(document)
        if isinstance(inline, Term)
    }
    for block in document_blocks(document):
        if isinstance(block, Heading) and block.anchor in terms:
            notes = [Note("it is that of this term", terms[block.anchor])]
            message = f"the id `{block.anchor}` is already used"
            yield diagnose("anchor-repeated", block.span, message, notes=notes)
