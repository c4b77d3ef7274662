"""Lab code as Python: what it gives is what V8 gives, to the last digit."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.run.v8 import Isolate
from coursebuild.features.lab.export import helpers
from coursebuild.features.lab.export.statements import translate_expression, translate_statements
from coursebuild.features.lab.export.values import Type

CONTEXT: dict[str, Type] = {"n": "num"}

VALUES = "const x = -0, y = -7.25, z = 0.1, i = 5, data = {qpos: new Float64Array([2.5, -0])}"
ATOMS = "x y z 0 1 2 3 0.5 1.5 2.5 1e3 1e-3 0x10 4294967296 1e300 data.qpos[0] data.qpos[1]".split()
FUNCTIONS = "abs floor ceil trunc round sign sqrt".split()
INEXACT = "sin cos tan exp log1p atan tanh cbrt log2 expm1 asinh".split()


@pytest.fixture(scope="module")
def v8() -> Iterator[Isolate]:
    isolate = Isolate(
        f"{VALUES}; globalThis.run = (code) => {{ const v = eval(code); "
        "return Object.is(v, -0) ? '-0' : String(v) }"
    )
    yield isolate
    isolate.close()


def formulas(functions: list[str]) -> st.SearchStrategy[str]:
    def larger(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        tests = st.builds(
            "({} {} {})".format, inner, st.sampled_from("< > <= >= === !==".split()), inner
        )
        conditions = tests | inner | st.builds("!({})".format, inner)
        conditions |= st.builds(
            "(({}) {} ({}))".format, conditions, st.sampled_from(["&&", "||"]), conditions
        )
        return st.one_of(
            st.builds("{} {} {}".format, inner, st.sampled_from("+-*/%"), inner),
            st.builds("({} {} {})".format, inner, st.sampled_from("+-*/%"), inner),
            st.builds("-({})".format, inner),
            st.builds("({} ? {} : {})".format, conditions, inner, inner),
            st.builds("Math.{}({})".format, st.sampled_from(functions), inner),
            st.builds("Math.{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner),
        )

    return st.recursive(st.sampled_from(ATOMS), larger, max_leaves=12)


def python_value(code: str) -> float | None:
    """The value of an expression in Python; `None` where Python raises for a division by zero."""
    declared = "const x = -0, y = -7.25, z = 0.1, i = 5\n"
    lines = translate_statements(f"{declared}ctx.n = {code}", CONTEXT).lines
    scope = {
        **vars(helpers),
        "data": SimpleNamespace(qpos=np.array([2.5, -0.0])),
        "ctx": SimpleNamespace(n=None),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            exec("\n".join(lines), scope)
        except (ZeroDivisionError, OverflowError):
            return None
    value = scope["ctx"].n
    assert isinstance(value, float)
    return float(value)


def same(mine: float, theirs: float) -> bool:
    if math.isnan(mine) or math.isnan(theirs):
        return math.isnan(mine) and math.isnan(theirs)
    return mine == theirs and math.copysign(1, mine) == math.copysign(1, theirs)


FORMS = ["", ".toFixed()", ".toFixed(2)", ".toFixed(100)", ".toPrecision(1)", ".toPrecision(3)"]
FORMS += [".toPrecision(17)", ".toPrecision(100)", ".toExponential(0)", ".toExponential(4)"]
TIES = [
    0.5,
    1.5,
    2.5,
    -0.5,
    1.25,
    1.005,
    0.045,
    9.5,
    99.95,
    1e21,
    1e-6,
    1e-7,
    123456789012345680000,
]
WRITTEN = st.one_of(
    st.floats(),
    st.floats(-100, 100),
    st.sampled_from([*TIES, 1e20, 999999999999999868928, 5e-324, -0.0, 0.1 + 0.2, 1e300, 9.995]),
    st.integers(-4000, 4000).map(lambda n: n / 8),
)


@given(x=WRITTEN, form=st.sampled_from(FORMS))
def test_numbers_are_written_as_v8_writes_them(v8: Isolate, x: float, form: str) -> None:
    made = translate_expression(f"`${{ctx.n{form}}}`", CONTEXT).text
    scope = {**vars(helpers), "ctx": SimpleNamespace(n=np.float64(x))}
    number = "NaN" if math.isnan(x) else repr(x).replace("inf", "Infinity")
    assert eval(made, scope) == v8.call("run", f"`${{({number}){form}}}`", 10.0)


@given(code=formulas(FUNCTIONS))
def test_numbers_are_those_of_v8(v8: Isolate, code: str) -> None:
    mine = python_value(code)
    if mine is not None:
        assert same(mine, float(v8.call("run", code, 10.0).replace("Infinity", "inf")))


@pytest.mark.parametrize("name", INEXACT)
@pytest.mark.parametrize("x", ["-0", "0.3", "-2.7", "1e300", "1e-300"])
def test_functions_are_those_of_v8_but_for_the_last_bits(v8: Isolate, name: str, x: str) -> None:
    mine = python_value(f"Math.{name}({x})")
    theirs = float(v8.call("run", f"Math.{name}({x})", 10.0).replace("Infinity", "inf"))
    assert mine is not None
    assert same(mine, theirs) or math.isclose(mine, theirs, rel_tol=4 * sys.float_info.epsilon)


@pytest.mark.parametrize("base", ["-8", "0.5", "1", "-1", "0"])
@pytest.mark.parametrize("exponent", ["0.5", "2", "-3", "(0 * 1e300 * 1e300 * 1e300 - 0)", "1e300"])
def test_powers_are_those_of_v8(v8: Isolate, base: str, exponent: str) -> None:
    code = f"({base}) ** {exponent}"
    mine, theirs = python_value(code), float(v8.call("run", code, 9.0).replace("Infinity", "inf"))
    assert mine is not None and (same(mine, theirs) or math.isclose(mine, theirs, rel_tol=1e-15))


@pytest.mark.parametrize(
    "code",
    [
        '"it\'s"',
        "'say \"a\\n\"'",
        "'\\u00e9\\x41\\u{1F600} é 😀'",
        "'\\\\ \\' \\0 \\q'",
        '`it\'s "a"\r\n$ {} \\` \\${1} \\u00e9 $`',
        "`$${`}`}${ `{${'`'}` }`",
        "''+``",
    ],
)
def test_texts_are_those_of_v8(v8: Isolate, code: str) -> None:
    made = translate_expression(code, CONTEXT).text
    assert eval(made) == v8.call("run", code, 10.0)


def test_random_numbers_are_those_of_the_lab() -> None:
    random = helpers.Random(7)
    first = [random() for _ in range(5)]
    random.restart()
    assert first == [random() for _ in range(5)] and all(0 <= x < 1 for x in first)
