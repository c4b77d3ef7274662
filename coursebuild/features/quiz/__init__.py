"""Quizzes across the course: questions name scripts and labs that there are."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    Excerpt,
    Feature,
    FenceKind,
    Mathml,
    Note,
    Outcome,
    PagePart,
    Parsed,
    Recording,
    ScriptRun,
    diagnose,
    did_you_mean,
    document_scripts,
    find_blocks,
    is_run,
    on_demand,
    parse_json,
)
from coursebuild.core.model import CodeBlock, Heading, Mode, ThematicBreak
from coursebuild.core.scripts.lines import LineMatcher, MappedText, apply_filters
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.relations import check_steps
from coursebuild.features.quiz.model import ChoiceQuestion, Quiz
from coursebuild.features.quiz.schema import QuizFile


def check_quizzes(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report output questions of some documents about scripts that nothing runs."""
    scripts = {s.path: s for document in course.documents for s in document_scripts(document)}
    for document in documents:
        for quiz in find_blocks(document, Quiz):
            for question in quiz.output_questions():
                script, place = question.script, question.script_span
                if script not in scripts:
                    message = f"no lesson has a script `{script}`"
                    help = did_you_mean(script, scripts)
                    yield diagnose("quiz-output", place, message, help=help)
                elif not is_run(course, scripts[script]):
                    message = f"`{script}` is not run, so it has no output"
                    yield diagnose("quiz-output", place, message)


def check_predictions(document: Document, mathml: Mathml) -> Parsed[Struct | None]:
    """Report predictions with nothing to hide below them, or no lab there to run."""
    diagnostics: list[Diagnostic] = []
    for quiz in find_blocks(document, Quiz):
        # The blocks after a quiz, up to the next heading or rule; none if it is inside a block
        at = next((at for at, block in enumerate(document.blocks) if block is quiz), None)
        rest = () if at is None else document.blocks[at + 1 :]
        ends = (i for i, block in enumerate(rest) if isinstance(block, Heading | ThematicBreak))
        end = next(ends, len(rest))
        blocks = rest[:end]
        stops = [Note("what can be hidden ends here", b.span.first_line()) for b in rest[end:][:1]]
        labs = [block for block in blocks if isinstance(block, Lab)]
        for question in quiz.questions:
            if not isinstance(question, ChoiceQuestion):
                continue
            if question.gate and blocks in ((), tuple(labs[:1])):
                message = "nothing follows that could be hidden"
                help = "what answers the question stands below the quiz, before the next heading"
                diagnostics.append(
                    diagnose("quiz-gate", question.gate_span, message, help=help, notes=stops)
                )
            run = question.run
            if run is not None and labs:
                node = parse_json(run, run.span()).value
                controls = {control.label: control for control in labs[0].fields.controls}
                diagnostics += () if node is None else check_steps(node, "run", controls)
            elif run is not None and not any(
                isinstance(block, CodeBlock) and block.language == "lab" for block in blocks
            ):
                message = "no lab follows that could be run"
                help = "the lab stands below the quiz, before the next heading"
                later = [block.span.first_line() for block in rest if isinstance(block, Lab)][:1]
                notes = [Note("the next lab is here", span) for span in later]
                diagnostics.append(
                    diagnose("quiz-gate", run.span(), message, help=help, notes=notes)
                )
    return Parsed(None, tuple(diagnostics))


def check_output_lines(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    """Report `output` questions about a line that the script, run to its end, did not print.

    Nor is a line an answer that its recording leaves out of the comparison.
    """
    good_runs = {run.path: run for run in runs if run.outcome is Outcome.OK}
    recordings: dict[str, list[Recording]] = {}
    for document in course.documents:
        for recording in find_blocks(document, Recording):
            recordings.setdefault(recording.script or "", []).append(recording)
    course_quizzes = (quiz for document in course.documents for quiz in find_blocks(document, Quiz))
    for question in (q for quiz in course_quizzes for q in quiz.output_questions()):
        if (run := good_runs.get(question.script)) is not None:
            lines = run.stdout.rstrip().split("\n")
            count = len(lines)
            if question.line <= count:
                line = lines[question.line - 1].rstrip()
                start = sum(len(before) + 1 for before in lines[: question.line - 1])
                part = bisect_right(run.part_starts, start)
                of_part = [r for r in recordings.get(question.script, ()) if r.part == part]
                if any(_is_left_out(course, r, line) for r in of_part):
                    message = f"output line {question.line} of `{question.script}` is not compared"
                    help = "ask for a line that its recorded output compares"
                    yield diagnose("quiz-output", question.line_span, message, help=help)
            else:
                message = f"`{question.script}` has no line {question.line}: it prints {count}"
                yield diagnose("quiz-output", question.line_span, message)


def _is_left_out(course: Course, recording: Recording, line: str) -> bool:
    comparison, body = course.comparison_of(recording), recording.body
    if comparison.mode is Mode.VOLATILE:
        return True
    if apply_filters(MappedText.copy(line), comparison.filters).text != line:
        return True
    if not comparison.ellipsis or not isinstance(body, Excerpt):
        return False
    matcher = LineMatcher(comparison)
    texts = [text.rstrip() for text in body.text.split("\n")]
    return not any(matcher.matches(text, line) for text in texts if not matcher.elides(text))


FEATURE = Feature(
    name="quiz",
    needs=("lab",),
    fences=(
        FenceKind(
            name="quiz",
            block=Quiz,
            parse=on_demand("coursebuild.features.quiz.parse:parse_fence"),
            draw=on_demand("coursebuild.features.quiz.page:draw_quiz"),
            markdown=on_demand("coursebuild.features.quiz.page:quiz_markdown"),
            index=on_demand("coursebuild.features.quiz.page:index_quiz"),
            wide=False,
            scopes=lambda quiz: tuple(question.span for question in quiz.questions),
        ),
    ),
    summary=check_predictions,
    check=check_quizzes,
    check_runs=check_output_lines,
    parts=(
        PagePart(mark="data-quiz=", bundled="quiz.js", late=True, texts=("quiz.live.",)),
        PagePart(mark="data-quizzes=", kinds=("review",), bundled="quiz.js"),
    ),
    schemas={"quiz": (QuizFile, "A quiz fence")},
)
