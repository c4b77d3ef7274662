"""Hints: what is only likely a mistake, and changes nothing but what `check --hints` shows.

There are three, and no more:

1. `shown-as-written`: a character of Markdown would be shown where it is almost never meant.
2. `name-near`: a name that stands nowhere else is one slip from one other name of its page.
3. `angle-unit`: MJCF holds an angle in degrees where it is read as radians, or the reverse.

A kind of which less than half is worth a look is deleted, not tuned.
"""

from __future__ import annotations

import builtins
import keyword
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from fnmatch import fnmatchcase

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.features import Feature
from coursebuild.core.model import Course, Document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.near import distance, have_other_ids
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Span
from coursebuild.features.names.claims import names_of
from coursebuild.features.names.known_names import known_keys
from coursebuild.features.names.resolve import resolver_of

# --- shown as written

_OTHER = "\ufffc"
"""Stands for what is no text: code, a formula, an image, an escaped character."""
_HIDDEN = re.compile(r"\\[!-/:-@\[-`{-~]|&#?\w+;")
_MARKS = re.compile(r"(`|\*|_|~|#|\[|\]|\{|\}|<|>|\||\$|\^|\\)\1*")
_BRACKETS = (
    re.compile(r"\[([-+\d.,; ]*(?:\[[-+\d.,; ]*\][,; ]*)*)\](?![(\[{])"),  # [[1, 2], [3, 4]]
    re.compile(r"[\[\](]([^\[\](){}\n]{0,99}[,;][^\[\](){}\n]{0,99})[\])\[]"),  # [0, 1), ]0, 1[
    re.compile(r"(?<!!)\[(?![\^(])([^\[\]\n]{0,400})\](?![(\[{])"),  # [sic], [see [1]]
    re.compile(rf"(?<![\w{_OTHER}\])}}{{])\{{(?![%#.:])([^{{}}\n]{{0,400}})\}}(?!\}})"),  # {1, 2}
)
"""Brackets that belong together, around what they hold."""
_ORDINARY = (
    rf"(?<=[\w{_OTHER})\].%°'′])[*^_~|<>\\]=?(?=[\w{_OTHER}(+\-−.∞])",  # a_1, x*y, 2^8, a|b, A\b
    r"(?<=\w)\*\*(?=\d)|(?<=[\d)])\*{2,3}(?![*\w])",  # x**2, 4**
    rf"(?<=[^\W_])\*(?![*\w{_OTHER}])|(?<=[{_OTHER})\].!?])\*(?![*\w{_OTHER}])",  # RRT*
    r"(?<![^\s(\"“„«'‘])(?:[*_^~#<>=\\]|<<|>>|[<>]=|\*\*)(?![^\s).,;:?!\"”“»'’])(?<!\s\*\*)",
    r"(?<=\S )\|{1,2}(?= \S)",  # alone
    r"(?<![#\w])#(?=\w)|(?<=[^\W_])#(?!#)|~(?=[\w/.+−-])(?<!~~)",  # #3, C#, ~20, ~/.config
    r"[A-Z]{0,3}\$(?=[ \u202f]?[-+−]?\d)|(?<=\d)[ \u202f]?\$|[A-Z]{1,3}\$(?!\w)|\$[A-Z_]{2,}\b",
    r"<?[-=]{1,3}>|<[-=]{1,3}|<3|\^_+\^|[<>]=?(?=[ \u202f]?[-+−.~]?[\d∞])",  # arrows, signs
    r"\b[A-Za-z]:\\|\^(?=[A-Z\d])|\\[a-z](?![a-z])",  # C:\, ^C, \n
    r"(?<!\w)__\w{1,60}__(?!\w)|(?<!\w)_(?=[^\W_])|(?<=[^\W_])_(?!\w)",  # __init__, _x, class_
    r"\|{1,2}\S(?:[^|\n]{0,40}\S)?\|{1,2}|[<>]=(?=\w)",  # |x|, >=a
    rf"<{_OTHER}[^<>\n]{{0,80}}>",  # <link>
)
_PROSE = re.compile("|".join(_ORDINARY))
"""What texts hold, as far as characters of Markdown are concerned, beside words and numbers."""


def find_mark(text: str) -> re.Match[str] | None:
    """The first mark of a text of one paragraph that is no part of prose."""
    rest = text
    for pair in (*_BRACKETS, _BRACKETS[2]):
        rest = pair.sub(r"(\1)", rest)
    rest = _PROSE.sub(lambda match: "x" * len(match[0]), rest)
    return _MARKS.search(rest)


def unread_marks(document: Document) -> Iterator[Diagnostic]:
    """The first mark of each paragraph, heading and cell that would be shown as it is written."""
    for block in model.document_blocks(document):
        cells: tuple[model.Cell, ...] = ()
        if isinstance(block, model.Table):
            cells = tuple(cell for row in (block.header, *block.rows) for cell in row)
        runs = [cell.children for cell in cells] or [model.block_inlines(block)]
        for inlines in runs if not isinstance(block, model.HtmlFlow) else ():
            text, places = _source_text(inlines)
            mark = find_mark(text) if _MARKS.search(text) else None
            if mark is not None:
                span = document.source.span(places[mark.start()], places[mark.end() - 1] + 1)
                message = f"`{mark[0]}` would be shown as written"
                help = "close what it begins; or write a backslash before it, or code in backticks"
                yield diagnose("shown-as-written", span, message, help=help)


