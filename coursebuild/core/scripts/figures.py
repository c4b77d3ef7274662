"""Figures as they are recorded, and how they differ from what a script drew now.

A figure is judged as text of somebody else's: `core.drawing.safe_svg` says what an SVG may hold; of
a PNG what draws is recorded, and nothing else. Dates, comments and ids, which change from run to
run, are taken out of an SVG, so that the same drawing gives the same bytes.

Figures of Matplotlib hold what they draw (`figure_data`), which must be the same wherever a script
runs. Their layout depends on versions and fonts: it is compared only where these are as they were.
Of other figures the drawing itself is compared: numbers may differ by `TOLERANCE`, pixels by
`PIXEL_TOLERANCE`; everything else must be the same.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
import struct
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec

from coursebuild.core.drawing.safe_svg import SVG, XLINK, read_svg
from coursebuild.core.model import Course
from coursebuild.core.model.addresses import RecordedFigure, recorded_figures, unshown_figures
from coursebuild.core.model.lesson_record import LessonRecord, data_digest
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.figure_data import (
    TOLERANCE,
    add_to_svg,
    describe_data_difference,
    png_chunk,
    read_figure_data,
)
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.regex import regex

PIXEL_TOLERANCE = 1.0
"""How much pixels may differ: root mean square over all channels, of 255 steps."""

MAX_PIXELS = 25_000_000
MAX_TABLE = 4 << 20
"""Bytes of data."""
SVG_HELP = "an SVG may contain only what draws a still picture, and refer only to its own parts"

_NUMBER = regex(r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?")
_HREFS = ("href", f"{XLINK}href")
_ID = regex(r"""(url\(\s*["']?#)([^()\s"']+)""")
_RULE_PART = regex(r"[^{};]*+[{};]?")
"""What ends in a brace are selectors."""
_SELECTED = regex(r"(#)([\w:-]+)")
_PNG_PARTS = frozenset(b"IHDR PLTE IDAT IEND tRNS bKGD cHRM cICP gAMA iCCP pHYs sBIT sRGB".split())
"""The chunks of a PNG that say what is drawn."""
_PNG_END = b"\0\0\0\0IEND"

ReadFile = Callable[[str], bytes | None]
Prepare = Callable[[str, bytes], bytes | str]
"""Does as `prepare_figure`."""


def figure_findings(
    course: Course, runs: Sequence[ScriptRun], read: ReadFile, prepare: Prepare
) -> Iterator[Diagnostic]:
    """What is wrong with the figures of the scripts that ran."""
    outcomes = (Outcome.OK, Outcome.UNRECORDED)
    by_path = {run.path: run for run in runs if run.outcome in outcomes}
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
                record = course.records.get(document.source.path, LessonRecord())
                yield from compare_figure(
                    recorded, run, read(recorded.path), record, owner.id, prepare
                )


def compare_figure(
    figure: RecordedFigure,
    run: ScriptRun,
    recorded: bytes | None,
    record: LessonRecord,
    owner: str = "",
    prepare: Prepare | None = None,
) -> Iterator[Diagnostic]:
    """What is wrong with a figure of a run, given the file that is recorded."""
    data = dict(run.figures).get(figure.name)
    if data is None and run.outcome is Outcome.OK:
        message = f"`{run.path}` does not draw `{figure.name}`"
        help = f'save it under this name, as in `plt.savefig("{figure.name}")`'
        yield diagnose("figure-missing", figure.span, message, help=help)
        return
    figure_file = b"" if data is None else (prepare or prepare_figure)(figure.name, data)
    if isinstance(figure_file, str):
        help = SVG_HELP if figure_file.startswith("holds") else ""
        message = f"`{figure.name}` {figure_file}"
        yield diagnose("figure-unreadable", figure.span, message, help=help)
        return
    update = f"`coursebuild update {owner}`"
    if recorded is None:
        message = f"no figure of `{run.path}` is recorded yet"
        yield diagnose("figure-drift", figure.span, message, help=f"run {update}")
        return
    change, wording = figure_difference(figure, run, recorded, figure_file, record)
    if wording:
        kind = "data differ" if figure.name.endswith(".csv") else "figure differs"
        message = f"the recorded {kind} from this run: {wording}"
        message = f"{change}: {message}" if change else message
        help = f"if the change is intended, run {update}"
        yield diagnose("figure-drift", figure.span, message, help=help)


def figure_difference(
    figure: RecordedFigure, run: ScriptRun, recorded: bytes, drawing: bytes, record: LessonRecord
) -> tuple[str, str]:
    """What is another now than when a figure was recorded, and how it differs, both in words."""
    made_with, change = record.find(figure.script, data_digest(recorded)), ""
    if made_with is not None and run.provenance is not None:
        change = made_with.change(run.provenance)
    return change, describe_difference(figure.name, recorded, drawing, is_same_place=not change)


def prepare_figure(name: str, data: bytes) -> bytes | str:
    """The bytes to record of a figure; or why it cannot be shown, in words."""
    if name.endswith(".png"):
        drawing, figure_data = _png_drawing(data), read_figure_data(data)
        size = _png_size(drawing)
        if isinstance(size, str):
            return size
        head, end, tail = drawing.rpartition(_PNG_END)
        return drawing if figure_data is None else head + png_chunk(figure_data) + end + tail
    if name.endswith(".csv"):
        if len(data) > MAX_TABLE:
            return f"is larger than {MAX_TABLE >> 20} MiB"
        return b"\n".join(data.splitlines()) + b"\n"
    tree = _read_drawing(data)
    if isinstance(tree, str):
        return tree
    if (figure_data := read_figure_data(data)) is not None:
        add_to_svg(tree, figure_data)
    svg: bytes = ET.tostring(tree, encoding="utf-8")
    return svg + b"\n"


def describe_difference(name: str, old: bytes, new: bytes, *, is_same_place: bool = True) -> str:
    """How a new figure differs from the recorded one, in words; empty where it does not.

    `is_same_place`: as far as is known, the recorded one was drawn with the same versions, on the
    same platform.
    """
    if old == new:
        return ""
    data_before, data_now = read_figure_data(old), read_figure_data(new)
    if data_before is not None and data_now is not None:
        wording = describe_data_difference(data_before, data_now)
        if wording or not is_same_place or data_before.fonts != data_now.fonts:
            return wording
    kinds = {"png": _png_difference, "csv": _csv_difference, "svg": _svg_difference}
    return kinds[name.rpartition(".")[2]](old, new)


# --- SVG


def _read_drawing(data: bytes) -> ET.Element | str:
    """The drawing without what changes from run to run; or why it cannot be shown, in words."""
    root = read_svg(data)
    if isinstance(root, str):
        return root
    ET.register_namespace("", SVG[1:-1])
    ET.register_namespace("xlink", XLINK[1:-1])
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag == f"{SVG}metadata":
                parent.remove(child)
    names: dict[str, str] = {}
    for element in root.iter():
        if "id" in element.attrib:
            names.setdefault(element.attrib["id"], f"x{len(names) + 1}")

    def rename(match: re.Match[str]) -> str:
        return match[1] + names.get(match[2], match[2])

    for element in root.iter():
        for key, value in element.attrib.items():
            if key == "id":
                element.attrib[key] = names[value]
            elif key in _HREFS and value.startswith("#"):
                element.attrib[key] = "#" + names.get(value[1:], value[1:])
            elif key in ("aria-labelledby", "aria-describedby"):
                element.attrib[key] = " ".join(names.get(word, word) for word in value.split())
            else:
                element.attrib[key] = _ID.sub(rename, value)
        if element.tag == f"{SVG}style" and element.text:
            parts = _RULE_PART.findall(element.text)
            element.text = "".join(
                (_SELECTED if part.endswith("{") else _ID).sub(rename, part) for part in parts
            )
    return root


def _svg_difference(old_data: bytes, new_data: bytes) -> str:
    old_root, new_root = _read_drawing(old_data), _read_drawing(new_data)
    if isinstance(old_root, str) or isinstance(new_root, str):
        return f"the recorded file {old_root}" if isinstance(old_root, str) else str(new_root)
    old_words, new_words = list(_words(old_root)), list(_words(new_root))
    if len(old_words) != len(new_words):
        return f"it has {len(new_words)} parts where {len(old_words)} are recorded"
    # The longer side of a drawing, in its own units
    box = [float(n) for n in _NUMBER.findall(old_root.get("viewBox", ""))]
    lengths = (_NUMBER.match(old_root.get(side, "")) for side in ("width", "height"))
    sides = box[2:4] or [float(number[0]) for number in lengths if number is not None]
    size = max([side for side in sides if math.isfinite(side) and side > 0], default=1.0)
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


# --- PNG


def _png_size(data: bytes) -> tuple[int, int] | str:
    """Width and height of a PNG; or why it cannot be shown, in words."""
    if find_spec("PIL") is None:
        return "needs the package Pillow: run `pip install 'coursebuild[figures]'`"
    from PIL import Image

    width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))
    if width * height > MAX_PIXELS:  # known before a decoder takes memory for them
        return f"has more than {MAX_PIXELS // 1_000_000} million pixels"
    try:
        with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
            image.load()
            return image.size
    except (OSError, ValueError, SyntaxError, struct.error):
        return "is not a PNG file"


def _png_drawing(data: bytes) -> bytes:
    """A PNG without its texts and dates, other frames, and whatever follows its end."""
    parts, at = [data[:8]], 8
    while at < len(data) and not parts[-1].startswith(b"IEND", 4):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] in _PNG_PARTS:
            parts.append(data[at:end])
        at = end
    return b"".join(parts)


def _png_difference(old: bytes, new: bytes) -> str:
    old, new = _png_drawing(old), _png_drawing(new)
    old_size, new_size = _png_size(old), _png_size(new)
    if isinstance(old_size, str) or isinstance(new_size, str):
        return f"the recorded file {old_size}" if isinstance(old_size, str) else str(new_size)
    from PIL import Image, ImageChops, ImageStat

    if old_size != new_size:
        return "it has {}×{} pixels where {}×{} are recorded".format(*new_size, *old_size)
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
    different = 0
    for old_cells, new_cells in columns:
        pairs = [(_number(a), _number(b)) for a, b in zip(old_cells, new_cells, strict=True)]
        largest = max((abs(a) for a, _ in pairs if math.isfinite(a)), default=0.0)
        different += sum(
            old_cell != new_cell and not abs(a - b) <= TOLERANCE * largest
            for old_cell, new_cell, (a, b) in zip(old_cells, new_cells, pairs, strict=True)
        )
    return f"{different} of its cells differ" if different else ""


def _number(cell: str | None) -> float:
    """The number in a cell; not a number where there is none."""
    text = (cell or "").strip()
    return float(text) if _NUMBER.fullmatch(text) else math.nan
