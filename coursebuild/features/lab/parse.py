"""`lab` fences.

Entry points: `parse_fence`, `sim_lab` (a lab that stands inside other JSON, as in a quiz).

1. The JSON is read into nodes, and these into the declared fields.
2. A `simlab` is checked to its end; of another kind only the fields that all labs have, since the
   rest is for its own code.
3. The Markdown in it is parsed, and all of it becomes a `Lab`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from coursebuild.core.syntax.decode import decode
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.info import kind_of
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode, StringNode
from coursebuild.core.syntax.texts import Prose, TextParser
from coursebuild.core.syntax.wording import JSON
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, sort_diagnostics
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.features.lab.model import SIMLAB, Entry, Lab
from coursebuild.features.lab.relations import check_lab
from coursebuild.features.lab.schema import CommonLab, SimLab

_CODE = ("setup", "controller", "set", "apply", "run", "expr")
"""Fields that hold JavaScript."""


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[Lab | None]:
    """The lab of a fence; its kind may stand after the word `lab`."""
    keys = fence.keys(named=True)
    name = keys.value.name
    kind, place = (SIMLAB, kind_of(fence.info).span()) if name is None else (name.key, name.span)
    lab = parse_lab(fence.span, kind, place, fence.body, texts)
    return Parsed(lab.value, (*keys.diagnostics, *lab.diagnostics))


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
            lab = Lab(span, kind, kind_span, node.raw, fields, note)
    return Parsed(None if found else lab, sort_diagnostics(found))


def sim_lab(
    span: Span,
    kind_span: Span,
    node: ObjectNode,
    structs: Mapping[ObjectNode, Struct],
    prose: Prose,
) -> Lab | None:
    """The simulation that a node describes; none when its fields are not right."""
    fields, xml = structs.get(node), node.get("xml")
    if not isinstance(fields, SimLab):
        return None
    return Lab(
        span=span,
        kind=SIMLAB,
        kind_span=kind_span,
        config=node.raw,
        fields=fields,
        note=prose.blocks(node.get("note")),
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
