"""Formats citations and references by a style in CSL, with `citeproc`.

The course's own style is `content/references.csl`; otherwise it is `style.csl`, author and year.
Marks of the style, such as italics, are private characters until all text is escaped. `citeproc`
gives no letters to works of one author and year; they get them here (1758a, 1758b).
"""

from __future__ import annotations

import functools
import io
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.api import Source, regex
from coursebuild.features.references.bibtex import Work, read_works

_STYLE = Path(__file__).with_name("style.csl")
_KINDS = {
    "article": "article-journal",
    "book": "book",
    "booklet": "pamphlet",
    "conference": "paper-conference",
    "dataset": "dataset",
    "electronic": "webpage",
    "inbook": "chapter",
    "incollection": "chapter",
    "inproceedings": "paper-conference",
    "manual": "report",
    "mastersthesis": "thesis",
    "misc": "article",
    "online": "webpage",
    "phdthesis": "thesis",
    "proceedings": "book",
    "software": "webpage",
    "techreport": "report",
    "thesis": "thesis",
    "webpage": "webpage",
}
"""Types of CSL by those of BibTeX."""
_FIELDS = {
    "title": ("title",),
    "container-title": ("journal", "journaltitle", "booktitle", "howpublished"),
    "collection-title": ("series",),
    "volume": ("volume",),
    "issue": ("number", "issue"),
    "page": ("pages",),
    "edition": ("edition",),
    "publisher": ("publisher", "school", "institution", "organization"),
    "publisher-place": ("address", "location"),
    "note": ("note",),
    "DOI": ("doi",),
    "ISBN": ("isbn",),
    "URL": ("url",),
}
"""Variables of CSL, with the fields of BibTeX that they come from."""
_MONTHS = "jan feb mar apr may jun jul aug sep oct nov dec".split()
_LOCATORS = {
    "page": "p. pp. page pages s. pág. págs. ص",
    "chapter": "ch. chs. chap. chapter kap. cap. chapitre الفصل",
    "section": "sec. secs. section § §§ abschn. secc. القسم",
    "figure": "fig. figs. figure abb. الشكل",
    "volume": "vol. vols. volume bd. المجلد",
}
"""Words that may begin what is named within a work, by the label of CSL."""
_ORDINAL = regex(r"(\d+)(?:st|nd|rd|th|\.)?")
_MARKS = {
    "Italic": "i",
    "Oblique": "i",
    "Bold": "b",
    "Light": "",
    "Underline": "u",
    "Superscript": "sup",
    "Subscript": "sub",
    "SmallCaps": "",
}
_CSL = "{http://purl.org/net/xbiblio/csl}"
_MAX_CALLS = 10_000
"""How often the macros of a style may call others: the largest styles do so some hundred times."""
_FIRST = 0xE100
"""The private character that opens the first of these marks; the next one closes it."""


class _Formatter:
    """What `citeproc` calls for marks and text."""

    def __getattr__(self, name: str) -> Any:
        if name not in _MARKS:
            raise AttributeError(name)
        start = _FIRST + 2 * list(_MARKS).index(name)
        return lambda text: f"{chr(start)}{text}{chr(start + 1)}"

    def preformat(self, text: object) -> str:
        return str(text)


def _finish(text: object) -> Markup:
    html = str(escape(str(text)))
    for number, tag in enumerate(_MARKS.values()):
        start, end = chr(_FIRST + 2 * number), chr(_FIRST + 2 * number + 1)
        html = html.replace(start, f"<{tag}>" if tag else "")
        html = html.replace(end, f"</{tag}>" if tag else "")
    return Markup(re.sub(r"([.!?])\.(?=$|\s)", r"\1", html))


class FormattedWorks(Struct, frozen=True):
    """The works of a course that its texts cite, in the order of the style."""

    entries: Mapping[str, Markup]
    mark: Any
    """Returns the text of a citation, given a key, and what is named within the work."""
    prefix: str
    """Before the first text of several ones; after the last one, and between them."""
    suffix: str
    delimiter: str


class StyleFailure(Exception):  # noqa: N818
    """The course's own style cannot be used."""


@functools.lru_cache(maxsize=4)
def format_works(
    source: Source, style_source: Source | None, language: str, keys: tuple[str, ...]
) -> FormattedWorks:
    """Format the works with these keys, in the order in which the course cites them.

    Raises:
        StyleFailure: `style_source` is no style.
    """
    works = {work.key: work for work in read_works(source).value}
    cited_works = [works[key] for key in dict.fromkeys(keys) if key in works]
    try:
        if style_source is not None:
            _check_size(style_source.text)
        formatted = _format(cited_works, style_source, language, {})
        labels = [str(formatted.mark(work.key, "")) for work in cited_works]
        for label in _LOCATORS:  # so that a style which cannot name places is not used
            for work in cited_works[:1]:
                formatted.mark(work.key, f"{label} 1")
        counts, given_counts = Counter(labels), Counter[str]()
        suffixes: dict[str, str] = {}
        order = [*formatted.entries]
        for work in sorted(cited_works, key=lambda work: order.index(work.key)):
            label = str(formatted.mark(work.key, ""))
            if counts[label] > 1 and given_counts[label] < 26:
                suffixes[work.key] = "abcdefghijklmnopqrstuvwxyz"[given_counts[label]]
                given_counts[label] += 1
        return _format(cited_works, style_source, language, suffixes) if suffixes else formatted
    except Exception as error:
        if style_source is None:
            raise
        raise StyleFailure(" ".join(f"{error}".split())[:200] or type(error).__name__) from error


