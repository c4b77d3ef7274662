"""Quizzes: questions that a learner answers in the page, and whose answers the build checks."""

from coursebuild.core.features import Feature, FenceKind, PagePart
from coursebuild.features.quiz.checks import check_output_lines, check_predictions, check_quizzes
from coursebuild.features.quiz.model import Quiz
from coursebuild.features.quiz.page import index_quiz, quiz, quiz_markdown
from coursebuild.features.quiz.parse import parse_fence
from coursebuild.features.quiz.schema import QuizFile

FEATURE = Feature(
    name="quiz",
    needs=("lab",),
    fences=(
        FenceKind(
            name="quiz",
            block=Quiz,
            parse=parse_fence,
            draw=quiz,
            markdown=quiz_markdown,
            index=index_quiz,
            wide=False,
            scopes=lambda quiz: tuple(question.span for question in quiz.questions),
            tasks=lambda quiz: len(quiz.keys),
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
