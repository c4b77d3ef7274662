"""The renderer of pages: words, templates, formulas.

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

        Templates can use `t`, the interface texts, and `authored`, see `text`.
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
        return Markup("\n".join(highlight_lines(language, code)))

    def mathml(self, tex: str, display: bool) -> Markup:
        """A formula's MathML; one that does not parse is never rendered (`ValueError`)."""
        html = self.formulas[Formula(tex, display)]
        if isinstance(html, MathError):
            raise ValueError(f"formula {tex!r} does not parse: {html.message}")
        return Markup(html)
