"""Lab code as Python: what it becomes, that its values are V8's, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Iterator
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

FIELDS = ("n", "on", "v", "k")


@pytest.mark.parametrize(
    "code, python",
    [
        ("data.qvel[3] = 6; data.qvel[4] = .001", "data.qvel[3] = 6\ndata.qvel[4] = 0.001"),
        ("data.qpos[0] = data.qvel[1] = 0", "data.qpos[0] = data.qvel[1] = 0"),
        ("ctx.n = 1, ctx.n--; ; // end", "ctx.n = 1\nctx.n -= 1"),
        ("data.qvel[0] -= value * data.qvel[0]", "data.qvel[0] -= GAIN * data.qvel[0]"),
        ("ctx.n %= 3", "ctx.n = np.fmod(ctx.n, 3)"),
        ("(model.opt.gravity[2]\n) = -9.81", "model.opt.gravity[2] = -9.81"),
        ("model.geom_rgba[3] *= 0.1", "model.geom_rgba.flat[3] *= 0.1"),
        ("ctx.n = model.geom_rgba[3]", "ctx.n = float(model.geom_rgba.flat[3])"),
        ("model.pair_solref[0] = -value", "model.pair_solref.flat[0] = -GAIN"),
        (
            "data.mocap_quat.set([1, 0, 0, value], 4)",
            "data.mocap_quat.reshape(-1)[4:8] = [1, 0, 0, GAIN]",
        ),
        ("data.qvel.set(ctx.v, 3)", "data.qvel[3:3 + ctx.v.size] = ctx.v"),
        ("data.qvel.fill(0, 1, 3)", "data.qvel[1:3] = 0"),
        ("ctx.v = data.qpos.slice(3, 7)", "ctx.v = data.qpos[3:7].copy()"),
        ("ctx.on = !ctx.on && sim.time >= 1", "ctx.on = not ctx.on and data.time >= 1"),
        ("if (ctx.on) { } else ctx.n = 1", "if ctx.on:\n    pass\nelse:\n    ctx.n = 1"),
        (
            "if (ctx.n < 1) ctx.n = 1; else if (ctx.on) return",
            "if ctx.n < 1:\n    ctx.n = 1\nelif ctx.on:\n    return",
        ),
        (
            "for (let i = model.nv - 1; i >= 0; i -= 2) data.qvel[3 * i] *= 2",
            "for i in range(model.nv - 1, -1, -2):\n    data.qvel[3 * i] *= 2",
        ),
        (
            "for (let i = 0; i < data.qpos.length; i++) { if (ctx.on) continue; break }",
            "for i in range(data.qpos.size):\n    if ctx.on:\n        continue\n    break",
        ),
        ("const a = 1, N = 2, lambda = a + N", "a = 1\nN_ = 2\nlambda_ = a + N_"),
        ("let s = 0\nwhile (s < 3) s += 1", "s = 0\nwhile s < 3:\n    s += 1"),
        ("ctx.n = ctx.n !== 1 !== ctx.on", "ctx.n = (ctx.n != 1) != ctx.on"),
        ("data.qpos[ctx.n] = 1", "data.qpos[int(ctx.n)] = 1"),
        ("ctx.n = Math.sin(Math.PI * ctx.n) ** 2", "ctx.n = np.sin(math.pi * ctx.n) ** 2"),
        ("ctx.n = Math.max(...ctx.v, 0)", "ctx.n = max(*ctx.v, 0)"),
        (
            "data.xfrc_applied[6 * lib.bodyId('b')] = 1",
            "data.xfrc_applied.flat[6 * model.body('b').id] = 1",
        ),
    ],
)
def test_statements_become_those_of_python(code: str, python: str) -> None:
    value = "GAIN" if "value" in code else None
    assert "\n".join(translate_statements(code, FIELDS, value)) == python


def test_what_only_concerns_the_page_is_left_out_of_buttons() -> None:
    code = "sim.reset(); sim.play()"
    assert translate_statements(code, FIELDS, button=True) == ["reset(model, data, ctx)"]


def test_what_code_assigns_to_is_there_from_the_start() -> None:
    pieces = ["ctx.high = false; ctx.n = ctx.other", "if (ctx.high) { ctx.last = ctx.n = 1 }"]
    assert context_fields(pieces) == {"high": "False", "last": "math.nan", "n": "math.nan"}
    with pytest.raises(UntranslatableError, match=r"the name `ctx\.lambda`"):
        context_fields(["ctx.lambda = 1"])


@pytest.mark.parametrize(
    "code, python",
    [
        ("lib.energy().kinetic", "energy(model, data).kinetic"),
        ("data.ncon > 0 ? 'a' : \"b\\n\"", "'a' if data.ncon > 0 else 'b\\n'"),
        ("`z = ${data.qpos[2].toFixed(2)} m`", "'z = ' + format(data.qpos[2], '.2f') + ' m'"),
        ("`${ctx.on}, ${1}`", "str(ctx.on) + ', ' + str(1)"),
        ("'n = ' + ctx.n", "'n = ' + str(ctx.n)"),
        ("Math.hypot(...data.qvel.slice(3, 6))", "math.hypot(*data.qvel[3:6].copy())"),
        ("mj.mjtObj.mjOBJ_BODY.value", "mujoco.mjtObj.mjOBJ_BODY.value"),
        ("ctx.on ? ctx.n : null", "ctx.n if ctx.on else math.nan"),
    ],
)
def test_expressions_become_those_of_python(code: str, python: str) -> None:
    assert translate_expression(code, FIELDS) == python


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


@pytest.mark.parametrize(
    "code",
    """\
data.qvel[0] = lib.random()
data.qvel[0] = ctx.other
data.nothing[0] = 1
data.qpos[0] = 1 << 2
data.qpos[0] = parseFloat('1')
data?.qpos
ctx.k.x = 1
const s = ctx.n.toFixed(ctx.k)
const o = {a: 1}
const model = 1
const a = 1; { const a = 2 }
var w = 1
for (const x of data.qpos) ctx.n += x
for (;;) break
return 1
ctx.on && (ctx.n = 1)
sim.step(3)
mj.FS_unlink('x')
é = 1
ctx['n'] = 1
label: ctx.n = 1""".splitlines(),
)
def test_code_without_a_counterpart_in_python_is_refused(code: str) -> None:
    with pytest.raises(UntranslatableError):
        translate_statements(code, FIELDS)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("ctx.n = (a) => {\n  a\n}", "`(a) => {`"),
        ("new Float64Array(3)", "`new Float64Array(3)`"),
        ("ctx.n = data?.qpos", "`data?.qpos`"),
        ("ctx.n = 'a", "code that cannot be read"),
        ("ctx.n = 1n", "the number `1n`"),
        ("const s = '\\ud800'", "the escape `\\ud800`"),
        ("const s = '\\u{110000}'", "the escape `\\u{110000}`"),
        ("const s = `a\\\nb`", "the escape `\\\n`"),
        ("const s = '\ud800'", "half of a character"),
        ("const s = f`1`", "a template behind a name or a value"),
        ("ctx.v = [1, , 2]", "an array with holes"),
        ("let u", "`u` without a value"),
        ("break now", "`break now`"),
        ("ctx.n = 1; 2", "`2`"),
    ],
)
def test_a_refusal_says_what_has_no_counterpart(code: str, message: str) -> None:
    with pytest.raises(UntranslatableError) as refused:
        translate_statements(code, FIELDS)
    assert str(refused.value) == message
