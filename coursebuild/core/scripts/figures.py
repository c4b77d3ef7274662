"""Figures as they are recorded, and how they differ from what a script drew now.

Entry points: `figure_findings`; `prepare_figure`, what is recorded of a figure;
`describe_difference`.

1. Dates, comments and ids, which change from run to run, are taken out of a drawing in SVG, so that
   the same drawing gives the same bytes.
2. Two drawings in SVG are the same where elements, attributes and texts are, and numbers differ by
   less than a thousandth of the drawing's size. Two in PNG are the same where the root mean square
   of what pixels differ by is below one of 255 steps.
3. Data in CSV are the same where texts are, and numbers differ by less than a thousandth of the
   largest in their column.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence

from coursebuild.core.model import Course
from coursebuild.core.model.figures import RecordedFigure, recorded_figures, unshown_figures
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic, diagnose

TOLERANCE = 1e-3
"""How much numbers may differ: this part of the longer side of a drawing in SVG, or of the largest
number in a column of data."""
PIXEL_TOLERANCE = 1.0
"""How much pixels may differ: root mean square over all channels, of 255 steps."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_SVG = "{http://www.w3.org/2000/svg}"
_XLINK = "{http://www.w3.org/1999/xlink}href"
_URL = re.compile(r"url\(#([^()\s]+)\)")
_FAR = re.compile(r"""@import[^;]*|url\(\s*["']?(?!#|data:image/|["'\s])[^()]*\)""")
"""The parts of a style that load another file."""
_ACTIVE = ("script", "foreignObject", "iframe", "audio", "video")

ReadFile = Callable[[str], bytes | None]
"""A file of the course by its path; `None` where there is none."""


def figure_findings(
    course: Course, runs: Sequence[ScriptRun], read: ReadFile
) -> Iterator[Diagnostic]:
    """What is wrong with the figures of the scripts that ran."""
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK}
    for owner, document in course.owned_documents:
        for figure in unshown_figures(document):
            message = f"no paragraph below shows `{figure.name}`"
            help = f"write `Figure: ![what it shows]({figure.name}) A caption.` below the script"
            if figure.name.endswith(".csv"):
                message = f"no figure that is shown below has the data `{figure.name}`"
                help = "the figure has the same name, but for `.svg` or `.png` at its end"
            yield diagnose("figure-unshown", figure.span, message, help=help)
        for recorded in recorded_figures(document):
            run = by_path.get(recorded.script)
            if run is not None and not run.recorded:  # a run that the course keeps drew nothing now
                yield from _compare_figure(recorded, run, read(recorded.path), owner.id)


def _compare_figure(
    figure: RecordedFigure, run: ScriptRun, recorded: bytes | None, owner: str
) -> Iterator[Diagnostic]:
    data = dict(run.figures).get(figure.name)
    if data is None:
        message = f"`{run.path}` does not draw `{figure.name}`"
        help = f'save it under this name, as in `plt.savefig("{figure.name}")`'
        yield diagnose("figure-missing", figure.span, message, help=help)
        return
    figure_file = prepare_figure(figure.name, data)
    if isinstance(figure_file, str):
        yield diagnose("figure-unreadable", figure.span, f"`{figure.name}` {figure_file}")
        return
    update = f"`coursebuild update {owner}`"
    if recorded is None:
        message = f"nothing is recorded yet of what `{run.path}` draws"
        yield diagnose("figure-drift", figure.span, message, help=f"run {update}")
        return
    wording = describe_difference(figure.name, recorded, figure_file)
    if wording:
        kind = "data differ" if figure.name.endswith(".csv") else "figure differs"
        message = f"the recorded {kind} from this run: {wording}"
        help = f"if the change is intended, run {update}"
        yield diagnose("figure-drift", figure.span, message, help=help)


def prepare_figure(name: str, data: bytes) -> bytes | str:
    """The bytes to record of a figure; or why it cannot be shown, in words."""
    if name.endswith(".png"):
        return data if _png_size(data) is not None else "is no PNG"
    if name.endswith(".csv"):
        return b"\n".join(data.splitlines()) + b"\n"
    tree = _read_svg(data)
    return tree if isinstance(tree, str) else ET.tostring(tree, encoding="utf-8") + b"\n"


def describe_difference(name: str, old: bytes, new: bytes) -> str:
    """How a new figure differs from the recorded one, in words; empty where it does not."""
    if old == new:
        return ""
    kinds = {"png": _png_difference, "csv": _csv_difference, "svg": _svg_difference}
    return kinds[name.rpartition(".")[2]](old, new)


# --- SVG


def _read_svg(data: bytes) -> ET.Element | str:
    """The drawing without what changes from run to run; or why it cannot be shown, in words."""
    if b"<!ENTITY" in data:
        return "declares entities"
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:
        return f"is no SVG: {error}"
    if root.tag != f"{_SVG}svg":
        return "is no SVG: its root is another element"
    ET.register_namespace("", _SVG[1:-1])
    ET.register_namespace("xlink", _XLINK[1:-5])
    names: dict[str, str] = {}
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag == f"{_SVG}metadata":
                parent.remove(child)
    for element in root.iter():
        reason = _reason_unshowable(element)
        if reason:
            return reason
    for element in root.iter():
        if "id" in element.attrib:
            names.setdefault(element.attrib["id"], f"x{len(names) + 1}")
    for element in root.iter():
        for key, value in element.attrib.items():
            element.attrib[key] = _rename_ids(key, value, names)
    return root


