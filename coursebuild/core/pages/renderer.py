"""The renderer of pages: words, templates in Jinja's language, formulas.

Templates that the tool was bundled with are loaded as the Python they were compiled to then; those
of a source tree are compiled on use. A course may replace templates by its own. Errors in these are
its author's, and are reported with their place.
"""

from __future__ import annotations

import functools
import hashlib
import traceback
from collections.abc import Mapping
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
from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.model.course import TEMPLATES
from coursebuild.core.model.results import Formula, MathError, Mathml
from coursebuild.core.pages.quantities import text_html
from coursebuild.core.pages.strings import Strings, direction

Texts: TypeAlias = tuple[tuple[str, str], ...]
"""Files of `templates/` by path."""


@functools.lru_cache(maxsize=8)
def templates_of(
    texts: Texts, folder: Path | None = None, course_templates: Texts = ()
) -> Environment:
    """The templates among the tool's files, or compiled in `folder`, after those of the course."""
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


def known_mathml(formulas: Mapping[Formula, str | MathError]) -> Mathml:
    """A function that returns formulas as MathML, empty for those with an error."""

    def mathml(tex: str, display: bool) -> str:
        html = formulas.get(Formula(tex, display))
        return html if isinstance(html, str) else ""

    return mathml


class Renderer(Struct, frozen=True):
    """The interface texts in the course's language, the templates, and formulas as MathML."""

    words: Strings
    templates: Environment
    formulas: Mapping[Formula, str | MathError] = field(default_factory=dict)

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template, without its last line end.

        It can use `t`, the interface texts, and `authored`, see `text`.
        """
        variables = {"t": self.words, "authored": self.text, **values}
        try:
            return Markup(self.templates.get_template(template).render(variables).rstrip("\n"))
        except Exception as error:
            if (failure := TemplateFailure.of(error)) is not None:
                raise failure from error
            raise

    def text(self, text: str) -> Markup:
        """An author's plain text, with numbers joined to their units."""
        return text_html(text, direction(self.words.language))

    def highlight(self, language: str, code: str) -> Markup:
        """Code with its syntax highlighted."""
        # The package is built, its templates compiled, where no highlighter is installed.
        from coursebuild.core.pages.listings import highlight_lines

        return Markup("\n".join(highlight_lines(language, code)))

    def mathml(self, tex: str, display: bool) -> Markup:
        """A formula's MathML; one that does not parse is never rendered (`ValueError`)."""
        html = self.formulas[Formula(tex, display)]
        if isinstance(html, MathError):
            raise ValueError(f"formula {tex!r} does not parse: {html.message}")
        return Markup(html)
