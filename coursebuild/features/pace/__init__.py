"""Checks how long lessons take, by the pace that the course map states.

The effort of a document, on its main path and in further sections, is counted when it is read. An
estimate that differs from the map's by more than a quarter and five minutes is a warning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.features import Feature
from coursebuild.core.registry import kind_of_block
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.rules import Rule

_SHARE, _MINUTES = 0.25, 5
"""The accuracy of an estimate: it can differ by this share, and by so many minutes."""


class Effort(Struct, frozen=True):
    """What a reader has to read and to do."""

    words: int
    """Rounded to fifty, so that a small edit changes nothing."""
    lines: int
    """Lines of code and output, rounded to five; a formula is a line."""
    tasks: int

    def minutes(self, pace: model.Pace) -> int:
        """Estimate how long it takes, rounded to five minutes."""
        exact = self.words / pace.words + self.lines / pace.lines + self.tasks * pace.task
        return _round_to(exact, 5)


class Efforts(Struct, frozen=True):
    """The efforts of a document: on its main path, and in further sections."""

    main: Effort
    further: Effort


def count_efforts(document: model.Document) -> Efforts:
    """Count the effort of a document; without footnotes, which few read."""
    parts: dict[bool, list[model.Block]] = {False: [], True: []}
    for further, blocks in model.main_and_further(document.blocks):
        parts[further] += model.walk_blocks(blocks)
    return Efforts(_count_effort(parts[False]), _count_effort(parts[True]))


def _count_effort(blocks: list[model.Block]) -> Effort:
    words = sum(len(model.plain_text(model.block_inlines(block)).split()) for block in blocks)
    feature_blocks = [block for block in blocks if isinstance(block, model.FeatureBlock)]
    tasks = sum(kind_of_block(block).tasks(block) for block in feature_blocks)
    lines = 0
    for block in blocks:
        match block:
            case model.Script() | model.PlainCode() | model.CodeBlock() | model.Mjcf():
                lines += len(block.code.text.splitlines())
            case model.Recording(body=body):
                lines += len(body.rows if isinstance(body, model.Table) else body.text.splitlines())
            case model.MathBlock():
                lines += 1
            case _:
                pass
    return Effort(_round_to(words, 50), _round_to(lines, 5), tasks)


def _round_to(number: float, unit: int) -> int:
    return unit * round(number / unit)


def check(course: model.Course, documents: Iterable[model.Document]) -> Iterator[Diagnostic]:
    """Yield a warning for each lesson that takes more or less time than the map says."""
    if course.pace is None:
        return
    by_path = {document.source.path: document for document in documents}
    for lesson in course.lessons:
        if lesson.path in by_path:
            document = by_path[lesson.path]
            summary = (document.summaries or {}).get("pace")
            efforts = summary if isinstance(summary, Efforts) else count_efforts(document)
            main = f"the main path of lesson {lesson.id} takes"
            further = f"the further sections of lesson {lesson.id} take"
            for field, part, map_minutes, effort in (
                ("minutes", main, lesson.minutes, efforts.main),
                ("further", further, lesson.further, efforts.further),
            ):
                estimate = effort.minutes(course.pace)
                if abs(estimate - (map_minutes or 0)) <= max(_MINUTES, _SHARE * estimate):
                    continue
                map_says = "does not say so" if map_minutes is None else f"says {map_minutes}"
                message = f"{part} about {estimate} minutes, and the map {map_says}"
                help = f"write `{field} = {estimate}`"
                if field == "minutes" and estimate > (map_minutes or estimate):
                    help += ", or mark sections that only some need with `{.further}`"
                yield diagnose("lesson-minutes", lesson.span, message, help=help)


FEATURE = Feature(
    name="pace",
    summary=lambda document, mathml: Parsed(count_efforts(document)),
    check=check,
    rules=(
        Rule(
            "lesson-minutes",
            "warning",
            "A lesson takes more or less time than the map says.",
            "the estimate is rough, and the map may be right",
        ),
    ),
)
