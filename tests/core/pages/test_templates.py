"""Templates are those that were compiled when the tool was bundled, until they are edited."""

from __future__ import annotations

from pathlib import Path

import pytest
from jinja2 import TemplateNotFound, UndefinedError
from markupsafe import Markup

from coursebuild.core.pages.renderer import compile_templates, templates_of

TEXTS = (
    ("page.html", "<p>{{ a }}{% include 'part.html' %}</p>\n"),
    ("part.html", "{% for x in b %}{{ x }}{% if not loop.last %}, {% endif %}{% endfor %}\n"),
    ("strings/en.toml", "a = 1"),
)
VALUES = {"a": "<&>", "b": (Markup("<b>1</b>"), "2")}
RENDERED_HTML = "<p>&lt;&amp;&gt;<b>1</b>, 2</p>\n"


def test_compiled_templates_write_what_their_texts_do(tmp_path: Path) -> None:
    compile_templates(TEXTS, tmp_path)
    for folder in (tmp_path, None):
        assert templates_of(TEXTS, folder).get_template("page.html").render(VALUES) == RENDERED_HTML


def test_an_edited_template_is_not_taken_from_what_was_compiled(tmp_path: Path) -> None:
    compile_templates(TEXTS, tmp_path)
    texts = (TEXTS[0], ("part.html", "edited"))
    assert templates_of(texts, tmp_path).get_template("part.html").render() == "edited"


def test_what_is_not_there_is_an_error() -> None:
    for text in ("{{ a }}", "{% if a %}{% endif %}", "{{ t.missing }}"):
        with pytest.raises(UndefinedError):
            templates_of((("x.html", text),)).get_template("x.html").render(t="")
    with pytest.raises(TemplateNotFound):
        templates_of(()).get_template("x.html")
