"""Targets of links, as an address names them; only some schemes are safe on a page."""

from __future__ import annotations

import re
from urllib.parse import unquote

from coursebuild.core.model import (
    ExampleTarget,
    Inline,
    LessonTarget,
    ModelTarget,
    PageTarget,
    Target,
    TermTarget,
    UrlTarget,
    plain_text,
)
from coursebuild.core.model.course import Words
from coursebuild.core.model.inlines import LABEL_KINDS
from coursebuild.core.syntax.attributes import term_id
from coursebuild.core.syntax.mentions import mentioned_lesson
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.source import Span

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
_FORBIDDEN_SCHEMES = frozenset({"data", "file", "javascript", "vbscript"})
_PICTURE = re.compile(r"data:image/(?:avif|gif|jpeg|png|svg\+xml|webp)[;,]", re.IGNORECASE)
_BLANK = "".join(map(chr, range(33)))
_IGNORED_CHARACTER = re.compile("[\t\n\r]")
"""Characters that browsers ignore in an address, as they do those of `_BLANK` at its ends."""
_COURSE_SCHEMES = ("lesson", "model", "page", "term")


def classify(url: str) -> Target:
    """The target of a destination as markdown-it normalises it (percent-encoded)."""
    scheme, colon, rest = url.partition(":")
    name, _, anchor = rest.partition("#")
    place = unquote(anchor) or None
    match scheme + colon:
        case "lesson:":
            return LessonTarget(unquote(name), place)
        case "page:":
            return PageTarget(unquote(name), place)
        case "model:":
            return ModelTarget(unquote(name), place)
        case "term:":
            return TermTarget(term_id(unquote(rest)))
        case _:
            return ExampleTarget(unquote(url)) if url.startswith("examples/") else UrlTarget(url)


def check_scheme(url: str, span: Span, *, image: bool = False) -> Diagnostic | None:
    """The diagnostic of a wrong scheme in a normalised destination, if it has one."""
    match = _SCHEME.match(url.strip())
    if match is None or match[1] in _COURSE_SCHEMES:
        return None
    scheme = match[1].lower()
    if scheme in _FORBIDDEN_SCHEMES or len(scheme) == 1:  # `C:/Users/me/a.csv`
        if image and _PICTURE.match(url.strip()):
            return None
        help = "link to an address with `https:`, to a file, or by "
        help += "`lesson:`, `page:`, `model:`, `term:`"
        return diagnose("link-scheme", span, f"`{scheme}:` is not allowed in a page", help=help)
    if scheme in LABEL_KINDS:
        help = Fix(f"did you mean `#{url}`?", f"#{url}")
        return diagnose("link-scheme", span, f"no link scheme `{match[1]}:`", help=help)
    return None


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """The diagnostic of a wrong scheme in raw HTML, whose addresses are published unchanged."""
    url = _IGNORED_CHARACTER.sub("", url.strip(_BLANK))
    match = _SCHEME.match(url)
    if match is not None and match[1].lower() in _COURSE_SCHEMES:
        message = f"`{match[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)


def check_link_text(
    target: Target, children: tuple[Inline, ...], span: Span, words: Words
) -> Diagnostic | None:
    """The diagnostic of a text or an address that is missing, or names another lesson."""
    lesson = isinstance(target, LessonTarget) and mentioned_lesson(plain_text(children), words)
    address = getattr(target, "url", None) or f"#{getattr(target, 'anchor', None) or ''}"
    help = "write one in the brackets"
    if target == UrlTarget(""):
        message, help = "this link has no address", f"{help} behind its text"
    elif not children and ":" not in address.partition("#")[2]:  # else it may show a number
        message = "this link has no text, so no reader sees it"
    elif lesson and isinstance(target, LessonTarget) and lesson != target.id:
        message = f"the text names lesson {lesson}, and the address lesson {target.id}"
        help = "name the same lesson in both"
    else:
        return None
    return diagnose("link-text", span, message, help=help)
