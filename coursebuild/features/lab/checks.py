"""Checks labs against the course: their kind, their model and the names in it must exist.

Entry points: `check_labs`; `check_model_names`, once models are compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model import Course, Document, FeatureBlock, find_blocks
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.features.lab.model import BUILT_IN_KINDS, Lab

_FOLDER = "content/labs/"


def lab_kinds(course: Course) -> frozenset[str]:
    """The built-in kinds, and one for each `content/labs/NAME.js` of the course."""
    files = (path.removeprefix(_FOLDER) for path in course.files if path.startswith(_FOLDER))
    kinds = (file.removesuffix(".js") for file in files if file.endswith(".js"))
    return frozenset((*BUILT_IN_KINDS, *(kind for kind in kinds if "/" not in kind)))


def check_labs(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report unknown kinds and models of the labs in some documents."""
    kinds = lab_kinds(course)
    models = {model.name for model in course.models}
    for lab in (lab for document in documents for lab in find_blocks(document, Lab)):
        if lab.kind not in kinds:
            message, help = (
                f"`{lab.kind}` is not a known kind of lab",
                did_you_mean(lab.kind, kinds),
            )
            yield diagnose("lab-kind", lab.kind_span, message, help=help)
        for name in lab.models():
            if name not in models:
                message, help = f"no model `{name}` in models/", did_you_mean(name, models)
                yield diagnose("lab-model", lab.place(("model",)), message, help=help)


def check_model_names(
    course: Course, facts_of: Callable[[FeatureBlock], ModelFacts | None]
) -> Iterator[Diagnostic]:
    """Report keyframes and sites that the models of labs do not have."""
    for lab in (lab for document in course.documents for lab in find_blocks(document, Lab)):
        facts = facts_of(lab)
        if facts is not None:
            yield from _check_names(lab, facts)


def _check_names(lab: Lab, facts: ModelFacts) -> Iterator[Diagnostic]:
    key = lab.fields.key
    if isinstance(key, int) and not 0 <= key < len(facts.keyframes):
        count = f"it has {len(facts.keyframes) or 'none'}"
        message = f"the model has no keyframe {key}: {count}, counted from 0"
        yield diagnose("lab-name", lab.place(("key",)), message)
    for field, element, name, names in (
        ("key", "keyframe", key, [name for name in facts.keyframes if name]),
        ("trail", "site", lab.fields.trail, facts.sites),
    ):
        if isinstance(name, str) and name not in names:
            message, help = f"the model has no {element} `{name}`", did_you_mean(name, names)
            yield diagnose("lab-name", lab.place((field,)), message, help=help)
