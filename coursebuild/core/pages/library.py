"""A course, its results, words and templates, arranged for pages to look up."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any, TypeVar
from urllib.parse import quote

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.results import (
    ModelFacts,
    OutputFile,
    Reports,
    Results,
    ScriptRun,
    Verdict,
)
from coursebuild.core.model.script_download import ScriptDownload
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.renderer import Renderer, Strings, known_mathml
from coursebuild.core.text.regex import regex

Value = TypeVar("Value")

BY_LAB, BY_SCRIPT, BY_LINK = WAYS = "model.by_lab", "model.by_script", "model.by_link"
"""How a document uses a model: keys of interface texts, in the order of pages."""


class ModelUse(Struct, frozen=True):
    """A document that uses a model, and how."""

    owner: model.Owner
    ways: tuple[str, ...]
    """Some of `WAYS`."""


class Library(Struct, frozen=True, dict=True):
    """A course and its results, arranged by name; each arrangement is made when it is needed."""

    course: model.Course
    results: Results
    assets: Assets
    renderer: Renderer
    reports: Reports = Reports()
    trial_values: Mapping[tuple[str, int], Struct] = {}
    """What pages show of the trials of blocks, by the path and offset of the block."""
    trial_files: tuple[OutputFile, ...] = ()

    # --- the course

    @cached_property
    def order(self) -> tuple[model.Lesson, ...]:
        """All lessons in the order of the course."""
        return self.course.lessons

    @cached_property
    def positions(self) -> Mapping[str, int]:
        """The position of a lesson in the course, by id, from 0."""
        return {lesson.id: position for position, lesson in enumerate(self.order)}

    @cached_property
    def lessons(self) -> Mapping[str, model.Lesson]:
        """By id, in the order of the course; likewise levels and pages."""
        return {lesson.id: lesson for lesson in self.order}

    @cached_property
    def levels(self) -> Mapping[str, model.Level]:
        return {level.id: level for level in self.course.levels}

    @cached_property
    def pages(self) -> Mapping[str, model.Page]:
        return {page.id: page for page in self.course.pages}

    @property
    def menu(self) -> tuple[model.Page, ...]:
        """The pages in the menu of every page, besides the home page."""
        return tuple(page for page in self.course.pages if page.menu and not page.is_home)

    @property
    def gallery(self) -> str:
        """The site path of the page of all models; empty without models, or with one `index`."""
        names = {mjcf.name for mjcf in self.course.models}
        return urls.MODELS if names and "index" not in names else ""

    @cached_property
    def leads(self) -> Mapping[str, tuple[model.Lesson, ...]]:
        """The lessons that build on a lesson, by its id."""
        return _group((need, lesson) for lesson in self.order for need in lesson.prerequisites)

    @cached_property
    def scripts(self) -> Mapping[str, tuple[model.Script, model.Owner]]:
        """By path, in the order of the course; of two with the same path, the first."""
        scripts: dict[str, tuple[model.Script, model.Owner]] = {}
        for owner, document in self.course.owned_documents:
            for script in model.document_scripts(document):
                scripts.setdefault(script.path, (script, owner))
        return scripts

    @cached_property
    def terms(self) -> Mapping[str, model.Owner]:
        """The lesson or page that defines a term, by its id."""
        terms: dict[str, model.Owner] = {}
        for owner, document in self.course.owned_documents:
            for term in model.find_inlines(document, model.Term):
                terms.setdefault(term.id, owner)
        return terms

    @cached_property
    def referrers(self) -> Mapping[str, tuple[model.Owner, ...]]:
        """The lessons and pages that link to a lesson, by its id, in the order of the course."""
        return _group(
            (id, owner)
            for owner, document in self.course.owned_documents
            for id in {
                t.id for t in links(self.course, document) if isinstance(t, model.LessonTarget)
            }
            if self.lessons.get(id) is not owner
        )

    @cached_property
    def uses(self) -> Mapping[str, tuple[ModelUse, ...]]:
        """The documents that use a model, by its name, in the order of the course."""
        names = {mjcf.name for mjcf in self.course.models}
        return _group(
            (name, ModelUse(owner, tuple(way for way in WAYS if way in ways)))
            for owner, document in (self.course.owned_documents if names else ())
            for name, ways in named_models(document).items()
            if name in names
        )

    @cached_property
    def quiz_index(self) -> Mapping[str, str]:
        """The questions of documents that have any, by path, for the scripts of other pages.

        `ID:KEY,KEY ID:KEY`: each quiz with the keys of its questions; ids are percent-encoded.
        """
        index: dict[str, str] = {}
        for document in self.course.documents:
            keys_of_blocks = (
                b.progress_keys() for b in model.find_blocks(document, model.FeatureBlock)
            )
            entries = (
                f"{quote(progress[0], safe='')}:{','.join(progress[1])}"
                for progress in keys_of_blocks
                if progress is not None
            )
            if text := " ".join(entries):
                index[document.source.path] = text
        return index

    def summaries(self, feature: str) -> Iterator[tuple[model.Owner, Any]]:
        """A feature's summaries of documents (`Feature.summary`), in the order of the course."""
        for owner, document in self.course.owned_documents:
            summaries = document.summaries or {}
            if feature in summaries:
                yield owner, summaries[feature]

    # --- its results

    @cached_property
    def facts(self) -> Mapping[str, ModelFacts]:
        """Facts about the models that compile, by name."""
        return {name: result.facts for name, result in self.results.models if result.facts}

    @cached_property
    def runs(self) -> Mapping[str, ScriptRun]:
        """By path of the script."""
        return {run.path: run for run in self.results.runs}

    @cached_property
    def downloads(self) -> Mapping[str, ScriptDownload]:
        """What is handed over of scripts, by their path."""
        return {download.script: download for download in self.results.downloads}

    @cached_property
    def _verdicts(self) -> Mapping[tuple[str, int], Verdict]:
        return {_place(verdict.recording): verdict for verdict in self.results.verdicts}

    def verdict(self, recording: model.Recording) -> Verdict | None:
        """The verdict on a recorded output; `None` if it was not compared."""
        return self._verdicts.get(_place(recording))

    def trial_value(self, block: model.FeatureBlock) -> Struct | None:
        """The value that a feature publishes of the trial of a block."""
        return self.trial_values.get(_place(block))

    # --- its words and looks

    @property
    def words(self) -> Strings:
        return self.renderer.words

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template; see `Renderer`."""
        return self.renderer.render(template, **values)

    def mathml(self, tex: str, display: bool) -> str:
        """A formula as MathML; empty for one with an error."""
        return known_mathml(self.renderer.formulas)(tex, display)

    def callout(self, name: str) -> model.CalloutKind:
        """A kind of callout, with the course's own label and promise if it has any."""
        kind = next(
            (kind for kind in self.course.callouts if kind.name == name), model.CalloutKind(name)
        )
        default_label, default_promise = (
            self.words(key) if self.words.has(key) else ""
            for key in (f"callout.{name}", f"promise.{name}")
        )
        label = kind.label or default_label or name.capitalize()
        return model.CalloutKind(name, label, kind.promise or default_promise)


