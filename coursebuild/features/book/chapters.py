"""Lessons from the pages of a site, with other ids and links, and the whole course as page and PDF.

The page contains its style sheet, fonts and pictures; it loads nothing and runs nothing, as its
security policy says.

The PDF is printed from it by a Chromium of the machine, twice: the first PDF says on which page
each lesson begins, the second has these numbers in its contents. Chromium runs without a network,
in a profile of its own. Pictures and fonts are a stranger's, so it keeps its sandbox, which it has
for every user but root. Its note of the time of printing is replaced by one of the same length, for
the same bytes.
"""

from __future__ import annotations

import base64
import functools
import os
import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from html import unescape
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import (
    EffectError,
    ExportContext,
    Lesson,
    OutputFile,
    gate,
    regex,
    temporary_folder,
    urls,
)
from coursebuild.core.files.errors import reason
from coursebuild.core.model import Level
from coursebuild.core.model.lesson_record import shown_versions
from coursebuild.core.pages.frame import citation
from coursebuild.core.pages.html_xml import HtmlContent, HtmlElement, parse_html, to_html
from coursebuild.core.pages.materials import in_language
from coursebuild.core.pages.renderer import direction
from coursebuild.core.text.characters import visible
from coursebuild.features.book import PDF_MARK

_DROPPED_ELEMENTS = frozenset(
    "button form template script style dialog iframe object embed audio video source track"
    " noembed noframes".split()
)
_WITHOUT_MARKUP = frozenset(("plaintext", "xmp"))
"""Elements whose content is text; the first has no end tag, and would swallow the rest."""
_NOT_PRINTED = frozenset(("anchor", "bar-tools", "plot-wide", "figure-dark", "qr"))
"""Classes of elements that are left out: links of headings to themselves, downloads, QR codes, and
the drawings of a plot for large screens or dark pages."""
_KEPT_FOR_SCRIPTS = frozenset(("plot-wide", "figure-dark", "qr"))
"""Those that stay where scripts run, on screens of all kinds and on paper."""
_LEFT_OUT = frozenset("style download loading srcset sizes xmlns usemap autofocus".split())
_ID_ATTRIBUTES = frozenset(
    "aria-activedescendant aria-controls aria-describedby aria-details aria-errormessage"
    " aria-flowto aria-labelledby aria-owns for headers list".split()
)
_ADDRESSES = frozenset(("href", "xlink:href", "src"))
_IN_SVG = regex(r"url\(#([^)]+)\)")


class RewriteRules(Struct, frozen=True):
    """How a lesson is rewritten."""

    place: urls.Place
    address: Callable[[str, str], str]
    """Return the address for a site path and an anchor; empty if the link has no target."""
    picture: Callable[[str], str]
    """Return the address for a picture at a site path; empty if it cannot be shown."""
    id: Callable[[str], str]
    """Return the new id for an old one."""
    heading_shift: int = 0
    closed_classes: frozenset[str] = frozenset()
    """Classes of the folds that stay closed."""
    section: str = ""
    """A suffix for the labels of sections, to tell them from those of other lessons."""
    live: bool = False
    """Whether scripts run there: what they need is kept, and folds stay as they are."""


def rewrite(content: Iterable[HtmlContent], rules: RewriteRules) -> Iterator[HtmlContent]:
    """Yield the content of a lesson's page, rewritten."""
    dropped_classes = _NOT_PRINTED - _KEPT_FOR_SCRIPTS if rules.live else _NOT_PRINTED
    for child in content:
        if isinstance(child, str):
            yield child
            continue
        name, old_attributes = child.name, child.attributes
        if name in _DROPPED_ELEMENTS or child.classes & dropped_classes:
            continue
        if name == "img":
            path, _ = rules.place.target(old_attributes.get("src", ""))
            address = rules.picture(path) if path is not None else ""
            if not address:
                yield old_attributes.get("alt", "")
                continue
            old_attributes = old_attributes | {"src": address}
        attributes = {
            key: new_value
            for key, value in old_attributes.items()
            if (new_value := _rewrite_attribute(child, key, value, rules)) is not None
        }
        if name == "details" and not rules.live and not child.classes & rules.closed_classes:
            attributes["open"] = ""
        if name in _WITHOUT_MARKUP:
            name = "pre"
        if len(name) == 2 and name[0] == "h" and name[1] in "123456":
            name = f"h{min(int(name[1]) + rules.heading_shift, 6)}"
        yield HtmlElement(name, attributes, list(rewrite(child.children, rules)))


