"""Links to places of a model's page: its sections, its scenarios, the lines of its file.

Entry point: `model_place`. The ids are those that `templates/model.html` writes; of scenarios only
those that `models/NAME.toml` declares have one, since of others nobody knows before they are
measured.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from urllib.parse import unquote

from coursebuild.core.model import (
    MjcfModel,
    line_anchor,
    linked_lines,
    listing_anchor,
    model_anchors,
)
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Span


def model_place(
    span: Span, anchor: str | None, model: MjcfModel, scenarios: Collection[str]
) -> Iterator[Diagnostic]:
    """What is wrong with an anchor behind `model:NAME`, if anything."""
    if not anchor:
        return
    name, path = unquote(anchor), model.source.path
    known = {*model_anchors(scenarios), listing_anchor(path)}
    if name in known:
        return
    lines = linked_lines(name)
    if lines is None or line_anchor(path, lines[1]) != f"{lines[0]}.L{lines[1]}":
        help = did_you_mean(name, known)
    else:
        last = model.source.text.rstrip().count("\n") + 1
        if lines[2] <= last:
            return
        help = f"the last line of `{path}` is {last}"
    message = f"the page of the model `{model.name}` has no anchor `#{anchor}`"
    yield diagnose("link-anchor", span, message, help=help)