def _place(block: model.Recording | model.FeatureBlock) -> tuple[str, int]:
    return block.span.path, block.span.start


def _group(pairs: Iterable[tuple[str, Value]]) -> Mapping[str, tuple[Value, ...]]:
    """The values of each key; none for a key without any."""
    groups = defaultdict[str, tuple[Value, ...]](tuple)
    for key, value in pairs:
        groups[key] += (value,)
    return groups


def links(course: model.Course, document: model.Document) -> Iterator[model.Target]:
    """The targets of the links in a document."""
    for link in model.find_inlines(document, model.Link):
        yield model.resolve(link.target, course, document.source.path)


_MODEL_PATH = regex(r"""model_path\(\s*[rR]?(["'])(.+?)\1""")
_QUOTED_WORD = regex(r"""(["'])([A-Za-z_][\w/-]{0,80})\1""")
_REVERSED_FILE = regex(r"lmx(?<!\wlmx)\.([\w./-]+)")
"""A file's name from its end on: so each is read once."""


def models_named(script: model.Script) -> frozenset[str]:
    """The names in a script that may be models: of files, and single words in quotes.

    A function of the script may pass such a word on to `model_path`.
    """
    text = script.code.text
    names = [name for pattern in (_MODEL_PATH, _QUOTED_WORD) for _, name in pattern.findall(text)]
    names += [name[::-1] for name in _REVERSED_FILE.findall(text[::-1])]
    return frozenset(name.removesuffix(".xml").removeprefix("models/") for name in names)


def named_models(document: model.Document) -> Mapping[str, tuple[str, ...]]:
    """The names in a document that may be models, with the ways in which it uses them."""

    def uses() -> Iterator[tuple[str, str]]:
        for block in model.document_blocks(document):
            if isinstance(block, model.FeatureBlock):
                yield from ((name, BY_LAB) for name in block.models())
                yield from ((name, BY_LINK) for name in block.mentioned_models())
        for script in model.document_scripts(document):
            yield from ((name, BY_SCRIPT) for name in models_named(script))
        for link in model.find_inlines(document, model.Link):
            if isinstance(link.target, model.ModelTarget):
                yield link.target.name, BY_LINK

    return model.computed_once(document, "models", lambda: _group(uses()))