def _rewrite_attribute(
    element: HtmlElement, name: str, value: str, rules: RewriteRules
) -> str | None:
    if name in _LEFT_OUT or name.startswith("on"):
        return None
    is_hidden_code = name == "hidden" and value == "until-found"
    if name == "tabindex" or name.startswith("data-") or is_hidden_code:
        return value if rules.live else None
    if name == "id" or (name == "name" and element.name == "a"):
        return rules.id(value)
    if name in _ID_ATTRIBUTES:
        return " ".join(map(rules.id, value.split()))
    if name == "aria-label" and element.name == "section" and rules.section:
        return f"{value}, {rules.section}"
    if name == "src" and element.name == "img":
        return value
    if name in _ADDRESSES:
        if element.name == "image":  # inside a drawing, and not part of the lesson
            return None
        if value.startswith("#"):
            return f"#{urls.quote_anchor(rules.id(unquote(value[1:])))}" if len(value) > 1 else "#"
        path, anchor = rules.place.target(value)
        return value if path is None else rules.address(path, anchor) or None
    if "url(#" in value:
        return _IN_SVG.sub(lambda match: f"url(#{rules.id(match[1])})", value)
    return value


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
    words, runs = context.library.words, context.library.results.runs
    versions = shown_versions(run.provenance for run in runs)
    sentences = [words("exports.lessons", n=len(context.course.written_lessons))]
    sentences += [words("site.verified", versions=words.join(versions))] if versions else []
    return " ".join(f"{sentence}." for sentence in sentences)


def render_lesson(
    context: ExportContext,
    lesson: Lesson,
    rules: RewriteRules,
    write: Callable[[list[HtmlContent]], str],
    top: str,
) -> Markup:
    """Render a lesson for use elsewhere; `write` writes its tree, `top` is its own id there."""
    language = context.course.language_of(lesson)
    return in_language(context.library, language).render(
        "book/lesson.html",
        lesson=lesson,
        language=language,
        direction=direction(language),
        is_foreign=language != context.course.language,
        draft=lesson.status == "draft",
        article=Markup(write(list(rewrite(lesson_text(context, rules.place.path), rules)))),
        top=top,
        heading=1 + rules.heading_shift,
    )


def lesson_text(context: ExportContext, path: str) -> list[HtmlContent]:
    """Return the text of a lesson, from its page."""
    page = context.site()[path].make().decode()
    return parse_html(page.partition(_TEXT_START)[2].rpartition(_TEXT_END)[0])


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


_HEADING_SHIFT = 2
"""Levels that headings move down: the course is the first heading, its levels are the second."""
_ANSWERS = frozenset(("answer", "hint"))
_FOLDS = _ANSWERS | {"callout", "further-text", "lab-note"}
"""With what authors fold, where the map says that it stays folded."""
_TYPES = {**PICTURES, "avif": "image/avif", "woff2": "font/woff2"}