def _source_text(inlines: Iterable[model.Inline]) -> tuple[str, list[int]]:
    """The texts of a paragraph as they are written, and where each character stands."""
    text, places = "", list[int]()
    for inline in model.walk_inlines(inlines):
        match inline:
            case model.Text():
                text += _HIDDEN.sub(lambda match: _OTHER * len(match[0]), inline.span.text)
                places += range(inline.span.start, inline.span.end)
            case model.Emphasis() | model.Strong() | model.Strikethrough() | model.Term():
                pass
            case _:
                is_line_end = isinstance(inline, model.SoftBreak | model.HardBreak)
                text += "\n" if is_line_end else _OTHER
                places.append(inline.span.start)
    return text, places


# --- a name one slip from another of its page

_NAME = re.compile(r"([A-Za-z_]\w{3,})(?:\(\))?")


class NamesInCode(Struct, frozen=True):
    """Words of a document that are a piece of inline code each, with their places."""

    names: tuple[str, ...]
    places: tuple[Span, ...]


def _names_in_code(document: Document) -> NamesInCode | None:
    codes = [code for code in model.find_inlines(document, model.CodeSpan) if not code.literal]
    matches = ((_NAME.fullmatch(code.text.strip()), code.span) for code in codes)
    pairs = [(match[1], span) for match, span in matches if match is not None]
    return NamesInCode(*zip(*pairs, strict=True)) if pairs else None


def near_names(course: Course, document: Document) -> Iterator[Diagnostic]:
    """Names in inline code that mean nothing and are one slip from one name of their page."""
    note, codes = names_of(document), (document.summaries or {}).get("hints")
    if note is None or not isinstance(codes, NamesInCode):
        return
    engine, uses = resolver_of(course).engine, Counter(codes.names)
    page_names = {*note.names.words, *(name for name, count in uses.items() if count > 1)}
    for name, span in zip(codes.names, codes.places, strict=True):
        if uses[name] != 1 or name in page_names:
            continue
        if hasattr(builtins, name) or keyword.iskeyword(name) or name in known_keys():
            continue
        if engine is not None and (name in engine.words or name in engine.declared):
            continue
        near = [word for word in page_names if len(word) > 3 and _is_slip(name, word)]
        if len(near) != 1 or any(fnmatchcase(name, pattern) for pattern in course.names):
            continue
        if sum(_count_uses(name, source.text) for source in course.sources) == 1:
            message = f"`{name}` stands nowhere else, and `{near[0]}` is one letter from it"
            help = "write one of them in both places, or say `{code}` after it"
            yield diagnose("name-near", span, message, help=help)


def _count_uses(name: str, text: str) -> int:
    return len(re.findall(rf"\b{name}\b", text)) if name in text else 0


def _is_slip(name: str, word: str) -> bool:
    """Whether a letter differs that is no ending, as of a plural, and no number or index."""
    shorter, longer = sorted((name, word), key=len)
    is_far = len(longer) - len(shorter) > 1 or longer[:-1] == shorter
    return not is_far and distance(name, word) == 1 and not have_other_ids(name, word)


# --- degrees or radians

_ANGLES = re.compile(r"<(joint|body|geom|site|camera|frame)\b([^<>]*)>")
_VALUES = re.compile(r'\b(range|ref|springref|euler)\s*=\s*"([^"]*)"')
_SLIDES = re.compile(r'\btype\s*=\s*"(?:slide|free|ball)"')
_COMPILER = re.compile(r'<compiler\b[^<>]*\bangle\s*=\s*"(degree|radian)"')


def odd_angles(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    """Angles of whole models that have the look of the unit that their compiler does not read."""
    texts = [(m.source.text, m.source.span(0, len(m.source.text))) for m in course.models]
    for document in documents:
        blocks = model.find_blocks(document, model.Mjcf)
        texts += [(b.span.text, b.span) for b in blocks if b.fragment is None]
    for text, place in texts:
        if "<mujoco" not in text or "<include" in text:
            continue  # another file may say the unit
        compiler = _COMPILER.search(text)
        unit = "degree" if compiler is None else compiler[1]
        for element in _ANGLES.finditer(text):
            for values in _VALUES.finditer(text, element.start(2), element.end(2)):
                number = next((n for n in values[2].split() if _is_odd(n, unit)), None)
                of_joint = element[1] == "joint"
                is_angle = not _SLIDES.search(element[2]) if of_joint else values[1] == "euler"
                if number is None or not is_angle:
                    continue
                start = place.start + values.start(2) + values[2].index(number)
                span = Span(place.source, start, start + len(number))
                likely = "radians" if unit == "degree" else "degrees"
                message = f"`{number}` has the look of {likely}, and this model reads {unit}s"
                help = f'write it in {unit}s, or `angle="{likely[:-1]}"` on `<compiler>`'
                yield diagnose("angle-unit", span, message, help=help)
                break


def _is_odd(number: str, unit: str) -> bool:
    """Whether a number is likely no angle in a unit: a multiple of pi/12, or whole degrees."""
    if unit == "radian":
        return re.fullmatch(r"[-+]?\d*[1-9]\d*0|[-+]?\d*[1-9]5", number) is not None
    if not re.fullmatch(r"[-+]?\d*\.\d{4,}", number):
        return False
    parts = float(number) / (math.pi / 12)
    return round(parts) != 0 and abs(parts - round(parts)) < 4e-4


def check(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    """The hints that need more than a document."""
    for document in documents:
        yield from near_names(course, document)
    yield from odd_angles(course, documents)


FEATURE = Feature(
    name="hints",
    needs=("names",),
    summary=lambda document, mathml: Parsed(
        _names_in_code(document), tuple(unread_marks(document))
    ),
    check=check,
    rules=(
        Rule("shown-as-written", "hint", "A character of Markdown would be shown."),
        Rule("name-near", "hint", "A name that is used once is one letter from another."),
        Rule("angle-unit", "hint", "An angle has the look of degrees where radians are read."),
    ),
)