def _reason_unshowable(element: ET.Element) -> str:
    """Why an element cannot be shown, in words: it is active, or loads something; else empty."""
    kind = element.tag.removeprefix(_SVG)
    if kind in _ACTIVE or any(key.lower().startswith("on") for key in element.attrib):
        return f"holds active content, `{kind}`"
    links = (element.attrib[key] for key in (_XLINK, "href") if key in element.attrib)
    target = next((link for link in links if not link.startswith(("#", "data:image/"))), "")
    styles = (*element.attrib.values(), *([element.text or ""] if kind == "style" else ()))
    target = target or next((match[0] for style in styles if (match := _FAR.search(style))), "")
    return f"leads to `{target}`" if target else ""


def _rename_ids(key: str, value: str, names: dict[str, str]) -> str:
    if key == "id":
        return names[value]
    if key in (_XLINK, "href") and value.startswith("#"):
        return "#" + names.get(value[1:], value[1:])
    return _URL.sub(lambda match: f"url(#{names.get(match[1], match[1])})", value)


def _svg_difference(old_data: bytes, new_data: bytes) -> str:
    old_root, new_root = _read_svg(old_data), _read_svg(new_data)
    if isinstance(old_root, str) or isinstance(new_root, str):
        return f"the recorded file {old_root}" if isinstance(old_root, str) else str(new_root)
    old_words, new_words = list(_words(old_root)), list(_words(new_root))
    if len(old_words) != len(new_words):
        return f"it has {len(new_words)} parts where {len(old_words)} are recorded"
    size = _size(old_root)
    numbers, texts, worst = 0, 0, 0.0
    for old_word, new_word in zip(old_words, new_words, strict=True):
        if old_word == new_word:
            continue
        if _NUMBER.split(old_word) != _NUMBER.split(new_word):
            texts += 1
            continue
        pairs = zip(_NUMBER.findall(old_word), _NUMBER.findall(new_word), strict=True)
        error = max(abs(float(a) - float(b)) for a, b in pairs) / size
        if not error <= TOLERANCE:
            numbers, worst = numbers + 1, max(worst, error)
    clauses = [f"other words or colours in {texts} of its parts"] if texts else []
    if numbers:
        clauses.append(f"{numbers} of its parts moved, by up to {worst:.1%} of its size")
    return " and ".join(clauses)


def _words(root: ET.Element) -> Iterator[str]:
    """The content of a drawing: a string for each tag, attribute and text."""
    for element in root.iter():
        yield element.tag
        yield from (f"{key}={value}" for key, value in sorted(element.attrib.items()))
        yield " ".join(f"{element.text or ''} {element.tail or ''}".split())


def _size(root: ET.Element) -> float:
    """The longer side of a drawing, in its own units."""
    box = [float(n) for n in _NUMBER.findall(root.get("viewBox", ""))]
    lengths = (_NUMBER.match(root.get(side, "")) for side in ("width", "height"))
    sides = box[2:4] or [float(number[0]) for number in lengths if number is not None]
    return max([side for side in sides if math.isfinite(side) and side > 0], default=1.0)


# --- PNG


def _png_size(data: bytes) -> tuple[int, int] | None:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
            image.load()
            return image.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _png_difference(old: bytes, new: bytes) -> str:
    from PIL import Image, ImageChops, ImageStat

    sizes = _png_size(old), _png_size(new)
    if sizes[0] is None:
        return "the recorded file is no PNG"
    if sizes[0] != sizes[1] or sizes[1] is None:
        return "it has {}×{} pixels where {}×{} are recorded".format(*(sizes[1] or ()), *sizes[0])
    images = [Image.open(io.BytesIO(data)).convert("RGBA") for data in (old, new)]
    change = ImageChops.difference(*images)
    square = sum(value**2 for value in ImageStat.Stat(change).rms) / 4
    if math.sqrt(square) < PIXEL_TOLERANCE:
        return ""
    left, top, right, bottom = change.getbbox(alpha_only=False) or (0, 0, 0, 0)
    return f"pixels differ in columns {left} to {right}, rows {top} to {bottom}"


# --- CSV


def _csv_difference(old_data: bytes, new_data: bytes) -> str:
    try:
        old, new = (
            list(csv.reader(io.StringIO(data.decode("utf-8", "replace"))))
            for data in (old_data, new_data)
        )
    except csv.Error as error:
        return f"a table cannot be read: {error}"
    if [len(row) for row in old] != [len(row) for row in new]:
        return "the table has other rows or columns"
    columns = zip(itertools.zip_longest(*old), itertools.zip_longest(*new), strict=True)
    different = sum(_count_unequal(*column) for column in columns)
    return f"{different} of its cells differ" if different else ""


def _count_unequal(old: Sequence[str | None], new: Sequence[str | None]) -> int:
    """How many cells of a column differ."""
    numbers = [(_number(a), _number(b)) for a, b in zip(old, new, strict=True)]
    largest = max((abs(number) for number, _ in numbers if math.isfinite(number)), default=0.0)
    return sum(
        old_cell != new_cell and not abs(a - b) <= TOLERANCE * largest
        for old_cell, new_cell, (a, b) in zip(old, new, numbers, strict=True)
    )


def _number(cell: str | None) -> float:
    """The number in a cell; not a number where there is none."""
    text = (cell or "").strip()
    return float(text) if _NUMBER.fullmatch(text) else math.nan
