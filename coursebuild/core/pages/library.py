"""What a page may have to look up: the course by id, its results, words and templates.

Entry point: `Library.of(course, results, assets)`. It is made once for a site and only read
afterwards.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, TypeAlias

from jinja2 import Environment
from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.features import PageKind, PublishedTrials
from coursebuild.core.model import (
    CalloutKind,
    Course,
    Document,
    FeatureBlock,
    Lesson,
    LessonTarget,
    Level,
    Link,
    ModelTarget,
    Page,
    Recording,
    Script,
    Target,
    Term,
    document_blocks,
    document_inlines,
    document_scripts,
    resolve,
)
from coursebuild.core.model.results import (
    CompileResult,
    Formula,
    MathError,
    OutputFile,
    Results,
    ScriptRun,
    Verdict,
)
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets, strings_for
from coursebuild.core.pages.quiz_index import QuizIndex, quiz_index
from coursebuild.core.pages.renderer import Renderer, known_mathml
from coursebuild.core.pages.strings import Strings
from coursebuild.core.pages.templates import templates_of
from coursebuild.core.registry import feature_trials, page_kinds, publish_trials, summarize
from coursebuild.numerics.reports import Reports

_OURS = {kind.name: kind for kind in CALLOUTS}

Owner: TypeAlias = Lesson | Page
"""What a document belongs to."""


class ModelUse(Struct, frozen=True):
    """A document that uses a model, and how."""

    owner: Owner
    by_lab: bool
    by_script: bool
    by_link: bool


class Library(Struct, frozen=True, dict=True):
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
    order: tuple[Lesson, ...]
    """All lessons in the order of the course."""
    positions: Mapping[str, int]
    """Where a lesson stands in the order of the course, by id, from 0."""
    leads: Mapping[str, tuple[Lesson, ...]]
    """The lessons that need a lesson, by its id."""
    uses: Mapping[str, tuple[ModelUse, ...]]
    """Where a model is used, by its name, in the order of the course."""
    referrers: Mapping[str, tuple[Owner, ...]]
    """Who links to a lesson, by its id, in the order of the course."""
    terms: Mapping[str, Owner]
    """Where a term is defined, by its id."""
    asked: QuizIndex
    """The questions of each document, as lists of lessons name them."""
    tried: Mapping[tuple[str, int], Struct]
    """What features show of what was tried, by path and offset of the block."""
    feature_files: tuple[OutputFile, ...]
    """What of that is files of the site."""
    _formulas: Mapping[Formula, str | MathError]
    verdicts: Mapping[tuple[str, int], Verdict]
    """By `recording_place`."""
    reports: Reports
    """What was measured on models and hard cases, as far as it fits the course."""

    @classmethod
    def of(
        cls,
        course: Course,
        results: Results,
        assets: Assets,
        reports: Reports | None = None,
        *,
        trials: PublishedTrials | None = None,
    ) -> Library:
        """Look everything over once.

        `trials` is what a site needs of what was tried, where it is known.
        """
        questions: dict[str, str] = {}
        terms: dict[str, Owner] = {}
        referrers: dict[str, list[Owner]] = {}
        for owner, document in documents(course):
            text = quiz_index(document)  # while its blocks are at hand
            if text:
                questions[document.source.path] = text
            for id in _linked_lessons(course, document):
                if not (isinstance(owner, Lesson) and owner.id == id):
                    referrers.setdefault(id, []).append(owner)
            for inline in document_inlines(document):
                if isinstance(inline, Term):
                    terms.setdefault(inline.id, owner)
        if trials is None:
            trials = publish_trials(results, assets)
        return cls(
            course=course,
            results=results,
            words=strings_for(assets.templates, course.language),
            templates=templates_of(assets.templates, assets.compiled, course.theme.template_texts),
            lessons={lesson.id: lesson for lesson in course.lessons},
            levels={level.id: level for level in course.levels},
            pages={page.id: page for page in course.pages},
            callouts={kind.name: kind for kind in course.callouts},
            models=dict(results.models),
            scripts=course_scripts(course),
            runs={run.path: run for run in results.runs},
            order=course.lessons,
            positions={lesson.id: at for at, lesson in enumerate(course.lessons)},
            leads=_leads(course),
            uses=_uses(course),
            referrers={id: tuple(found) for id, found in referrers.items()},
            terms=terms,
            asked=questions,
            tried=_placed(course, trials),
            feature_files=trials.files,
            _formulas=dict(results.formulas),
            verdicts={recording_place(verdict.recording): verdict for verdict in results.verdicts},
            reports=reports or Reports(),
        )

    @cached_property
    def added_pages(self) -> tuple[PageKind, ...]:
        """The pages that features add to this course, in their order."""
        return tuple(kind for kind in page_kinds() if kind.exists(self))

    @property
    def menu(self) -> tuple[Page, ...]:
        """The pages in the menu of every page, beside the home page."""
        return tuple(page for page in self.course.pages if page.menu and not page.is_home)

    @property
    def gallery(self) -> str:
        """The site path of the page of all models; empty where there are none, or one `index`."""
        names = {model.name for model in self.course.models}
        return urls.MODELS if names and "index" not in names else ""

    def mathml(self, tex: str, display: bool) -> str:
        """A formula; empty for one that cannot be set."""
        return known_mathml(self._formulas)(tex, display)

    def summaries(self, feature: str) -> Iterator[tuple[Owner, Any]]:
        """What a feature has of documents (`Feature.summary`), in the order of the course."""
        for owner, document in documents(self.course):
            known = document.summaries
            if known is None:
                known = summarize(document, self.mathml).value
            if feature in known:
                yield owner, known[feature]

    @property
    def renderer(self) -> Renderer:
        """What pages are drawn with."""
        return Renderer(self.words, self.templates, self._formulas)

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template; see `Renderer`."""
        return self.renderer.render(template, **values)

    def verdict(self, recording: Recording) -> Verdict | None:
        """How a recorded output compared with the run; `None` where nobody compared it."""
        return self.verdicts.get(recording_place(recording))

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


