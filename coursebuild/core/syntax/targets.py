"""Where links lead: destinations as targets, and schemes that a page must not have.

Entry points: `classify`, `check_scheme`, `check_raw_scheme`.
"""

from __future__ import annotations

import re
from urllib.parse import unquote

from coursebuild.core.model import (
    ExampleTarget,
    LessonTarget,
    ModelTarget,
    PageTarget,
    Target,
    TermTarget,
    UrlTarget,
)
from coursebuild.core.syntax.headings import term_id
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Span

_SCHEME = pattern(r"([A-Za-z][A-Za-z0-9+.-]*):")
_FORBIDDEN = frozenset({"data", "file", "javascript", "vbscript"})
_PICTURE = pattern(r"data:image/(?:avif|gif|jpeg|png|svg\+xml|webp)[;,]", re.IGNORECASE)
_OURS = ("lesson", "model", "page", "term")


def classify(url: str) -> Target:
    """The target of a destination as markdown-it normalises it (percent-encoded)."""
    found = _SCHEME.match(url)
    scheme = found[1] if found else ""
    if scheme in _OURS:
        name, mark, anchor = url[len(scheme) + 1 :].partition("#")
        place = unquote(anchor) if mark and anchor else None
        if scheme == "lesson":
            return LessonTarget(unquote(name), place)
        if scheme == "page":
            return PageTarget(unquote(name), place)
        if scheme == "term":
            return TermTarget(term_id(unquote(url[len(scheme) + 1 :])))
        return ModelTarget(unquote(name), place)
    if url.startswith("examples/"):
        return ExampleTarget(unquote(url))
    return UrlTarget(url)


def check_scheme(url: str, span: Span, *, image: bool = False) -> Diagnostic | None:
    """What is wrong with the scheme of a normalised destination, if anything."""
    found = _SCHEME.match(url.strip())
    if found is None or found[1] in _OURS:
        return None
    scheme = found[1].lower()
    if scheme in _FORBIDDEN:
        if image and _PICTURE.match(url.strip()):
            return None
        return diagnose(
            "link-scheme",
            span,
            f"`{scheme}:` must not stand in a page",
            help="link to an address with `https:`, to a file, or by "
            "`lesson:`, `page:`, `model:`, `term:`",
        )
    near = nearest(scheme, _OURS, cutoff=0.75)
    if near is None:
        return None
    return diagnose(
        "link-scheme", span, f"no link scheme `{found[1]}:`", help=f"did you mean `{near}:`?"
    )


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """What is wrong with the scheme of an address in raw HTML, which is published as it is."""
    found = _SCHEME.match(url.strip())
    if found is not None and found[1].lower() in _OURS:
        message = f"`{found[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url.strip()})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)
