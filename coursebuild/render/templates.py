"""Templates of pages: Python functions, which write a page's text from its values.

Entry point: `Templates`; `made_ahead`, the Python of templates, for who bundles the tool.

The templates are written in Jinja's language, as much of it as `template_code` knows. What they
become is Python that needs nothing of Jinja: an engine that knows a whole language takes longer to
be imported than a page takes to be drawn. Jinja is imported where a template has to be read, and
that is only where it was changed since the tool was bundled.

1. What is neither `Markup` nor has an `__html__` method is escaped where it is written.
2. A name or an attribute that is not there is an error.
3. A template that is included sees all that the other sees.
"""

from __future__ import annotations

import functools
import hashlib
import marshal
import sys
from collections.abc import Callable, Iterable, Mapping
from types import CodeType
from typing import Protocol, TypeAlias
from urllib.parse import quote

from markupsafe import Markup, escape

from coursebuild.patterns import pattern

FORMAT = 1
"""Of the Python that templates become: to be raised with every change of `template_code`."""


class Compiled(Protocol):
    """Keeps the code that templates are compiled to."""

    def __hash__(self) -> int:
        """Templates are made once for each."""

    def load(self, name: str) -> bytes | None:
        """What was kept under a name."""

    def generated(self, name: str) -> str | None:
        """The Python that `made_ahead` made of the template of this name."""

    def keep(self, name: str, data: bytes) -> None:
        """Keep a template's code."""


Values: TypeAlias = Mapping[str, object]
_Included: TypeAlias = Callable[[str, Values], str]
_Function: TypeAlias = Callable[[Values, _Included], str]


class Templates:
    """All templates, each compiled when it is first asked for."""

    def __init__(self, texts: Mapping[str, str], compiled: Compiled | None = None) -> None:
        """`texts` are the templates by name; `compiled` has what was made of them before."""
        self._texts = texts
        self._compiled = compiled
        self._functions: dict[str, _Function] = {}

    def render(self, name: str, values: Values) -> str:
        """A template (`KeyError` where there is none) with its values put in."""
        function = self._functions.get(name)
        if function is None:
            function = self._functions[name] = self._function(name)
        return function(values, self.render)

    def _function(self, name: str) -> _Function:
        known = dict(_KNOWN)
        exec(self._code(name), known)
        function: _Function = known["root"]  # type: ignore[assignment]  # as `template_code` says
        return function

    def _code(self, name: str) -> CodeType:
        text = self._texts[name]
        ahead = _name(name, text)
        kept = f"{sys.implementation.cache_tag}/{ahead}"
        data = self._compiled.load(kept) if self._compiled is not None else None
        if data is not None:
            code: CodeType = marshal.loads(data)
            return code
        source = self._compiled.generated(ahead) if self._compiled is not None else None
        code = compile(source or _source(text), f"<template {name}>", "exec")
        if self._compiled is not None:
            self._compiled.keep(kept, marshal.dumps(code))
        return code


def made_ahead(texts: Iterable[tuple[str, str]]) -> dict[str, str]:
    """The Python that templates become, by a name for all that it depends on."""
    return {_name(name, text): _source(text) for name, text in texts if name.endswith(".html")}


def _name(name: str, text: str) -> str:
    return f"{FORMAT}/{name}/{hashlib.sha256(text.encode()).hexdigest()}"


def _source(text: str) -> str:
    from coursebuild.render.template_code import python_of

    return python_of(text)


# --- what the functions call


def _said(value: object) -> str:
    """A value as HTML, as `escape` gives it."""
    if type(value) is Markup:
        return value
    if type(value) is str:
        text = value.replace("&", "&amp;").replace(">", "&gt;").replace("<", "&lt;")
        return text.replace("'", "&#39;").replace('"', "&#34;")
    return escape(value)


def _joined(values: Iterable[object], between: str) -> str:
    """Values with a text between them, as HTML where one of them is."""
    parts = [value if hasattr(value, "__html__") else str(value) for value in values]
    if any(map(_is_html, parts)):
        return escape(between).join(parts)
    return between.join(map(str, parts))


def _together(*values: object) -> str:
    """Values one after the other, as HTML where one of them is."""
    if any(map(_is_html, values)):
        return Markup().join(map(escape, values))
    return "".join(map(str, values))


def _is_html(value: object) -> bool:
    return hasattr(value, "__html__")


_UNQUOTED = pattern("[A-Za-z0-9_.~/-]*+")


def _quoted(value: object) -> str:
    """A value as a part of an address."""
    text = str(value)
    return text if _UNQUOTED.fullmatch(text) else quote(text, safe="/")


_KNOWN: dict[str, object] = {
    "Markup": Markup,
    "said": _said,
    "joined": _joined,
    "together": _together,
    "quoted": _quoted,
}


def templates_of(
    templates: tuple[tuple[str, str], ...], compiled: Compiled | None = None
) -> Templates:
    """Those among the tool's files, which are the same ones as long as the files are."""
    return _templates_of(templates, compiled)


@functools.lru_cache(maxsize=8)
def _templates_of(templates: tuple[tuple[str, str], ...], compiled: Compiled | None) -> Templates:
    return Templates({name: text for name, text in templates if name.endswith(".html")}, compiled)
