"""The library: a course, its results, words and templates, arranged for pages to look up.

Entry point: `Library`, made once for a site and only read afterwards.
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

_DEFAULT_CALLOUTS = {kind.name: kind for kind in CALLOUTS}

BY_LAB, BY_SCRIPT, BY_LINK = WAYS = "model.by_lab", "model.by_script", "model.by_link"
"""How a document uses a model: keys of interface texts, in the order of pages."""


class ModelUse(Struct, frozen=True):
    """A document that uses a model, and how."""

    owner: Owner
    ways: tuple[str, ...]
    """Some of `WAYS`."""


class Library(Struct, frozen=True, dict=True):
    """A course and its results, arranged by name when something is first looked up."""

    course: Course
    results: Results
    assets: Assets
    reports: Reports = Reports()
    """The reports on models and hard cases that fit the course."""
    published_trials: PublishedTrials | None = None
    """The published results of trials, if they are known already."""

    # --- interface

    @cached_property
    def words(self) -> Strings:
        """The words of the interface."""
        return strings_for(self.assets.templates, self.course.language)

    @cached_property
    def templates(self) -> Environment:
        """The templates, with the course's own."""
        assets, theme = self.assets, self.course.theme
        return templates_of(assets.templates, assets.compiled_templates, theme.template_texts)

    # --- the course

    @cached_property
    def order(self) -> tuple[Lesson, ...]:
        """All lessons in the order of the course."""
        return self.course.lessons

    @cached_property
    def positions(self) -> Mapping[str, int]:
        """The position of a lesson in the course, by id, from 0."""
        return {lesson.id: position for position, lesson in enumerate(self.order)}

    @cached_property
    def lessons(self) -> Mapping[str, Lesson]:
        """The lessons by id."""
        return {lesson.id: lesson for lesson in self.order}

    @cached_property
    def levels(self) -> Mapping[str, Level]:
        """The levels by id."""
        return {level.id: level for level in self.course.levels}

    @cached_property
    def pages(self) -> Mapping[str, Page]:
        """The pages of the map by id."""
        return {page.id: page for page in self.course.pages}

    @cached_property
    def callouts(self) -> Mapping[str, CalloutKind]:
        """The kinds of callouts by name."""
        return {kind.name: kind for kind in self.course.callouts}

    @cached_property
    def scripts(self) -> Mapping[str, tuple[Script, Owner]]:
        """The scripts by path, in the order of the course; of two with the same path, the first."""
        scripts: dict[str, tuple[Script, Owner]] = {}
        for owner, document in self.course.owned_documents:
            for script in document_scripts(document):
                scripts.setdefault(script.path, (script, owner))
        return scripts

    @cached_property
    def terms(self) -> Mapping[str, Owner]:
        """The lesson or page that defines a term, by its id."""
        terms: dict[str, Owner] = {}
        for owner, document in self.course.owned_documents:
            for inline in document_inlines(document):
                if isinstance(inline, Term):
                    terms.setdefault(inline.id, owner)
        return terms

    @cached_property
    def quiz_index(self) -> Mapping[str, str]:
        """The questions of documents that have any, by path; see `quiz_index`."""
        indexes = ((d.source.path, quiz_index(d)) for d in self.course.documents)
        return {path: index for path, index in indexes if index}

    @cached_property
    def leads(self) -> Mapping[str, tuple[Lesson, ...]]:
        """The lessons that build on a lesson, by its id."""
        leads: dict[str, tuple[Lesson, ...]] = dict.fromkeys(self.lessons, ())
        for lesson in self.order:
            for need in lesson.prerequisites:
                leads[need] = (*leads[need], lesson)
        return leads

    @cached_property
    def referrers(self) -> Mapping[str, tuple[Owner, ...]]:
        """The lessons and pages that link to a lesson, by its id, in the order of the course."""
        referrers: dict[str, tuple[Owner, ...]] = {}
        for owner, document in self.course.owned_documents:
            targets = links(self.course, document)
            for id in {target.id for target in targets if isinstance(target, LessonTarget)}:
                if not (isinstance(owner, Lesson) and owner.id == id):
                    referrers[id] = (*referrers.get(id, ()), owner)
        return referrers

    @cached_property
    def uses(self) -> Mapping[str, tuple[ModelUse, ...]]:
        """The documents that use a model, by its name, in the order of the course."""
        uses: dict[str, tuple[ModelUse, ...]] = {model.name: () for model in self.course.models}
        for owner, document in self.course.owned_documents if uses else ():
            for name, ways in _named_models(document).items():
                if name in uses:
                    use = ModelUse(owner, tuple(way for way in WAYS if way in ways))
                    uses[name] = (*uses[name], use)
        return uses

    # --- results

    @cached_property
    def facts(self) -> Mapping[str, ModelFacts]:
        """Facts about the models that compile, by name."""
        return {name: result.facts for name, result in self.results.models if result.facts}

    @cached_property
    def runs(self) -> Mapping[str, ScriptRun]:
        """The runs of scripts, by path."""
        return {run.path: run for run in self.results.runs}

    @cached_property
    def formulas(self) -> Mapping[Formula, str | MathError]:
        """The formulas that were typeset with the results."""
        return dict(self.results.formulas)

    @cached_property
    def _verdicts(self) -> Mapping[tuple[str, int], Verdict]:
        """By path and offset of the recording."""
        verdicts = self.results.verdicts
        return {(v.recording.span.path, v.recording.span.start): v for v in verdicts}

    @cached_property
    def _trials(self) -> PublishedTrials:
        return self.published_trials or publish_trials(self.results, self.assets)

    @property
    def trial_files(self) -> tuple[OutputFile, ...]:
        """The files that features publish of trials."""
        return self._trials.files

    @cached_property
    def trial_values(self) -> Mapping[tuple[str, int], Struct]:
        """The values that features publish of trials, by path and offset of the block."""
        values = self._trials.values
        trials = feature_trials(self.course) if values else {}
        spans = {name: trial.block.span for name, (_, trial) in trials.items() if name in values}
        return {(span.path, span.start): values[name] for name, span in spans.items()}

    # --- pages

    @cached_property
    def added_pages(self) -> tuple[PageKind, ...]:
        """The pages that features add to this course, in their order."""
        return tuple(kind for kind in page_kinds() if kind.exists(self))

    @property
    def menu(self) -> tuple[Page, ...]:
        """The pages in the menu of every page, besides the home page."""
        return tuple(page for page in self.course.pages if page.menu and not page.is_home)

    @property
    def gallery(self) -> str:
        """The site path of the page of all models; empty without models, or with one `index`."""
        names = {model.name for model in self.course.models}
        return urls.MODELS if names and "index" not in names else ""

    def mathml(self, tex: str, display: bool) -> str:
        """A formula as MathML; empty for one with an error."""
        return known_mathml(self.formulas)(tex, display)

    def summaries(self, feature: str) -> Iterator[tuple[Owner, Any]]:
        """A feature's summaries of documents (`Feature.summary`), in the order of the course."""
        for owner, document in self.course.owned_documents:
            values = document.summaries
            if values is None:
                values = summarize(document, self.mathml).value
            if feature in values:
                yield owner, values[feature]

    @property
    def renderer(self) -> Renderer:
        """The renderer of pages."""
        return Renderer(self.words, self.templates, self.formulas)

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template; see `Renderer`."""
        return self.renderer.render(template, **values)

    def verdict(self, recording: Recording) -> Verdict | None:
        """The verdict on a recorded output; `None` if it was not compared."""
        return self._verdicts.get((recording.span.path, recording.span.start))

    def callout(self, name: str) -> CalloutKind:
        """A kind of callout, with the course's own label and promise if it has any."""
        default, custom = _DEFAULT_CALLOUTS.get(name), self.callouts.get(name)
        label, promise = name.capitalize(), ""
        if default is not None:
            key = f"promise.{name}"
            label = self.words(f"callout.{name}")
            promise = self.words(key) if self.words.has(key) else default.promise
        if custom is not None and (default is None or custom.label != default.label):
            label = custom.label
        if custom is not None and (default is None or custom.promise != default.promise):
            promise = custom.promise
        return CalloutKind(name, label, promise)


def links(course: Course, document: Document) -> Iterator[Target]:
    """The targets of the links in a document."""
    for inline in document_inlines(document):
        if isinstance(inline, Link):
            yield resolve(inline.target, course, document.source.path)


_MODEL_NAMED = re.compile(
    r"""model_path\(\s*[rR]?(["'])(?P<name>.+?)\1|(?<![\w./-])(?P<file>[\w./-]+)\.xml\b"""
    r"""|(["'])(?P<word>[A-Za-z_][\w/-]{0,80})\4"""
)


def models_named(script: Script) -> frozenset[str]:
    """The names in a script that may be models.

    They are arguments of `model_path`, names of files, and single words in quotes, which a function
    of the script may pass on to `model_path`.
    """
    names: set[str] = set()
    for match in _MODEL_NAMED.finditer(script.code.text):
        name = (match["name"] or match["file"] or match["word"]).removesuffix(".xml")
        names.add(name.removeprefix("models/"))
    return frozenset(names)


def _named_models(document: Document) -> dict[str, set[str]]:
    """The names in a document that may be models, with the ways in which it uses them."""

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
