"""Macros of a course in formulas: what stands for them, and where."""

from __future__ import annotations

import pytest

from coursebuild.core.text.macros import expand_macros
from coursebuild.core.text.source import Excerpt, Source

MACROS = {
    "RR": r"\mathbb{R}",
    "norm": r"\left\lVert #1\right\rVert",
    "of": "#1(#2)",
    "id": "#1",
    "bold": r"\mathbf#1",
    "twice": r"\id{\id{#1}#1}",
    "none": "",
    "num": r"\#1",
    "both": "#1#2",
    "defeq": ":=",
    "loop": r"\loop\loop",
}


@pytest.mark.parametrize(
    ("tex", "expanded"),
    [
        (r"x \in \RR^3", r"x \in \mathbb{R}^3"),
        (r"\norm{a + \norm b} \RRR", r"\left\lVert a + \left\lVert b\right\rVert\right\rVert \RRR"),
        (r"\of f{\{x\}} \of\alpha x", r"f(\{x\}) \alpha(x)"),
        (r"\bold{x}\id{\alpha}x\beta\id{y}", r"\mathbf x\alpha x\beta y"),
        (
            r"\dot\RR \frac1\RR \cdot\RR \num",
            r"\dot{\mathbb{R}} \frac1{\mathbb{R}} \cdot\mathbb{R} \#1",
        ),
        (r"\both{\alpha}{b} \RR\defeq\RR", r"\alpha b \mathbb{R}:=\mathbb{R}"),
        (r"\twice{\RR}", r"\mathbb{R}\mathbb{R}"),
        (r"x_\RR^ \norm{x}", r"x_{\mathbb{R}}^ {\left\lVert x\right\rVert}"),
        (r"a\none b \\RR", r"a b \\RR"),
        (r"\def\RR{R}\newcommand{\id}{i} \RR\id", r"\def\RR{R}\newcommand{\id}{i} \RR\id"),
        (r"\frac{\norm}{\of a}", r"\frac{\norm}{\of a}"),
    ],
)
def test_a_macro_is_what_stands_for_it_with_its_arguments(tex: str, expanded: str) -> None:
    assert expand_macros(Excerpt.of_span(Source("x.md", tex).span()), MACROS).text == expanded


def test_what_stands_for_a_macro_is_where_the_macro_begins_and_an_argument_where_it_was() -> None:
    tex = r"a \norm{xy} b"
    expansion = expand_macros(Excerpt.of_span(Source("x.md", tex).span()), MACROS)
    for part, place in ((r"\left\lVert ", "\\"), ("xy", "xy"), ("b", "b"), ("a", "a")):
        start = expansion.text.index(part)
        assert expansion.span(start, start + len(part)).text == place


def test_macros_without_an_end_are_left_at_some_point() -> None:
    loop = Excerpt.of_span(Source("x.md", r"\loop").span())
    assert r"\loop" in expand_macros(loop, MACROS).text