def _check_size(style: str) -> None:
    """Refuse a style whose macros stand for so much that no work would ever be formatted."""
    root = ElementTree.fromstring(style)
    calls: dict[str | None, list[str]] = {None: []}
    for part in root.iter():
        if part.tag == f"{_CSL}macro":
            calls[part.get("name")] = [e.get("macro", "") for e in part.iter() if e.get("macro")]
    calls[None] = [e.get("macro", "") for e in root.iter() if e.get("macro")]

    @functools.cache
    def size(name: str | None) -> int:
        return 1 + sum(size(called) for called in calls.get(name, ()))

    if size(None) > _MAX_CALLS:  # where macros call themselves, it is Python that refuses
        raise StyleFailure(f"its macros call others more than {_MAX_CALLS:,} times")


def _format(
    works: Iterable[Work],
    style_source: Source | None,
    language: str,
    suffixes: Mapping[str, str],
) -> FormattedWorks:
    from citeproc import Citation, CitationItem, CitationStylesBibliography, Locator
    from citeproc.frontend import CitationStylesStyle
    from citeproc.source.json import CiteProcJSON

    works = tuple(works)
    ids = {work.key: f"w{number}" for number, work in enumerate(works)}
    keys = {id: key for key, id in ids.items()}
    data = [_variables(work, ids[work.key], suffixes.get(work.key, "")) for work in works]
    text = _STYLE.read_bytes() if style_source is None else style_source.text.encode()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        style = CitationStylesStyle(io.BytesIO(text), locale=_locale(language), validate=False)
        bibliography = CitationStylesBibliography(style, CiteProcJSON(data), _Formatter())
        for work in works:
            bibliography.register(Citation([CitationItem(ids[work.key])]))
        bibliography.sort()
        references = zip(bibliography.keys, bibliography.bibliography(), strict=True)
        entries = {keys[id]: _finish(text) for id, text in references}
    layout = style.root.citation.layout

    def mark(key: str, place: str) -> Markup:
        label, identifier = _split_locator(place)
        options = {"locator": Locator(label, identifier)} if identifier else {}
        citation = Citation([CitationItem(ids[key], **options)])
        citation.bibliography = bibliography
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            text = str(bibliography.cite(citation, lambda item: None))
        text = text.removeprefix(layout.get("prefix", "")).removesuffix(layout.get("suffix", ""))
        return _finish(text + (f", {place}" if place and not identifier else ""))

    prefix, suffix = layout.get("prefix", ""), layout.get("suffix", "")
    return FormattedWorks(entries, mark, prefix, suffix, layout.get("delimiter", "; "))


def _locale(language: str) -> str:
    """The name of `citeproc`'s terms for a language; English ones where it has none."""
    import citeproc

    folder = Path(citeproc.LOCALES_PATH)
    usual = {"en": "en-US", "pt": "pt-BR", "zh": "zh-CN"}
    names = [language, usual.get(language, ""), f"{language}-{language.upper()}"]
    names += sorted(
        path.stem.removeprefix("locales-") for path in folder.glob(f"locales-{language[:2]}*")
    )
    return next((name for name in names if (folder / f"locales-{name}.xml").is_file()), "en-US")


def _split_locator(text: str) -> tuple[str, str]:
    """The label and the number of what is named within a work; no number for other words."""
    word, _, rest = text.strip().partition(" ")
    for label, words in _LOCATORS.items():
        if word.lower() in words.split() and rest.strip():
            return label, rest.strip()
    return (
        ("page", text.strip())
        if re.fullmatch(r"[\divxlc]+(?:[-–]\d+)?", text.strip())
        else ("", "")
    )


def _variables(work: Work, id: str, suffix: str) -> dict[str, Any]:
    values: dict[str, Any] = {"id": id, "type": _KINDS.get(work.kind, "article")}
    for name, fields in _FIELDS.items():
        if value := work.field(*fields):
            values[name] = value
    if ordinal := _ORDINAL.fullmatch(values.get("edition", "")):
        values["edition"] = ordinal[1]
    for role, people in work.people:
        values[role] = [
            {"family": name.family}
            | ({"given": name.given} if name.given else {})
            | ({"non-dropping-particle": name.particle} if name.particle else {})
            | ({"suffix": name.suffix} if name.suffix else {})
            if name.given or name.particle
            else {"literal": name.family}
            for name in people
        ]
    date = re.match(r"(\d{1,4})(?:-(\d\d))?", work.field("date", "year"))
    if date is not None:
        month = work.field("month").lower()[:3]
        number = int(date[2] or 0) or (_MONTHS.index(month) + 1 if month in _MONTHS else 0)
        values["issued"] = {"date-parts": [[int(date[1]), *([number] if number else [])]]}
    if suffix:
        values["year-suffix"] = suffix
    return values
