"""Labs against the course: the kind exists, the model exists, and what the lab names in it.

Entry points: `check_labs`; `check_model_names`, once models are compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model import Course, Document, FeatureBlock, document_blocks
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.features.lab.model import TRIED, Lab

_FOLDER = "content/labs/"


def lab_kinds(course: Course) -> frozenset[str]:
    """Those that there are, and each `content/labs/NAME.js` that the course brings."""
    names = (path.removeprefix(_FOLDER) for path in course.files if path.startswith(_FOLDER))
    own = (name.removesuffix(".js") for name in names if name.endswith(".js"))
    return frozenset((*TRIED, *(name for name in own if "/" not in name)))


def check_labs(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Unknown kinds and models of the labs in some documents."""
    kinds = lab_kinds(course)
    models = {model.name for model in course.models}
    for lab in labs_in(documents):
        if lab.kind not in kinds:
            message, help = f"no kind of lab is called `{lab.kind}`", did_you_mean(lab.kind, kinds)
            yield diagnose("lab-kind", lab.kind_span, message, help=help)
        for name in lab.models():
            if name not in models:
                message, help = f"no model `{name}` in models/", did_you_mean(name, models)
                yield diagnose("lab-model", lab.place(("model",)), message, help=help)


def labs_in(documents: Iterable[Document]) -> Iterator[Lab]:
    """The labs of some documents, those of quizzes included."""
    for document in documents:
        yield from (block for block in document_blocks(document) if isinstance(block, Lab))


def check_model_names(
    course: Course, facts_of: Callable[[FeatureBlock], ModelFacts | None]
) -> Iterator[Diagnostic]:
    """Keyframes and sites that the models of labs do not have."""
    for lab in labs_in(course.documents):
        facts = facts_of(lab)
        if facts is not None:
            yield from _check_names(lab, facts)


def _check_names(lab: Lab, facts: ModelFacts) -> Iterator[Diagnostic]:
    key = lab.fields.key
    if isinstance(key, int) and not 0 <= key < len(facts.keyframes):
        have = f"it has {len(facts.keyframes) or 'none'}"
        message = f"the model has no keyframe {key}: {have}, counted from 0"
        yield diagnose("lab-name", lab.place(("key",)), message)
    for field, what, name, names in (
        ("key", "keyframe", key, [name for name in facts.keyframes if name]),
        ("trail", "site", lab.fields.trail, facts.sites),
    ):
        if isinstance(name, str) and name not in names:
            message, help = f"the model has no {what} `{name}`", did_you_mean(name, names)
            yield diagnose("lab-name", lab.place((field,)), message, help=help)
