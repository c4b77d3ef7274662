"""Python in long strides: what a page shows is what Pygments' own lexer gives, to the byte."""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pygments import unistring
from pygments.lexers.python import PythonLexer
from pygments.token import Name

from coursebuild.render.highlight import PYTHON, highlight_lines, marked
from coursebuild.render.lexers import class_of
from coursebuild.render.python_lexer import LETTERS, MAGIC, python_runs

PYGMENTS = PythonLexer(stripnl=False, ensurenl=False)
LIBRARY = Path(sysconfig.get_path("stdlib"))

PIECES = [
    *"\n'\"#:.,()[]{}%\\@=!~0e_ \t\f$é²\u00a0",
    '"""',
    "'''",
    "\n    ",
    "\n\n",
    "\n   \n",
    "\\\n",
    "\\N{DASH}",
    "{x!r:>{w}}",
    "{a[0]:.3f}",
    "{'b' if c}",
    "{n=}",
    "{{",
    "}}",
    '{:"<5}',
    "%(a)s",
    "0x1F",
    "1_0.5e-3j",
    "1.",
    *("def f", "class C", "import a.b", "from .a import", "as", "match x:", "case _:", "_", "lazy"),
    *("from x", "import a as b, c", " as ", "from None", "import", "raise e from", "yield from"),
    *("async", "for", "yield", "from", "None", "True", "not in", "is", "lambda", "print", "self"),
    *("__init__", "__name__", "ValueError", "r", "b", "u", "f", "rb", "fr", "ifé", "elsewhere"),
    *('f"', "f'''", '"a"', "@d", "def __init__(", "θ", "lambda θé:", "ж"),
]


def shown(code: str) -> list[str]:
    """The lines of a page."""
    lines = marked(python_runs(code)).split("\n")
    assert highlight_lines("python", code) == tuple(lines)
    return lines


def by_pygments(code: str) -> list[str]:
    found = [(class_of(token), text) for token, text in PYGMENTS.get_tokens(code)]
    assert "".join(text for _, text in found) == code
    return marked(found).split("\n")


@given(
    st.lists(st.sampled_from(PIECES), max_size=40).map("".join).map(lambda t: t.replace("\f", ""))
)
@settings(max_examples=200)
@example("import a\n\n  , if\n")
@example("import as as b, c\nas d\n")
@example("from a.as import as\n")
@example("raise E from None\nraise E from x.y\nyield from a\nyield  from None\n")
@example('x = f"{a:{b}}}}" f"{ {1: 2} }" f"{x!r}" f"{x = }" f"{x==y}" f"{a[1:2]:>{w}.{p}f}"\n')
@example("f'{f\"{f'{x}'}\"}' f'{x['a']}' f'''{\nx}''' f\"\"\"a\n\"b\" {c}\\\"\"\"\"\n")
@example('"%d {} {{0}} {a.b[0]} {:>5} %" % (1,)\n')
@example("def f():\n    '''Doc'''\n    \"Plain\"\n    r'''Raw'''\n\n\n   \n  '''Not'''\n")
@example("x = 1 \\\n  '''doc'''\nmatch x:\n    case _:\n        match = 2\n")
@example('f"' + '{f"' * 50)
def test_any_text_is_shown_as_pygments_shows_it(code: str) -> None:
    assert shown(code) == by_pygments(code)


@pytest.mark.parametrize(
    "name",
    [*("ast", "dataclasses", "enum", "fractions", "statistics", "string", "textwrap", "typing")],
)
def test_the_standard_library_is_shown_as_pygments_shows_it(name: str) -> None:
    code = (LIBRARY / f"{name}.py").read_text(encoding="utf-8").replace("\f", "")
    assert shown(code) == by_pygments(code)
    half = code[len(code) // 3 :].replace("\n\n", "\n \n", 30).replace("'", '"', 7)
    assert shown(half) == by_pygments(half)


def test_what_it_knows_by_heart_is_what_pygments_knows() -> None:
    def tokens(name: str) -> list[object]:
        return [token for token, text in PYGMENTS.get_tokens(name) if text == name]

    special = {f"__{name.strip('_')}__" for name in (*dir(int), *dir(list), *dir(type))}
    for name in (*MAGIC, *special):
        assert (Name.Function.Magic in tokens(name)) == (name in MAGIC), name
    rules = str(PythonLexer.tokens["magicfuncs"][0][0].words)
    assert all(f"'{name}'" in rules for name in MAGIC)
    assert rules.count("__'") == len(MAGIC)
    letters = re.compile(f"[{LETTERS}]")
    start = re.compile(f"[{unistring.xid_start}]")
    known = [chr(code) for code in range(0x10000) if letters.match(chr(code))]
    assert len(known) > 300
    assert all(start.match(letter) for letter in known)
    assert set(PythonLexer.aliases) == PYTHON


def test_python_has_the_same_colours_under_all_its_names() -> None:
    for name in ("python", "py", "python3", "Python"):
        assert highlight_lines(name, "def f(): 1") == highlight_lines("python", "def f(): 1")


@pytest.mark.site
def test_an_ordinary_script_needs_no_pygments() -> None:
    code = (
        '"""Title."""\n\nimport math as m\nfrom a.b import (c,\n    d)\n\nΔθ = 0.1  # rad\n\n\n'
        '@cache\ndef f(x: float) -> float:\n    """Doc."""\n'
        '    print(f"{x:.3f} {m.sin(x)!r:>{9}}")\n'
        '    print("%d %%" % x, "{} {{".format(x), b"\\x00", f"""\n  {x["a"]}""")\n'
        "    raise ValueError(__name__) from None\n\n\nclass C:\n"
        "    def __init__(self):\n        super().__init__()\n        re.match(x)\n"
    )
    script = (
        "import sys\nfrom coursebuild.render.highlight import highlight_lines\n"
        f"highlight_lines('python', {code!r})\nhighlight_lines('text', 'x')\n"
        "print('pygments' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
    assert shown(code) == by_pygments(code)


def test_it_makes_few_runs() -> None:
    code = (LIBRARY / "fractions.py").read_text(encoding="utf-8")
    assert len(python_runs(code)) < len(list(PYGMENTS.get_tokens(code))) / 2