def page_file(context: ExportContext, *, page_numbers: bool = False) -> tuple[OutputFile]:
    """Return the page."""
    course = context.course
    ids = {urls.lesson_path(lesson): lesson.id for lesson in course.written_lessons}
    picture = functools.cache(functools.partial(data_address, context))

    def address(path: str, anchor: str) -> str:
        if path in ids:
            return f"#{urls.quote_anchor(_anchor(ids[path], anchor))}"
        return site_address(context, path, anchor)

    def text(lesson: Lesson) -> Markup:
        rules = RewriteRules(
            urls.Place(urls.lesson_path(lesson)),
            address,
            picture,
            functools.partial(_anchor, lesson.id),
            heading_shift=_HEADING_SHIFT,
            closed_classes=_ANSWERS if course.folds == "open" else _FOLDS,
            section=lesson.id,
        )
        return render_lesson(context, lesson, rules, to_html, _anchor(lesson.id))

    def level_anchor(level: Level) -> str:
        return _anchor("level", level.id)

    language = course.language or "en"
    html = context.library.render(
        "book/page.html",
        language=language,
        direction=direction(language),
        style=Markup(embed_fonts(context)),
        head_title=context.library.words("exports.book_title", title=course.title),
        title=course.title,
        summary=course.summary,
        facts=summary_line(context),
        licence=course.licence,
        authors=course.authors,
        citation=citation(course, context.library.words, course.base_url),
        levels=course.written_levels,
        level_anchor=level_anchor,
        lesson_anchor=lambda lesson: _anchor(lesson.id),
        quoted=urls.quote_anchor,
        page_numbers=page_numbers,
        text=text,
    )
    return (OutputFile("course.html", visible(html).encode()),)


def _anchor(lesson: str, id: str = "_top") -> str:
    """Return the id on this page for an id in a lesson, or for the lesson.

    It does not begin with a digit, since in a drawing it must be a name of XML.
    """
    return f"_{lesson}--{id or '_top'}"


def embed_fonts(context: ExportContext) -> str:
    """Return the style sheet with its fonts, and without `</`, which could end the element."""
    path = style_path(context)
    folder = posixpath.dirname(path)

    def embed(match: re.Match[str]) -> str:
        return f'url("{data_address(context, posixpath.join(folder, match[1]))}")'

    text = context.site()[path].make().decode()
    return re.sub(r'url\("([^"():]+)"\)', embed, text).replace("</", "<\\/")


def data_address(context: ExportContext, path: str) -> str:
    """Return a file as a `data:` address; empty if it cannot be shown."""
    kind, file = _TYPES.get(extension(path)), context.site().get(path)
    if kind is None or file is None:
        return ""
    return f"data:{kind};base64,{base64.b64encode(file.make()).decode()}"


# --- the page as a PDF

_BROWSER_PATH = "CHROME_PATH"
"""The variable of the environment that names another Chromium."""
_BROWSERS = """
    chromium chromium-browser google-chrome google-chrome-stable chrome chromium-headless-shell
    headless_shell microsoft-edge
""".split()
_MAC_BROWSER = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
_BROWSER_OPTIONS = (
    *("--headless", "--disable-gpu", "--no-first-run", "--no-default-browser-check"),
    *("--disable-background-networking", "--disable-component-update", "--disable-extensions"),
    *("--disable-sync", "--disable-dev-shm-usage", "--host-resolver-rules=MAP * ~NOTFOUND"),
    *("--no-pdf-header-footer", "--generate-pdf-document-outline", "--export-tagged-pdf"),
)
_SECONDS = 600
"""How long printing may take."""
_ENTRY = regex(r'(<span class="book-page" data-at="([^"]*)">)(</span>)')
_TIMES = regex(rb"/CreationDate \([^()]*\)\s*/ModDate \([^()]*\)")
_NODE = regex(rb"\(node\d{8}\)")
_DESTINATION = regex(rb"/([^\s/\[\]()<>]+) \[(\d+) 0 R /XYZ")
_OBJECT = regex(rb"(?:^|\n)(\d+) 0 obj\n(<<.*?)\nendobj", re.DOTALL)
_KIDS = regex(rb"/Kids \[([^\]]*)\]")
_ROOT = regex(rb"/Type /Catalog\s+/Pages (\d+) 0 R")


