"""What Python says of a text: the same as a plain `compile` and `ast.parse` say."""

from __future__ import annotations

import ast
import sysconfig
import warnings
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coursebuild import python_text
from coursebuild.python_text import python_mistake, text_key, top_level

LIBRARY = Path(sysconfig.get_path("stdlib"))
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


def seen(body: list[ast.stmt] | None) -> object:
    """All of a text's statements that is said of them."""
    if body is None:
        return None
    outside: list[object] = []
    for one in body:
        if isinstance(one, DEFINITIONS):
            decorators = [ast.dump(each, include_attributes=True) for each in one.decorator_list]
            outside.append((type(one), one.name, one.lineno, decorators))
        else:
            outside.append(ast.dump(one, include_attributes=True))
    nodes = [node for one in body for node in ast.walk(one)]
    imports = [ast.dump(n) for n in nodes if isinstance(n, ast.Import | ast.ImportFrom)]
    return outside, sorted(imports)


parsed = python_text._parse

QUOTED = st.text("ab\n\t\\\"'{}#:fr! ", max_size=8)
STRINGS = st.builds(
    lambda prefix, quote, text: f"{prefix}{quote}{text}{quote}",
    st.sampled_from(["", "f", "r", "b", "rb", "fR", "F", "u"]),
    st.sampled_from(['"', "'", '"""', "'''"]),
    st.one_of(
        QUOTED,
        st.sampled_from(
            [
                "\ndef inner():\n    pass\n",
                "\nclass C:\n\n    import hidden\n",
                "{a}{{ {b:>{w}}",
                "{'x'}{'{y}'}",
                '{"a}"}',
                "{x:#x}",
                "\\N{DASH}{n!r}",
                "{''}",
                "{a # b\n}",
            ]
        ),
    ),
)
EXPRESSIONS = st.one_of(
    st.sampled_from(
        ["x", "1", "(a, b)", "[\n1,\n    2]", "{1:\n    2}", "a[1:\n  2]", "(\n# c\n1)"]
    ),
    STRINGS,
    st.builds("({}\n,\n    {})".format, STRINGS, STRINGS),
    st.builds("[{}\nif x else\n  {}]".format, STRINGS, STRINGS),
)
LINES = st.one_of(
    st.builds("{}\n".format, EXPRESSIONS),
    st.builds("y = {}  # it's\n".format, EXPRESSIONS),
    st.builds("if{}:\n        z = {}\n".format, STRINGS, EXPRESSIONS),
    st.sampled_from(["import a.b\n", "from c import d\n", "pass\n", "x = 1 + \\\n  2\n"]),
)
HEADS = st.sampled_from(
    [
        "def f():\n",
        "async def g(a: int) -> str:\n",
        "class C(B):\n",
        "@d\ndef f(a, b=(1,\n    2)):\n",
        "def f(a: lambda:\n    0):\n",
        "def f(a: lambda:\n    0, b=x[\n1:\n]):\n",
        "class C(x[1:\n    2], metaclass=M):\n",
        "def f(): import one; x = {1:\n    2}\n",
        "class C: x = y[1:\n    2]\n",
        "def ﬁ():\n",
        "def x℘(a) -> (int):\n",
        "async  def\tg():\n",
        "class \tD:\n",
        "def  f(a:\n   int):  # says\n",
        "class C:  \n",
        "def f(x='a:'):\n",
        "if __name__ == '__main__':\n",
        "for i in (1,\n2):\n",
    ]
)
BODIES = st.lists(
    st.one_of(
        LINES.map("    {}".format),
        st.sampled_from(["\n", "    \n", "# left\n", "\t\n", "    # in\n", "\f    x\n", "    ;\n"]),
    ),
    min_size=1,
    max_size=4,
).map("".join)
PROGRAMS = st.lists(
    st.one_of(
        LINES,
        st.builds("{}{}".format, HEADS, BODIES),
        st.sampled_from(
            ["\n", "# def f():\n", "\r\n", "x = '''\n", "y = [\n", "]\n", "\\\n", "\f"]
        ),
    ),
    max_size=6,
).map("".join)
PIECES = st.lists(
    st.sampled_from(
        [
            *('"', "'", '"""', "'''", "#", "\n", "\\", "(", ")", "[", "]", "{", "}", ":", ",", "x"),
            *("def f():\n", "class C:\n", " pass\n", "    import a\n", "\n    ", "=", "f", "\t"),
        ]
    ),
    max_size=16,
).map("".join)


@given(st.one_of(PROGRAMS, PIECES))
@settings(max_examples=400)
@example('def f():\n    """\ndef g():\n    """\n    import a\n')
@example("def f():\n    x = [\n1]\ndef g():\n    y\n")
@example("def f(x=[lambda:\n 1\n]):\n    y\n")
@example("def f(): import a; x = {1:\n 2}\n")
@example("def x℘(a):\n    y\n")
@example("def f(a:\n\n    int):\n    x\n")
@example("x = '''\ndef f():\n    '''\nimport a\nz = '''\n    '''\n")
@example("def f():\n    a\n# c\n    import b\n")
@example("def f():\n a\n# c\n b\nx\n")
@example("if f'{a'\ndef f():\n    pass\n")
@example("class A:\n    f'''{\"}'''\"}'''\n    import b\n")
def test_statements_are_those_of_the_whole_text(code: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert seen(top_level(code)) == seen(parsed(code))


@pytest.mark.parametrize("name", ["ast", "enum", "fractions", "inspect", "textwrap", "typing"])
def test_the_standard_library_has_its_statements(name: str) -> None:
    code = (LIBRARY / f"{name}.py").read_text(encoding="utf-8")
    assert seen(top_level(code)) == seen(parsed(code))


def test_bodies_are_left_out_of_an_ordinary_script() -> None:
    code = (
        '"""A script."""\n\nimport math\n\n\n@cache\ndef f(x: float) -> float:\n'
        '    """It\'s x."""\n    print(f"{x:.3f}\\n", "def g():")  # "\n\n'
        "    return math.sin(x)\n\n\n"
        'class C:\n    x = """\nimport nothing\n"""\n\n\ndef g():\n    import b\n'
    )
    short = python_text._without_bodies(code)
    assert short is not None
    assert "return" not in short
    assert "float" not in short
    assert "nothing" in short  # which looks like an import
    assert "import b" in short
    assert short.count("\n") == code.count("\n") + 1
    assert seen(top_level(code)) == seen(parsed(code))


@given(st.one_of(PROGRAMS, PIECES))
@settings(max_examples=100)
def test_a_last_line_end_makes_no_other_text(code: str) -> None:
    if not code.endswith(("\n", "\\")):
        assert text_key(code) == text_key(f"{code}\n")
        assert python_text._compile(code) == python_text._compile(f"{code}\n")


def test_more_line_ends_make_another_text() -> None:
    assert (
        len({text_key(text) for text in ("if x:", "if x:\n\n", "if x:\n\n\n", "x\\", "x\\\n")}) == 5
    )


def test_what_the_compiler_finds_last_is_a_mistake_too() -> None:
    mistake = python_mistake("def f():\n    x = 1\nreturn 2\n")
    assert mistake is not None
    assert (mistake.line, mistake.message) == (3, "'return' outside function")
    assert seen(top_level("return 2\n")) == seen(parsed("return 2\n"))


def test_few_texts_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(python_text, "_known", {})
    monkeypatch.setattr(python_text, "_MOST", 3)
    for number in range(9):
        assert python_mistake(f"x = {number}") is None
        assert len(python_text._known) <= 3
    assert python_mistake("x =") is not None
