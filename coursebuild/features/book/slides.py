"""A lesson as slides: one HTML file that needs no other, with labs and quizzes that work.

A slide begins at each heading of the second or third level; below the latter's stands the title of
its section. What authors fold stays folded, and so does the code of scripts.

Files that labs and quizzes load are in the page, compressed; `site/js/slides.js` gives them
addresses. The security policy allows this one script and these files. Only a page with an engine
allows functions made of texts, as a worker has the policy of the page from which its code comes.
"""

from __future__ import annotations

import base64
import functools
import gzip
import hashlib
import json
import re
from collections.abc import Iterable, Iterator

from markupsafe import Markup

from coursebuild.api import ExportContext, OutputFile, document_scripts, regex, urls
from coursebuild.core.model.lesson_record import shown_versions
from coursebuild.core.pages.frame import citation
from coursebuild.core.pages.html_xml import HtmlContent, HtmlElement, to_html
from coursebuild.core.pages.materials import in_language
from coursebuild.core.pages.renderer import direction
from coursebuild.core.text.characters import visible
from coursebuild.features.book import chapters

_POLICY = (
    "default-src 'none'; script-src 'sha256-{}' data:{}; worker-src data:; "
    "connect-src data:; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "base-uri 'none'; form-action 'none'"
)
_OWN_ID = regex("_+slide-")
_WORDS = regex(r'<template id="_words"([^>]*)>(.*?)</template>', re.DOTALL)
_QUIZ_SCRIPT = regex(r'data-quiz-script="([^"]*)"')
_LAB_FILES = ("module", "mjb", "worker", "wasm")
"""The fields of a lab's JSON that hold addresses."""
_TYPES = {"js": "text/javascript", "json": "application/json", "wasm": "application/wasm"}
_END_SECTIONS = frozenset(("footnotes", "references"))
_UNWRAPPED = frozenset(("dock", "dock-before", "dock-lab", "dock-after", "further"))
"""Classes of elements that only group what may begin slides."""


def slides_file(context: ExportContext) -> tuple[OutputFile]:
    """Return the page."""
    lesson, course = context.lesson, context.course
    assert lesson is not None  # the exporter is one of a lesson
    language = course.language_of(lesson) or "en"
    library = in_language(context.library, language)
    words = library.words
    path = urls.lesson_path(lesson)
    place = urls.Place(path)
    files: dict[str, bytes] = {}
    text = chapters.lesson_text(context, path)
    for lab in (element for element in _elements(text) if "data-config" in element.attributes):
        _embed_lab(context, place, lab, files)

    def address(target: str, anchor: str) -> str:
        if target == path:
            return f"#{urls.quote_anchor(anchor or '_slide-1')}"
        return chapters.site_address(context, target, anchor)

    rules = chapters.RewriteRules(
        place,
        address,
        functools.cache(functools.partial(chapters.data_address, context)),
        lambda id: f"_{id}" if _OWN_ID.match(id) else id,
        live=True,
    )
    content = list(chapters.rewrite(text, rules))
    for element in _elements(content):
        if element.name == "figure" and "script" in element.classes:
            _fold_code(element, words("code.label"))
    template = _WORDS.search(context.site()[path].make().decode())
    attributes, page_words = template.groups() if template is not None else ("", "")
    quiz_script = ""
    if quiz := _QUIZ_SCRIPT.search(attributes):
        quiz_script = _embed(context, place, quiz[1], files)
    script = context.assets.file("js/slides.js").decode().replace("</", "<\\/")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    evaluation = " 'unsafe-eval'" if any(path.endswith(".wasm") for path in files) else ""
    runs = library.runs
    scripts = document_scripts(lesson.document) if lesson.document is not None else ()
    versions = shown_versions(runs[s.path].provenance for s in scripts if s.path in runs)
    html = library.render(
        "book/slides.html",
        language=language,
        direction=direction(language),
        policy=_POLICY.format(digest, evaluation),
        style=Markup(
            chapters.embed_fonts(context) + context.assets.file("css/slides.css").decode()
        ),
        head_title=f"{lesson.id} {lesson.title} · {course.title}",
        course=course,
        lesson=lesson,
        citation=citation(course, words, course.base_url, lesson.title),
        verified=words("site.verified", versions=words.join(versions)) if versions else "",
        slides=[(section, Markup(to_html(part))) for section, part in _split(content)],
        words=Markup(page_words),
        quiz_script=quiz_script,
        script=Markup(script),
        files=[
            (
                path,
                _TYPES.get(chapters.extension(path), ""),
                base64.b64encode(gzip.compress(data, 9, mtime=0)).decode(),
            )
            for path, data in files.items()
        ],
    )
    return (OutputFile("slides.html", visible(html).encode()),)


