"""Templates write what Jinja writes, and refuse what is no part of their language."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jinja2
import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.effects.prepared import prepared_template
from coursebuild.effects.resources import template_texts
from coursebuild.render import templates as module
from coursebuild.render.template_code import python_of
from coursebuild.render.templates import Templates, Values
from tests.render.test_site import LESSON, options

Make = Callable[..., Any]


def jinja(texts: Mapping[str, str]) -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.DictLoader(texts),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


class Thing(NamedTuple):
    name: object
    parts: tuple[object, ...] = ()


def said(key: str, **values: object) -> str:
    return f"{key} {sorted(values.items())}"


INNER = "<i>{{ a }}{% if b is not none %}, {{ b }}{% endif %}</i>\n"
PIECES = (
    "text <b>\n",
    "{{ a }}",
    "{{ a or 'no\"ne' }}{{ a and b }}",
    "{{ '' -}}   \n",
    '{{ t("key", n=c|length) }}',
    "{{ 'a' ~ a ~ b }}",
    "{{ c|join(', ') }}",
    "{{ c|join(' & ') }}",
    "{{ (c + d)|join('; ') }}",
    "{{ e.name }}{{ e.parts|length }}",
    "{{ d[0] }}{{ f[g] }}",
    "{{ a|urlencode }}",
    "{{ things|map(attribute='name')|join(', ') }}",
    "{{ things|selectattr('parts')|list|length }}",
    "{% include 'inner' %}",
    "  {% if a %}\n  yes\n  {% elif b is none %}\n  none\n  {% else %}\n  no\n  {% endif %}\n",
    "{% if not a and (g == 1 or g > 2) %}x{% endif %}",
    "{% if g in (1, 2) and g not in d %}x{% endif %}",
    "{% for x in c %}{{ x }}{% if not loop.last %}, {% endif %}{% endfor %}",
    "{% for x in c %}{{ loop.first }}{{ loop.index }}{{ loop.index0 }}{% endfor %}",
    "{% for x in c if x != a %}{{ x }}{{ loop.last }}{% else %}nothing{% endfor %}",
    "{% for x, a in pairs %}{{ x }}{{ a }}{% include 'inner' %}{% endfor %}{{ a }}",
    "{% for x in things %}{% for y in x.parts if y %}{{ y }}{{ loop.index }}{% endfor %}"
    "{{ loop.index }}{% endfor %}",
    "{% for x in c %}{% endfor %}",
    "{% with a = b, h = a %}{{ a }}{{ h }}{% include 'inner' %}{% endwith %}{{ a }}",
    "{# nothing #}\n",
    "{% set b %}<b>{{ a }}</b>{% endset %}{{ b }}{% include 'inner' %}",
)
LEAVES = st.one_of(
    st.text("ab<>&'\"é ", max_size=4),
    st.integers(0, 3),
    st.none(),
    st.builds(Markup, st.sampled_from(("<b>x</b>", "", "&amp;"))),
)
LISTS = st.lists(LEAVES, max_size=3)


@given(
    st.lists(st.sampled_from(PIECES), max_size=6).map("".join),
    st.fixed_dictionaries(
        {
            "a": LEAVES,
            "b": LEAVES,
            "c": LISTS,
            "pairs": st.lists(st.tuples(LEAVES, LEAVES), max_size=2),
            "things": st.lists(st.builds(Thing, LEAVES, LISTS.map(tuple)), max_size=2),
        }
    ),
    st.integers(0, 3),
)
def test_they_write_what_jinja_writes(text: str, values: dict[str, Any], number: int) -> None:
    texts = {"outer": text, "inner": INNER}
    seen = {
        **values,
        "t": said,
        "d": [1, "<"],
        "e": Thing("&", (1,)),
        "f": {n: f"<{n}>" for n in range(4)},
        "g": number,
    }
    assert Templates(texts).render("outer", seen) == jinja(texts).get_template("outer").render(seen)


def test_the_templates_of_pages_write_what_jinja_writes(
    monkeypatch: pytest.MonkeyPatch, make: Make
) -> None:
    environment = jinja(dict(template_texts()))
    ours, names = Templates.render, set()

    def both(self: Templates, name: str, values: Values) -> str:
        text = ours(self, name, values)
        assert text == environment.get_template(name).render(values)
        names.add(name)
        return text

    monkeypatch.setattr(Templates, "render", both)
    make(LESSON).site(options())
    assert {"base.html", "lesson.html", "partials/toc.html", "blocks/script.html"} <= names


@pytest.mark.parametrize(
    "text",
    [
        "{{ a|upper }}",
        "{% for x in a recursive %}{% endfor %}",
        "{{ loop }}",
        "{% for x in a %}{{ loop.cycle(1) }}{% endfor %}",
        "{% include a %}",
        "{% if a is defined %}{% endif %}",
        "{% if a %}{% set b %}{% endset %}{% endif %}",
        "{{ f(*a) }}",
        "{% macro m() %}{% endmacro %}",
        "{{ 1 if a else 2 }}",
    ],
)
def test_what_they_do_not_know_is_refused(text: str) -> None:
    if text == "{{ loop }}":
        with pytest.raises(KeyError):
            Templates({"x": text}).render("x", {})
        return
    with pytest.raises(TypeError, match="templates have no"):
        python_of(text)


@pytest.mark.parametrize("text", ["{{ a }}", "{% if a %}{% endif %}", "{{ t.missing }}"])
def test_what_is_not_there_is_an_error(text: str) -> None:
    with pytest.raises((KeyError, AttributeError)):
        Templates({"x": text}).render("x", {"t": ""})
    with pytest.raises(KeyError):
        Templates({}).render("x", {})


class Kept:
    """What compiling templates asks for, without a store."""

    def __init__(self) -> None:
        self.codes: dict[str, bytes] = {}

    def load(self, name: str) -> bytes | None:
        return self.codes.get(name)

    def generated(self, name: str) -> str | None:
        return prepared_template(name)

    def keep(self, name: str, data: bytes) -> None:
        self.codes[name] = data


def test_no_template_that_came_with_the_tool_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    kept, texts = Kept(), {k: v for k, v in template_texts() if k.endswith(".html")}

    def read(_: str) -> str:
        raise AssertionError("it was read")

    monkeypatch.setattr(module, "_source", read)
    for _ in range(2):  # the second time from what was kept
        templates = Templates(texts, kept)
        for name in texts:
            assert callable(templates._function(name))
        assert len(kept.codes) == len(texts)


def test_a_template_that_was_changed_is_read() -> None:
    kept = Kept()
    for _ in range(2):
        templates = Templates({"notfound.html": "now {{ what }}"}, kept)
        assert templates.render("notfound.html", {"what": "else"}) == "now else"
        assert len(kept.codes) == 1
