"""Labels, by which formulas, figures, tables, listings and labs get numbers: `{#fig:flip}`."""

from __future__ import annotations

import re

from msgspec.structs import replace

from coursebuild.core.model import LABEL_KINDS, Block, Label
from coursebuild.core.model.blocks import Labelled
from coursebuild.core.registry import fence_kind
from coursebuild.core.syntax.attributes import read_pairs, value_text
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_ID = re.compile(rf"\{{#((?P<kind>{'|'.join(LABEL_KINDS)}):[\w-]+)(?=[\s}}])")
_MARK_HELP = 'write `{#eq:name check}`, or `{#eq:name given="its source"}`'


def read_label(braces: Excerpt, kind: str, state: ParsingState) -> Label | None:
    """The label of what has a prefix of `LABEL_KINDS`; `None` after a mistake."""
    is_closed = braces.text.endswith("}")
    match = _ID.match(braces.text) if is_closed else None
    if match is None or match["kind"] != kind:
        subject = LABEL_KINDS[kind]
        message = f"the label of {subject} is never closed"
        if is_closed:
            message = f"`{braces.text}` is not a label of {subject}"
        help = f"write `{{#{kind}:name}}`, of letters, digits, `-` and `_`"
        state.report(diagnose("label-attribute", braces.span(), message, help=help))
        return None
    end, keys = match.end(), ("check", "given") if kind == "eq" else ()
    help = _MARK_HELP if keys else f"write `{{#{kind}:name}}`"
    values = read_pairs(braces.slice(end - 1), keys, "label-attribute", help)
    if isinstance(values, Diagnostic):
        state.report(values)
        values = {}
    source = value_text(values["given"]) if "given" in values else None
    check = braces.span(end, len(braces.text) - 1) if "check" in values else None
    return Label(braces.span(2, end), match[1], source, check)


def take_label(braces: Excerpt | None, kind: str, state: ParsingState) -> Label | None:
    """The label in braces, whose id nothing else may have; `None` for none, or after a mistake."""
    label = None if braces is None else read_label(braces, kind, state)
    if label is not None:
        state.anchors.take(label.id, label.span)
    return label


def reject_label(braces: Excerpt, message: str, help: str, state: ParsingState) -> None:
    """Report a label that stands where none may."""
    state.report(diagnose("label-attribute", braces.span(), message, help=help))


def label_block(block: Block, braces: Excerpt, fence: Fence, state: ParsingState) -> Block:
    """A block with the label on the first line of its fence."""
    feature_kind = fence_kind(fence.kind)
    kind = "lst" if feature_kind is None else feature_kind.label
    if fence.nested:
        message = "a block in a text of a quiz or lab has no label"
        reject_label(braces, message, "label blocks of the lesson's text", state)
    elif fence.kind == "output":
        help = "write `{#lst:name}` on the first line of its script"
        reject_label(braces, "an output has no label", help, state)
    elif not kind:
        message = f"a block of kind `{fence.kind}` has no label"
        reject_label(braces, message, "labels stand on scripts, code and labs", state)
    elif isinstance(block, Labelled):
        return replace(block, label=take_label(braces, kind, state))
    return block
