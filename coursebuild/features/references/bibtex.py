"""A list of sources in BibTeX, each with its place.

LaTeX in it becomes plain text. Nothing in it is HTML: what is shown of a source is escaped where it
is drawn.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import re

from msgspec import Struct

from coursebuild.api import Diagnostic, Note, Parsed, Source, Span, diagnose, regex

NAMES = ("author", "editor", "translator")
_KEY = regex(r"@\s*\w+\s*[{(]\s*([^,\s{}()]*)")
_ENTRY = regex(r"^[ \t]*@", re.MULTILINE)
_DOI = regex(r"(?:https?://(?:dx\.)?doi\.org/|doi:\s*)?(10\.\d{4,9}/\S+)", re.IGNORECASE)
_IDENTIFIERS = frozenset(("doi", "isbn", "url"))
"""Fields in which a backslash only stands before a character of LaTeX."""


class PersonName(Struct, frozen=True):
    """The name of a person, or of a body, which has a family name only."""

    family: str
    given: str = ""
    particle: str = ""
    suffix: str = ""


class Work(Struct, frozen=True):
    """An entry of the list: a work that texts cite."""

    key: str
    kind: str
    """The type of the entry, such as `article`."""
    fields: tuple[tuple[str, str], ...]
    """Plain texts by the name of their field, but for names."""
    people: tuple[tuple[str, tuple[PersonName, ...]], ...]
    """The names in the fields `NAMES`."""
    span: Span
    """The first line of the entry."""

    def field(self, *names: str) -> str:
        """The first of some fields that is not empty; empty if all are."""
        fields = dict(self.fields)
        return next((fields[name] for name in names if fields.get(name)), "")

    @property
    def doi(self) -> str:
        """Without the address of a resolver; empty if there is none."""
        match = _DOI.fullmatch(self.field("doi"))
        return match[1] if match is not None else ""

    @property
    def isbn(self) -> str:
        """Empty if there is none."""
        return self.field("isbn")


@functools.lru_cache(maxsize=8)
def read_works(source: Source) -> Parsed[tuple[Work, ...]]:
    """The works of a list, and what is wrong in it.

    Raises:
        ImportError: the packages that read it are not installed.
    """
    from bibtexparser import middlewares
    from bibtexparser.entrypoint import parse_string
    from bibtexparser.model import (
        DuplicateBlockKeyBlock,
        DuplicateFieldKeyBlock,
        Entry,
        ImplicitComment,
        MiddlewareErrorBlock,
    )

    for name in (
        "bibtexparser",
        "bibtexparser.entrypoint",
        "bibtexparser.splitter",
        "pylatexenc.latexwalker",
        "pylatexenc.latex2text",
    ):
        logging.getLogger(name).disabled = True
    list_text = source.text.replace("\r\n", "\n").replace("\r", "\n")
    library = parse_string(list_text, parse_stack=())
    for block in library.failed_blocks:
        entry = block.ignore_error_block
        if not (isinstance(block, DuplicateFieldKeyBlock) and isinstance(entry, Entry)):
            continue
        if len({(f.key, f.value) for f in entry.fields}) == len(entry.fields_dict):
            entry.fields = [*entry.fields_dict.values()]
            library.replace(block, entry, fail_on_duplicate_key=False)
    diagnostics: list[Diagnostic] = []

    def report(line: int | None, message: str, help: str, notes: tuple[Note, ...] = ()) -> None:
        place = _line(source, line)
        diagnostics.append(diagnose("source-malformed", place, message, help=help, notes=notes))

    for entry in library.entries:  # values as they are written
        for field in entry.fields:
            if (swallowed := _find_swallowed(field.value)) is not None:
                start, message, help = swallowed
                before = "\n".join(list_text.split("\n")[: field.start_line])
                start += list_text.index(field.value, len(before))
                report(
                    list_text.count("\n", 0, start),
                    f"in `{entry.key}`, the value of `{field.key}` {message}",
                    help,
                )
    for middleware in (
        *middlewares.default_parse_stack(),
        middlewares.NormalizeFieldKeys(),
        middlewares.SeparateCoAuthors(),
        middlewares.SplitNameParts(),
    ):
        library = middleware.transform(library)
    for block in library.failed_blocks:
        match, notes = _KEY.match(block.raw or ""), tuple[Note, ...]()
        name = f"`{match[1]}`" if match is not None and match[1] else "this entry"
        message = f"{name} is not whole"
        help = "close each value and each entry with the brace or quote that it opened"
        if isinstance(block, DuplicateBlockKeyBlock):
            notes = (Note("the first one is here", _line(source, block.previous_block.start_line)),)
            message, help = f"{name} is listed twice", "give one of the two another key"
        elif isinstance(block, DuplicateFieldKeyBlock):
            message, help = f"{name} has `{min(block.duplicate_keys)}` twice", "keep one of them"
        elif isinstance(block, MiddlewareErrorBlock):
            reason = " ".join(str(block.error).split())
            message, help = f"{name} cannot be read: {reason[:200]}", "mend the field"
        report(block.start_line, message, help, notes)
    for comment in library.blocks:
        if not isinstance(comment, ImplicitComment):
            continue
        for match in _ENTRY.finditer(comment.comment or ""):
            line = (comment.start_line or 0) + comment.comment[: match.start()].count("\n")
            report(line, "no entry begins here", "an entry is `@article{key, title = {…}, …}`")
    works: list[Work] = []
    for entry in library.entries:
        fields: list[tuple[str, str]] = []
        people: list[tuple[str, tuple[PersonName, ...]]] = []
        for field in entry.fields:
            if field.key in NAMES and isinstance(field.value, list):
                people.append((field.key, tuple(map(_read_name, field.value))))
            else:
                fields.append((field.key, _plain(str(field.value), field.key)))
        kind, span = entry.entry_type.lower(), _line(source, entry.start_line)
        works.append(Work(entry.key, kind, tuple(fields), tuple(people), span))
    return Parsed(tuple(works), tuple(diagnostics))


_PIECE = regex(r"""[^\s"#%'(),={}]+""")
"""A number, or a name of `@string`."""


