"""Labs as plain Markdown: the recorded picture, what can be changed, and what is shown.

Entry point: `lab_markdown`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from coursebuild.core.pages.marks import (
    code_span,
    escape_line,
    escape_marks,
    fence,
    link,
    picture,
    table,
)
from coursebuild.features.lab.model import MJCF, Lab
from coursebuild.features.lab.page import LabView, RecordedView, page_view

if TYPE_CHECKING:
    from coursebuild.core.features import MarkdownWriter


def lab_markdown(writer: MarkdownWriter, lab: Lab) -> str:
    """Write a lab as its trial recorded it, with a link to where it runs."""
    words, view = writer.words, page_view(writer.page, lab)
    parts = [f"**{words('lab.label')}: {escape_marks(view.title)}**"]
    if view.recorded is not None:
        parts += _write_recording(writer, view.recorded)
    if lab.goal:
        parts.append(f"**{words('lab.goal')}:** {writer.inlines(lab.goal)}")
    parts.append(_describe(writer, view))
    if lab.kind == MJCF and lab.xml is not None:
        parts.append(fence("xml", lab.xml.text))
    if view.controls:
        rows = [(escape_line(label), escape_line(values)) for label, values in view.controls]
        parts.append(table((words("lab.control"), words("lab.range")), rows))
    displays = (
        f"- {escape_marks(name)}: {escape_marks(', '.join(labels))}"
        for name, labels in _list_displays(writer, view)
    )
    parts.append("\n".join(displays))
    parts += [writer.blocks(lab.note), link(words("exports.run_lab"), writer.live)]
    return "\n\n".join(filter(None, parts))


def _write_recording(writer: MarkdownWriter, recorded: RecordedView) -> Iterator[str]:
    """Write the picture, and the readouts at the end."""
    yield picture(recorded.alt, writer.locate(recorded.picture))
    if readouts := recorded.record.readouts:
        yield f"{escape_marks(recorded.at)}:"
        rows = [(escape_line(label), escape_line(value)) for label, value in readouts]
        yield table((writer.words("lab.readouts"), ""), rows)


def _describe(writer: MarkdownWriter, view: LabView) -> str:
    """Say what is simulated, from which start, and until when."""
    words = writer.words
    text = f"{escape_marks(view.subject)}."
    if view.model is not None:
        name = link(escape_marks(view.model), writer.locate(view.model_href))
        text = f"{escape_marks(view.subject)} {name}."
    if view.start:
        text += f" {words('lab.start')} {code_span(view.start)}."
    if view.stop is not None:
        text += f" {words('lab.stops', t=view.stop)}"
    return text


def _list_displays(writer: MarkdownWriter, view: LabView) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield what the lab shows while it runs: its name, and its parts."""
    texts = writer.page.renderer.words
    if view.readouts and view.recorded is None:
        yield texts("lab.readouts"), view.readouts
    yield from view.plots
    if view.overlays:
        yield texts("lab.overlays"), view.overlays
