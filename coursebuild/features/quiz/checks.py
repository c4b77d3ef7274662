"""Quizzes across the course: ids are unique, `output` questions name a script of the course.

Entry points: `check_quizzes`; `check_output_lines`, once the scripts have run.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from coursebuild.core.model import Course, Document, Heading, document_blocks, document_scripts
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean
from coursebuild.features.quiz.model import Quiz


def check_quizzes(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Repeated ids, anchors that are taken, and output questions about scripts that nothing runs.

    What is wrong in `documents` is reported; ids are compared with those of the whole course.
    """
    first: dict[str, Quiz] = {}
    for document in course.documents:
        for quiz in quizzes(document):
            first.setdefault(quiz.id, quiz)  # one whose id cannot be read has none
    norun = {s.path: s.norun for document in course.documents for s in document_scripts(document)}
    for document in documents:
        for quiz in quizzes(document):
            if quiz.id and first[quiz.id] is not quiz:
                yield diagnose(
                    "quiz-id-repeated",
                    quiz.id_span,
                    f"the quiz id `{quiz.id}` is used twice",
                    help="a learner's progress hangs on the id; give each quiz its own",
                    notes=[Note("the first one is here", first[quiz.id].id_span)],
                )
            yield from _output_questions(quiz, norun)
        yield from _taken_anchors(document)


def quizzes(document: Document) -> Iterator[Quiz]:
    """The quizzes of a document."""
    return (block for block in document_blocks(document) if isinstance(block, Quiz))


def _taken_anchors(document: Document) -> Iterator[Diagnostic]:
    """Questions whose anchor a heading or another quiz of the document has."""
    found = [quiz for quiz in quizzes(document) if quiz.id]
    taken = {b.anchor: b.span for b in document_blocks(document) if isinstance(b, Heading)}
    taken |= {quiz.id: quiz.id_span for quiz in found}
    for quiz in found:
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
    for question in quiz.output_questions():
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


def check_output_lines(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    """`output` questions about a line that the script, run to its end, did not print."""
    printed = {run.path: run.stdout for run in runs if run.outcome is Outcome.OK}
    found = (quiz for document in course.documents for quiz in quizzes(document))
    for question in (question for quiz in found for question in quiz.output_questions()):
        if question.script in printed:
            count = len(printed[question.script].rstrip().split("\n"))
            if question.line > count:
                message = f"`{question.script}` has no line {question.line}: it prints {count}"
                yield diagnose("quiz-output", question.line_span, message)
