"""Labs against the course: the kind exists, the model exists.

Entry point: `lab_findings`, for some blocks. Names inside a model (keyframes, sites) are checked
where the compiled model is known (`checks.compiled`).
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterable

from coursebuild.core.model import Block, Course, Lab
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean


def lab_kinds(course: Course) -> frozenset[str]:
    """`simlab`, and each `content/labs/NAME.js` that the course brings."""
    own = (posixpath.split(path) for path in course.files)
    return frozenset(
        {
            "simlab",
            *(
                name[:-3]
                for folder, name in own
                if folder == "content/labs" and name.endswith(".js")
            ),
        }
    )


def lab_findings(blocks: Iterable[Block], course: Course) -> tuple[Diagnostic, ...]:
    """Unknown kinds and models of the labs among some blocks."""
    labs = [block for block in blocks if isinstance(block, Lab)]
    if not labs:
        return ()
    kinds = lab_kinds(course)
    models = {model.name for model in course.models}
    found: list[Diagnostic] = []
    for lab in labs:
        if lab.kind not in kinds:
            found.append(
                diagnose(
                    "lab-kind",
                    lab.kind_span,
                    f"no kind of lab is called `{lab.kind}`",
                    help=did_you_mean(lab.kind, kinds),
                )
            )
        if lab.model is not None and lab.model not in models and lab.model_span is not None:
            found.append(
                diagnose(
                    "lab-model",
                    lab.model_span,
                    f"no model `{lab.model}` in models/",
                    help=did_you_mean(lab.model, models),
                )
            )
    return tuple(found)
