"""A document as text: a line per node with its span, `line:column-line:column`; diagnostics."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import fields

from coursebuild.core.model import (
    Block,
    Comparison,
    Document,
    Inline,
    Label,
    ListItem,
    Meaning,
    Table,
)
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Excerpt, Span

HIDDEN_FIELDS = {"span", "children", "blocks", "items", "header", "rows", "caption"}


def format_span(span: Span) -> str:
    return f"{span.line}:{span.column}-{span.end_line}:{span.end_column}"


def dump(result: Parsed[Document]) -> str:
    lines = list(_nodes(result.value.blocks, 0))
    for note in result.value.footnotes:
        head = f"Footnote {format_span(note.span)} {note.number} {note.label!r}"
        lines += [f"{head} references={note.references}", *_nodes(note.blocks, 1)]
    return "".join(f"{line}\n" for line in lines) + format_diagnostics(result.diagnostics)


def format_diagnostics(diagnostics: tuple[Diagnostic, ...]) -> str:
    lines = []
    for d in diagnostics:
        lines.append(f"! {format_span(d.span)} {d.severity}[{d.rule}]: {d.message}")
        lines += [f"!   = help: {d.help}"] if d.help else []
        for note in d.notes:
            place = f" at {format_span(note.span)}" if note.span else ""
            lines.append(f"!   = note: {note.message}{place}")
    return "".join(f"{line}\n" for line in lines)


def _nodes(nodes: tuple[Block | Inline, ...], depth: int) -> Iterator[str]:
    for node in nodes:
        yield from _node(node, depth)


def _node(node: Block | Inline | ListItem, depth: int) -> Iterator[str]:
    indent = "  " * depth
    values = [
        _value(f.name, getattr(node, f.name)) for f in fields(node) if f.name not in HIDDEN_FIELDS
    ]
    words = [type(node).__name__, format_span(node.span), *filter(None, values)]
    yield indent + " ".join(words)
    if isinstance(node, Table):
        for cells in (node.header, *node.rows):
            for cell in cells:
                yield f"{indent}  Cell {format_span(cell.span)} {cell.text.text!r}"
                yield from _nodes(cell.children, depth + 2)
        if node.caption:
            yield f"{indent}  caption:"
            yield from _nodes(node.caption, depth + 2)
        return
    for name in ("title", "caption", "numbers", "input", "process", "output"):
        content = getattr(node, name, None)
        if content and isinstance(content, tuple):
            yield f"{indent}  {name}:"
            yield from _nodes(content, depth + 2)
    body = getattr(node, "body", None)
    if isinstance(body, Table):
        yield from _node(body, depth + 1)
    for item in getattr(node, "items", ()):
        yield from _node(item, depth + 1)
    yield from _nodes(getattr(node, "children", getattr(node, "blocks", ())), depth + 1)


def _value(name: str, value: object) -> str:
    if isinstance(value, Span):
        return f"{name}={format_span(value)}"
    if isinstance(value, Excerpt):
        return f"{name}={format_span(value.span())} {value.text!r}"
    if isinstance(value, Label):
        return f"label={format_span(value.span)} {value.id!r}"
    if isinstance(value, Meaning):
        return f"meaning={format_span(value.span)} {value.text!r} {value.unit!r}"
    if isinstance(value, Comparison):
        tolerances = f" rtol={value.rtol} atol={value.atol}" if value.mode.value == "rtol" else ""
        return f"[{value.mode.value}{tolerances}{' ellipsis' if value.ellipsis else ''}]"
    if name == "checked" and value is not None:
        return f"checked={value}"
    if name == "part" and value == 0:  # of a recording: nearly all scripts have one part
        return ""
    if value is None or value is False or value == () or value == "" or isinstance(value, Table):
        return ""
    if isinstance(value, tuple) and not all(isinstance(v, str | None) for v in value):
        return ""
    return repr(value) if name in ("text", "html") else f"{name}={value!r}"
