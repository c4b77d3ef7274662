"""What the page of a document looks up in the course and in its results.

Entry point: `document_inputs(library, place, document)`.
"""

from __future__ import annotations

from typing import assert_never
from urllib.parse import urlsplit

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.equations import equations_of
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import (
    ShownCallout,
    ShownDocument,
    ShownRun,
    ShownVerdict,
)
from coursebuild.core.registry import kind_of_block


def document_inputs(library: Library, place: urls.Place, document: model.Document) -> ShownDocument:
    """All that the document's page shows besides what stands in the document.

    The summary of a document does as well as the document.
    """
    page = _Page(library, place, document)
    for block in model.document_blocks(document):
        page.note(block)
    return ShownDocument(
        engine=library.results.engine,
        python=library.results.python,
        hrefs=page.hrefs,
        equations=page.equations,
        callouts=page.callouts,
        runs=page.runs(),
        verdicts=page.verdicts,
        trials=page.trials,
        blocks=page.blocks,
        keyframes=page.keyframes,
        address=urls.absolute(library.course, place.path),
    )


class _Page:
    """Collects what a document asks for."""

    def __init__(self, library: Library, place: urls.Place, document: model.Document) -> None:
        self.library = library
        self.place = place
        self.path = document.source.path
        self.hrefs: dict[model.Target, str] = {}
        self.equations: dict[model.Target, str] = {}
        self.callouts: dict[str, ShownCallout] = {}
        self.verdicts: dict[int, ShownVerdict] = {}
        self.trials: dict[int, Struct] = {}
        self.blocks: dict[int, Struct] = {}
        self.keyframes: dict[str, tuple[str, ...]] = {}
        self.scripts: dict[str, set[int]] = {}
        """Paths of scripts, and the numbers of the lines that are quoted."""

    def note(self, block: model.Block) -> None:
        """Note what a block asks for."""
        match block:
            case model.Script():
                self.scripts.setdefault(block.path, set())
            case model.Recording():
                self._recording(block)
            case model.FeatureBlock():
                self._feature(block)
            case model.Callout():
                library, kind = self.library, block.kind
                words = ShownCallout(library.callout_label(kind), library.callout_promise(kind))
                self.callouts[kind] = words
            case _:
                pass
        for inline in model.walk_inlines(model.block_inlines(block)):
            if isinstance(inline, model.Link):
                self._link(inline.target)

    def _recording(self, block: model.Recording) -> None:
        if block.script is not None:
            self.scripts.setdefault(block.script, set())
        verdict = self.library.verdict(block)
        if verdict is not None:
            self.verdicts[block.span.start] = ShownVerdict(verdict.status, verdict.comparison)

    def _feature(self, block: model.FeatureBlock) -> None:
        values = kind_of_block(block).values
        if values is not None:
            self.blocks[block.span.start] = values(self.library, self.place, block)
        for script, line in block.quoted_lines():
            self.scripts.setdefault(script, set()).add(line)
        tried = self.library.tried.get((block.span.path, block.span.start))
        if tried is not None:
            self.trials[block.span.start] = tried
        for name in block.models():
            self._link(model.ModelTarget(name))
            compiled = self.library.models.get(name)
            if compiled is not None and compiled.facts is not None:
                self.keyframes[name] = compiled.facts.keyframes

    def _link(self, target: model.Target) -> None:
        if target not in self.hrefs:
            self.hrefs[target] = address(self.library, self.place, self.path, target)
            name = equation_name(self.library, self.path, target)
            if name:
                self.equations[target] = name

    def runs(self) -> dict[str, ShownRun]:
        """What is shown of the scripts that ran."""
        runs = self.library.runs
        return {
            path: _shown_run(runs[path], lines)
            for path, lines in self.scripts.items()
            if path in runs
        }


def _shown_run(run: ScriptRun, numbers: set[int]) -> ShownRun:
    if run.outcome is not Outcome.OK or not numbers:
        return ShownRun(run.outcome, run.missing, recorded=run.recorded)
    lines = run.stdout.split("\n")
    asked = (
        (n, visible(lines[n - 1].rstrip()) if 1 <= n <= len(lines) else None)
        for n in sorted(numbers)
    )
    return ShownRun(run.outcome, run.missing, tuple(asked), run.recorded)


def address(library: Library, place: urls.Place, path: str, target: model.Target) -> str:
    """The address of a link's target, from a place, in the document with a path."""
    target = model.resolve(target, library.course, path)
    match target:
        case model.LessonTarget():
            return place.href(urls.lesson_path(library.lessons[target.id]), target.anchor)
        case model.LevelTarget():
            return place.href(urls.level_path(library.levels[target.id]))
        case model.ModelTarget():
            return place.href(urls.model_page_path(target.name), target.anchor)
        case model.PageTarget():
            return place.href(urls.page_path(library.pages[target.id]), target.anchor)
        case model.ExampleTarget():
            return place.href(target.path)
        case model.TermTarget():
            found = library.terms.get(target.id)
            # In a preview the text that defined it may have changed just now.
            path = place.path if found is None else urls.owner_path(found)
            return place.href(path, f"term:{target.id}")
        case model.UrlTarget():
            return file_address(place, path, target.url)
        case _:
            assert_never(target)


def equation_name(library: Library, path: str, target: model.Target) -> str:
    """How another page calls a formula with a number; empty where a target is none."""
    target = model.resolve(target, library.course, path)
    if not isinstance(target, model.LessonTarget | model.PageTarget) or not target.anchor:
        return ""
    if not target.anchor.startswith("eq:"):
        return ""
    lesson = isinstance(target, model.LessonTarget)
    owner = library.lessons[target.id] if lesson else library.pages[target.id]
    if owner.document is None:
        return ""
    equations = equations_of(owner.document, library.mathml)
    number = next((e.number for e in equations if e.id == target.anchor), "")
    if not number:
        return ""
    if owner.document.source.path == path:
        return f"({number})"
    if lesson:
        return library.words("equation.of_lesson", number=number, id=owner.id)
    return library.words("equation.of_page", number=number, title=owner.title)


def file_address(place: urls.Place, path: str, url: str) -> str:
    """An address as written, but a file of the course becomes its place in the site."""
    parts = urlsplit(url)
    if parts.scheme or parts.netloc or not parts.path:
        return url
    site_path = urls.file_path(model.local_file(url, path))
    return place.href(site_path) + url[len(url.split("#", 1)[0].split("?", 1)[0]) :]