def _elements(content: Iterable[HtmlContent]) -> Iterator[HtmlElement]:
    for child in content:
        if isinstance(child, HtmlElement):
            yield child
            yield from _elements(child.children)


def _embed_lab(
    context: ExportContext, place: urls.Place, lab: HtmlElement, files: dict[str, bytes]
) -> None:
    """Put what a lab loads into `files`, and paths for addresses; without all of it, it is still.

    In a course of trusted HTML, anything may have these attributes.
    """
    config = _embed(context, place, lab.attributes.pop("data-config"), files)
    script = _embed(context, place, lab.attributes.pop("data-script", ""), files)
    try:
        fields = json.loads(files[config])
        addresses = {name: fields[name] for name in _LAB_FILES if fields.get(name)}
    except (KeyError, ValueError, AttributeError, TypeError):
        return
    config_place = urls.Place(config)
    paths = {name: _embed(context, config_place, str(addresses[name]), files) for name in addresses}
    if script and all(paths.values()):
        files[config] = json.dumps(fields | paths, ensure_ascii=False).encode()
        lab.attributes |= {"data-config": config, "data-script": script}


def _embed(context: ExportContext, place: urls.Place, address: str, files: dict[str, bytes]) -> str:
    """Put a file of the site into `files`; return its path, empty if there is none."""
    path, _ = place.target(address)
    if path is None:
        path = address if address in files else ""
    file = context.site().get(path)
    if file is None:
        return ""
    if path not in files:
        files[path] = file.make()
    return path


def _fold_code(figure: HtmlElement, label: str) -> None:
    code = [
        child for child in figure.elements if child.name == "pre" or child.classes & {"fold", "run"}
    ]
    if code:
        summary = HtmlElement("summary", {}, [label])
        at = next(i for i, child in enumerate(figure.children) if child is code[0])
        rest = [child for child in figure.children if not any(child is part for part in code)]
        for part in code:
            if part.name == "details":
                part.attributes["open"] = ""
        figure.children = rest
        figure.children.insert(at, HtmlElement("details", {"class": "fold"}, [summary, *code]))


def _split(content: Iterable[HtmlContent]) -> Iterator[tuple[str, list[HtmlContent]]]:
    """Yield the slides of a text, each with the title of its section where it has its own."""
    section, above, slide = "", "", list[HtmlContent]()
    for child in _unwrap(content):
        level = child.name if isinstance(child, HtmlElement) else ""
        ends = isinstance(child, HtmlElement) and child.classes & _END_SECTIONS
        if level in ("h1", "h2", "h3") or ends:
            if not _is_empty(slide):
                yield above, slide
            slide = []
            above = section if level == "h3" else ""
            if isinstance(child, HtmlElement) and level in ("h1", "h2"):
                section = child.text.strip()
        slide.append(child)
    if not _is_empty(slide):
        yield above, slide


def _unwrap(content: Iterable[HtmlContent]) -> Iterator[HtmlContent]:
    for child in content:
        if isinstance(child, HtmlElement) and child.classes & _UNWRAPPED:
            yield from _unwrap(child.children)
        else:
            yield child


def _is_empty(content: Iterable[HtmlContent]) -> bool:
    return all(isinstance(child, str) and not child.strip() for child in content)
