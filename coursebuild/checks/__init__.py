"""Checks of a whole course: values in, diagnostics out.

Entry point: `check_course(course)`, everything that can be known before anything runs;
`check_compiled` and `check_formulas` for what MuJoCo and the typesetter said.
"""

from __future__ import annotations

from coursebuild.checks.compiled import check_compiled as check_compiled
from coursebuild.checks.compiled import mjcf_texts as mjcf_texts
from coursebuild.checks.formulas import check_formulas as check_formulas
from coursebuild.checks.formulas import course_formulas as course_formulas
from coursebuild.checks.labs import check_labs
from coursebuild.checks.links import check_links
from coursebuild.checks.quizzes import check_quizzes
from coursebuild.diagnostics import Diagnostic
from coursebuild.model import Course


def check_course(course: Course) -> tuple[Diagnostic, ...]:
    """Links, mentions, quizzes and labs, checked against each other."""
    return (*check_links(course), *check_quizzes(course), *check_labs(course))
