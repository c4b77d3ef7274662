"""Takes lessons from the pages of a site: with other ids and links, and nothing for scripts.

Entry points: `render_lesson`; `rewrite(content, rules)`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from urllib.parse import unquote

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import ExportContext
from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html

_DROPPED_ELEMENTS = frozenset(
    "button form template script style dialog iframe object embed audio video source track"
    " noembed noframes".split()
)
_WITHOUT_MARKUP = frozenset(("plaintext", "xmp"))
"""Elements whose content is text; the first has no end tag, and would swallow the rest."""
_NOT_PRINTED = frozenset(("anchor", "bar-tools", "plot-wide", "figure-dark", "qr"))
"""Classes of elements that are left out: links of headings to themselves, downloads, QR codes, and
the drawings of a plot for large screens or dark pages."""
_FOR_SCRIPTS = frozenset(
    "style download loading srcset sizes tabindex xmlns usemap autofocus".split()
)
_ID_ATTRIBUTES = frozenset(
    "aria-activedescendant aria-controls aria-describedby aria-details aria-errormessage"
    " aria-flowto aria-labelledby aria-owns for headers list".split()
)
"""Attributes that hold ids."""
_ADDRESSES = frozenset(("href", "xlink:href", "src"))
_IN_SVG = re.compile(r"url\(#([^)]+)\)")


class RewriteRules(Struct, frozen=True):
    """How a lesson is rewritten."""

    place: urls.Place
    """Its page."""
    address: Callable[[str, str], str]
    """Return the address for a site path and an anchor; empty if the link has no target."""
    picture: Callable[[str], str]
    """Return the address for a picture at a site path; empty if it cannot be shown."""
    id: Callable[[str], str]
    """Return the new id for an old one."""
    heading_shift: int = 0
    """Levels that headings move down."""
    closed_classes: frozenset[str] = frozenset()
    """Classes of the folds that stay closed."""
    section: str = ""
    """A suffix for the labels of sections, to tell them from those of other lessons."""


def rewrite(content: Iterable[HtmlContent], rules: RewriteRules) -> Iterator[HtmlContent]:
    """Yield the content of a lesson's page, rewritten."""
    for child in content:
        if isinstance(child, str):
            yield child
        elif child.name not in _DROPPED_ELEMENTS and not child.classes & _NOT_PRINTED:
            yield _rewrite_element(child, rules)


def _rewrite_element(element: HtmlElement, rules: RewriteRules) -> HtmlContent:
    name, old_attributes = element.name, element.attributes
    if name == "img":
        path, _ = rules.place.target(old_attributes.get("src", ""))
        address = rules.picture(path) if path is not None else ""
        if not address:
            return old_attributes.get("alt", "")
        old_attributes = old_attributes | {"src": address}
    attributes = {
        key: new_value
        for key, value in old_attributes.items()
        if (new_value := _rewrite_attribute(element, key, value, rules)) is not None
    }
    if name == "details" and not element.classes & rules.closed_classes:
        attributes["open"] = ""
    if name in _WITHOUT_MARKUP:
        name = "pre"
    if len(name) == 2 and name[0] == "h" and name[1] in "123456":
        name = f"h{min(int(name[1]) + rules.heading_shift, 6)}"
    return HtmlElement(name, attributes, list(rewrite(element.children, rules)))


def _rewrite_attribute(
    element: HtmlElement, name: str, value: str, rules: RewriteRules
) -> str | None:
    """Return the new value of an attribute; `None` if it is left out."""
    if name in _FOR_SCRIPTS or name.startswith(("on", "data-")):
        return None
    if name == "id" or (name == "name" and element.name == "a"):
        return rules.id(value)
    if name in _ID_ATTRIBUTES:
        return " ".join(map(rules.id, value.split()))
    if name == "aria-label" and element.name == "section" and rules.section:
        return f"{value}, {rules.section}"
    if name == "src" and element.name == "img":
        return value
    if name in _ADDRESSES:
        # A picture inside a drawing is not part of the lesson.
        return None if element.name == "image" else _rewrite_address(value, rules)
    if "url(#" in value:
        return _IN_SVG.sub(lambda match: f"url(#{rules.id(match[1])})", value)
    return value


def _rewrite_address(url: str, rules: RewriteRules) -> str | None:
    if url.startswith("#"):
        return f"#{urls.quote_anchor(rules.id(unquote(url[1:])))}" if len(url) > 1 else "#"
    path, anchor = rules.place.target(url)
    return url if path is None else rules.address(path, anchor) or None


PICTURES = {
    "gif": "image/gif",
    "jpeg": "image/jpeg",
    "jpg": "image/jpeg",
    "png": "image/png",
    "svg": "image/svg+xml",
    "webp": "image/webp",
}
"""Media types of the pictures that every reading system shows, by extension."""
_TEXT_START, _TEXT_END = '<div class="prose">\n', '\n</div>\n<div class="lesson-end"'
"""What surrounds the text of a lesson, see `templates/lesson.html`."""


def summary_line(context: ExportContext) -> str:
    """Return the number of lessons, and the versions that they were verified with."""
    words, results = context.library.words, context.library.results
    verified = words("site.verified", engine=results.engine, python=results.python)
    lessons = words("exports.lessons", n=len(context.course.written_lessons))
    return f"{lessons}. {verified}."


def render_lesson(
    context: ExportContext,
    lesson: Lesson,
    rules: RewriteRules,
    write: Callable[[list[HtmlContent]], str],
    top: str,
) -> Markup:
    """Render a lesson for use elsewhere; `write` writes its tree, `top` is its own id there."""
    page = context.site()[rules.place.path].make().decode()
    text = page.partition(_TEXT_START)[2].rpartition(_TEXT_END)[0]
    return context.library.render(
        "book/lesson.html",
        lesson=lesson,
        draft=lesson.status == "draft",
        article=Markup(write(list(rewrite(parse_html(text), rules)))),
        top=top,
        heading=1 + rules.heading_shift,
    )


def site_address(context: ExportContext, path: str, anchor: str) -> str:
    """Return the address of a page on the site; empty if the course has none."""
    address = urls.absolute(context.course.base_url, path)
    return f"{address}#{urls.quote_anchor(anchor)}" if address and anchor else address


def style_path(context: ExportContext) -> str:
    """Return the path of the style sheet of the site's pages."""
    paths = (path for path in context.site() if path.startswith("assets/site."))
    return next(path for path in paths if path.endswith(".css"))


def extension(path: str) -> str:
    """Return the extension of a file in lower case."""
    return path.lower().rpartition(".")[2]
