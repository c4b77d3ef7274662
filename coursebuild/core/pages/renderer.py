"""What pages are drawn with, whatever they show: words, templates, formulas.

Entry points: `Renderer`; `known_mathml`.
"""

from __future__ import annotations

from collections.abc import Mapping

from jinja2 import Environment
from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.features import Mathml
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.highlight import highlight_lines
from coursebuild.core.pages.quantities import text_html
from coursebuild.core.pages.strings import Strings
from coursebuild.core.pages.templates import TemplateFailure


def known_mathml(formulas: Mapping[Formula, str | MathError]) -> Mathml:
    """Gives formulas as MathML, as far as they are set."""

    def mathml(tex: str, display: bool) -> str:
        found = formulas.get(Formula(tex, display))
        return found if isinstance(found, str) else ""

    return mathml


class Renderer(Struct, frozen=True):
    """The interface's words in the course's language, the templates, and formulas as MathML."""

    words: Strings
    templates: Environment
    formulas: Mapping[Formula, str | MathError] = field(default_factory=dict)

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template, without its last line end.

        It sees `t`, the interface's words, and `authored`, see `text`.
        """
        seen = {"t": self.words, "authored": self.text, **values}
        try:
            return Markup(self.templates.get_template(template).render(seen).rstrip("\n"))
        except Exception as error:
            if (failure := TemplateFailure.of(error)) is not None:
                raise failure from error
            raise

    def text(self, text: str) -> Markup:
        """Text of an author that is not Markdown, with its quantities kept together."""
        return text_html(text, direction(self.words.language))

    def highlight(self, language: str, code: str) -> Markup:
        """Code with its tokens marked."""
        return Markup("\n".join(highlight_lines(language, code)))

    def mathml(self, tex: str, display: bool) -> Markup:
        """A formula's MathML; one that does not parse is never rendered (`ValueError`)."""
        found = self.formulas[Formula(tex, display)]
        if isinstance(found, MathError):
            raise ValueError(f"formula {tex!r} does not parse: {found.message}")
        return Markup(found)
