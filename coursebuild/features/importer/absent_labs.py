"""Labs of kinds that only another tool has: a card on the page, and where to write the lab."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterator, Mapping
from textwrap import shorten

from coursebuild.api import marks
from coursebuild.features.importer.context import LessonContext

_MOST_VALUE = 70
"""Characters of a field's value that are shown as an example."""


def write_absent_lab(kind: str, text: str, context: LessonContext) -> str:
    """Return a card for a lab: its title, its note, its picture and its fields."""
    context.leave(
        "lab", f"a lab of the kind `{kind}`: write content/labs/{kind}.js, or choose another kind"
    )
    fields: dict[str, object] = {}
    with contextlib.suppress(ValueError, RecursionError):
        value = json.loads(text)
        fields = value if isinstance(value, dict) else {}
    examples = context.labs.setdefault(kind, {})
    examples |= {name: value for name, value in fields.items() if name not in examples}
    words = [str(fields[key]) for key in ("title", "note", "caption") if fields.get(key)]
    for key in ("poster", "picture", "image", "thumbnail"):
        source = fields.get(key)
        if isinstance(source, str) and (address := context.resolve_picture(source)):
            words.append(f"![{words[0] if words else kind}]({address})")
    head = f"[!note] This lab is not here yet: {kind}"
    parts = (*words, marks.fence("json" if fields else "text", text))
    return marks.block_quote("\n\n".join((head, *parts)))


def lab_files(labs: Mapping[str, Mapping[str, object]]) -> Iterator[tuple[str, str]]:
    """Yield the path and the text of a module for each kind of lab, by the fields of its fences.

    As it stands it shows what a fence says; the lab itself is to be written in its place.
    """
    for kind, fields in labs.items():
        if not re.fullmatch(r"[a-z][a-z0-9-]*", kind):
            continue  # no fence can name it
        texts = ((name, json.dumps(value, ensure_ascii=False)) for name, value in fields.items())
        lines = (
            f"//   {' '.join(name.split())}: {shorten(text, _MOST_VALUE, placeholder=' …')}\n"
            for name, text in texts
        )
        start, end = _MODULE.replace("KIND", kind).split("FIELDS\n")
        yield f"content/labs/{kind}.js", start + "".join(lines) + end


_MODULE = """\
// The lab `KIND`, which another tool draws. Its fences have these fields:
//
FIELDS
//
// Write it below. Then make each card of it a fence again, with the JSON in it:
// `lab KIND`

export function mount(element, config, api) {
  element.append(api.h('p', {}, config.title ?? 'KIND'))
  if (config.note) element.append(api.h('p', {}, config.note))
  element.append(api.h('pre', {}, JSON.stringify(config, null, 2)))
}
"""
