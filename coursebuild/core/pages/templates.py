"""The templates of pages, in Jinja's language.

Entry points: `templates_of`; `compile_templates`, for who bundles the tool; `TemplateFailure`.

1. What is not `Markup` is escaped where it is written.
2. A name or an attribute that is not there is an error.
3. Templates that are those which the tool was bundled with are loaded from the Python that they
   were compiled to then. Others, in a source tree, are compiled when they are asked for.
4. A course may have templates of its own in the place of some. What goes wrong in these is its
   author's to mend, and is told with its place.
"""

from __future__ import annotations

import functools
import hashlib
import traceback
from pathlib import Path
from typing import TypeAlias

from jinja2 import (
    BaseLoader,
    ChoiceLoader,
    DictLoader,
    Environment,
    FunctionLoader,
    ModuleLoader,
    StrictUndefined,
    TemplateSyntaxError,
)

from coursebuild.core.model.theme import TEMPLATES

Texts: TypeAlias = tuple[tuple[str, str], ...]
"""Files of `templates/` by path."""


@functools.lru_cache(maxsize=8)
def templates_of(texts: Texts, folder: Path | None = None, own: Texts = ()) -> Environment:
    """The templates among files of the tool; `folder` has those that were compiled before.

    `own` are those of the course, which come first.
    """
    compiled = None if folder is None else folder / compiled_name(texts)
    found: list[BaseLoader] = [DictLoader(_pages(texts))]
    if compiled is not None and compiled.is_dir():
        found = [ModuleLoader(compiled)]
    if own:
        theirs = {name: (text, f"{TEMPLATES}{name}", None) for name, text in own}
        found = [FunctionLoader(theirs.get), *found]
    return _environment(ChoiceLoader(found))


class TemplateFailure(Exception):  # noqa: N818
    """What a template of the course does wrong: its path, the line, and what, in words."""

    def __init__(self, path: str, line: int, message: str) -> None:
        super().__init__(path, line, message)
        self.path, self.line, self.message = path, line, message

    @classmethod
    def of(cls, error: Exception) -> TemplateFailure | None:
        """That of an error which came about in a template of the course, if it did."""
        if isinstance(error, TemplateFailure):
            return error
        for frame, line in reversed(tuple(traceback.walk_tb(error.__traceback__))):
            path = frame.f_code.co_filename
            if path.startswith(TEMPLATES):
                return cls(path, line, str(error) or type(error).__name__)
        return None


def template_mistake(text: str) -> tuple[int, str] | None:
    """The line at which a text is no template, and why."""
    try:
        _environment(DictLoader({})).from_string(text)
    except TemplateSyntaxError as error:
        return error.lineno, error.message or "it is no template"
    return None


def compile_templates(texts: Texts, folder: Path) -> None:
    """Write templates into a folder as Python that `templates_of` loads."""
    environment = _environment(DictLoader(_pages(texts)))
    target = folder / compiled_name(texts)
    environment.compile_templates(target, zip=None, ignore_errors=False)


def compiled_name(texts: Texts) -> str:
    """The name of the folder of these templates as Python."""
    digest = hashlib.sha256(repr(sorted(_pages(texts).items())).encode())
    return f"templates-{digest.hexdigest()[:16]}"


def _pages(texts: Texts) -> dict[str, str]:
    return {name: text for name, text in texts if name.endswith(".html")}


def _environment(loader: BaseLoader) -> Environment:
    return Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,
    )
