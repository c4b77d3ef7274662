"""Hints: what is only likely a mistake, and changes nothing but what `check --hints` shows.

There are two, and no more:

1. `shown-as-written`: a character of Markdown would be shown where it is almost never meant.
2. `angle-unit`: MJCF holds an angle in degrees where it is read as radians, or the reverse.

A kind of which less than half is worth a look is deleted, not tuned.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Sequence
from operator import itemgetter

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    Feature,
    Rule,
    Span,
    diagnose,
    model,
    regex,
)

# --- shown as written

_OTHER = "\ufffc"
"""Stands for what is no text: code, a formula, an image, an escaped character."""
_ESCAPED = {"\\[": "\ue000", "\\{": "\ue001", "\\<": "\ue002", "&lt;": "\ue002"}
"""Stand for brackets that are escaped, and may be closed by one that need not be."""
_HIDDEN = regex(r"\\[!-/:-@\[-`{-~]|&#?\w+;")
_MARKS = regex(r"(`|\*|_|~|#|\[|\]|\{|\}|<|\||\$|\^|\\)\1*")
_BRACKETS = (
    regex(r"\[([-+\d.,; ]*(?:\[[-+\d.,; ]*\][,; ]*)*)\](?![(\[{])"),  # [[1, 2], [3, 4]]
    regex(  # [0, 1), ]0, 1[, but not what lies between the brackets of a(b, [c])
        r"(?<![\w\])])[\[\](](?=\S)([^\[\](){}\n]{0,99}[,;][^\[\](){}\n]{0,99})(?<=\S)[\])\[](?![\w\[])"
    ),
    regex(  # [sic], [see [1]], \[a]
        r"(?:(?<!!)\[(?![\^(])|\ue000)([^\[\]\ue000]{0,400})\](?![(\[{])"
    ),
    regex(  # {1, 2}, \{a}
        rf"(?:(?<![\w{_OTHER}\])}}{{])\{{(?![%#.:])|\ue001)([^{{}}\ue001]{{0,400}})\}}"
    ),
    regex(r"(?:(?<=\w)<|\ue002)([^<>\ue002]{0,400})>"),  # \<a>; List< [Item](#item)>
)
"""Brackets that belong together, around what they hold."""
_ORDINARY = (
    rf"(?<=[\w{_OTHER})\].%°'′])[*^_~|<>\\]=?(?=[\w{_OTHER}(+\-−.∞])",  # a_1, x*y, 2^8, a|b, A\b
    r"(?<=\w)\*\*(?=\d)|(?<=[A-Za-z\d])\*\*(?=[A-Za-z])",  # x**2, x**y
    r"(?<=[\d)])\*{2,3}(?![*\w])|(?<=\S )\*{2,3}\s*\Z",  # 4**; a sign of a note at the end
    rf"(?<=\w)\*(?![*\w{_OTHER}])|(?<=[{_OTHER})\].!?])\*(?![*\w{_OTHER}])",  # RRT*, find_*
    r"(?<![^\s(\"“„«'‘])(?:[*_^~#<>=\\]|<<|>>|[<>]=|\*\*)(?![^\s).,;:?!\"”“»'’])(?<!\s\*\*)(?<!^\*\*)",
    r"(?<=\S\s)\|{1,2}(?=\s\S)",  # alone
    r"(?<![#\w])#(?=\w)|(?<=[^\W_])#(?!#)|~(?=[\w/.=+−-])(?<!~~)",  # #3, C#, ~20, ~/.config
    r"[A-Z]{0,3}\$(?=[ \u202f]?[-+−]?\d)|(?<=\d)[ \u202f]?\$|[A-Z]{1,3}\$(?!\w)",
    r"\$(?:[A-Z_]{2,}\b|\(\w{2,}\))",  # $HOME, $(pwd); ${name}, whose brackets are round by now
    r"<?[-=~]{1,3}>|<[-=]{1,3}|<3|\^_+\^|[<>]=?(?=[ \u202f]?[-+−.~]?[\d∞])",  # arrows, signs
    r"\b[A-Za-z]:\\|\^(?=[A-Z\d])|\\[a-z](?![a-z])",  # C:\, ^C, \n
    r"(?<!\w)__\w{1,60}__(?!\w)|(?<!\w)_(?=[^\W_])|(?<=[^\W_])_(?!\w)",  # __init__, _x, class_
    r"\|(?=[^|\s]{1,20}⟩)|\|{1,2}\S(?:[^|\n]{0,40}\S)?\|{1,2}|[<>]=(?=\w)",  # |0⟩, |x|, >=a
    rf"<{_OTHER}[^<>\n]{{0,80}}>",  # <link>
)
_PROSE = regex("|".join(_ORDINARY))
"""What texts hold, as far as characters of Markdown are concerned, beside words and numbers."""


def find_mark(text: str) -> re.Match[str] | None:
    """The first mark of a text of one paragraph that is no part of prose."""
    rest = text
    for pair in _BRACKETS * 3:  # brackets in brackets
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
            if cells:  # a bar in a cell is always escaped
                text = text.replace("|", _OTHER)
            mark = find_mark(text) if _MARKS.search(text) else None
            if mark is not None:
                start, end = (_find_place(places, at) for at in (mark.start(), mark.end() - 1))
                span = document.source.span(start, end + 1)
                message = f"`{mark[0]}` would be shown as written"
                help = "close what it begins; or write a backslash before it, or code in backticks"
                yield diagnose("shown-as-written", span, message, help=help)


def _find_place(places: Sequence[tuple[int, int]], at: int) -> int:
    start, place = places[bisect_right(places, at, key=itemgetter(0)) - 1]
    return place + at - start


def _source_text(inlines: Iterable[model.Inline]) -> tuple[str, list[tuple[int, int]]]:
    """The texts of a paragraph as they are written, and where each begins there and in its file."""
    text, places = "", list[tuple[int, int]]()
    for inline in model.walk_inlines(inlines):
        match inline:
            case model.Text():
                places.append((len(text), inline.span.start))
                text += _HIDDEN.sub(
                    lambda m: _ESCAPED.get(m[0], _OTHER) + _OTHER * (len(m[0]) - 1),
                    inline.span.text,
                )
            case model.Emphasis() | model.Strong() | model.Strikethrough() | model.Term():
                pass
            case _:
                is_line_end = isinstance(inline, model.SoftBreak | model.HardBreak)
                places.append((len(text), inline.span.start))
                text += "\n" if is_line_end else _OTHER
    return text, places


# --- degrees or radians

_ANGLES = regex(r"<(joint|body|geom|site|camera|frame)\b([^<>]*)>")
_VALUES = regex(r'\b(range|ref|springref|euler|axisangle)\s*=\s*"([^"]*)"')
_SLIDES = regex(r'\btype\s*=\s*"(?:slide|free)"')
_COMPILER = regex(r'<compiler\b[^<>]*\bangle\s*=\s*"(degree|radian)"')


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
                turns = values[1] in ("euler", "axisangle")
                numbers = values[2].split()[3 if values[1] == "axisangle" else 0 :]
                number = next((n for n in numbers if _is_odd(n, unit)), None)
                is_angle = turns or (element[1] == "joint" and not _SLIDES.search(element[2]))
                if number is None or not is_angle:
                    continue
                start = place.start + values.start(2) + values[2].rindex(number)
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
    decimals = len(number.partition(".")[2])
    if not re.fullmatch(r"[-+]?\d*\.\d{2,}", number):
        return False
    step = math.pi / (12 if decimals > 3 else 2)  # 1.57 and 3.14, but not 0.79
    parts = float(number) / step
    return round(parts) != 0 and abs(parts - round(parts)) * step < max(10.0**-decimals / 2, 1e-4)


FEATURE = Feature(
    name="hints",
    check_document=unread_marks,
    check=odd_angles,
    rules=(Rule("angle-unit", "hint", "An angle has the look of degrees where radians are read."),),
)
