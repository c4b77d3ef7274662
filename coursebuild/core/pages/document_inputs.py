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
from coursebuild.core.registry import code_links, kind_of_block


def document_inputs(
    library: Library, place: urls.Place, document: model.Document
) -> DocumentInputs:
    """Everything that the document's page shows besides the document itself.

    The summary of the document is enough.
    """
    path = document.source.path
    blocks = tuple(model.document_blocks(document))
    feature_blocks = [block for block in blocks if isinstance(block, model.FeatureBlock)]
    recordings = [block for block in blocks if isinstance(block, model.Recording)]
    models = dict.fromkeys(name for block in feature_blocks for name in block.models())
    link_targets = (link.target for link in model.find_inlines(document, model.Link))
    targets = dict.fromkeys((*link_targets, *map(model.ModelTarget, models)))
    bindings = model.find_inlines(document, model.NumberBinding)
    named_scripts: dict[str, set[int]] = {b.script: set() for b in bindings if b.script}
    names = {target: equation_name(library, path, target) for target in targets}
    verdicts = ((block.span.start, library.verdict(block)) for block in recordings)
    trials = ((block.span.start, library.trial_value(block)) for block in feature_blocks)
    values = ((block, kind_of_block(block).values) for block in feature_blocks)
    return DocumentInputs(
        engine=library.results.engine,
        python=library.results.python,
        hrefs={target: address(library, place, path, target) for target in targets},
        equations={target: name for target, name in names.items() if name},
        callouts={b.kind: library.callout(b.kind) for b in blocks if isinstance(b, model.Callout)},
        runs={
            path: _shown_run(library.runs[path], lines)
            for path, lines in (named_scripts | _quoted_lines(blocks)).items()
            if path in library.runs
        },
        verdicts={start: ShownVerdict(v.status, v.comparison) for start, v in verdicts if v},
        trials={start: value for start, value in trials if value is not None},
        blocks={b.span.start: make(library, place, b) for b, make in values if make is not None},
        code_links=code_links(library, place, document),
        keyframes={n: library.facts[n].keyframes for n in models if n in library.facts},
        address=urls.absolute(library.course.base_url, place.path),
    )


def _quoted_lines(blocks: tuple[model.Block, ...]) -> dict[str, set[int]]:
    """The paths of the scripts in a document or named there, with the lines it quotes of each."""
    lines_by_script: dict[str, set[int]] = {}
    for block in blocks:
        if isinstance(block, model.Script):
            lines_by_script.setdefault(block.path, set())
        elif isinstance(block, model.Recording) and block.script is not None:
            lines_by_script.setdefault(block.script, set())
        elif isinstance(block, model.FeatureBlock):
            for script, line in block.quoted_lines():
                lines_by_script.setdefault(script, set()).add(line)
    return lines_by_script


def _shown_run(run: ScriptRun, numbers: set[int]) -> ShownRun:
    if run.outcome is not Outcome.OK or not numbers:
        return ShownRun(run.outcome, run.missing, recorded=run.recorded)
    lines = run.stdout.split("\n")
    quoted_lines = (
        (n, visible(lines[n - 1].rstrip()) if 1 <= n <= len(lines) else None)
        for n in sorted(numbers)
    )
    return ShownRun(run.outcome, run.missing, tuple(quoted_lines), run.recorded)


def address(library: Library, place: urls.Place, path: str, target: model.Target) -> str:
    """The address of a link's target, relative to a place; `path` is that of the document."""
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
            owner = library.terms.get(target.id)
            # In a preview the definition may just have been removed.
            path = place.path if owner is None else urls.owner_path(owner)
            return place.href(path, f"term:{target.id}")
        case model.UrlTarget():
            return file_address(place, path, target.url)
        case _:
            assert_never(target)


def equation_name(library: Library, path: str, target: model.Target) -> str:
    """The name of a numbered formula on another page; empty for other targets."""
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
    """An address as written; that of a file of the course becomes its place in the site."""
    parts = urlsplit(url)
    if parts.scheme or parts.netloc or not parts.path:
        return url
    site_path = urls.file_path(model.local_file(url, path))
    return place.href(site_path) + url[len(url.split("#", 1)[0].split("?", 1)[0]) :]
