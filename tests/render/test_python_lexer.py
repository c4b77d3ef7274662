"""Python in long strides: what a page shows is what Pygments' own lexer gives, to the byte."""

from __future__ import annotations

import sysconfig
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pygments.lexers.python import PythonLexer

from coursebuild.render import highlight
from coursebuild.render.python_lexer import FastPythonLexer

OURS = FastPythonLexer(stripnl=False, ensurenl=False)
PYGMENTS = PythonLexer(stripnl=False, ensurenl=False)
LIBRARY = Path(sysconfig.get_path("stdlib"))

PIECES = [
    *"\n'\"#:.,()[]{}%\\@=!~0e_ \t\f$é²\u00a0",
    '"""',
    "'''",
    "\n    ",
    "\n\n",
    "\\\n",
    "{x!r:>{w}}",
    "%(a)s",
    "0x1F",
    "1_0.5e-3j",
    "1.",
    *("def f", "class C", "import a.b", "from .a import", "as", "match x:", "case _:", "_", "lazy"),
    *("async", "for", "yield", "from", "None", "True", "not in", "is", "lambda", "print", "self"),
    *("__init__", "__name__", "ValueError", "r", "b", "u", "f", "rb", "fr", "ifé", "elsewhere"),
]


def shown(code: str, lexer: PythonLexer) -> tuple[str, ...]:
    """The lines of a page."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(highlight, "_lexer", lambda language: lexer)
        return highlight.highlight_lines.__wrapped__("python", code)


@given(st.lists(st.sampled_from(PIECES), max_size=40).map("".join))
@settings(max_examples=400)
def test_any_text_is_shown_as_pygments_shows_it(code: str) -> None:
    assert shown(code, OURS) == shown(code, PYGMENTS)


@pytest.mark.parametrize(
    "name",
    [*("ast", "dataclasses", "enum", "fractions", "statistics", "string", "textwrap", "typing")],
)
def test_the_standard_library_is_shown_as_pygments_shows_it(name: str) -> None:
    code = (LIBRARY / f"{name}.py").read_text(encoding="utf-8")
    assert shown(code, OURS) == shown(code, PYGMENTS)
    half = code[len(code) // 3 :].replace("\n\n", "\n \n", 30).replace("'", '"', 7)
    assert shown(half, OURS) == shown(half, PYGMENTS)


def test_python_is_read_by_it_under_all_its_names() -> None:
    for name in ("python", "py", "python3", "Python"):
        lexer = highlight._lexer(name.lower())
        assert type(lexer) is FastPythonLexer
    assert type(highlight._lexer("pycon")) is not FastPythonLexer


def test_it_makes_few_tokens() -> None:
    code = (LIBRARY / "fractions.py").read_text(encoding="utf-8")
    count = len(list(OURS.get_tokens(code)))
    assert count < len(list(PYGMENTS.get_tokens(code))) / 2
