"""`lab` fences.

The text of a fence `lab mjcf` is a model, and keys say the rest; `equations` reads labs without an
engine; the text of any other is JSON. A `simlab` is checked completely; of a course's own kind only
the fields that all labs have, since the rest is for its own code.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec import Struct, ValidationError, convert
from msgspec.structs import replace

from coursebuild.api import (
    Excerpt,
    Fence,
    Parsed,
    Prose,
    Span,
    TextParser,
    decode,
    diagnose,
    parse_json,
)
from coursebuild.core.model.fields import Positive, RelativeTolerance
from coursebuild.core.syntax.fence import kind_of
from coursebuild.core.syntax.json_text import to_one_line
from coursebuild.core.syntax.nodes import JSON, ObjectNode, StringNode
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.features.lab.equations.equation_lab import parse_equations
from coursebuild.features.lab.model import MJCF, ODE, PLOT, SIMLAB, START, Lab, values_in
from coursebuild.features.lab.relations import check_lab, plotted_numbers
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
    "starts": (str, "names of models"),
    "height": (Height, "a whole number from 80 to 2000"),
    "seconds": (Positive, "a number above 0"),
    "rtol": (RelativeTolerance, "a number of at least 0 and below 1"),
    "diverges": (Positive, "a number above 0"),
}
"""Keys of a fence `lab mjcf`, with the type of their value, and its name in messages."""


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[Lab | None]:
    """Parse the lab of a fence; its kind may stand after the word `lab`."""
    keys = fence.keys(has_name=True)
    name = keys.value.name
    if name is None or name.key != MJCF:
        kind = SIMLAB if name is None else name.key
        place = kind_of(fence.info).span() if name is None else name.span
        parse = parse_equations if kind in (PLOT, ODE) else parse_lab
        parsed_lab = parse(fence.span, kind, place, fence.body, texts)
        return Parsed(parsed_lab.value, (*keys.diagnostics, *parsed_lab.diagnostics))
    keys = fence.keys(values=tuple(_KEYS), flags=("dock", "deep"), has_name=True)
    diagnostics, values = list(keys.diagnostics), dict[str, Any]()
    for word in keys.value.words:
        type, type_name = _KEYS.get(word.key, (bool, ""))
        try:
            value = True if word.value is None else convert(word.value, type, strict=False)
            values[word.key] = value
        except (ValidationError, UnicodeEncodeError):  # half a character cannot be converted
            message = f"`{word.value}` is not {type_name}"
            diagnostics.append(diagnose("fence-key-value", word.value_span, message))
    verify_keys = [key for key in ("seconds", "rtol", "deep") if key in values]
    verify = Verify(**{key: values.pop(key) for key in verify_keys})
    diverges = values.pop("diverges", None)
    starts = tuple(values.pop("starts", "").split())
    claims = () if diverges is None else (Expect(t=diverges, diverges=True),)
    fields = SimLab(**values, toggles=OVERLAYS, setup=START, expect=claims, verify=verify)
    body = fence.body
    lab = Lab(fence.span, MJCF, name.span, body.text, fields, xml=body, starts=starts)
    return Parsed(None if diagnostics else lab, tuple(diagnostics))


def parse_lab(
    span: Span, kind: str, kind_span: Span, body: Excerpt, texts: TextParser
) -> Parsed[Lab | None]:
    """Parse a lab; `span` is all of its fence and `body` the text inside. Never raises."""
    json = parse_json(body, span.first_line())
    node = json.value
    if node is None:
        return Parsed(None, sort_diagnostics(json.diagnostics))
    fields_type: type[SimLab] | type[CommonLab] = SimLab if kind == SIMLAB else CommonLab
    decoding = decode(node, fields_type, "the lab", JSON, comma=texts.has_decimal_comma)
    prose = Prose.read(decoding.texts, texts)
    diagnostics = [*json.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    lab: Lab | None = None
    if isinstance(node, ObjectNode):
        if kind == SIMLAB:
            diagnostics += check_lab(node, decoding.structs)
            lab = sim_lab(span, kind_span, node, decoding.structs, prose)
        elif isinstance(decoding.value, CommonLab):
            common = decoding.value
            fields = SimLab(title=common.title, height=common.height, dock=common.dock)
            note = prose.blocks(node.get("note"))
            lab = Lab(span, kind, kind_span, to_one_line(node).text, fields, note)
    if lab is not None and isinstance(node, ObjectNode):
        lab = replace(lab, numbers=plotted_numbers(prose.numbers, node))
    return Parsed(None if diagnostics else lab, sort_diagnostics(diagnostics))


def sim_lab(
    span: Span,
    kind_span: Span,
    node: ObjectNode,
    structs: Mapping[ObjectNode, Struct],
    prose: Prose,
) -> Lab | None:
    """Make the simulation that a node describes; `None` if its fields are not right."""
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
        legend=tuple(prose.inlines(entry.get("text")) for entry in node.objects("legend")),
        xml=xml.excerpt if isinstance(xml, StringNode) else None,
        places=tuple((path, value.mark) for path, value in values_in(node, ())),
        code=tuple(
            (path, value.excerpt)
            for path, value in values_in(node, ())
            if isinstance(value, StringNode) and path[-1] in _CODE
        ),
    )
