"""Records of drawn pages, and the files that all pages refer to: fonts, styles, scripts, icons.

Inline styles become classes of the style sheet, since the Content-Security-Policy forbids them.
Formulas have some (the padding of a matrix's columns), and so may an author's HTML; each distinct
declaration gets a class named after a hash.

The fonts are cut down to the characters that the pages use, and the style sheet holds the fonts'
names and the styles taken out of single elements. A changed page therefore changes these files only
if it is the first or the last one with some character or style.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Callable, Iterable, Iterator
from html import escape, unescape

from msgspec import Struct

from coursebuild.core.drawing.picture_size import picture_size
from coursebuild.core.model.course import Theme, ThemeFile
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import typography
from coursebuild.core.pages.assets import SCRIPTS, Assets, Names, hashed_name, page_script
from coursebuild.core.pages.context import PageContext, PageHead, PageRecord
from coursebuild.core.pages.frame import FRAME_IDS, LOGO_HEIGHT, parts_of, script_words
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.references import (
    ids_and_addresses,
    merge_line_ids,
    references,
)
from coursebuild.core.pages.theme import (
    BASE,
    FontJob,
    face_rules,
    font_jobs,
    fonts_at_once,
    read_faces,
    theme_faces,
    theme_style,
)
from coursebuild.core.pages.typography import FORMULA
from coursebuild.core.registry import features
from coursebuild.core.text.characters import visible
from coursebuild.core.text.regex import regex


class PageFacts(Struct, frozen=True):
    """What the shared files depend on in a page."""

    text: frozenset[str]
    """Characters of its text, without those that every font has."""
    mathematics: frozenset[str]
    """Characters of its formulas outside ASCII; and a blank if it has a formula."""
    declarations: frozenset[str]
    parts: frozenset[str]


def record(
    head: PageHead, body: str, base_url: str, page: PageContext | None = None
) -> tuple[PageRecord, str]:
    """The record of a page just drawn, with its document if any, and its body as published."""
    # A plain string, since `Markup` would escape what is inserted.
    html, declarations = hoist_styles(typography.glue_formulas(str(body)))
    text, mathematics = page_characters(html)
    html = visible(html)
    ids, addresses, repeated_ids = ids_and_addresses(html)
    repeated_ids |= ids & FRAME_IDS
    places: dict[str, tuple[int, int]] = {}
    if page is not None:
        spans = ((name, page.find_repetition(name)) for name in repeated_ids)
        places = {name: (span.start, span.end) for name, span in spans}
    page_record = PageRecord(
        kind=head.kind,
        title=head.title,
        indexed=head.indexed,
        text="".join(sorted(text.union(head.title) - BASE)),
        mathematics="".join(sorted(mathematics)),
        declarations=tuple(sorted(declarations)),
        ids=tuple(sorted(merge_line_ids(ids))),
        references=tuple(sorted(references(head.path, addresses, base_url))),
        repeated_ids=tuple((name, *places.get(name, (0, 0))) for name in sorted(repeated_ids)),
        parts=parts_of(html, head.kind),
    )
    return page_record, html


# --- inline styles

_INSIDE = r"""(?>(?:[^"'>]++|"[^"]*+(?:"|\Z)|'[^']*+(?:'|\Z))*)"""
_PIECE = regex(
    r"<!--.*?(?:-->|\Z)"
    rf"|<(?P<raw>script|style|textarea|title)\b{_INSIDE}(?:\Z|(?<!/)>.*?(?:</(?P=raw)\s*>|\Z))"
    rf"|<(?P<tag>[a-zA-Z]{_INSIDE})(?:>|\Z)",
    re.DOTALL | re.IGNORECASE,
)
"""A comment, an element of raw text, or a tag, so that only real attributes are found. What never
ends takes the rest of the page, as in browsers."""

_ATTRIBUTE = regex(r"""\s+([^\s"'>/=]+)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?""")


def hoist_styles(html: str) -> tuple[str, frozenset[str]]:
    """Replace `style` attributes by classes; return the page and the declarations.

    Most pages have some in their formulas only, and then nothing else is looked at.
    """
    parts = FORMULA.split(html)
    if "style" in "".join(parts[::2]).lower():
        return _hoist_all.__wrapped__(html)
    declarations: set[str] = set()
    for at in range(1, len(parts), 2):
        if "style" in parts[at].lower():
            parts[at], formula_declarations = _hoist_all(parts[at])
            declarations |= formula_declarations
    return "".join(parts), frozenset(declarations)


@functools.lru_cache(maxsize=2048)
def _hoist_all(html: str) -> tuple[str, frozenset[str]]:
    """The same, wherever they stand; kept for formulas, which pages repeat."""
    declarations: set[str] = set()

    def replace(piece: re.Match[str]) -> str:
        if not piece["tag"] or "style" not in piece["tag"].lower():  # as most
            return piece[0]
        tag, declaration = _without_style(piece["tag"])
        if declaration:
            declarations.add(declaration)
        return tag

    return _PIECE.sub(replace, html), frozenset(declarations)


@functools.lru_cache(maxsize=4096)
def _without_style(tag: str) -> tuple[str, str]:
    """A tag, given its inside, with a class instead of its style; and the style, if any."""
    names = {name.lower(): value for name, value in _ATTRIBUTE.findall(tag)}
    if "style" not in names:
        return f"<{tag}>", ""
    text = " ".join(unescape(names["style"].strip("\"'")).split()).strip("; ")
    quotes = text.count('"') % 2 or text.count("'") % 2
    declaration = "" if quotes or re.search(r"[{}<\\]|/\*", text) else text
    classes = [unescape(names.get("class", "").strip("\"'"))]
    if declaration:
        classes.append(class_name(declaration))
    value = escape(" ".join(filter(None, classes)))
    texts = iter([f' class="{value}"'] if value else [])  # in the place of the first of the two

    def replace(match: re.Match[str]) -> str:
        return next(texts, "") if match[1].lower() in ("style", "class") else match[0]

    return f"<{_ATTRIBUTE.sub(replace, tag)}>", declaration


def class_name(declaration: str) -> str:
    """The name of the class of a declaration."""
    return "s" + hashlib.sha256(declaration.encode()).hexdigest()[:7]


def style_rules(declarations: Iterable[str]) -> str:
    """The rules of the classes, sorted."""
    rules = sorted(f".{class_name(text)}{{{text}}}\n" for text in set(declarations))
    return "".join(rules)


# --- characters

_TEXT = regex(">([^<]+)")
_FOREIGN = regex(r"[^\x00-\x7f]")


def page_characters(html: str) -> tuple[frozenset[str], frozenset[str]]:
    """The characters outside ASCII of a page's text and of its formulas; see `PageFacts`."""
    parts = FORMULA.split(html)
    formulas = _characters("\n".join(parts[1::2]))
    return _characters("\n".join(parts[::2])), formulas.union(" " if len(parts) > 1 else "")


def _characters(html: str) -> frozenset[str]:
    """The characters outside ASCII of the text of HTML."""
    html = ">" + html
    texts = _TEXT.findall(html)
    texts.append(html.rpartition(">")[2])  # with a tag that nothing ends
    return frozenset(_FOREIGN.findall(unescape("\n".join(texts))))


# --- the files that every page refers to


def common_characters(library: Library, parts: frozenset[str]) -> frozenset[str]:
    """The characters that frames may show, and the scripts of pages with these parts."""
    course, texts = library.course, library.words.texts
    titles = (course.title, course.licence, *(page.title for page in course.pages))
    own_texts = (text for key, text in texts.items() if key.startswith(("site.", "search.")))
    script_texts = (texts[key] for key in script_words(texts, parts))
    return frozenset().union(*titles, *own_texts, *script_texts)


def common_files(
    assets: Assets,
    cut_font: Callable[[FontJob], bytes] | None,
    facts: PageFacts,
    theme: Theme,
) -> tuple[tuple[SiteFile, ...], Names]:
    """The files for pages with these facts, merged, and their names; fonts whole if not cut."""
    shared = _SharedFiles(assets)
    faces = read_faces(assets.file("fonts/fonts.json"))
    fonts_with_data = ((face, assets.file(f"fonts/{face.file}")) for face in faces)
    text, mathematics = "".join(sorted(facts.text)), "".join(sorted(facts.mathematics))
    jobs = font_jobs(fonts_with_data, text, mathematics, theme_faces(theme))
    cut_fonts = [(job, shared.add_font(job, cut_font)) for job in jobs]
    rules = face_rules((job, name.removeprefix("assets/")) for job, name in cut_fonts)
    style = style_rules(facts.declarations) + "".join(f.style for f in features())
    style += theme_style(theme)
    part_scripts = tuple(shared.add_part_scripts(facts.parts))
    icon, touch_icon = shared.add_icons(theme)
    sheet = rules.encode() + assets.file("css/site.css") + style.encode()
    logo = theme.logo or theme.logo_dark
    size = picture_size(logo.data) if logo is not None else None
    licences = [
        (path.removeprefix("licences/").removesuffix(".txt"), data.decode())
        for path, data in assets.files("licences")
    ]
    for family in theme.fonts:
        files = (file.path.rpartition("/")[2] for file in family.files)
        licences.append((", ".join(files), family.licence.text))
    parts = [f"{name}\n{'=' * len(name)}\n\n{text.strip()}\n" for name, text in licences]
    names = Names(
        style=shared.add("site.css", sheet),
        theme_script=shared.add_script("theme.js"),
        script=shared.add_script("site.js"),
        icon=icon,
        credits=shared.add("licences.txt", "\n\n".join(parts).encode()),
        touch_icon=touch_icon,
        scripts=part_scripts,
        fonts=fonts_at_once(cut_fonts),
        logo=shared.add_picture("logo", theme.logo),
        logo_dark=shared.add_picture("logo-dark", theme.logo_dark),
        logo_width=round(LOGO_HEIGHT * size[0] / size[1]) if size else 0,
    )
    return tuple(shared.files), names


class _SharedFiles:
    """Collects files for all pages; each method returns the site path of what it adds."""

    def __init__(self, assets: Assets) -> None:
        self._assets = assets
        self._script_names: dict[str, str] = {}
        self.files: list[SiteFile] = []

    def add(self, path: str, data: bytes) -> str:
        name = hashed_name(f"assets/{path}", data)
        self.files.append(OutputFile(name, data))
        return name

    def add_script(self, name: str) -> str:
        """Add a bundled script, once."""
        if name not in self._script_names:
            code = self._assets.file(SCRIPTS.get(name, f"js/{name}"))
            self._script_names[name] = self.add(name, page_script(code))
        return self._script_names[name]

    def add_part_scripts(self, marks: frozenset[str]) -> Iterator[tuple[str, str]]:
        """Add the scripts of the parts that pages have, each after the mark of the part."""
        for feature in features():
            for part in feature.parts:
                if part.mark not in marks:
                    continue
                if part.bundled:
                    yield part.mark, self.add_script(part.bundled)
                elif part.code:
                    yield part.mark, self.add(f"{feature.name}.js", page_script(part.code.encode()))

    def add_font(self, job: FontJob, cut_font: Callable[[FontJob], bytes] | None) -> str:
        stem, _, ending = job.face.file.rpartition(".")
        if cut_font is None:
            ending = "woff2" if job.data.startswith(b"wOF2") else ending
            return self.add(f"fonts/{stem}.{ending}", job.data)
        # The name comes from the input, so that it can be cut while pages are written.
        key = job.key
        name = f"assets/fonts/{stem}.{key[:8]}.woff2"
        self.files.append(CachedFile(name, key, functools.partial(cut_font, job)))
        return name

    def add_picture(self, name: str, file: ThemeFile | None) -> str:
        return "" if file is None else self.add(f"{name}.{file.ending}", file.data)

    def add_icons(self, theme: Theme) -> tuple[str, str]:
        """Add the icon and the one for touch screens: those of the course, if it has any."""
        if theme.icon is None and theme.touch_icon is None:
            return (
                self.add("icon.svg", self._assets.template("icon.svg").encode()),
                self.add("icon-touch.png", self._assets.file("icons/icon-touch.png")),
            )
        return (
            self.add_picture("icon", theme.icon or theme.touch_icon),
            self.add_picture("icon-touch", theme.touch_icon),
        )
