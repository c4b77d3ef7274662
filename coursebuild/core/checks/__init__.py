"""Checks of a whole course: values in, diagnostics out.

Entry points: `course.check_course`, all checks that need no run, and `course.check_document`, the
same for one document; `compiled.check_compiled` and `formulas.check_formulas` for what MuJoCo and
the typesetter reported.
"""
