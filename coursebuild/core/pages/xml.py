"""XML: elements, files from templates, valid names."""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element as Element
from xml.etree.ElementTree import tostring

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup, escape

from coursebuild.core.text.characters import clean_xml

Child: TypeAlias = "Element | str | None"


def element(name: str, attributes: dict[str, str] | None = None, *children: Child) -> Element:
    """An element; a child that is `None` is left out."""
    node = Element(name, {key: clean_xml(value) for key, value in (attributes or {}).items()})
    add(node, *children)
    return node


def add(parent: Element, *children: Child) -> None:
    """Append elements and texts, in their order."""
    for child in children:
        if child is None:
            continue
        if isinstance(child, Element):
            parent.append(child)
        elif len(parent):
            parent[-1].tail = (parent[-1].tail or "") + clean_xml(child)
        else:
            parent.text = (parent.text or "") + clean_xml(child)


def render_xml(template: Path, **values: Any) -> bytes:
    """A whole file; values that are not `Markup` are escaped."""
    return clean_xml(_template(template).render(values)).encode()


@functools.cache
def _template(path: Path) -> Template:
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    return environment.from_string(path.read_text(encoding="utf-8"))


def markup(content: Iterable[Element | str]) -> Markup:
    """Elements and texts as markup for a template."""
    parts = (escape(c) if isinstance(c, str) else Markup(tostring(c, "unicode")) for c in content)
    return Markup("").join(parts)


def identifier(prefix: str, text: str, *, most: int = 0) -> str:
    """An ASCII NCName of a text, another one for each.

    Beyond `most` characters it ends with digits of its hash.
    """
    name = prefix + re.sub("[^A-Za-z0-9.-]", lambda match: f"_{ord(match[0]):x}_", text)
    if most and len(name) > most:
        digest = hashlib.sha256(name.encode()).hexdigest()[:12]
        name = f"{name[: most - 13]}_{digest}"
    return name
