"""How long lessons take, by the pace that the course map states.

Entry point: `FEATURE`. The effort of a document, on its main path and further, is counted when it
is read, and kept with it. The map says how many minutes a lesson takes; where the count differs by
more than a quarter, and by more than five minutes, that is a warning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.features import Feature
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.rules import Rule

_SHARE, _MINUTES = 0.25, 5
"""A count is as good as that: it may differ by this share, and by so many minutes."""


class Effort(Struct, frozen=True):
    """What there is to read and to do."""

    words: int
    """To fifty, so that not each edit counts."""
    lines: int
    """Of code and output, to five; a formula is a line."""
    tasks: int

    def minutes(self, pace: model.Pace) -> int:
        """How long it takes, to five minutes."""
        exact = self.words / pace.words + self.lines / pace.lines + self.tasks * pace.task
        return _rounded(exact, 5)


class Efforts(Struct, frozen=True):
    """Of a document."""

    main: Effort
    further: Effort


def efforts(document: model.Document) -> Efforts:
    """What a document asks of its reader. Footnotes are read by few, and count nothing."""
    parts: dict[bool, list[model.Block]] = {False: [], True: []}
    for further, blocks in model.main_and_further(document.blocks):
        parts[further] += model.walk_blocks(blocks)
    return Efforts(_effort(parts[False]), _effort(parts[True]))


def _effort(blocks: list[model.Block]) -> Effort:
    words = sum(len(model.plain_text(model.block_inlines(block)).split()) for block in blocks)
    tasks = sum(block.tasks() for block in blocks if isinstance(block, model.FeatureBlock))
    return Effort(_rounded(words, 50), _rounded(sum(map(_lines, blocks)), 5), tasks)


def _rounded(number: float, unit: int) -> int:
    return unit * round(number / unit)


def _lines(block: model.Block) -> int:
    match block:
        case model.Script() | model.PlainCode() | model.CodeBlock() | model.Mjcf():
            return len(block.code.text.splitlines())
        case model.Recording():
            body = block.body
            return len(body.rows if isinstance(body, model.Table) else body.text.splitlines())
        case model.MathBlock():
            return 1
        case _:
            return 0


def check(course: model.Course, documents: Iterable[model.Document]) -> Iterator[Diagnostic]:
    """Where a lesson takes longer than the map says, or is done sooner."""
    if course.pace is None:
        return
    read = {document.source.path: document for document in documents}
    for lesson in course.lessons:
        if lesson.path in read:
            yield from _compare(lesson, _known(read[lesson.path]), course.pace)


def _known(document: model.Document) -> Efforts:
    kept = (document.summaries or {}).get("pace")
    return kept if isinstance(kept, Efforts) else efforts(document)


def _compare(lesson: model.Lesson, found: Efforts, pace: model.Pace) -> Iterator[Diagnostic]:
    for field, part, stated, effort in (
        ("minutes", f"the main path of lesson {lesson.id} takes", lesson.minutes, found.main),
        (
            "further",
            f"the further sections of lesson {lesson.id} take",
            lesson.further,
            found.further,
        ),
    ):
        counted = effort.minutes(pace)
        if abs(counted - (stated or 0)) <= max(_MINUTES, _SHARE * counted):
            continue
        says = "does not say so" if stated is None else f"says {stated}"
        message = f"{part} about {counted} minutes, and the map {says}"
        help = f"write `{field} = {counted}`"
        if field == "minutes" and counted > (stated or counted):
            help += ", or mark sections that only some need with `{.further}`"
        yield diagnose("lesson-minutes", lesson.span, message, help=help)


FEATURE = Feature(
    name="pace",
    summary=lambda document, mathml: Parsed(efforts(document)),
    check=check,
    rules=(
        Rule("lesson-minutes", "warning", "A lesson takes more or less time than its map says."),
    ),
)
