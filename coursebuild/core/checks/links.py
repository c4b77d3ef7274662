"""Links and mentions of the sources: every one leads somewhere.

Entry points: `link_targets(course)`; `document_links`, for one document.

1. Collect what can be linked to: lessons, levels, pages, models, scripts, files, and the anchors of
   each document.
2. Walk each document's inlines and compare.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterator, Mapping
from typing import TypeAlias, assert_never
from urllib.parse import SplitResult, unquote, urlsplit

from msgspec import Struct

from coursebuild.core.model import (
    Course,
    Document,
    ExampleTarget,
    FeatureBlock,
    Heading,
    HtmlBlock,
    Image,
    LessonTarget,
    LevelTarget,
    Link,
    MjcfModel,
    ModelTarget,
    PageTarget,
    RawInline,
    Recording,
    Script,
    Target,
    Term,
    TermTarget,
    UrlTarget,
    block_inlines,
    document_blocks,
    document_inlines,
    document_scripts,
    is_comment,
    line_anchor,
    linked_lines,
    listing_anchor,
    local_file,
    model_anchors,
    output_anchor,
    resolve,
    walk_inlines,
)
from coursebuild.core.model.equations import display_formulas
from coursebuild.core.model.figures import recorded_figures
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean, nearest
from coursebuild.core.text.source import Span

_Name: TypeAlias = (
    LessonTarget | LevelTarget | PageTarget | ModelTarget | ExampleTarget | TermTarget
)

_HTML_ID = re.compile(r"""<[^>]*?\sid\s*=\s*["']?([^"'\s>]+)""", re.IGNORECASE)
_HTML_ANCHOR = re.compile(r"""<a\s[^>]*?\bhref\s*=\s*\\?["']?(#[^"'\s>\\]+)""", re.IGNORECASE)


class LinkTargets(Struct, frozen=True):
    """Everything that a link may lead to."""

    lessons: Mapping[str, Document | None]
    levels: frozenset[str]
    pages: Mapping[str, Document | None]
    models: Mapping[str, MjcfModel]
    scenarios: Mapping[str, tuple[str, ...]]
    """Those that models declare, by the model's name."""
    scripts: frozenset[str]
    files: frozenset[str]
    terms: Mapping[str, Span]
    """Where each is defined, by its id; of two places the first."""


def link_targets(course: Course) -> LinkTargets:
    """What the course offers as targets."""
    scripts: set[str] = set()
    terms: dict[str, Span] = {}
    for document in course.documents:
        scripts.update(script.path for script in document_scripts(document))
        for inline in document_inlines(document):
            if isinstance(inline, Term):
                terms.setdefault(inline.id, inline.span)
    return LinkTargets(
        {lesson.id: lesson.document for lesson in course.lessons},
        frozenset(level.id for level in course.levels),
        {page.id: page.document for page in course.pages},
        {model.name: model for model in course.models},
        {d.model: tuple(one.name for one in d.scenarios) for d in course.declarations},
        frozenset(scripts),
        frozenset(course.files),
        terms,
    )


def anchors(document: Document) -> Mapping[str, Span]:
    """The ids that a link may name in a document, and where they lead.

    The title of a page, headings, quizzes, listings, outputs, formulas, terms, and ids written in
    raw HTML; of lines, see `_is_line`. Each lookup after the first finds what was kept with the
    document.
    """
    known: dict[str, Span] | None = document.__dict__.get("anchors")
    if known is None:
        known = document.__dict__["anchors"] = dict(_anchors(document))
    return known


def _anchors(document: Document) -> Iterator[tuple[str, Span]]:
    if document.title_anchor:
        yield document.title_anchor, document.source.span(0, 0)
    outputs: dict[str, int] = {}
    # A summary does not say where formulas stand.
    yield from ((formula.id, document.source.span(0, 0)) for formula in document.equations)
    if document.summaries is None:
        for displayed in filter(lambda formula: formula.id, display_formulas(document)):
            yield displayed.id, document.source.span(displayed.start, displayed.start)
    for block in document_blocks(document):
        if isinstance(block, Heading):
            yield block.anchor, block.span
        elif isinstance(block, FeatureBlock):
            yield from ((id, block.span) for id in block.anchors())
        elif isinstance(block, Script):
            yield listing_anchor(block.path), block.span
        elif isinstance(block, Recording) and block.script is not None:
            outputs[block.script] = outputs.get(block.script, 0) + 1
            yield output_anchor(block.script, outputs[block.script]), block.span
        elif isinstance(block, HtmlBlock):
            yield from ((id, block.span) for id in _HTML_ID.findall(block.html))
        for inline in walk_inlines(block_inlines(block)):
            if isinstance(inline, RawInline):
                yield from ((id, inline.span) for id in _HTML_ID.findall(inline.html))
            elif isinstance(inline, Term):
                yield inline.anchor, inline.span


def _is_line(anchor: str, document: Document) -> bool:
    """Whether an anchor names lines of a script of a document."""
    lines, script = linked_lines(anchor), _listing(anchor, document)
    return lines is not None and script is not None and lines[2] <= _length(script)


def _listing(anchor: str, document: Document) -> Script | None:
    """The script of a document of which an anchor names lines, whether it has them or not."""
    if (lines := linked_lines(anchor)) is None:
        return None
    wanted = f"{lines[0]}.L{lines[1]}"
    scripts = document_scripts(document)
    return next((s for s in scripts if line_anchor(s.path, lines[1]) == wanted), None)


def _length(script: Script) -> int:
    return script.code.text.rstrip("\n").count("\n") + 1


def document_links(course: Course, document: Document, known: LinkTargets) -> Iterator[Diagnostic]:
    """A diagnostic for each link, mention or image of a document that leads nowhere.

    `known` is what the course offers.
    """
    drawn = {figure.span for figure in recorded_figures(document)}
    for block in document_blocks(document):
        if isinstance(block, HtmlBlock):
            yield from _forbidden(block, course)
            yield from _check_html(block, document, known)
        for inline in walk_inlines(block_inlines(block)):
            if isinstance(inline, Link):
                target = resolve(inline.target, course, document.source.path)
                yield from _check_link(inline, target, document, known)
            elif isinstance(inline, Image) and inline.url_span not in drawn:
                yield from _check_media("the image ", inline.url, inline.url_span, document, known)
            elif isinstance(inline, RawInline):
                yield from _forbidden(inline, course)
                yield from _check_html(inline, document, known)


def _forbidden(html: HtmlBlock | RawInline, course: Course) -> Iterator[Diagnostic]:
    """What the course does not allow of raw HTML."""
    if course.html == "none" and not (is_comment(html) or html.html.startswith("</")):
        message, help = "the course allows no raw HTML", "write it in Markdown"
        yield diagnose("html-forbidden", html.span, message, help=help)
    elif course.html == "safe":
        help = 'if you trust all who write the course, its map may say `html = "trusted"`'
        for part in html.forbidden:
            yield diagnose("html-forbidden", part.span, part.message, help=help)


def _check_html(
    html: HtmlBlock | RawInline, document: Document, known: LinkTargets
) -> Iterator[Diagnostic]:
    """Links of raw HTML to anchors of its own page, and the files that it shows."""
    span = html.span
    for link in _HTML_ANCHOR.finditer(span.text):
        place = Span(span.source, span.start + link.start(1), span.start + link.end(1))
        yield from _check_url(place, link[1], document, known)
    for media in html.media:
        parts = urlsplit_or_none(media.url)
        if parts is None or (parts.scheme != "data" and (parts.netloc or parts.path)):
            yield from _check_media("", media.url, media.span, document, known)


def _check_link(
    link: Link, target: Target, document: Document, known: LinkTargets
) -> Iterator[Diagnostic]:
    span = link.target_span
    if isinstance(target, UrlTarget):
        yield from _check_url(span, target.url, document, known)
        return
    rule, name, names, missing = _named(link, target, known)
    if name not in names:
        help = _other_kind(target, known) or _lesson_help(target, known)
        help = help or did_you_mean(name, names)
        yield diagnose(rule, span, missing, help=help)
    elif isinstance(target, ModelTarget):
        declared = known.scenarios.get(target.name, ())
        yield from _model_place(span, target.anchor, known.models[target.name], declared)
    elif isinstance(target, LessonTarget):
        to, where = known.lessons[target.id], f"lesson {target.id}"
        yield from _anchor(span, target.anchor, to, where)
    elif isinstance(target, PageTarget):
        to, where = known.pages[target.id], f"page `{target.id}`"
        yield from _anchor(span, target.anchor, to, where)


def _by_id(kind: str, id: str) -> str:
    """How to lead to a lesson, a level or a page."""
    if kind == "level":
        return f"write `Level {id}` in the text, which becomes a link"
    if kind == "lesson":
        return f"write `Lesson {id}` in the text, or link to `lesson:{id}`"
    return f"link to `{kind}:{id}`"


def _other_kind(target: _Name, known: LinkTargets) -> str:
    """What to write where a lesson is called a level, or a level a lesson."""
    if isinstance(target, LessonTarget) and target.id in known.levels:
        kind = "level"
    elif isinstance(target, LevelTarget) and target.id in known.lessons:
        kind = "lesson"
    else:
        return ""
    return f"{target.id} is a {kind}: {_by_id(kind, target.id)}"


_NUMBERED = re.compile(r"(?:.*/)?([\w.]+?)(?:-.*)?(?:\.\w+)?")
"""A file or an address that begins with the id of a lesson."""


def _lesson_help(target: _Name, known: LinkTargets) -> str:
    """The lesson that is meant by its file or slug, else those of the same level."""
    if not isinstance(target, LessonTarget):
        return ""
    numbered = _NUMBERED.fullmatch(target.id)
    if numbered and numbered[1] in known.lessons:
        return f"did you mean `lesson:{numbered[1]}`?"
    written = ((id, d.source.path) for id, d in known.lessons.items() if d is not None)
    named = [id for id, path in written if path.endswith(f"-{target.id}.md")]
    if len(named) == 1:
        return f"did you mean `lesson:{named[0]}`?"
    level = target.id.rpartition(".")[0]
    near = [id for id in known.lessons if level and id.rpartition(".")[0] == level]
    return f"level {level} has " + ", ".join(f"`{id}`" for id in near) if near else ""


def _named(link: Link, target: _Name, known: LinkTargets) -> tuple[str, str, Collection[str], str]:
    """The rule of a link, the name by which it calls, all there are, and what to say without it."""
    lacks = (
        f"is {'mentioned' if link.mention else 'linked to'}, and the course map does not have it"
    )
    match target:
        case LessonTarget(id=id):
            return "link-lesson", id, known.lessons, f"lesson {id} {lacks}"
        case LevelTarget(id=id):
            return "link-level", id, known.levels, f"level {id} {lacks}"
        case PageTarget(id=id):
            return "link-page", id, known.pages, f"no page `{id}` in the course map"
        case ModelTarget(name=name):
            return "link-model", name, known.models, f"no model `{name}` in models/"
        case ExampleTarget(path=path):
            return "link-example", path, known.scripts, f"no lesson has a script `{path}`"
        case TermTarget(id=id):
            return "link-term", id, known.terms, f"no lesson defines the term `{id}`"
        case _:
            assert_never(target)


def _anchor(
    span: Span, anchor: str | None, document: Document | None, where: str
) -> Iterator[Diagnostic]:
    if not anchor:
        return
    if document is None:
        yield diagnose(
            "link-anchor",
            span,
            f"{where} is planned, so it has no anchor `#{anchor}` yet",
            help="link to the lesson itself",
        )
        return
    known = anchors(document)
    name = unquote(anchor)
    if name in known or _is_line(name, document):
        return
    listing = _listing(name, document)
    help = (
        did_you_mean(anchor, known)
        if listing is None
        else f"the last line of `{listing.path}` is {_length(listing)}"
    )
    yield diagnose("link-anchor", span, f"{where} has no anchor `#{anchor}`", help=help)


def _check_url(
    span: Span, url: str, document: Document, known: LinkTargets
) -> Iterator[Diagnostic]:
    parts = urlsplit_or_none(url)
    if parts is None:
        yield diagnose("link-file", span, f"`{url}` is no address that can be read")
        return
    if parts.scheme or parts.netloc:
        return
    if not parts.path:
        route = _ROUTE.fullmatch(unquote(parts.fragment))
        if route is not None and (ids := _ids(route[1], known)) and route[2] in ids:
            message = f"`{url}` is an address of another tool"
            help = _by_id(route[1], route[2])
            yield diagnose("link-anchor", span, message, help=help)
            return
        yield from _anchor(span, parts.fragment or None, document, "this page")
        return
    path = local_file(url, document.source.path)
    if path not in known.files:
        yield diagnose("link-file", span, f"no file `{path}`", help=_file_help(path, known))


_ROUTE = re.compile(r"!?/?(lesson|level|page)s?[/:]([^/]+)/?")
"""The address of a lesson in a course that one page with a script shows."""


def _ids(kind: str, known: LinkTargets) -> Collection[str]:
    """The ids of lessons, levels or pages."""
    return {"lesson": known.lessons, "level": known.levels, "page": known.pages}[kind]


def _file_help(path: str, known: LinkTargets) -> str:
    name = posixpath.basename(path)
    numbered = _NUMBERED.fullmatch(name)
    if name.endswith((".md", ".html")) and numbered and numbered[1] in known.lessons:
        return f"link to the lesson by its id: `lesson:{numbered[1]}`"
    if name.endswith(".md"):
        return "link to a lesson by its id (`lesson:4.3`) and to a page by `page:about`"
    if name.endswith(".xml") and name[:-4] in known.models:
        return f"link to a model by its name: `model:{name[:-4]}`"
    files = {posixpath.basename(file): file for file in known.files if not file.endswith(".md")}
    near = nearest(name, files)
    return f"did you mean `{files[near]}`?" if near else "files that pages may use lie in content/"


def _check_media(
    what: str, url: str, span: Span, document: Document, known: LinkTargets
) -> Iterator[Diagnostic]:
    """Whether a file that a page shows is one of the course."""
    parts = urlsplit_or_none(url)
    if parts is None or parts.scheme or parts.netloc:
        message = f"{what}`{url}` is not a file of the course"
        help = "put the file into content/ and name it relative to the lesson"
        yield diagnose("image-remote", span, message, help=help)
        return
    path = local_file(url, document.source.path)
    if path not in known.files:
        yield diagnose("link-file", span, f"no file `{path}`", help=_file_help(path, known))


def urlsplit_or_none(url: str) -> SplitResult | None:
    """`urlsplit`, or `None` for an address that it refuses."""
    try:
        return urlsplit(url)
    except ValueError:
        return None


def _model_place(
    span: Span, anchor: str | None, model: MjcfModel, scenarios: Collection[str]
) -> Iterator[Diagnostic]:
    """What is wrong with an anchor behind `model:NAME`, if anything.

    The ids are those that `templates/model.html` writes. Only scenarios that `models/NAME.toml`
    declares have one: of others nobody knows before they are measured.
    """
    if not anchor:
        return
    name, path = unquote(anchor), model.source.path
    known = {*model_anchors(scenarios), listing_anchor(path)}
    if name in known:
        return
    lines = linked_lines(name)
    if lines is None or line_anchor(path, lines[1]) != f"{lines[0]}.L{lines[1]}":
        help = did_you_mean(name, known)
    else:
        last = model.source.text.rstrip().count("\n") + 1
        if lines[2] <= last:
            return
        help = f"the last line of `{path}` is {last}"
    message = f"the page of the model `{model.name}` has no anchor `#{anchor}`"
    yield diagnose("link-anchor", span, message, help=help)
