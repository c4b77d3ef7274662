"""Names in inline code: linked to what they mean, and a mistake where they certainly mean nothing.

1. `claims` finds them in a document, and what its code defines.
2. `known_names` lists those of MuJoCo and MJCF, by a child (`introspect`).
3. `resolve` says what a name means; its page links to that, an editor shows it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from fnmatch import fnmatchcase

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    Feature,
    Interpreter,
    Library,
    Parsed,
    Rule,
    Store,
    diagnose,
    urls,
)
from coursebuild.features.names.claims import DocumentNames, course_names, document_names
from coursebuild.features.names.known_names import (
    EngineTable,
    KnownName,
    Unknown,
    engine_names,
    list_names,
)
from coursebuild.features.names.resolve import Resolver, resolver_of

_HELP = "say `{code}` after it if it is no name, or list it under `names` in `[verify]`"


def reference(course: Course, store: Store, interpreter: Interpreter | None) -> EngineTable | None:
    """Return the names of the installed MuJoCo, if the course names anything."""
    is_asked = any(names.claims for names in course_names(course))
    return engine_names(store, interpreter) if is_asked else None


def check(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    """Report names that certainly mean nothing."""
    free = {id(page.document) for page in course.pages if not page.names}
    resolver = resolver_of(course)
    for document in documents:
        note = document.summary_of(DocumentNames)
        if note is None or id(document) in free:
            continue
        codes = {code.start: code.text for _, code, _ in note.claims}.values()
        for claim, code, span in note.claims:
            answer = resolver.resolve(claim, note)
            if not isinstance(answer, Unknown):
                continue
            name = rf"\b{answer.part}\b"
            uses = [len(re.findall(name, text)) for text in (code.source.text, "\n".join(codes))]
            if answer.part.startswith("mj") and uses[0] > uses[1]:
                continue  # of code that is shown, which may be in C
            words = (code.text.strip("` "), answer.part)
            if any(fnmatchcase(word, name) for word in words for name in course.names):
                continue
            at = code.source.text.find(answer.part, span.start, code.end)
            place = code.source.span(at, at + len(answer.part)) if at >= 0 else span
            yield diagnose("name-unknown", place, answer.message, help=answer.help or _HELP)


def lost_names(course: Course, python: str) -> Iterator[Diagnostic]:
    """Report names of MuJoCo that the one of another interpreter has lost, or deprecated."""
    resolver = resolver_of(course)
    uses = [
        (claim, span, note, meaning)
        for document in course.documents
        if (note := document.summary_of(DocumentNames)) is not None
        for claim, _, span in note.claims
        if isinstance(meaning := resolver.resolve(claim, note), KnownName) and meaning.engine
    ]
    if not uses or resolver.engine is None:
        return
    engine = list_names(python)
    other_resolver = Resolver(course, engine)
    for claim, span, names, meaning in uses:
        answer = other_resolver.resolve(claim, names)
        if isinstance(answer, KnownName) and answer.engine:
            if "deprecated" in answer.doc.lower() and "deprecated" not in meaning.doc.lower():
                message = f"MuJoCo {engine.version} discourages `{claim.name}`: {answer.doc}"
                yield diagnose("name-unknown", span, message)
        elif isinstance(answer, Unknown):
            yield diagnose("name-unknown", span, answer.message)
        else:
            message = f"MuJoCo {engine.version} has no `{claim.name}`"
            yield diagnose("name-unknown", span, message)


def code_links(library: Library, place: urls.Place, document: Document) -> dict[int, str]:
    """Return the addresses of what inline code names."""
    note, links = document.summary_of(DocumentNames), dict[int, str]()
    if note is None:
        return links
    resolver = resolver_of(library.course)
    pages = {page.path: page for page in library.course.pages}
    for claim, code, _ in note.claims:
        answer = resolver.resolve(claim, note) if claim.linked else None
        href = answer.href if isinstance(answer, KnownName) else ""
        page = pages.get(href)
        if href.startswith("#examples/"):
            href = place.href(href[1:]) if href[1:] in library.scripts else ""
        elif page is not None:
            href = "" if page.document is document else place.href(urls.page_path(page))
        if href:
            links[code.start] = href
    return links


FEATURE = Feature(
    name="names",
    summary=lambda document, mathml: Parsed(document_names(document)),
    reference=reference,
    code_links=code_links,
    against=lost_names,
    check=check,
    rules=(Rule("name-unknown", "error", "Inline code names what certainly does not exist."),),
)
