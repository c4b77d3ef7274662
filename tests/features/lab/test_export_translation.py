"""Lab code as Python: what it becomes, that its values are V8's, and what is refused.

The cases are `translated.md`; `pytest --rewrite-fixtures` writes what is expected anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import indent
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from coursebuild.core.run.v8 import Isolate
from coursebuild.features.lab.export.translate import (
    context_fields,
    translate_expression,
    translate_statements,
)
from coursebuild.features.lab.javascript import UntranslatableError
from support.fixture_cases import Case, check_cases

FIELDS = ("n", "on", "v", "k")


def python(code: str) -> str:
    value = "GAIN" if "value" in code else None
    return "\n".join(translate_statements(code, FIELDS, value))


def refusal(code: str) -> str:
    with pytest.raises(UntranslatableError) as refused:
        translate_statements(code, FIELDS)
    return str(refused.value)


TRANSLATORS: dict[str, Callable[[str], str]] = {
    "statements": python,
    "expressions": lambda code: translate_expression(code, FIELDS),
    "code without a counterpart in Python is refused": refusal,
}


def test_code_becomes_python_or_is_refused(rewriting: bool) -> None:
    def translate_pieces(case: Case) -> str:
        pieces = case.input.rstrip("\n").split("\n\n")
        translate = TRANSLATORS[case.title]
        return "\n".join(f"{code}\n{indent(translate(code), '    ')}\n" for code in pieces)

    check_cases(Path(__file__).with_name("translated.md"), translate_pieces, rewriting=rewriting)


def test_what_only_concerns_the_page_is_left_out_of_buttons() -> None:
    code = "sim.reset(); sim.play()"
    assert translate_statements(code, FIELDS, button=True) == ["reset(model, data, ctx)"]


def test_what_code_assigns_to_is_there_from_the_start() -> None:
    pieces = ["ctx.high = false; ctx.n = ctx.other", "if (ctx.high) { ctx.last = ctx.n = 1 }"]
    assert context_fields(pieces) == {"high": "False", "last": "math.nan", "n": "math.nan"}
    with pytest.raises(UntranslatableError, match=r"the name `ctx\.lambda`"):
        context_fields(["ctx.lambda = 1"])


@pytest.fixture(scope="module")
def v8() -> Iterator[Isolate]:
    isolate = Isolate(
        "const x = 3.5, y = -7.25, data = {qpos: new Float64Array([2.5, -1])};"
        "globalThis.run = (code) => String(eval(code))"
    )
    yield isolate
    isolate.close()


def formulas() -> st.SearchStrategy[str]:
    def larger(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        comparisons = st.sampled_from("< > <= >= === !==".split())
        tests = st.builds("{} {} {}".format, inner, comparisons, inner)
        tests |= st.builds("({}) {} !({})".format, tests, st.sampled_from(["&&", "||"]), tests)
        functions = st.sampled_from("abs floor ceil trunc round sign cos atan".split())
        return st.one_of(
            st.builds("({} {} {})".format, inner, st.sampled_from("+-*/%"), inner),
            st.builds("-{}".format, inner.map("({})".format)),
            st.builds("({} ? {} : {})".format, tests, inner, inner),
            st.builds("Math.{}({})".format, functions, inner),
            st.builds("Math.{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner),
        )

    atoms = "x y 0 1 2 0.5 2.5 1e3 0x10 data.qpos[0] data.qpos[1]".split()
    return st.recursive(st.sampled_from(atoms), larger, max_leaves=12)


@example(code="Math.round(data.qpos[0])")
@given(code=formulas())
def test_values_are_those_of_v8(v8: Isolate, code: str) -> None:
    lines = translate_statements(f"const x = 3.5, y = -7.25\nctx.n = {code}", FIELDS)
    ctx, data = SimpleNamespace(), SimpleNamespace(qpos=np.array([2.5, -1]))
    try:
        with np.errstate(divide="raise", invalid="raise"):
            exec("\n".join(lines), {"np": np, "math": math, "data": data, "ctx": ctx})
    except (ZeroDivisionError, FloatingPointError):  # which is said when the script is tried
        return
    theirs = float(v8.call("run", code, 10.0).replace("Infinity", "inf"))
    assert math.isclose(ctx.n, theirs, rel_tol=1e-9, abs_tol=1e-9)


@pytest.mark.parametrize(
    "code",
    [
        '"it\'s"',
        "'say \"a\\n\"'",
        "'\\u00e9\\x41\\u{1F600} é 😀'",
        "'\\\\ \\' \\0 \\q'",
        '`it\'s "a"\r\n$ {} \\` \\${1} \\u00e9 $`',
        "`$${`}`}${ `{${`'`}` }`",
        "''+``",
        "`${(2.345).toFixed(1)} ${(-1 / 3).toFixed()} ${7}`",
    ],
)
def test_texts_are_those_of_v8(v8: Isolate, code: str) -> None:
    assert eval(translate_expression(code, FIELDS)) == v8.call("run", code, 10.0)
