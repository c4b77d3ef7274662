"""The templates of pages, in Jinja's language.

Entry points: `templates_of`; `compile_templates`, for bundling the tool; `TemplateFailure`.

1. Values that are not `Markup` are escaped.
2. An undefined name or attribute is an error.
3. Templates that the tool was bundled with are loaded as the Python they were compiled to then.
   Others, in a source tree, are compiled on use.
4. A course may replace templates by its own. Errors in these are its author's, and are reported
   with their place.
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
def templates_of(
    texts: Texts, folder: Path | None = None, course_templates: Texts = ()
) -> Environment:
    """The templates among the tool's files; `folder` holds compiled ones.

    `course_templates` are those of the course, which come first.
    """
    compiled_folder = None if folder is None else folder / compiled_name(texts)
    loaders: list[BaseLoader] = [DictLoader(_pages(texts))]
    if compiled_folder is not None and compiled_folder.is_dir():
        loaders = [ModuleLoader(compiled_folder)]
    if course_templates:
        sources = {name: (text, f"{TEMPLATES}{name}", None) for name, text in course_templates}
        loaders = [FunctionLoader(sources.get), *loaders]
    return _environment(ChoiceLoader(loaders))


class TemplateFailure(Exception):  # noqa: N818
    """An error in a template of the course: path, line and message."""

    def __init__(self, path: str, line: int, message: str) -> None:
        super().__init__(path, line, message)
        self.path, self.line, self.message = path, line, message

    @classmethod
    def of(cls, error: Exception) -> TemplateFailure | None:
        """The failure for an exception, if that was raised in a template of the course."""
        if isinstance(error, TemplateFailure):
            return error
        for frame, line in reversed(tuple(traceback.walk_tb(error.__traceback__))):
            path = frame.f_code.co_filename
            if path.startswith(TEMPLATES):
                return cls(path, line, str(error) or type(error).__name__)
        return None


def find_template_error(text: str) -> tuple[int, str] | None:
    """The line and message of the first syntax error in a template; `None` if it is valid."""
    try:
        _environment(DictLoader({})).from_string(text)
    except TemplateSyntaxError as error:
        return error.lineno, error.message or "it is not a template"
    return None


def compile_templates(texts: Texts, folder: Path) -> None:
    """Compile templates into a folder, for `templates_of` to load."""
    environment = _environment(DictLoader(_pages(texts)))
    target = folder / compiled_name(texts)
    environment.compile_templates(target, zip=None, ignore_errors=False)


def compiled_name(texts: Texts) -> str:
    """The name of the folder of these templates, compiled."""
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
