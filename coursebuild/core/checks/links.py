"""Check that every link, mention and image of the sources leads somewhere."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterator, Mapping
from typing import assert_never
from urllib.parse import SplitResult, unquote, urlsplit

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.near import nearest
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

_HTML_ANCHOR = regex(
    r"""<a\s[^>]*?\bhref\s*=\s*(\\?["'])?(#(?(1)(?:(?!\1).)+|[^"'\s>]+))""", re.IGNORECASE
)


class LinkTargets(Struct, frozen=True):
    """Everything that a link may lead to."""

    lessons: Mapping[str, model.Document | None]
    levels: frozenset[str]
    pages: Mapping[str, model.Document | None]
    models: Mapping[str, model.MjcfModel]
    scenarios: Mapping[str, tuple[str, ...]]
    scripts: frozenset[str]
    files: frozenset[str]
    terms: Mapping[str, Span]
    progress_ids: Mapping[str, Span]
    """Under which what readers did is kept."""
    planned: frozenset[str]
    """The lessons that have no text yet."""


def link_targets(course: model.Course) -> LinkTargets:
    """What the course offers as targets."""
    terms: dict[str, Span] = {}
    progress_ids: dict[str, Span] = {}
    for document in course.documents:
        for term in model.find_inlines(document, model.Term):
            terms.setdefault(term.id, term.span)
        for block in model.find_blocks(document, model.FeatureBlock):
            if (entry := block.given_id()) is not None:
                progress_ids.setdefault(*entry)
    return LinkTargets(
        {lesson.id: lesson.document for lesson in course.lessons},
        frozenset(level.id for level in course.levels),
        {page.id: page.document for page in course.pages},
        {mjcf.name: mjcf for mjcf in course.models},
        {d.model: tuple(scenario.name for scenario in d.scenarios) for d in course.declarations},
        frozenset(s.path for d in course.documents for s in model.document_scripts(d)),
        frozenset(course.files),
        terms,
        progress_ids,
        frozenset(lesson.id for lesson in course.lessons if lesson.status == "planned"),
    )


def is_whole(course: model.Course) -> bool:
    """Whether all its texts could be read: else nobody knows what is nowhere in it."""
    has_lessons = all(o.document is not None for o in course.lessons if o.status != "planned")
    return has_lessons and all(page.document is not None for page in course.pages)


def anchors(document: model.Document) -> Mapping[str, Span]:
    """The ids that a link may name in a document, but for lines of scripts, and their spans."""
    triples = model.document_anchors(document)
    return model.computed_once(document, "anchors", lambda: {id: span for id, _, span in triples})


def check_links(
    course: model.Course, document: model.Document, targets: LinkTargets
) -> Iterator[Diagnostic]:
    """Report each link, mention or image of a document that leads nowhere."""
    checker = _Checker(course, document, targets)
    recorded_spans = {figure.span for figure in recorded_figures(document)}
    for block, inlines in model.inlines_by_block(document):
        if isinstance(block, model.HtmlBlock):
            yield from checker.check_html(block)
        for inline in inlines:
            if isinstance(inline, model.Link):
                target = model.resolve(inline.target, course, document.source.path)
                diagnostics = [*checker.check_target(inline.target_span, target)]
                yield from diagnostics or checker.check_number(inline, target)
                yield from checker.check_name(inline)
            elif isinstance(inline, model.Image) and inline.url_span not in recorded_spans:
                yield from checker.check_media("the image ", inline.url, inline.url_span)
            elif isinstance(inline, model.RawInline):
                yield from checker.check_html(inline)


class _Checker(Struct, frozen=True):
    """Checks links of one document."""

    course: model.Course
    document: model.Document
    targets: LinkTargets

    def check_html(self, html: model.HtmlBlock | model.RawInline) -> Iterator[Diagnostic]:
        if self.course.html == "none" and not (
            model.is_comment(html) or html.html.startswith("</")
        ):
            message, help = "the course allows no raw HTML", "write it in Markdown"
            yield diagnose("html-forbidden", html.span, message, help=help)
        elif self.course.html == "safe":
            help = 'if you trust everyone who writes the course, set `html = "trusted"` in its map'
            for part in html.forbidden:
                yield diagnose("html-forbidden", part.span, part.message, help=help)
        span = html.span
        for link in _HTML_ANCHOR.finditer(span.text):
            place = Span(span.source, span.start + link.start(2), span.start + link.end(2))
            yield from self.check_url(place, link[2])
        for media in html.media:
            parts = urlsplit_or_none(media.url)
            if parts is None or (parts.scheme != "data" and (parts.netloc or parts.path)):
                yield from self.check_media("", media.url, media.span)

    def check_target(self, span: Span, target: model.Target) -> Iterator[Diagnostic]:
        if isinstance(target, model.UrlTarget):
            yield from self.check_url(span, target.url)
            return
        targets = self.targets
        names: Collection[str]
        match target:
            case model.LessonTarget(id=name):
                missing = f"lesson {name} is not in the course map"
                rule, names = "link-lesson", targets.lessons
            case model.LevelTarget():
                return  # only a mention: without such a level it means another thing
            case model.PageTarget(id=name):
                missing = f"no page `{name}` in the course map"
                rule, names = "link-page", targets.pages
            case model.ModelTarget(name=name):
                rule, names, missing = "link-model", targets.models, f"no model `{name}` in models/"
            case model.ExampleTarget(path=name):
                missing = f"no lesson has a script `{name}`"
                rule, names = "link-example", targets.scripts
            case model.TermTarget(id=name):
                missing = f"no lesson defines the term `{name}`"
                rule, names = "link-term", targets.terms
            case _:
                assert_never(target)
        if name not in names:
            if rule in ("link-example", "link-term") and not is_whole(self.course):
                return  # a text that could not be read may have it
            if isinstance(target, model.LessonTarget) and name in targets.levels:
                help = f"{name} is a level: write `Level {name}`, which becomes a link"
            else:
                help = did_you_mean(name, names)
            yield diagnose(rule, span, missing, help=help)
        elif isinstance(target, model.ModelTarget) and target.anchor:
            # The ids that `templates/model.html` writes. Only scenarios that `models/NAME.toml`
            # declares have one, as others are unknown before they are measured.
            source, scenarios = targets.models[name].source, targets.scenarios.get(name, ())
            ids = {*model.model_anchors(scenarios), model.listing_anchor(source.path)}
            listings = {source.path: source.text.rstrip()}
            page_name = f"the page of the model `{name}`"
            yield from _check_anchor(span, target.anchor, page_name, ids, listings)
        elif isinstance(target, model.LessonTarget):
            lesson = targets.lessons[name]
            if target.anchor and name in targets.planned:
                message = f"lesson {name} is planned, so it has no anchor `#{target.anchor}` yet"
                yield diagnose("link-anchor", span, message, help="link to the lesson itself")
            yield from _check_document_anchor(span, target.anchor, lesson, f"lesson {name}")
        elif isinstance(target, model.PageTarget):
            page = targets.pages[name]
            yield from _check_document_anchor(span, target.anchor, page, f"page `{name}`")

    def check_number(self, link: model.Link, target: model.Target) -> Iterator[Diagnostic]:
        """Report a link without a text to what has no number either."""
        document: model.Document | None = self.document
        match target:
            case model.LessonTarget(id=name, anchor=anchor):
                document = self.targets.lessons[name]
            case model.PageTarget(id=name, anchor=anchor):
                document = self.targets.pages[name]
            case model.UrlTarget(url=url):
                anchor = unquote(url.partition("#")[2])
            case _:
                return
        if link.bare and document is not None and anchor not in _numbered_ids(document):
            message = "this link has no text, so no reader sees it"
            help = "write one in the brackets"
            yield diagnose("link-text", link.span, message, help=help)

    def check_name(self, link: model.Link) -> Iterator[Diagnostic]:
        """Report a link to a lesson whose text is the name of another one, as `Lesson 1.2`."""
        target, name, lessons = link.target, link.lesson_in_text, self.targets.lessons
        if isinstance(target, model.LessonTarget) and {name, target.id} <= lessons.keys():
            title = next(lesson.title for lesson in self.course.lessons if lesson.id == target.id)
            if name not in (target.id, *title.split()):
                message = f"the text names lesson {name}, and the address lesson {target.id}"
                help = "name the same lesson in both"
                yield diagnose("link-text", link.span, message, help=help)

    def check_url(self, span: Span, url: str) -> Iterator[Diagnostic]:
        parts = urlsplit_or_none(url)
        if parts is None or (parts.scheme in ("http", "https") and not parts.netloc):
            yield diagnose("link-file", span, f"`{url}` is not a readable address")
        elif parts.scheme or parts.netloc:
            return
        elif parts.path:
            yield from self.check_file(url, span)
        else:
            yield from _check_document_anchor(span, parts.fragment, self.document, "this page")

    def check_file(self, url: str, span: Span) -> Iterator[Diagnostic]:
        files = self.targets.files
        path = model.local_file(url, self.document.source.path)
        if path in files:
            return
        help, name = "files that pages may use lie in content/", posixpath.basename(path)
        names = {posixpath.basename(file): file for file in files if not file.endswith(".md")}
        likely = name if name in names else nearest(name, names)
        if name.endswith(".md"):
            help = "link to a lesson by its id (`lesson:4.3`) and to a page by `page:about`"
        elif likely is not None:
            help = f"did you mean `{names[likely]}`?"
        yield diagnose("link-file", span, f"no file `{path}`", help=help)

    def check_media(self, subject: str, url: str, span: Span) -> Iterator[Diagnostic]:
        parts = urlsplit_or_none(url)
        if parts is None or parts.scheme or parts.netloc:
            message = f"{subject}`{url}` is not a file of the course"
            help = "put the file into content/ and name it relative to the lesson"
            yield diagnose("image-remote", span, message, help=help)
        else:
            yield from self.check_file(url, span)


def _numbered_ids(document: model.Document) -> frozenset[str]:
    if document.summaries is not None:
        return frozenset(item.id for item in document.numbered_items if item.number)
    formulas = (f.label for f in model.display_formulas(document) if f.label is not None)
    labels = (*formulas, *(label for _, label in model.labelled_blocks(document)))
    return frozenset(label.id for label in labels)


def _check_document_anchor(
    span: Span, anchor: str | None, document: model.Document | None, page_name: str
) -> Iterator[Diagnostic]:
    if anchor and document is not None:
        listings = {script.path: script.code.text for script in model.document_scripts(document)}
        yield from _check_anchor(span, anchor, page_name, anchors(document), listings)


def _check_anchor(
    span: Span, anchor: str, page_name: str, ids: Collection[str], listings: Mapping[str, str]
) -> Iterator[Diagnostic]:
    """Report an anchor that is no id of a page and names no lines of its listings."""
    name = unquote(anchor)
    if name in ids:
        return
    listing, first, last = model.linked_lines(name) or ("", 0, 0)
    path = next((p for p in listings if model.line_anchor(p, first) == f"{listing}.L{first}"), None)
    if path is None:
        help = did_you_mean(anchor, ids)
    else:
        count = listings[path].rstrip("\n").count("\n") + 1
        if last <= count:
            return
        help = f"the last line of `{path}` is {count}"
    message = f"{page_name} has no anchor `#{anchor}`"
    yield diagnose("link-anchor", span, message, help=help)


def urlsplit_or_none(url: str) -> SplitResult | None:
    """`urlsplit`, or `None` for an address that it refuses."""
    try:
        return urlsplit(url)
    except ValueError:
        return None
