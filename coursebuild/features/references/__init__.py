"""Sources: `content/references.bib`, cited by `[@euler1758, p. 12]`, with a page that lists all.

The packages that read and format are an extra, `coursebuild[references]`, and are imported where a
course has a list of sources.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from importlib.util import find_spec
from urllib.parse import quote

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.api import (
    Citations,
    Course,
    Diagnostic,
    Document,
    Feature,
    Library,
    PageKind,
    Rule,
    diagnose,
    did_you_mean,
    urls,
)
from coursebuild.core.model import Citation, CitedWork, Owner, find_inlines
from coursebuild.core.pages.context import CitedEntry
from coursebuild.core.pages.document_inputs import OwnerLinks, owner_links
from coursebuild.features.references.bibtex import Work, check_identifier, read_works
from coursebuild.features.references.csl import FormattedWorks, StyleFailure, format_works

_PAGE = urls.Place("references/index.html")


def _cited_works(document: Document) -> Iterator[CitedWork]:
    for citation in find_inlines(document, Citation):
        yield from citation.works


def _format(course: Course, *further_keys: str) -> FormattedWorks | None:
    """The cited works of a course, and further ones; `None` where nothing formats them."""
    if course.bibliography is None or not _is_installed():
        return None
    keys = [work.key for document in course.documents for work in _cited_works(document)]
    language = course.language or "en"
    try:
        return format_works(
            course.bibliography,
            course.citation_style,
            language,
            tuple(dict.fromkeys((*keys, *further_keys))),
        )
    except StyleFailure:
        return None


def _is_installed() -> bool:
    return all(find_spec(name) is not None for name in ("bibtexparser", "citeproc"))


def works_of(course: Course) -> Mapping[str, Work]:
    """The sources of a course by their keys; none where nothing reads them."""
    if course.bibliography is None or not _is_installed():
        return {}
    return {work.key: work for work in read_works(course.bibliography).value}


def _reference(formatted: FormattedWorks, work: Work) -> Markup:
    html = formatted.entries[work.key]
    links: list[Markup] = []
    if work.doi and work.doi not in html:
        address = f"https://doi.org/{urls.encode(work.doi)}"
        links.append(Markup('<a class="url" href="{}">doi:{}</a>').format(address, work.doi))
    url = work.field("url")
    if url.startswith(("https://", "http://")) and url not in html and not work.doi:
        address = quote(url, safe="%/:=&?~#+!$,;'@()*")
        links.append(Markup('<a class="url" href="{}">{}</a>').format(address, url))
    if work.isbn and work.isbn not in html:
        links.append(escape(f"ISBN {work.isbn}"))
    return Markup(" ").join((html, *(link + "." for link in links)))


def reference_text(course: Course, key: str) -> str:
    """A reference as plain text; empty where there is no such source, or nothing formats it."""
    work = works_of(course).get(key)
    formatted = None if work is None else _format(course, key)
    return "" if work is None or formatted is None else _reference(formatted, work).striptags()


def _anchor(key: str, prefix: str = "ref") -> str:
    return f"{prefix}:{key}"


def document_citations(library: Library, place: urls.Place, document: Document) -> Citations:
    """What the page of a document shows of the sources that it cites."""
    citations = [*find_inlines(document, Citation)]
    formatted = _format(library.course) if citations else None
    if formatted is None:
        return Citations()
    works, texts, cited = works_of(library.course), dict[int, Markup](), dict[str, None]()
    for citation in citations:
        parts: list[Markup] = []
        for work in citation.works:
            if work.key not in works:
                parts.append(escape(work.key))
                continue
            id = (
                Markup(' id="{}"').format(_anchor(work.key, "cite"))
                if work.key not in cited
                else ""
            )
            cited[work.key] = None
            address = f"#{urls.quote_anchor(_anchor(work.key))}"
            text = formatted.mark(work.key, work.locator)
            link = Markup('<a href="{}"{} role="doc-biblioref">{}</a>').format(address, id, text)
            parts.append(escape(work.before + " ") + link if work.before else link)
        text = escape(formatted.delimiter).join(parts)
        inner = escape(formatted.prefix) + text + escape(formatted.suffix)
        texts[citation.span.start] = Markup('<span class="citation">{}</span>').format(inner)
    entries = tuple(
        CitedEntry(_anchor(key), _anchor(key, "cite"), _reference(formatted, works[key]))
        for key in formatted.entries
        if key in cited
    )
    return Citations(texts, entries, place.href(_PAGE.path))


class ListedReference(Struct, frozen=True):
    """An entry of the page of references."""

    id: str
    html: Markup
    uses: OwnerLinks
    """The lessons and pages that cite it, at their first citations."""


def references_values(library: Library) -> dict[str, object]:
    """Return the values for the template of the page: the references of the course."""
    course = library.course
    formatted, works = _format(course), works_of(course)
    users: dict[str, list[Owner]] = {}
    if formatted is None:
        return {"entries": ()}
    for owner, document in course.owned_documents:
        for key in dict.fromkeys(work.key for work in _cited_works(document)):
            users.setdefault(key, []).append(owner)
    entries = (
        ListedReference(
            _anchor(key),
            _reference(formatted, works[key]),
            owner_links(_PAGE, users.get(key, ()), _anchor(key, "cite")),
        )
        for key in formatted.entries
    )
    return {"entries": tuple(entries)}


def check_sources(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    """Compare citations with the list of sources; given the whole course, check the list too."""
    source, works = course.bibliography, works_of(course)
    is_whole = len(documents) == len(course.documents)
    if source is not None and not _is_installed():
        if is_whole:
            message = f"nothing that is installed reads {source.path}"
            help = "run `pip install 'coursebuild[references]'`"
            yield diagnose("feature-missing", source.span(0, 0), message, help=help)
        return
    for document in documents:
        for cited_work in _cited_works(document):
            if (key := cited_work.key) not in works:
                message = f"there is no source `{key}`"
                help = did_you_mean(key, works) or "add it to content/references.bib"
                yield diagnose("source-unknown", cited_work.span, message, help=help)
    if source is None or not is_whole:
        return
    yield from read_works(source).diagnostics
    cited = {work.key for document in course.documents for work in _cited_works(document)}
    for work in works.values():
        if work.key not in cited:
            message, help = f"no text cites `{work.key}`", f"cite it, `[@{work.key}]`, or delete it"
            yield diagnose("source-unused", work.span, message, help=help)
        elif message := check_identifier(work):
            help = "copy it once more from the work"
            yield diagnose("source-identifier", work.span, message, help=help)
    if course.citation_style is not None:
        try:
            keys = tuple(sorted(cited & works.keys()))
            format_works(source, course.citation_style, course.language or "en", keys)
        except StyleFailure as error:
            message = f"this style cannot be used: {error}"
            help = "it is a style of CSL 1.0, such as Zotero's"
            place = course.citation_style.span(0, 0)
            yield diagnose("source-style", place, message, help=help)


FEATURE = Feature(
    name="references",
    citations=document_citations,
    check=check_sources,
    pages=(
        PageKind(
            name="references",
            values=references_values,
            exists=lambda library: bool(references_values(library)["entries"]),
            order=25,
        ),
    ),
    rules=(
        Rule("source-unknown", "error", "A text cites a source that is not in the list."),
        Rule("source-malformed", "error", "An entry of the list of sources cannot be read."),
        Rule("source-style", "error", "The course's style for citations cannot be used."),
        Rule("source-unused", "warning", "No text cites this source."),
        Rule("source-identifier", "warning", "The DOI or ISBN of a source cannot be one."),
    ),
)
