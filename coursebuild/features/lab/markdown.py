"""Labs as plain Markdown: the recorded picture, what can be changed, and what is shown.

Entry point: `lab_markdown`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from coursebuild.core.model import ModelTarget
from coursebuild.core.pages.marks import code_span, escaped, fence, link, picture, table
from coursebuild.core.pages.quantities import number
from coursebuild.features.lab.files import LabRecord
from coursebuild.features.lab.model import MJCF, Lab
from coursebuild.features.lab.page import (
    control_view,
    overlay_name,
    plot_view,
    seconds,
    shown_lab,
    start_name,
    title_of,
)

if TYPE_CHECKING:
    from coursebuild.core.features import MarkdownWriter


def lab_markdown(writer: MarkdownWriter, lab: Lab) -> str:
    """A lab as it was recorded, with a link to where it runs."""
    words, texts = writer.words, writer.page.renderer.words
    title = title_of(writer.page, lab)
    live = shown_lab(writer.page, lab)
    parts = [f"**{words('lab.label')}: {escaped(title)}**"]
    record = live.record if live is not None else None
    if live is not None and record is not None:
        parts += _recorded(writer, title, live.picture, record)
    if lab.goal:
        parts.append(f"**{words('lab.goal')}:** {writer.inlines(lab.goal)}")
    parts.append(_about(writer, lab))
    if lab.kind == MJCF and lab.xml is not None:
        parts.append(fence("xml", lab.xml.text))
    if lab.fields.controls:
        views = [control_view(texts, control) for control in lab.fields.controls]
        rows = [(_cell(view.label), _cell(view.values)) for view in views]
        parts.append(table((words("lab.control"), words("lab.range")), rows))
    shows = _shows(writer, lab, recorded=record is not None)
    parts.append("\n".join(f"- {escaped(name)}: {escaped(', '.join(of))}" for name, of in shows))
    parts += [writer.blocks(lab.note), link(words("exports.run_lab"), writer.live)]
    return "\n\n".join(filter(None, parts))


def _recorded(writer: MarkdownWriter, title: str, image: str, record: LabRecord) -> Iterator[str]:
    """The picture, and the readouts at the end."""
    words, page = writer.words, writer.page
    alt = page.renderer.words("lab.picture", title=title, t=number(record.time, 4))
    yield picture(alt, writer.locate(page.place.href(image)))
    if record.readouts:
        yield f"{words('lab.at', t=seconds(record.end))}:"
        rows = [(_cell(label), _cell(value)) for label, value in record.readouts]
        yield table((words("lab.readouts"), ""), rows)


def _about(writer: MarkdownWriter, lab: Lab) -> str:
    """What is simulated, and from where to where."""
    words = writer.words
    about = f"{words('lab.static_xml')}."
    if lab.fields.model is not None:
        name = link(escaped(lab.fields.model), writer.href(ModelTarget(lab.fields.model)))
        about = f"{words('lab.static')} {name}."
    start = start_name(writer.page, lab)
    if start:
        about += f" {words('lab.start')} {code_span(start)}."
    if lab.fields.stopAt is not None:
        about += f" {words('lab.stops', t=number(lab.fields.stopAt))}"
    return about


def _shows(
    writer: MarkdownWriter, lab: Lab, *, recorded: bool
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What the lab shows while it runs: what it is called, and its parts."""
    texts, fields = writer.page.renderer.words, lab.fields
    if fields.readouts and not recorded:
        yield texts("lab.readouts"), tuple(readout.label for readout in fields.readouts)
    for index in range(len(fields.plots)):
        view = plot_view(texts, lab, index)
        yield view.title, view.traces + view.marks
    if fields.toggles:
        yield (
            texts("lab.overlays"),
            tuple(overlay_name(texts, name) for name in fields.toggles),
        )


def _cell(text: str) -> str:
    return escaped(" ".join(text.split()))