def pdf_file(context: ExportContext) -> tuple[OutputFile]:
    """Return the PDF.

    Raises:
        EffectError: there is no Chromium, or it does not print.
    """
    choice = os.environ.get(_BROWSER_PATH, "")
    candidates = [choice] if choice else [*_BROWSERS, _MAC_BROWSER]
    program = next(filter(None, map(gate.find_program, candidates)), None)
    if program is None:
        message = f"`{choice}`, which {_BROWSER_PATH} names, is not a program" if choice else ""
        raise EffectError(
            message or "`export pdf` prints with Chromium, and there is none on this machine",
            help=f"install Chromium or Chrome, or name one in the variable {_BROWSER_PATH}; or "
            "print the page of `coursebuild export page` in any browser",
        )
    (page,) = page_file(context, page_numbers=True)
    html = page.data.decode()
    with temporary_folder() as folder:
        first = _print(program, Path(folder), _with_numbers(html, {}))
        # The pages on which it has the targets of links.
        objects = {int(number): text for number, text in _OBJECT.findall(first)}
        root = _ROOT.search(first)
        nodes = () if root is None else _pages(objects, int(root[1]))
        pages = {node: number for number, node in enumerate(nodes, 1)}
        page_numbers = {
            unquote_to_bytes(name.replace(b"#", b"%")).decode(errors="replace"): pages[int(node)]
            for name, node in _DESTINATION.findall(first)
            if int(node) in pages
        }
        data = _print(program, Path(folder), _with_numbers(html, page_numbers))
    times = _TIMES.search(data, 0, 4096)
    if times is not None:
        note = f"{PDF_MARK})".encode().ljust(len(times[0]))
        data = data[: times.start()] + note + data[times.end() :]
    # Chromium's numbers of nodes depend on what it did before; their order, its key, stays.
    numbers = {node: number for number, node in enumerate(sorted(set(_NODE.findall(data))))}
    data = _NODE.sub(lambda match: b"(node%08d)" % numbers[match[0]], data)
    return (OutputFile("course.pdf", data),)


def _print(program: str, folder: Path, html: str) -> bytes:
    page, pdf = folder / "course.html", folder / "course.pdf"
    page.write_text(html, encoding="utf-8")
    pdf.unlink(missing_ok=True)
    options = [*_BROWSER_OPTIONS, f"--user-data-dir={folder / 'profile'}", f"--print-to-pdf={pdf}"]
    if os.geteuid() == 0:  # Chromium refuses to start otherwise
        options.append("--no-sandbox")
    variables = gate.environment(HOME=str(folder), TMPDIR=str(folder), TZ="UTC")
    try:
        printing = gate.finish([program, *options, page.as_uri()], variables, seconds=_SECONDS)
    except TimeoutError:
        raise EffectError(
            f"{program} has not printed the course in {_SECONDS} s",
            help="print the page of `coursebuild export page` in parts",
        ) from None
    except OSError as error:
        raise EffectError(f"{program} cannot be started: {reason(error)}") from None
    data = pdf.read_bytes() if pdf.is_file() else b""
    if not data.startswith(b"%PDF-"):
        cause = printing.last_line()[:300] or f"its status is {printing.status}"
        raise EffectError(
            f"{program} did not print the course: {cause}",
            help="where its sandbox cannot start, as in some containers, print the page of "
            "`coursebuild export page` elsewhere",
        )
    return data


def _with_numbers(html: str, numbers: Mapping[str, int]) -> str:
    """The page with numbers in its contents; three digits stand for those not known yet."""
    return _ENTRY.sub(
        lambda entry: f"{entry[1]}{numbers.get(unescape(entry[2]), '000')}{entry[3]}", html
    )


def _pages(objects: Mapping[int, bytes], number: int, depth: int = 0) -> Iterator[int]:
    kids = _KIDS.search(objects.get(number, b""))
    if kids is None or depth > 50:
        yield number
        return
    for kid in re.findall(rb"(\d+) 0 R", kids[1]):
        yield from _pages(objects, int(kid), depth + 1)
