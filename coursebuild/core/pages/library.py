"""What a page may have to look up: the course by id, its results, words and templates.

Entry point: `Library.of(course, results, assets)`. It is made once for a site and only read
afterwards.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

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
    Owner,
    Page,
    Recording,
    Script,
    Target,
    Term,
    computed_once,
    document_blocks,
    document_inlines,
    document_scripts,
    resolve,
)
from coursebuild.core.model.results import (
    Formula,
    MathError,
    ModelFacts,
    OutputFile,
    Results,
    ScriptRun,
    Verdict,
)
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets, strings_for
from coursebuild.core.pages.quiz_index import quiz_index
from coursebuild.core.pages.renderer import Renderer, known_mathml
from coursebuild.core.pages.strings import Strings
from coursebuild.core.pages.templates import templates_of
from coursebuild.core.registry import feature_trials, page_kinds, publish_trials, summarize
from coursebuild.numerics.reports import Reports

_OURS = {kind.name: kind for kind in CALLOUTS}

BY_LAB, BY_SCRIPT, BY_LINK = WAYS = "model.by_lab", "model.by_script", "model.by_link"
"""How a document uses a model: keys of interface texts, in the order in which a page says them."""


class ModelUse(Struct, frozen=True):
    """A document that uses a model, and how."""

    owner: Owner
    ways: tuple[str, ...]
    """Of `WAYS`."""


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
    facts: Mapping[str, ModelFacts]
    """What the models hold that compile, by name."""
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
    asked: Mapping[str, str]
    """The questions of documents that ask any, by their path; see `quiz_index`."""
    tried: Mapping[tuple[str, int], Struct]
    """What features show of what was tried, by path and offset of the block."""
    feature_files: tuple[OutputFile, ...]
    """What of that is files of the site."""
    _formulas: Mapping[Formula, str | MathError]
    verdicts: Mapping[tuple[str, int], Verdict]
    """By path and offset of the recording."""
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
        for owner, document in course.owned_documents:
            text = quiz_index(document)  # while its blocks are at hand
            if text:
                questions[document.source.path] = text
            linked = links(course, document)
            for id in {target.id for target in linked if isinstance(target, LessonTarget)}:
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
            facts={name: result.facts for name, result in results.models if result.facts},
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
            verdicts={(v.recording.span.path, v.recording.span.start): v for v in results.verdicts},
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
        for owner, document in self.course.owned_documents:
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
        return self.verdicts.get((recording.span.path, recording.span.start))

    def callout(self, name: str) -> CalloutKind:
        """A kind of callout, in the course's own words where it has some."""
        ours, theirs = _OURS.get(name), self.callouts.get(name)
        label, promise = name.capitalize(), ""
        if ours is not None:
            key = f"promise.{name}"
            label = self.words(f"callout.{name}")
            promise = self.words(key) if self.words.has(key) else ours.promise
        if theirs is not None and (ours is None or theirs.label != ours.label):
            label = theirs.label
        if theirs is not None and (ours is None or theirs.promise != ours.promise):
            promise = theirs.promise
        return CalloutKind(name, label, promise)


def _placed(course: Course, trials: PublishedTrials) -> dict[tuple[str, int], Struct]:
    """What is shown of trials, by the places of their blocks: one that moved stays the same."""
    found = feature_trials(course) if trials.values else {}
    spans = {name: trial.block.span for name, (_, trial) in found.items() if name in trials.values}
    return {(span.path, span.start): trials.values[name] for name, span in spans.items()}


def links(course: Course, document: Document) -> Iterator[Target]:
    """Where the links of a document lead."""
    for inline in document_inlines(document):
        if isinstance(inline, Link):
            yield resolve(inline.target, course, document.source.path)


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


def _named_models(document: Document) -> dict[str, set[str]]:
    """What a document names that may be models, each with the ways in which it uses them."""

    def collect() -> dict[str, set[str]]:
        ways_by_name: dict[str, set[str]] = {}
        for way, name in _model_names(document):
            ways_by_name.setdefault(name, set()).add(way)
        return ways_by_name

    return computed_once(document, "models", collect)


def _model_names(document: Document) -> Iterator[tuple[str, str]]:
    for block in document_blocks(document):
        if isinstance(block, FeatureBlock):
            yield from ((BY_LAB, name) for name in block.models())
            yield from ((BY_LINK, name) for name in block.mentioned_models())
        elif isinstance(block, Script):
            yield from ((BY_SCRIPT, name) for name in models_named(block))
    for inline in document_inlines(document):
        if isinstance(inline, Link) and isinstance(inline.target, ModelTarget):
            yield BY_LINK, inline.target.name


def course_scripts(course: Course) -> dict[str, tuple[Script, Owner]]:
    """The scripts of a course by path, in order; of two with one path, the first."""
    found: dict[str, tuple[Script, Owner]] = {}
    for owner, document in course.owned_documents:
        for script in document_scripts(document):
            found.setdefault(script.path, (script, owner))
    return found


def _leads(course: Course) -> dict[str, tuple[Lesson, ...]]:
    found: dict[str, list[Lesson]] = {lesson.id: [] for lesson in course.lessons}
    for lesson in course.lessons:
        for need in lesson.prerequisites:
            found[need].append(lesson)
    return {id: tuple(lessons) for id, lessons in found.items()}


def _uses(course: Course) -> dict[str, tuple[ModelUse, ...]]:
    """Where each model is used."""
    found: dict[str, list[ModelUse]] = {model.name: [] for model in course.models}
    for owner, document in course.owned_documents if found else ():
        for name, ways in _named_models(document).items():
            if name in found:
                found[name].append(ModelUse(owner, tuple(way for way in WAYS if way in ways)))
    return {name: tuple(uses) for name, uses in found.items()}