def _find_swallowed(value: str) -> tuple[int, str, str] | None:
    """Where a value goes on with what is not its own, in words, and a help.

    A value is one piece, or several with `#` between them: texts in braces or quotes, numbers and
    names.
    """
    end = _end_of_piece(value, 0)
    while (joint := re.compile(r"\s*#\s*").match(value, end)) is not None:
        end = _end_of_piece(value, joint.end())
    if rest := value[end:].strip():
        start = value.index(rest, end)
        excerpt = " ".join(rest.split())[:40]
        return start, f"ends before `{excerpt}`", "put a comma between the two"
    return None


def _end_of_piece(value: str, start: int) -> int:
    """The end of a text, number or name; of a text that nothing closes, the end of all."""
    opening = value[start : start + 1]
    if opening not in ("{", '"'):
        piece = _PIECE.match(value, start)
        return start if piece is None else piece.end()
    depth = 0
    for mark in re.compile(r'\\.|[{}"]', re.DOTALL).finditer(value, start + (opening == '"')):
        depth += {"{": 1, "}": -1}.get(mark[0], 0)
        if depth == 0 and mark[0] == ("}" if opening == "{" else '"'):
            return mark.end()
    return len(value)


def _line(source: Source, index: int | None) -> Span:
    """A line of the list, from 0, without the white space at its ends; the first if unknown."""
    line = min((index or 0) + 1, len(source.line_starts))
    text = source.line_text(line)
    start = source.line_start(line) + len(text) - len(text.lstrip())
    return source.span(start, start + len(text.strip()))


def _read_name(name: object) -> PersonName:
    """A name from its parts; one in braces stays whole."""
    first, von, last, junior = (
        _plain(" ".join(getattr(name, part))) for part in ("first", "von", "last", "jr")
    )
    return PersonName(last, first, von, junior)


def _plain(text: str, field: str = "") -> str:
    """A field on one line as plain text: without LaTeX, and braces that only protect capitals."""
    from pylatexenc.latex2text import LatexNodes2Text

    if field in _IDENTIFIERS:
        text = text.replace("\\", "")
    elif "\\" in text or "$" in text or "~" in text:
        # What this raises at broken LaTeX is whatever meets it; the text stays as it is written.
        with contextlib.suppress(Exception):
            text = LatexNodes2Text(math_mode="text").latex_to_text(text)
    return " ".join(re.sub(r"[{}\ue000-\uf8ff]", "", text).replace("--", "–").split())


def check_identifier(work: Work) -> str:
    """Why the DOI or ISBN of a source leads nowhere; empty if it does not."""
    doi, isbn = work.field("doi"), re.sub(r"[\s-]", "", work.isbn).upper()
    if doi and not work.doi:
        return f"`{doi}` is not a DOI"
    if isbn and not _is_isbn(isbn):
        return f"`{work.isbn}` is not an ISBN: its digits do not fit together"
    return ""


def _is_isbn(text: str) -> bool:
    """Whether the check digit of an ISBN of 10 or 13 digits is right."""
    if re.fullmatch(r"\d{9}[\dX]", text):
        digits = [10 if char == "X" else int(char) for char in text]
        return sum((10 - i) * digit for i, digit in enumerate(digits)) % 11 == 0
    if re.fullmatch(r"\d{13}", text):
        return sum((3 if i % 2 else 1) * int(char) for i, char in enumerate(text)) % 10 == 0
    return False
