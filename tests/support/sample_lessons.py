"""Small lessons as values, read without the Markdown parser: these tests stand on their own.

`document(text)` reads `file=` blocks, `Output:` with a fence or a table, and bound numbers, inside
one prefix (`> `, indentation). It knows nothing else of Markdown.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from decimal import Decimal

from coursebuild.core.model import (
    Block,
    Cell,
    CodeSpan,
    Comparison,
    Course,
    Document,
    Inline,
    Lesson,
    Level,
    Mode,
    NumberBinding,
    Paragraph,
    Recording,
    Script,
    Status,
    Strong,
    Table,
    Text,
)
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Excerpt, Source, Span

EXACT = Comparison()
DIGITS = Comparison(Mode.DIGITS)
VOLATILE = Comparison(Mode.VOLATILE)
ELLIPSIS = Comparison(ellipsis=True)
DIGITS_ELLIPSIS = Comparison(Mode.DIGITS, ellipsis=True)


def within(rtol: str = "0", atol: str = "0", *, ellipsis: bool = False) -> Comparison:
    return Comparison(Mode.TOLERANCE, Decimal(rtol), Decimal(atol), ellipsis)


_LINE = re.compile(r"([^\r\n]*)(\r\n|\n|\r|\Z)")
_CELL_INLINE = re.compile(r"`([^`]+)`|\*\*([^*]+)\*\*|([^`*]+)")
_BINDING = re.compile(r"`([^`]+)`\{out(?:=([^}]+))?\}")
_MODES = {"exact": EXACT, "digits": DIGITS, "volatile": VOLATILE, "ellipsis": ELLIPSIS}


def document(text: str, path: str = "content/lessons/4.2-mass.md", prefix: str = "") -> Document:
    return _Reader(Source(path, text), prefix).read()


class _Reader:
    def __init__(self, source: Source, prefix: str) -> None:
        self.source, self.prefix = source, prefix
        self.rows: list[tuple[int, int, str]] = []
        """Offset of the line, offset of its content, content."""
        for found in _LINE.finditer(source.text):
            line = found[1]
            inner = len(prefix) if line.startswith(prefix) else len(prefix.rstrip())
            if found.start() < len(source.text) or not self.rows:
                self.rows.append((found.start(), found.start() + inner, line[inner:]))
        self.at = 0

    def read(self) -> Document:
        blocks: list[Block] = []
        script: str | None = None
        while self.at < len(self.rows):
            _, start, line = self.rows[self.at]
            opened = re.match(r"(`{3,}|~{3,})python file=(\S+)(.*)", line)
            if opened:
                block = self.script(opened)
                script = block.path
                blocks.append(block)
            elif re.fullmatch(r"Output.*:", line):
                blocks.append(self.recording(script))
            else:
                inlines = tuple(self.inlines(start, line))
                if inlines:
                    blocks.append(Paragraph(self.span(start, start + len(line)), inlines))
                self.at += 1
        return Document(self.source, tuple(blocks), ())

    def span(self, start: int, end: int) -> Span:
        return Span(self.source, start, end)

    def fence(self) -> tuple[Excerpt, Span, Span]:
        """The body, its span, and that of the whole fence; moves past it."""
        _, start, line = self.rows[self.at]
        marks = re.match(r"`{3,}|~{3,}", line)
        assert marks
        first = self.at + 1
        last = first
        closing = re.compile(rf" {{0,3}}{re.escape(marks[0][0])}{{{len(marks[0])},}}[ \t]*")
        while not closing.fullmatch(self.rows[last][2]):
            last += 1
        lines = [(text, offset) for _, offset, text in self.rows[first:last]]
        body = Excerpt.of_lines(self.source, [*lines, ("", self.rows[last][0])])
        self.at = last + 1
        whole = self.span(start, self.rows[last][1] + len(self.rows[last][2]))
        return body, self.span(self.rows[first][0], self.rows[last][0]), whole

    def script(self, opened: re.Match[str]) -> Script:
        at = self.rows[self.at][1]
        path_span = self.span(at + opened.start(2), at + opened.end(2))
        timeout = re.search(r"timeout=(\S+)", opened[3])
        body, body_span, span = self.fence()
        seconds = float(timeout[1]) if timeout else 60.0
        norun = "norun" in opened[3].split()
        return Script(
            span, opened[2], path_span, body, self.prefix, seconds, (), (), norun, body_span
        )

    def recording(self, script: str | None) -> Recording:
        _, start, line = self.rows[self.at]
        caption = self.span(start, start + len(line))
        self.at += 1
        while not self.rows[self.at][2]:
            self.at += 1
        if self.rows[self.at][2].startswith("|"):
            table = self.table()
            body: Excerpt | Table = table
            body_span, whole, comparison = table.span, caption.to(table.span), None
        else:
            comparison = self.comparison(self.rows[self.at][2])
            body, body_span, fence = self.fence()
            whole = caption.to(fence)
        inlines = (Text(caption, line),)
        return Recording(whole, inlines, caption, body, body_span, self.prefix, comparison, script)

    def comparison(self, opening: str) -> Comparison | None:
        return next((_MODES[key] for key in opening.split()[1:] if key in _MODES), None)

    def table(self) -> Table:
        rows: list[tuple[Cell, ...]] = []
        start = self.rows[self.at][1]
        end = start
        while self.at < len(self.rows) and self.rows[self.at][2].startswith("|"):
            _, offset, line = self.rows[self.at]
            rows.append(tuple(self.cells(offset, line)))
            end = offset + len(line)
            self.at += 1
        header, _, *body = rows
        return Table(self.span(start, end), (None,) * len(header), header, tuple(body))

    def cells(self, offset: int, line: str) -> Iterator[Cell]:
        for found in re.finditer(r"\|([^|]*)(?=\|)", line):
            text = found[1].strip()
            start = offset + found.start(1) + len(found[1]) - len(found[1].lstrip())
            span = self.span(start, start + len(text))
            inlines: list[Inline] = []
            for part in _CELL_INLINE.finditer(text):
                where = self.span(start + part.start(), start + part.end())
                if part[1]:
                    inlines.append(CodeSpan(where, part[1]))
                elif part[2]:
                    inner = self.span(where.start + 2, where.end - 2)
                    inlines.append(Strong(where, (Text(inner, part[2]),)))
                else:
                    inlines.append(Text(where, part[3]))
            yield Cell(span, Excerpt.of_span(span), tuple(inlines))

    def inlines(self, offset: int, line: str) -> Iterator[Inline]:
        for found in _BINDING.finditer(line):
            span = self.span(offset + found.start(), offset + found.end())
            inner = self.span(offset + found.start(1), offset + found.end(1))
            yield NumberBinding(span, found[1], inner, found[2])


def told(diagnostic: Diagnostic) -> str:
    """All that a diagnostic says, with its places."""

    def place(span: Span | None) -> str:
        return "" if span is None else f" at {span.line}:{span.column} `{span.first_line().text}`"

    lines = [f"{diagnostic.rule}{place(diagnostic.span)}", f"  {diagnostic.message}"]
    if diagnostic.label:
        lines.append(f"  ^ {diagnostic.label}")
    for note in diagnostic.notes:
        first, *rest = note.message.split("\n")
        lines += [f"  note{place(note.span)}: {first}", *(f"    {line}".rstrip() for line in rest)]
    if diagnostic.help:
        lines.append(f"  help: {diagnostic.help}")
    return "\n".join(lines)


def recordings(found: Document) -> tuple[Recording, ...]:
    return tuple(block for block in found.blocks if isinstance(block, Recording))


def recording(
    body: str, *, prefix: str = "", eol: str = "\n", fence: str = "```", above: str = ""
) -> Recording:
    """A lesson with one script and one recorded fence, its lines after `prefix`, ended by `eol`."""
    lines = [
        *(above.split("\n") if above else ()),
        "```python file=examples/a.py",
        "print(1)",
        "```",
        "Output:",
        "",
        f"{fence}text",
        *(body.split("\n") if body else ()),
        fence,
        "After.",
        "",
    ]
    text = eol.join((prefix + line) if line else prefix.rstrip() for line in lines)
    return recordings(document(text, prefix=prefix))[0]


def table(rows: str) -> Recording:
    """A lesson with one script and one recorded table."""
    text = f"```python file=examples/a.py\nprint(1)\n```\n\nOutput:\n\n{rows}\n\nAfter.\n"
    return recordings(document(text))[0]


def course(
    *documents: Document,
    comparison: Comparison = EXACT,
    filters: tuple = (),  # type: ignore[type-arg]
) -> Course:
    """A course of these lessons; ids are taken from the file names."""
    source = Source("content/course.toml", "")
    lessons = []
    for found in documents:
        id, _, slug = found.source.path.rpartition("/")[2].removesuffix(".md").partition("-")
        lessons.append(
            Lesson(
                span=source.span(),
                id=id,
                slug=slug,
                title=slug,
                status=Status.COMPLETE,
                summary="",
                aliases=(),
                objectives=(),
                prerequisites=(),
                prerequisite_spans=(),
                minutes=None,
                further=None,
                level="1",
                document=found,
            )
        )
    return Course(
        map=source,
        title="",
        summary="",
        language="en",
        base_url="",
        repository="",
        licence="",
        engine=None,
        engine_span=None,
        comparison=comparison,
        filters=filters,
        callouts=(),
        silences=(),
        levels=(Level(source.span(), "1", "", "", tuple(lessons)),),
        pages=(),
        models=(),
    )


def ran(
    stdout: str = "",
    *,
    path: str = "examples/a.py",
    outcome: Outcome = Outcome.OK,
    status: int = 0,
    stderr: str = "",
) -> ScriptRun:
    return ScriptRun(path, outcome, status, stdout, stderr, 0.1)