def _placed(course: Course, trials: PublishedTrials) -> dict[tuple[str, int], Struct]:
    """What is shown of trials, by the places of their blocks: one that moved stays the same."""
    found = feature_trials(course) if trials.shown else {}
    spans = {name: trial.block.span for name, (_, trial) in found.items() if name in trials.shown}
    return {(span.path, span.start): trials.shown[name] for name, span in spans.items()}


def owners(course: Course) -> tuple[Owner, ...]:
    """Everything of the course that has, or may have, a document."""
    return (*course.lessons, *course.pages)


def documents(course: Course) -> Iterator[tuple[Owner, Document]]:
    """The documents that there are, in the order of the course."""
    for owner in owners(course):
        if owner.document is not None:
            yield owner, owner.document


def links(course: Course, document: Document) -> Iterator[Target]:
    """Where the links of a document lead."""
    for inline in document_inlines(document):
        if isinstance(inline, Link):
            yield resolve(inline.target, course, document.source.path)


def _linked_lessons(course: Course, document: Document) -> set[str]:
    return {one.id for one in links(course, document) if isinstance(one, LessonTarget)}


_MODEL_NAMED = re.compile(
    r"""model_path\(\s*[rR]?(["'])(?P<name>.+?)\1|(?<![\w./-])(?P<file>[\w./-]+)\.xml\b"""
    r"""|(["'])(?P<word>[A-Za-z_][\w/-]{0,80})\4"""
)


def models_named(script: Script) -> frozenset[str]:
    """What may be models in a script.

    What it asks `model_path` for, files that it names, and words that stand in quotes by
    themselves, which a function of its own may hand on to `model_path`.
    """
    found: set[str] = set()
    for match in _MODEL_NAMED.finditer(script.code.text):
        name = (match["name"] or match["file"] or match["word"]).removesuffix(".xml")
        found.add(name.removeprefix("models/"))
    return frozenset(found)


class NamedModels(Struct, frozen=True):
    """What a document names that may be models."""

    by_labs: frozenset[str]
    by_scripts: frozenset[str]
    by_links: frozenset[str]


def _named_models(document: Document) -> NamedModels:
    """The models that a document may use."""
    known: NamedModels | None = document.__dict__.get("models")
    if known is not None:  # asked for with each edit of another
        return known
    blocks = tuple(document_blocks(document))
    ours = [block for block in blocks if isinstance(block, FeatureBlock)]
    labs = {name for block in ours for name in block.models()}
    scripts = {n for block in blocks if isinstance(block, Script) for n in models_named(block)}
    targets = (i.target for i in document_inlines(document) if isinstance(i, Link))
    links = {target.name for target in targets if isinstance(target, ModelTarget)}
    shown = {name for block in ours for name in block.mentioned_models()}
    found = NamedModels(frozenset(labs), frozenset(scripts), frozenset(links | shown))
    document.__dict__["models"] = found
    return found


def course_scripts(course: Course) -> dict[str, tuple[Script, Owner]]:
    """The scripts of a course by path, in order; of two with one path, the first."""
    found: dict[str, tuple[Script, Owner]] = {}
    for owner, document in documents(course):
        for script in document_scripts(document):
            found.setdefault(script.path, (script, owner))
    return found


def recording_place(recording: Recording) -> tuple[str, int]:
    """What a recorded output is found by."""
    return recording.span.path, recording.span.start


def _leads(course: Course) -> dict[str, tuple[Lesson, ...]]:
    found: dict[str, list[Lesson]] = {lesson.id: [] for lesson in course.lessons}
    for lesson in course.lessons:
        for need in lesson.prerequisites:
            found[need].append(lesson)
    return {id: tuple(lessons) for id, lessons in found.items()}


def _uses(course: Course) -> dict[str, tuple[ModelUse, ...]]:
    """Where each model is used."""
    found: dict[str, list[ModelUse]] = {model.name: [] for model in course.models}
    for owner, document in documents(course) if found else ():
        named = _named_models(document)
        for name in sorted(named.by_labs | named.by_scripts | named.by_links):
            if name in found:
                how = (name in named.by_labs, name in named.by_scripts, name in named.by_links)
                found[name].append(ModelUse(owner, *how))
    return {name: tuple(uses) for name, uses in found.items()}
