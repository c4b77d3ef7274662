"""What a text of another tool has from elsewhere: anchors, the text of links, macros of formulas.

Every tool makes the anchor of a heading in a way of its own: Jupyter's for `## 2. The arm` is
`2.-The-arm`, MkDocs's `2-the-arm`. They agree in letters and digits, by which they are found here.
MyST shows the title of what a link without text leads to, and MathJax keeps a macro for all
formulas below it.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from textwrap import shorten
from unicodedata import normalize
from urllib.parse import unquote

from msgspec import Struct

from coursebuild.api import Edit, Source, Span, model, regex
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.run.typesetting import MathEngine
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.syntax.document import parse_document
from coursebuild.features.importer.displays import DEFINITION
from coursebuild.features.importer.prose import GONE
from coursebuild.features.importer.roles import name_of_picture
from coursebuild.features.importer.source_files import find_group, title_of_file

_GONE = regex(rf"^[ ]{{0,3}}\[[^\[\]\n]+\]:[ \t]*{GONE}.*\n?", re.MULTILINE)
_REFERENCE = regex(r"\[(.*?)\](?:\[[^\[\]]*\]|\([^()]*\))?", re.DOTALL)


class _Text(Struct, frozen=True):
    """A new lesson or page."""

    document: model.Document
    title: str
    anchors: Mapping[str, str]
    """Its anchors, by themselves and by their letters and digits."""
    headings: Mapping[str, str]
    """What its headings say, by their anchors."""


def complete_texts(
    texts: Mapping[str, tuple[str, str]],
    resolve_label: Callable[[str, str], str],
    leave: Callable[[str, str, str], None],
    callouts: frozenset[str],
    *,
    has_mentions: bool,
) -> tuple[list[str], dict[str, str]]:
    """Return the new texts of lessons and pages, completed, and the macros that all may use.

    The texts are given by their links, each with its title.
    `resolve_label` gives the address of an anchor for a link in a text; empty if no text sets it.
    `leave` is told of what a page cannot hold, and is changed: the link, the kind, a message.
    Without mentions, "Level 1" is about another thing than the first level.
    """
    read = {
        link: _read(link, title, text, leave, callouts) for link, (title, text) in texts.items()
    }
    macros = _find_common_macros(text.document for text in read.values())
    completed_texts = []
    for link, text in read.items():
        edits = {edit.span.start: edit for edit in _edit_links(link, read, resolve_label)}
        if not has_mentions:
            edits |= {edit.span.start: edit for edit in _break_mentions(text.document)}
        edits |= {edit.span.start: edit for edit in _carry_macros(text.document, macros)}
        new = apply_edits(text.document.source.text, edits.values())
        completed_texts.append(_GONE.sub("", new).lstrip("\n"))
    return completed_texts, macros


_PASSES = 3
"""How often HTML is dropped: an end whose beginning was dropped is seen the next time."""
_ANCHOR = regex(r'<a id="[^"<>]*">|[ ]id="[^"<>]*"|[ ]?\{#[^{}\n]*\}')
_MEDIA = regex(
    r"<(?:(?:img|source)\b[^<>]*>(?:</img>)?"
    r"|(?P<name>video|audio)\b[^<>]*(?:/>|>(?:.*?</(?P=name)\s*>)?))",
    re.DOTALL | re.IGNORECASE,
)
_ELSEWHERE = regex("https?://|//")
_ELSEWHERE_NOTE = "a {} from another host, `{}`; it is a link now"
_WITH_CONTENT = regex(r"<(script|style)\b.*?(?:</\1\s*>|\Z)", re.DOTALL | re.IGNORECASE)


def _read(
    link: str,
    title: str,
    text: str,
    leave: Callable[[str, str, str], None],
    callouts: frozenset[str],
) -> _Text:
    for _ in range(_PASSES):
        source = Source(link, text)
        parse = parse_document(source, callouts, lesson=link.startswith("lesson:"))
        document, edits = parse.value, dict[int, Edit]()
        spans = [
            *(part.span for html in _raw_html(document) for part in html.forbidden),
            *(d.span for d in parse.diagnostics if d.rule in ("html-unbalanced", "heading-empty")),
            *(
                Span(source, *anchor.span())
                for d in parse.diagnostics
                if d.rule == "anchor-repeated"
                and (anchor := _ANCHOR.search(text, max(d.span.start - 3, 0), d.span.end + 1))
            ),
        ]
        for span in spans:
            whole = _WITH_CONTENT.match(text, span.start)
            end = whole.end() if whole is not None else span.end
            if span.start not in edits:
                edits[span.start] = Edit(_with_line(Span(source, span.start, end)), "")
                tag = shorten(text[span.start : end], 120, placeholder="…")
                if not tag.startswith("#"):
                    leave(link, "tag of HTML", f"`{tag}`, which a page cannot hold")
        for html in _raw_html(document):
            for media in html.media:
                if _ELSEWHERE.match(media.url):
                    edits |= _link_to_picture(source, media.span, link, leave)
        links = [link_node.span for link_node in model.find_inlines(document, model.Link)]
        for image in model.find_inlines(document, model.Image):
            if _ELSEWHERE.match(image.url):
                place, name = image.span, name_of_picture(image.url)
                is_in_link = any(at.start < place.start and place.end < at.end for at in links)
                new = f"[{'' if image.alt else name}{place.text.removeprefix('![')}"
                edits[place.start] = Edit(place, (image.alt or name) if is_in_link else new)
                leave(link, "picture", _ELSEWHERE_NOTE.format("picture", image.url))
        if not edits:
            break
        text = apply_edits(text, _without_overlaps(edits))
    names = [name for name, _, _ in model.document_anchors(document)]
    headings = {
        block.anchor: re.sub(r"^#+[ \t]*|[ \t]*(?:\{#[^{}]*\}|#+)?\s*$", "", block.span.text)
        for block in model.find_blocks(document, model.Heading)
    }
    anchors = {
        _letters(re.sub("<[^<>]*>", "", words)): name for name, words in reversed(headings.items())
    }
    anchors |= {_letters(name): name for name in reversed(names)} | {name: name for name in names}
    return _Text(document, title, anchors, headings)


def _link_to_picture(
    source: Source, address: Span, link: str, leave: Callable[[str, str, str], None]
) -> dict[int, Edit]:
    """Return the edit that makes a picture or film from another host in HTML a link."""
    start = source.text.rfind("<", 0, address.start)
    element = _MEDIA.match(source.text, start)
    if element is None:
        return {}
    end, tag = element.end(), element[0]
    kind = "recording" if element["name"] else "picture"
    leave(link, "tag of HTML", _ELSEWHERE_NOTE.format(kind, address.text))
    alt = find_group(r"\salt=[\"']([^\"']+)", tag)
    before = source.text[:start].lower()
    is_in_link = before.rfind("<a ") > before.rfind("</a")
    is_named = is_in_link and re.match(r"[^<]*\w", source.text[end:])  # by the words behind it
    words = alt or ("" if is_named else name_of_picture(address.text))
    new = words if is_in_link else f'<a href="{address.text}">{words}</a>'
    span = Span(source, start, end)
    return {start: Edit(_with_line(span), "") if tag.startswith("<source") else Edit(span, new)}


def _with_line(span: Span) -> Span:
    """Return the whole line of what stands alone on it: an empty one would end HTML."""
    text = span.source.text
    start, end = text.rfind("\n", 0, span.start) + 1, text.find("\n", span.end) + 1
    rest = text[start : span.start] + text[span.end : end]
    return span if rest.strip() or not end else Span(span.source, start, end)


def _raw_html(document: model.Document) -> Iterator[model.HtmlBlock | model.RawInline]:
    yield from model.find_blocks(document, model.HtmlBlock)
    yield from model.find_inlines(document, model.RawInline)


def _without_overlaps(edits: Mapping[int, Edit]) -> Iterator[Edit]:
    end = 0
    for start, edit in sorted(edits.items()):
        if start >= end:
            yield edit
            end = edit.span.end


def _letters(anchor: str) -> str:
    """The letters and digits of an anchor, without accents, in lower case; with a mark before."""
    letters = normalize("NFKD", unquote(anchor)).casefold()
    return " " + "".join(letter for letter in letters if letter.isalnum())


def _edit_links(
    link: str, texts: Mapping[str, _Text], resolve_label: Callable[[str, str], str]
) -> Iterator[Edit]:
    for inline in model.find_inlines(texts[link].document, model.Link):
        span, target = inline.target_span, inline.target
        match target:
            case model.LessonTarget() | model.PageTarget():
                kind = "lesson" if isinstance(target, model.LessonTarget) else "page"
                start, anchor = f"{kind}:{target.id}", target.anchor or ""
            case model.UrlTarget(url=url) if url.startswith("#"):
                start, anchor = "", url[1:]
            case model.UrlTarget(url=url) if url == GONE:
                if reference := _REFERENCE.fullmatch(inline.span.text):
                    yield Edit(inline.span, reference[1])
                continue
            case _:
                continue
        text = texts.get(start or link)
        if inline.mention or not span.text.startswith(start):
            continue
        if text is None:
            if anchor:  # of a lesson that is planned
                resolve_label(link, anchor)  # which notes that no text sets it
                yield Edit(span, start)
            continue
        target_anchor = text.anchors.get(anchor) or text.anchors.get(_letters(anchor)) or ""
        if anchor and target_anchor != anchor:
            address = f"{start}#{target_anchor}" if target_anchor else resolve_label(link, anchor)
            owner, _, target_anchor = address.partition("#")
            owner_text = texts.get(owner or link, text)
            if target_anchor in owner_text.anchors:
                text = owner_text
            elif start:  # the text is there
                address, target_anchor = start, ""
            else:
                if reference := _REFERENCE.fullmatch(inline.span.text):
                    words = reference[1] or title_of_file(anchor.rpartition(":")[2])
                    yield Edit(inline.span, words)
                continue
            yield Edit(span, address)
        if inline.span.text.startswith("[]("):
            names = {"fig": "the figure", "tab": "the table", "tbl": "the table"}
            name = names.get(target_anchor.partition("-")[0], "")
            words = text.headings.get(target_anchor) or name
            words = words if words and "](" not in words else text.title
            at = inline.span.start + 1
            if ":" not in target_anchor:  # what is numbered is called by its number
                yield Edit(Span(inline.span.source, at, at), words)


def _break_mentions(document: model.Document) -> Iterator[Edit]:
    """Put an empty comment into what would become a link to a lesson or level.

    Also into the text of a link that has the number of its source, and not the one of the course.
    """
    for link in model.find_inlines(document, model.Link):
        if link.mention:
            at = link.target_span.start
            yield Edit(Span(document.source, at, at), "<!-- -->")
        elif isinstance(link.target, model.LessonTarget):
            name = link.lesson_in_text
            if name not in ("", link.target.id):
                at = link.span.start + link.span.text.index(name)
                yield Edit(Span(document.source, at, at), "<!-- -->")


def _find_common_macros(documents: Iterable[model.Document]) -> dict[str, str]:
    """Return what macros stand for by which all texts mean the same, if any formula uses them.

    One that a text renews means something else elsewhere, and so does a command that has a meaning,
    in a text that uses it and does not define it.
    """
    bodies: dict[str, set[str]] = defaultdict(set)
    used_names, strange_names = set[str](), set[str]()
    for document in documents:
        texts = [formula.tex.text for _, formula in model.find_formulas(document)]
        matches = [match for tex in texts for match in DEFINITION.finditer(tex)]
        for match in matches:
            body = " ".join(match["body"].split())
            count = match["count"] or (match["arguments"] or "0")[-1]
            if match["kind"] == "DeclareMathOperator":
                body = f"\\operatorname{match['star']}{{{body}}}"
            is_whole = f"#{count}" in f"#0{body}" and not match["usual"]
            is_whole &= match["kind"] != "renewcommand"
            bodies[match["name"] or match["own"]] |= {body, body if is_whole else ""}
        commands = _commands(DEFINITION.sub(r"\g<body> ", " ".join(texts)))
        strange_names |= commands - {match["name"] or match["own"] for match in matches}
        used_names |= commands
    names = {n for n in bodies if len(bodies[n]) == 1 and min(bodies[n]) and n in used_names}
    shared_names = sorted(names & strange_names)
    formulas = [Formula(rf"\{name}{{x}}{{x}}", display=False) for name in shared_names]
    for name, result in zip(shared_names, MathEngine().typeset(formulas), strict=True):
        if not (isinstance(result, MathError) and "unknown command" in result.message):
            names.remove(name)
    while carried_names := {n for n in names if _commands(min(bodies[n])) & bodies.keys() - names}:
        names -= carried_names
    return {name: min(bodies[name]) for name in bodies if name in names}


def _commands(tex: str) -> set[str]:
    return {*re.findall(r"\\([A-Za-z]+)", tex)}


def _carry_macros(document: model.Document, common: Mapping[str, str]) -> Iterator[Edit]:
    """Take common macros out, and define others anew in each formula below that uses them."""
    macros: dict[str, str] = {}
    for _, formula in model.find_formulas(document):
        tex, definitions = formula.tex.text, ""
        matches = {match["name"] or match["own"]: match for match in DEFINITION.finditer(tex)}
        for name, definition in reversed(macros.items()):
            if name not in matches and name in _commands(tex + definitions):
                definitions = definition + definitions
        span, text = formula.tex.span(), document.source.text
        if matches and not DEFINITION.sub("", tex).strip():  # they stand in each formula below
            start, end = text.rfind("$", 0, span.start), text.find("$", span.end)
            start -= text[start - 1 : start] == "$"
            yield Edit(Span(document.source, start, end + 1 + (text[end + 1 : end + 2] == "$")), "")
        else:
            places = [formula.tex.span(*m.span()) for n, m in matches.items() if n in common]
            if definitions and span.start not in [place.start for place in places]:
                places.insert(0, Span(document.source, span.start, span.start))
            yield from (Edit(place, "" if at else definitions) for at, place in enumerate(places))
        macros |= {n: m[0].strip() for n, m in matches.items() if n not in common}
