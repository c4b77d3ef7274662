"""Quizzes across the course: ids are unique, `output` questions name a script of the course.

Entry points: `quiz_findings`, for some blocks; `check_output_lines`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from coursebuild.diagnostics import Diagnostic, Note, diagnose, did_you_mean
from coursebuild.model import (
    Block,
    Course,
    Heading,
    OutputQuestion,
    Quiz,
    document_blocks,
    document_has,
)
from coursebuild.results import Outcome, ScriptRun
from coursebuild.source import Span


def quiz_findings(
    blocks: Iterable[Block], scripts: Mapping[str, bool], seen: dict[str, Span] | None = None
) -> tuple[Diagnostic, ...]:
    """Repeated ids, and output questions about scripts that nothing runs.

    `scripts` are those of the course by path, and whether they are not run. `seen` are ids of
    other blocks, and where they stand; those of these blocks are added.
    """
    seen = {} if seen is None else seen
    found: list[Diagnostic] = []
    blocks = tuple(blocks)
    quizzes = tuple(block for block in blocks if isinstance(block, Quiz) and block.id)
    for quiz in quizzes:
        first = seen.setdefault(quiz.id, quiz.id_span)
        if first is not quiz.id_span:
            note = Note("the first one is here", first)
            found.append(
                diagnose(
                    "quiz-id-repeated",
                    quiz.id_span,
                    f"the quiz id `{quiz.id}` is used twice",
                    help="a learner's progress hangs on the id; give each quiz its own",
                    notes=[note],
                )
            )
    found += _taken_anchors(blocks, quizzes)
    for quiz in (block for block in blocks if isinstance(block, Quiz)):
        found += _output_questions(quiz, scripts)
    return tuple(found)


def _taken_anchors(blocks: tuple[Block, ...], quizzes: tuple[Quiz, ...]) -> Iterator[Diagnostic]:
    """Questions whose anchor a heading or another quiz has."""
    taken = {block.anchor: block.span for block in blocks if isinstance(block, Heading)}
    taken |= {quiz.id: quiz.id_span for quiz in quizzes}
    for quiz in quizzes:
        for key in quiz.keys:
            first = taken.get(quiz.anchor(key))
            if first is not None:
                yield diagnose(
                    "anchor-repeated",
                    first,
                    f"the id `{quiz.anchor(key)}` is already used",
                    help="it is the address of a question; choose another one here",
                    notes=[Note("in this quiz", quiz.id_span)],
                )


def _output_questions(quiz: Quiz, scripts: Mapping[str, bool]) -> Iterator[Diagnostic]:
    for question in quiz.questions:
        if not isinstance(question, OutputQuestion):
            continue
        norun = scripts.get(question.script)
        if norun is None:
            yield diagnose(
                "quiz-output",
                question.script_span,
                f"no lesson has a script `{question.script}`",
                help=did_you_mean(question.script, scripts),
            )
        elif norun:
            yield diagnose(
                "quiz-output",
                question.script_span,
                f"`{question.script}` is marked `norun`, so it has no output",
            )


def check_output_lines(course: Course, runs: Iterable[ScriptRun]) -> tuple[Diagnostic, ...]:
    """`output` questions about a line that the script, run to its end, did not print."""
    printed = {run.path: run.stdout for run in runs if run.outcome is Outcome.OK}
    found: list[Diagnostic] = []
    for document in course.documents:
        if not document_has(document, OutputQuestion):
            continue
        for quiz in document_blocks(document):
            if not isinstance(quiz, Quiz):
                continue
            for question in quiz.questions:
                if not isinstance(question, OutputQuestion) or question.script not in printed:
                    continue
                count = len(printed[question.script].rstrip().split("\n"))
                if question.line > count:
                    message = f"`{question.script}` has no line {question.line}: it prints {count}"
                    found.append(diagnose("quiz-output", question.line_span, message))
    return tuple(found)
