"""Figures as they are recorded, and how one differs from what a script drew now.

Entry points: `figure_findings`; `drawn_file`, what is recorded of a drawing; `difference`.

1. Of a drawing in SVG no date, no comment and no id is kept that changes from run to run, so that
   the same drawing is the same bytes.
2. Two drawings in SVG are the same where elements, attributes and texts are, and numbers differ by
   less than a thousandth of the drawing's size. Two in PNG are the same where the root mean square
   of what pixels differ by is below one of 255 steps.
3. Of its data, in CSV, texts are the same, and numbers differ by less than a thousandth of the
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
"""Of the longer side of a drawing in SVG; of the largest number in a column of data."""
PIXEL_TOLERANCE = 1.0
"""Root mean square over all channels of all pixels, of 255."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_SVG = "{http://www.w3.org/2000/svg}"
_XLINK = "{http://www.w3.org/1999/xlink}href"
_URL = re.compile(r"url\(#([^()\s]+)\)")
_FAR = re.compile(r"""@import[^;]*|url\(\s*["']?(?!#|data:image/|["'\s])[^()]*\)""")
"""What in a style asks for another file."""
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
                yield from _compared(recorded, run, read(recorded.path), owner.id)


def _compared(
    figure: RecordedFigure, run: ScriptRun, recorded: bytes | None, owner: str
) -> Iterator[Diagnostic]:
    data = dict(run.figures).get(figure.name)
    if data is None:
        message = f"`{run.path}` does not draw `{figure.name}`"
        help = f'save it under this name, as in `plt.savefig("{figure.name}")`'
        yield diagnose("figure-missing", figure.span, message, help=help)
        return
    drawn = drawn_file(figure.name, data)
    if isinstance(drawn, str):
        yield diagnose("figure-unreadable", figure.span, f"`{figure.name}` {drawn}")
        return
    update = f"`coursebuild update {owner}`"
    if recorded is None:
        message = f"nothing is recorded yet of what `{run.path}` draws"
        yield diagnose("figure-drift", figure.span, message, help=f"run {update}")
        return
    differs = difference(figure.name, recorded, drawn)
    if differs:
        kind = "data differ" if figure.name.endswith(".csv") else "figure differs"
        message = f"the recorded {kind} from this run: {differs}"
        help = f"if the change is intended, run {update}"
        yield diagnose("figure-drift", figure.span, message, help=help)


def drawn_file(name: str, data: bytes) -> bytes | str:
    """What is recorded of a drawing; in words, why it cannot be shown."""
    if name.endswith(".png"):
        return data if _png_size(data) is not None else "is no PNG"
    if name.endswith(".csv"):
        return b"\n".join(data.splitlines()) + b"\n"
    tree = _svg(data)
    return tree if isinstance(tree, str) else ET.tostring(tree, encoding="utf-8") + b"\n"


def difference(name: str, recorded: bytes, drawn: bytes) -> str:
    """How a drawing differs from what is recorded, in words; empty where it does not."""
    if recorded == drawn:
        return ""
    kinds = {"png": _png_difference, "csv": _csv_difference, "svg": _svg_difference}
    return kinds[name.rpartition(".")[2]](recorded, drawn)


# --- SVG


def _svg(data: bytes) -> ET.Element | str:
    """The drawing without what changes from run to run; why there is none, in words."""
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
        wrong = _active(element)
        if wrong:
            return wrong
    for element in root.iter():
        if "id" in element.attrib:
            names.setdefault(element.attrib["id"], f"x{len(names) + 1}")
    for element in root.iter():
        for key, value in element.attrib.items():
            element.attrib[key] = _renamed(key, value, names)
    return root


def _active(element: ET.Element) -> str:
    """What keeps an element from being shown, in words: it acts, or loads something."""
    kind = element.tag.removeprefix(_SVG)
    if kind in _ACTIVE or any(key.lower().startswith("on") for key in element.attrib):
        return f"holds active content, `{kind}`"
    links = (element.attrib[key] for key in (_XLINK, "href") if key in element.attrib)
    far = next((link for link in links if not link.startswith(("#", "data:image/"))), "")
    styles = (*element.attrib.values(), *([element.text or ""] if kind == "style" else ()))
    far = far or next((found[0] for style in styles if (found := _FAR.search(style))), "")
    return f"leads to `{far}`" if far else ""


def _renamed(key: str, value: str, names: dict[str, str]) -> str:
    if key == "id":
        return names[value]
    if key in (_XLINK, "href") and value.startswith("#"):
        return "#" + names.get(value[1:], value[1:])
    return _URL.sub(lambda match: f"url(#{names.get(match[1], match[1])})", value)


def _svg_difference(recorded: bytes, drawn: bytes) -> str:
    old, new = _svg(recorded), _svg(drawn)
    if isinstance(old, str) or isinstance(new, str):
        return f"the recorded file {old}" if isinstance(old, str) else str(new)
    before, after = list(_words(old)), list(_words(new))
    if len(before) != len(after):
        return f"it has {len(after)} parts where {len(before)} are recorded"
    size = _size(old)
    numbers, texts, worst = 0, 0, 0.0
    for one, two in zip(before, after, strict=True):
        if one == two:
            continue
        if _NUMBER.split(one) != _NUMBER.split(two):
            texts += 1
            continue
        pairs = zip(_NUMBER.findall(one), _NUMBER.findall(two), strict=True)
        error = max(abs(float(a) - float(b)) for a, b in pairs) / size
        if not error <= TOLERANCE:
            numbers, worst = numbers + 1, max(worst, error)
    said = [f"other words or colours in {texts} of its parts"] if texts else []
    if numbers:
        said.append(f"{numbers} of its parts moved, by up to {worst:.1%} of its size")
    return " and ".join(said)


def _words(root: ET.Element) -> Iterator[str]:
    """What a drawing says, one string for each tag, attribute and text."""
    for element in root.iter():
        yield element.tag
        yield from (f"{key}={value}" for key, value in sorted(element.attrib.items()))
        yield " ".join(f"{element.text or ''} {element.tail or ''}".split())


def _size(root: ET.Element) -> float:
    """The longer side, in units of the drawing."""
    box = [float(n) for n in _NUMBER.findall(root.get("viewBox", ""))]
    given = (_NUMBER.match(root.get(side, "")) for side in ("width", "height"))
    sides = box[2:4] or [float(number[0]) for number in given if number is not None]
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


def _png_difference(recorded: bytes, drawn: bytes) -> str:
    from PIL import Image, ImageChops, ImageStat

    sizes = _png_size(recorded), _png_size(drawn)
    if sizes[0] is None:
        return "the recorded file is no PNG"
    if sizes[0] != sizes[1] or sizes[1] is None:
        return "it has {}×{} pixels where {}×{} are recorded".format(*(sizes[1] or ()), *sizes[0])
    images = [Image.open(io.BytesIO(data)).convert("RGBA") for data in (recorded, drawn)]
    change = ImageChops.difference(*images)
    square = sum(value**2 for value in ImageStat.Stat(change).rms) / 4
    if math.sqrt(square) < PIXEL_TOLERANCE:
        return ""
    left, top, right, bottom = change.getbbox(alpha_only=False) or (0, 0, 0, 0)
    return f"pixels differ in columns {left} to {right}, rows {top} to {bottom}"


# --- CSV


def _csv_difference(recorded: bytes, drawn: bytes) -> str:
    old, new = (
        list(csv.reader(io.StringIO(data.decode("utf-8", "replace")))) for data in (recorded, drawn)
    )
    if [len(row) for row in old] != [len(row) for row in new]:
        return "the table has other rows or columns"
    columns = zip(itertools.zip_longest(*old), itertools.zip_longest(*new), strict=True)
    different = sum(_unequal(*column) for column in columns)
    return f"{different} of its cells differ" if different else ""


def _unequal(old: Sequence[str | None], new: Sequence[str | None]) -> int:
    """How many cells of a column differ."""
    numbers = [(_number(one), _number(two)) for one, two in zip(old, new, strict=True)]
    largest = max((abs(one) for one, _ in numbers if math.isfinite(one)), default=0.0)
    return sum(
        one != two and not abs(a - b) <= TOLERANCE * largest
        for one, two, (a, b) in zip(old, new, numbers, strict=True)
    )


def _number(cell: str | None) -> float:
    """The number in a cell; not a number where there is none."""
    return float(cell) if cell and _NUMBER.fullmatch(cell.strip()) else math.nan
