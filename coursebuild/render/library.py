"""What a page may have to look up: the course by id, its results, words and templates.

Entry point: `Library.of(course, results, assets)`. It is made once for a site and only read
afterwards.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from jinja2 import Environment
from markupsafe import Markup

from coursebuild.model import (
    CalloutKind,
    Course,
    Document,
    Lab,
    Lesson,
    Level,
    Link,
    ModelTarget,
    Page,
    Recording,
    Script,
    document_blocks,
    document_inlines,
)
from coursebuild.render.assets import Assets, strings_for, template_environment
from coursebuild.render.strings import Strings
from coursebuild.results import CompileResult, Formula, MathError, Results, ScriptRun, Verdict

Owner: TypeAlias = Lesson | Page
"""What a document belongs to."""


@dataclass(frozen=True, slots=True)
class ModelUse:
    """A document that uses a model, and how."""

    owner: Owner
    by_lab: bool
    by_script: bool
    by_link: bool


@dataclass(frozen=True, slots=True)
class Library:
    """A course and its results, by name."""

    course: Course
    results: Results
    words: Strings
    templates: Environment
    lessons: Mapping[str, Lesson]
    levels: Mapping[str, Level]
    pages: Mapping[str, Page]
    callouts: Mapping[str, CalloutKind]
    models: Mapping[str, CompileResult]
    scripts: Mapping[str, tuple[Script, Owner]]
    """By path, in the order of the course."""
    runs: Mapping[str, ScriptRun]
    _formulas: Mapping[Formula, str | MathError]
    _verdicts: Mapping[tuple[str, int], Verdict]

    @classmethod
    def of(cls, course: Course, results: Results, assets: Assets) -> Library:
        """Look everything over once."""
        return cls(
            course=course,
            results=results,
            words=strings_for(assets.templates, course.language),
            templates=template_environment(assets.templates),
            lessons={lesson.id: lesson for lesson in course.lessons},
            levels={level.id: level for level in course.levels},
            pages={page.id: page for page in course.pages},
            callouts={kind.name: kind for kind in course.callouts},
            models=dict(results.models),
            scripts=_scripts(course),
            runs={run.path: run for run in results.runs},
            _formulas=dict(results.formulas),
            _verdicts={_place(verdict.recording): verdict for verdict in results.verdicts},
        )

    def mathml(self, tex: str, display: bool) -> Markup:
        """A formula's MathML; one that does not parse is never rendered (`ValueError`)."""
        found = self._formulas[Formula(tex, display)]
        if isinstance(found, MathError):
            raise ValueError(f"formula {tex!r} does not parse: {found.message}")
        return Markup(found)

    def verdict(self, recording: Recording) -> Verdict | None:
        """How a recorded output compared with the run; `None` where nobody compared it."""
        return self._verdicts.get(_place(recording))

    def callout_label(self, kind: str) -> str:
        """The label of a kind of callout, translated where the kind is one of ours."""
        if self.words.has(f"callout.{kind}"):
            return self.words(f"callout.{kind}")
        return self.callouts[kind].label if kind in self.callouts else kind.capitalize()

    def model_uses(self, name: str) -> tuple[ModelUse, ...]:
        """Where a model is used, in the order of the course."""
        return tuple(use for owner in owners(self.course) if (use := _use(owner, name)) is not None)


def owners(course: Course) -> tuple[Owner, ...]:
    """Everything of the course that has, or may have, a document."""
    return (*course.lessons, *course.pages)


def document_scripts(document: Document) -> tuple[Script, ...]:
    """The complete scripts of a document."""
    return tuple(block for block in document_blocks(document) if isinstance(block, Script))


def uses_model(script: Script, name: str) -> bool:
    """Whether a script names a model, as an argument of `model_path` or as a file."""
    called = rf"""model_path\(\s*[rR]?(["']){re.escape(name)}\1"""
    return re.search(called, script.code.text) is not None or f"{name}.xml" in script.code.text


def _scripts(course: Course) -> dict[str, tuple[Script, Owner]]:
    found: dict[str, tuple[Script, Owner]] = {}
    for owner in owners(course):
        if owner.document is not None:
            for script in document_scripts(owner.document):
                found.setdefault(script.path, (script, owner))
    return found


def _place(recording: Recording) -> tuple[str, int]:
    return recording.span.path, recording.span.start


def _use(owner: Owner, name: str) -> ModelUse | None:
    if owner.document is None:
        return None
    blocks = tuple(document_blocks(owner.document))
    by_lab = any(isinstance(b, Lab) and b.model == name for b in blocks)
    by_script = any(isinstance(b, Script) and uses_model(b, name) for b in blocks)
    by_link = any(
        isinstance(i, Link) and i.target == ModelTarget(name)
        for i in document_inlines(owner.document)
    )
    return ModelUse(owner, by_lab, by_script, by_link) if by_lab or by_script or by_link else None
