"""`lab` fences.

Entry points: `parse_fence`, `sim_lab` (a lab that stands inside other JSON, as in a quiz).

1. The text of a fence `lab mjcf` is a model; the rest is said by keys. Of any other it is JSON.
2. The JSON is read into nodes, and these into the declared fields.
3. A `simlab` is checked to its end; of another kind only the fields that all labs have, since the
   rest is for its own code.
4. The Markdown in it is parsed, and all of it becomes a `Lab`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from msgspec import Struct, ValidationError, convert

from coursebuild.core.model.fields import Positive
from coursebuild.core.syntax.decode import decode
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.info import Word, kind_of
from coursebuild.core.syntax.json_text import parse_json, to_one_line
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode, StringNode
from coursebuild.core.syntax.texts import Prose, TextParser
from coursebuild.core.syntax.wording import JSON
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, sort_diagnostics
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.features.lab.model import MJCF, SIMLAB, START, Entry, Lab
from coursebuild.features.lab.relations import check_lab
from coursebuild.features.lab.schema import (
    OVERLAYS,
    CommonLab,
    Expect,
    Height,
    SimLab,
    Verify,
)

_CODE = ("setup", "controller", "set", "apply", "run", "expr")
"""Fields that hold JavaScript."""
_KEYS = {
    "title": (str, "a text"),
    "height": (Height, "a whole number from 80 to 2000"),
    "seconds": (Positive, "a number above 0"),
    "rtol": (Positive, "a number above 0"),
    "diverges": (Positive, "a number above 0"),
}
"""Keys of a fence `lab mjcf`, and what their values are."""


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[Lab | None]:
    """The lab of a fence; its kind may stand after the word `lab`."""
    keys = fence.keys(has_name=True)
    name = keys.value.name
    if name is not None and name.key == MJCF:
        return _parse_mjcf(fence, name)
    kind, place = (SIMLAB, kind_of(fence.info).span()) if name is None else (name.key, name.span)
    lab = parse_lab(fence.span, kind, place, fence.body, texts)
    return Parsed(lab.value, (*keys.diagnostics, *lab.diagnostics))


def _parse_mjcf(fence: Fence, name: Word) -> Parsed[Lab | None]:
    """A lab whose model the reader edits."""
    keys = fence.keys(values=tuple(_KEYS), flags=("dock", "deep"), has_name=True)
    found, given = list(keys.diagnostics), dict[str, Any]()
    for word in keys.value.words:
        type, what = _KEYS.get(word.key, (bool, ""))
        try:
            value = True if word.value is None else convert(word.value, type, strict=False)
            given[word.key] = value
        except (ValidationError, UnicodeEncodeError):  # half a character cannot be converted
            message = f"`{word.value}` is not {what}"
            found.append(diagnose("fence-key-value", word.value_span, message))
    verify = Verify(**{key: given.pop(key) for key in ("seconds", "rtol", "deep") if key in given})
    diverges = given.pop("diverges", None)
    claims = () if diverges is None else (Expect(t=diverges, diverges=True),)
    fields = SimLab(**given, toggles=OVERLAYS, setup=START, expect=claims, verify=verify)
    body = fence.body
    lab = Lab(fence.span, MJCF, name.span, body.text, fields, xml=body)
    return Parsed(None if found else lab, tuple(found))


def parse_lab(
    span: Span, kind: str, kind_span: Span, body: Excerpt, texts: TextParser
) -> Parsed[Lab | None]:
    """The lab of a kind; `span` is all of its fence and `body` the text inside. Never raises."""
    parsed = parse_json(body, span.first_line())
    node = parsed.value
    if node is None:
        return Parsed(None, sort_diagnostics(parsed.diagnostics))
    declared: type[SimLab] | type[CommonLab] = SimLab if kind == SIMLAB else CommonLab
    decoding = decode(node, declared, "the lab", JSON)
    prose = Prose.read(decoding.texts, texts)
    found: list[Diagnostic] = [*parsed.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    lab: Lab | None = None
    if isinstance(node, ObjectNode):
        if kind == SIMLAB:
            found += check_lab(node, decoding.structs)
            lab = sim_lab(span, kind_span, node, decoding.structs, prose)
        elif isinstance(decoding.value, CommonLab):
            common = decoding.value
            fields = SimLab(title=common.title, height=common.height, dock=common.dock)
            note = prose.blocks(node.get("note"))
            lab = Lab(span, kind, kind_span, to_one_line(node).text, fields, note)
    return Parsed(None if found else lab, sort_diagnostics(found))


def sim_lab(
    span: Span,
    kind_span: Span,
    node: ObjectNode,
    structs: Mapping[ObjectNode, Struct],
    prose: Prose,
) -> Lab | None:
    """The simulation that a node describes; none when its fields are not right."""
    fields, xml, goal = structs.get(node), node.get("xml"), node.get("goal")
    if not isinstance(fields, SimLab):
        return None
    return Lab(
        span=span,
        kind=SIMLAB,
        kind_span=kind_span,
        config=to_one_line(node).text,
        fields=fields,
        note=prose.blocks(node.get("note")),
        goal=prose.inlines(goal.get("text") if isinstance(goal, ObjectNode) else None),
        xml=xml.excerpt if isinstance(xml, StringNode) else None,
        places=tuple((way, value.mark) for way, value in _values(node, ())),
        code=tuple(
            (way, value.excerpt)
            for way, value in _values(node, ())
            if isinstance(value, StringNode) and way[-1] in _CODE
        ),
    )


def _values(node: Node, way: Entry) -> Iterator[tuple[Entry, Node]]:
    """Every value inside a node, with the way to it."""
    parts: list[tuple[str | int, Node]] = []
    if isinstance(node, ObjectNode):
        parts = [(member.key.value, member.value) for member in node.members]
    elif isinstance(node, ArrayNode):
        parts = list(enumerate(node.items))
    for name, value in parts:
        yield (*way, name), value
        yield from _values(value, (*way, name))
