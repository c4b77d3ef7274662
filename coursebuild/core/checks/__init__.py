"""Checks of a whole course: values in, diagnostics out.

Entry points: `course.check_course`, everything that can be known before anything runs, and
`course.check_document`, the same for one document; `compiled.check_compiled` and
`formulas.formula_findings` for what MuJoCo and the typesetter said.
"""
