"""The entry point of this package: a Markdown file of a course becomes a `Document`.

Entry point: `parse_document`. It never raises, whatever the text:

1. Line ends, NUL and a byte order mark are dealt with; front matter is reported and left out.
2. `tree` reads the blocks and, with `inlines`, what is in them; fences of ours go to their own
   modules.
3. Footnotes are read last, in the order of their numbers.
4. What stands where it must not is found in the whole (`places`).
"""

from __future__ import annotations

from coursebuild.core.model import Document
from coursebuild.core.syntax.places import misplaced
from coursebuild.core.syntax.session import ParsingState
from coursebuild.core.syntax.spans import whole
from coursebuild.core.syntax.tree import TextReader
from coursebuild.core.text.diagnostics import Parsed, diagnose, sort_diagnostics
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Excerpt, Source

_YAML = pattern(
    r"---[ \t]*\n(?:#[ \t].*\n)*"  # the first line, comments
    r"[\w-]+[ \t]*:(?:[ \t].*)?\n"  # the first field
    r"(?:.*\n)*?(?:---|\.\.\.)[ \t]*(?:\n|\Z)"
)
_TOML = pattern(r"\+\+\+[ \t]*\n(?:.*\n)*?\+\+\+[ \t]*(?:\n|\Z)")


def parse_document(source: Source, callouts: frozenset[str], *, lesson: bool) -> Parsed[Document]:
    """Parse a lesson or a page.

    `callouts` are the known kinds; a lesson, unlike a page, has no heading of level 1. All mistakes
    are diagnostics, in the order of their places; the document holds all that could be read.
    """
    session = ParsingState(source, callouts, lesson)
    base = _without_front_matter(whole(source), session)
    reader = TextReader(base, session, session.definitions, nested=False)
    blocks = reader.read()
    document = Document(source, blocks, session.notes.finish())
    session.end()
    session.diagnostics += misplaced(document)
    return Parsed(document, sort_diagnostics(session.diagnostics))


def _without_front_matter(text: Excerpt, session: ParsingState) -> Excerpt:
    found = _YAML.match(text.text) or _TOML.match(text.text)
    if found is None:
        return text
    what = "lesson" if session.lesson else "page"
    message = f"a {what} has no front matter"
    help = "its title and all else about it stand in content/course.toml; begin with the text"
    session.report(diagnose("front-matter", text.span(0, 3), message, help=help))
    return text.slice(found.end())
