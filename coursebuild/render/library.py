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
from coursebuild.render.lab_files import PublishedLabs, lab_files
from coursebuild.render.strings import Strings
from coursebuild.results import CompileResult, Formula, MathError, Results, ScriptRun, Verdict
from coursebuild.vocabulary import CALLOUTS

_OURS = {kind.name: kind for kind in CALLOUTS}

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
    positions: Mapping[str, int]
    """Where a lesson stands in the order of the course, by id, from 0."""
    leads: Mapping[str, tuple[Lesson, ...]]
    """The lessons that need a lesson, by its id."""
    uses: Mapping[str, tuple[ModelUse, ...]]
    """Where a model is used, by its name, in the order of the course."""
    labs: PublishedLabs
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
            positions={lesson.id: at for at, lesson in enumerate(course.lessons)},
            leads=_leads(course),
            uses=_uses(course),
            labs=lab_files(results.labs, assets),
            _formulas=dict(results.formulas),
            _verdicts={_place(verdict.recording): verdict for verdict in results.verdicts},
        )

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template, without its last line end; it sees `t`, the interface's words."""
        text = self.templates.get_template(template).render(t=self.words, **values)
        return Markup(text.rstrip("\n"))

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
        """The label of a kind of callout: the course's own, else that of the interface."""
        ours, theirs = _OURS.get(kind), self.callouts.get(kind)
        if theirs is not None and (ours is None or theirs.label != ours.label):
            return theirs.label
        return self.words(f"callout.{kind}") if ours is not None else kind.capitalize()

    def callout_promise(self, kind: str) -> str:
        """What a kind of callout promises; empty where nobody says."""
        ours, theirs = _OURS.get(kind), self.callouts.get(kind)
        if theirs is not None and (ours is None or theirs.promise != ours.promise):
            return theirs.promise
        if self.words.has(f"promise.{kind}"):
            return self.words(f"promise.{kind}")
        return ours.promise if ours is not None else ""


def owners(course: Course) -> tuple[Owner, ...]:
    """Everything of the course that has, or may have, a document."""
    return (*course.lessons, *course.pages)


def document_scripts(document: Document) -> tuple[Script, ...]:
    """The complete scripts of a document."""
    return tuple(block for block in document_blocks(document) if isinstance(block, Script))


_MODEL_NAMED = re.compile(
    r"""model_path\(\s*[rR]?(["'])(?P<name>.+?)\1|(?P<file>[\w./-]+)\.xml\b"""
)


def models_named(script: Script) -> frozenset[str]:
    """What may be models in a script: what it asks `model_path` for, and files that it names."""
    found: set[str] = set()
    for match in _MODEL_NAMED.finditer(script.code.text):
        name = (match["name"] or match["file"]).removesuffix(".xml")
        found.add(name.removeprefix("models/"))
    return frozenset(found)


def _scripts(course: Course) -> dict[str, tuple[Script, Owner]]:
    found: dict[str, tuple[Script, Owner]] = {}
    for owner in owners(course):
        if owner.document is not None:
            for script in document_scripts(owner.document):
                found.setdefault(script.path, (script, owner))
    return found


def _place(recording: Recording) -> tuple[str, int]:
    return recording.span.path, recording.span.start


def _leads(course: Course) -> dict[str, tuple[Lesson, ...]]:
    found: dict[str, list[Lesson]] = {lesson.id: [] for lesson in course.lessons}
    for lesson in course.lessons:
        for need in lesson.prerequisites:
            found[need].append(lesson)
    return {id: tuple(lessons) for id, lessons in found.items()}


def _uses(course: Course) -> dict[str, tuple[ModelUse, ...]]:
    found: dict[str, list[ModelUse]] = {model.name: [] for model in course.models}
    for owner in owners(course):
        if owner.document is None:
            continue
        blocks = tuple(document_blocks(owner.document))
        labs = {block.model for block in blocks if isinstance(block, Lab)}
        scripts = {n for block in blocks if isinstance(block, Script) for n in models_named(block)}
        targets = (i.target for i in document_inlines(owner.document) if isinstance(i, Link))
        links = {target.name for target in targets if isinstance(target, ModelTarget)}
        for name, uses in found.items():
            if name in labs or name in scripts or name in links:
                uses.append(ModelUse(owner, name in labs, name in scripts, name in links))
    return {name: tuple(uses) for name, uses in found.items()}
