"""What the page of a document looks up in the course and in its results.

Entry point: `document_inputs(library, place, document)`.
"""

from __future__ import annotations

from typing import assert_never
from urllib.parse import urlsplit

from coursebuild.core import model
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.equations import equations_of
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import DocumentInputs, ShownRun, ShownVerdict
from coursebuild.core.registry import kind_of_block


def document_inputs(
    library: Library, place: urls.Place, document: model.Document
) -> DocumentInputs:
    """All that the document's page shows besides what stands in the document.

    The summary of a document does as well as the document.
    """
    path = document.source.path
    blocks = tuple(model.document_blocks(document))
    ours = [block for block in blocks if isinstance(block, model.FeatureBlock)]
    recordings = [block for block in blocks if isinstance(block, model.Recording)]
    models = dict.fromkeys(name for block in ours for name in block.models())
    linked = (one.target for one in model.document_inlines(document) if isinstance(one, model.Link))
    targets = dict.fromkeys((*linked, *map(model.ModelTarget, models)))
    names = {target: equation_name(library, path, target) for target in targets}
    verdicts = ((block.span.start, library.verdict(block)) for block in recordings)
    trials = ((b.span.start, library.tried.get((b.span.path, b.span.start))) for b in ours)
    values = ((block, kind_of_block(block).values) for block in ours)
    return DocumentInputs(
        engine=library.results.engine,
        python=library.results.python,
        hrefs={target: address(library, place, path, target) for target in targets},
        equations={target: name for target, name in names.items() if name},
        callouts={b.kind: library.callout(b.kind) for b in blocks if isinstance(b, model.Callout)},
        runs={
            path: _shown_run(library.runs[path], lines)
            for path, lines in _quoted_lines(blocks).items()
            if path in library.runs
        },
        verdicts={start: ShownVerdict(v.status, v.comparison) for start, v in verdicts if v},
        trials={start: tried for start, tried in trials if tried is not None},
        blocks={b.span.start: make(library, place, b) for b, make in values if make is not None},
        keyframes={n: library.facts[n].keyframes for n in models if n in library.facts},
        address=urls.absolute(library.course, place.path),
    )


def _quoted_lines(blocks: tuple[model.Block, ...]) -> dict[str, set[int]]:
    """The paths of scripts that a document has or names, each with the lines that it quotes."""
    found: dict[str, set[int]] = {}
    for block in blocks:
        if isinstance(block, model.Script):
            found.setdefault(block.path, set())
        elif isinstance(block, model.Recording) and block.script is not None:
            found.setdefault(block.script, set())
        elif isinstance(block, model.FeatureBlock):
            for script, line in block.quoted_lines():
                found.setdefault(script, set()).add(line)
    return found


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
