"""Lab code as Python: exact translations, and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from coursebuild.features.lab.export.engine_names import CALLS, ArrayField, engine_field
from coursebuild.features.lab.export.statements import translate_expression, translate_statements
from coursebuild.features.lab.export.values import Code, Type
from coursebuild.features.lab.javascript import UntranslatableError
from support.lab_values import Bench, make_lab

CONTEXT: dict[str, Type] = {"n": "num", "on": "bool", "v": "vector", "k": "nat"}
GAIN = Code("GAIN", "num")


def translated(code: str, *, button: bool = False) -> str:
    return "\n".join(translate_statements(code, CONTEXT, GAIN, button=button).lines)


@pytest.mark.parametrize(
    "code, python",
    [
        ("data.qvel[3] = 6; data.qvel[4] = .001", "data.qvel[3] = 6\ndata.qvel[4] = 0.001"),
        ("mj.mj_resetData(model, data)", "mujoco.mj_resetData(model, data)"),
        ("data.qvel[0] = -0", "data.qvel[0] = -0.0"),
        ("data.qvel[0] = data.qvel[1] = 0", "data.qvel[0] = data.qvel[1] = 0"),
        ("data.qpos[0] = (ctx.n = 1)", "data.qpos[0] = ctx.n = 1.0"),
        ("ctx.n = 1, ctx.n--; ; // end", "ctx.n = 1.0\nctx.n -= 1"),
        ("data.qvel[0] -= value * data.qvel[0]", "data.qvel[0] -= GAIN * data.qvel[0]"),
        ("ctx.n = 0; ctx.n++\n--ctx.n", "ctx.n = 0.0\nctx.n += 1\nctx.n -= 1"),
        ("ctx.n %= 3", "ctx.n = np.fmod(ctx.n, 3.0)"),
        ("model.opt.integrator = value", "model.opt.integrator = int(GAIN)"),
        ("model.opt.disableflags |= 8", "model.opt.disableflags = model.opt.disableflags | 8"),
        ("model.opt.gravity[2] = -9.81", "model.opt.gravity[2] = -9.81"),
        (
            "model.geom_rgba[3] *= 0.1",
            "model.geom_rgba.flat[3] = float(model.geom_rgba.flat[3]) * 0.1",
        ),
        ("model.pair_solref[0] = -value", "model.pair_solref.flat[0] = -GAIN"),
        (
            "for (let i = 0; i < model.npair; i++) model.pair_margin[i] = 0",
            "for i in range(model.npair):\n    model.pair_margin[i] = 0",
        ),
        (
            "data.mocap_quat.set([1, 0, 0, value], 4)",
            "data.mocap_quat.reshape(-1)[4:8] = [1, 0, 0, GAIN]",
        ),
        ("data.qvel.set(ctx.v, 3)", "data.qvel[3:3 + ctx.v.size] = ctx.v"),
        ("data.qvel.fill(0)", "data.qvel.fill(0)"),
        ("data.eq_active[0] = ctx.n", "data.eq_active[0] = int(ctx.n)"),
        ("data.eq_active[0] = !ctx.on", "data.eq_active[0] = not ctx.on"),
        ("model.geom_group.fill(ctx.n)", "model.geom_group.fill(int(ctx.n))"),
        ("model.geom_group.set([1, ctx.n])", "model.geom_group[:2] = [1, int(ctx.n)]"),
        ("ctx.on = !ctx.on && sim.time >= 1", "ctx.on = not ctx.on and data.time >= 1"),
        ("if (ctx.n) ctx.n = 1", "if abs(ctx.n) > 0:\n    ctx.n = 1.0"),
        ("if (ctx.on) { } else ctx.n = 1", "if ctx.on:\n    pass\nelse:\n    ctx.n = 1.0"),
        (
            "for (let i = 0; i < 3; i++) data.ctrl[i] = i",
            "for i in range(3):\n    data.ctrl[i] = i",
        ),
        (
            "for (let i = model.nv - 1; i >= 0; i -= 2) data.qvel[i] *= 2",
            "for i in range(model.nv - 1, -1, -2):\n    data.qvel[i] *= 2",
        ),
        (
            "for (let i = 1; i <= data.qpos.length; i++) { if (ctx.on) continue; break }",
            "for i in range(1, data.qpos.size + 1):\n    if ctx.on:\n        continue\n    break",
        ),
        (
            "const a = 1, N = 2; { const a = 3; ctx.n = a } ctx.n = a + N",
            "a = 1\nN_ = 2\na_ = 3\nctx.n = float(a_)\nctx.n = float(a + N_)",
        ),
        ("const data_ = 1, lambda = 2", "data_ = 1\nlambda_ = 2"),
        ("let s = 0\nwhile (s < 3) s += 1", "s = 0.0\nwhile s < 3:\n    s += 1"),
        ("ctx.n = ctx.k - (1 - ctx.k)", "ctx.n = float(ctx.k - (1 - ctx.k))"),
        ("ctx.n = 2 * 3 * ctx.n", "ctx.n = 2 * 3 * ctx.n"),
        ("ctx.n = -ctx.k * -3", "ctx.n = -float(ctx.k) * -3"),
        ("ctx.n = ctx.on ? NaN : -Infinity", "ctx.n = math.nan if ctx.on else -math.inf"),
        ("ctx.n = 1 / 3 - .5e1", "ctx.n = 1 / 3 - 0.5e1"),
        ("ctx.n = ctx.on ? 1 : 2.5", "ctx.n = 1.0 if ctx.on else 2.5"),
        ("ctx.n = a\n/* b */ // c\n".replace("a", "0x10"), "ctx.n = float(0x10)"),
        ("ctx.on = ctx.on === (ctx.n > 1)", "ctx.on = ctx.on == (ctx.n > 1)"),
        ("ctx.on = ctx.n !== 1 !== ctx.on", "ctx.on = (ctx.n != 1) != ctx.on"),
        ("ctx.on = ctx.on === true || ctx.on == false", "ctx.on = ctx.on or not ctx.on"),
        ("ctx.n = true !== ctx.on ? 1 : 2", "ctx.n = float(1 if not ctx.on else 2)"),
        ("if (!ctx.on === ctx.on) ctx.n = 1", "if (not ctx.on) == ctx.on:\n    ctx.n = 1.0"),
        ("const s = `a`, t = `${s} ${ctx.k}`", 's = "a"\nt = s + " " + str(ctx.k)'),
        ("const u = 'n = ' + ctx.n + 1", 'u = "n = " + numeral(ctx.n) + str(1)'),
        ("const u = 1 + ctx.k + ` m`", 'u = str(1 + ctx.k) + " m"'),
        ("data.qpos[ctx.n] = 1", "data.qpos[index(ctx.n)] = 1"),
        ("data.qpos[-1] = 1", "data.qpos[index(-1)] = 1"),
        ("data.qpos[7 * ctx.k + 1] = 1", "data.qpos[7 * ctx.k + 1] = 1"),
        ("ctx.v = data.qpos.slice(3, 7)", "ctx.v = data.qpos[3:7].copy()"),
        ("ctx.n = Math.max(ctx.n, 0)", "ctx.n = maximum(ctx.n, 0.0)"),
        ("ctx.n = Math.sin(Math.PI * ctx.n)", "ctx.n = np.sin(math.pi * ctx.n)"),
        ("ctx.n = ctx.n ** 2 + 2 ** ctx.n", "ctx.n = ctx.n**2 + power(2, ctx.n)"),
        ("data.xfrc_applied[6 * lib.bodyId('b')] = 1", None),
    ],
)
def test_statements_become_those_of_python(code: str, python: str | None) -> None:
    if python is None:
        python = 'data.xfrc_applied.flat[6 * model.body("b").id] = 1'
    assert translated(code) == python


def test_what_only_concerns_the_page_is_left_out_of_buttons() -> None:
    assert translated("sim.reset(); sim.play()", button=True) == "reset(model, data, ctx)"


@pytest.mark.parametrize(
    "code",
    """\
data.qvel[0] = Math.random()
data.qvel[0] = ctx.other
data.qvel = [1, 2]
data.nothing[0] = 1
data.qpos[0] = data.qpos[1] || 1
data.qpos[0] = ctx.on + 1
data.qpos[0] = data.qpos ? 1 : 2
data.qpos[0] = 'a' + 1
data.qpos[0] = 1 < 2 < 3
data.qpos[0] ??= 1
data.qpos[0] = 5 & ctx.n
data.qpos[0] = 1 << 2
data.qpos[0] = ctx.n = 1, f()
data.qpos[0] = 10n
data.qpos[0] = null
ctx.n = ctx.on ? 1 : null
data.qpos[0] = parseFloat('1')
data.qpos[0] = 'ab'.length
data?.qpos
ctx.v = [...data.qpos]
ctx.v.push(1)
ctx.k.x = 1
ctx.on = 1
data.qpos[0] = `1`
data.qpos[0] = f`1`
data.qpos[0] = `a`.length
const s = `${data.qpos}`
const s = `${ctx.n.toFixed(ctx.k)}`
const s = `${ctx.n.toString()}`
const s = ctx.n.toFixed(101)
const s = ctx.n.toPrecision()
const s = ctx.n.toExponential()
const s = `${ctx.n = 1}`
const s = `${ctx.n; 1}`
const s = `${}`
const s = `${{a: 1}.a}`
ctx.on = ctx.on === 1
ctx.on = ctx.on < true
const o = {a: 1}
const model = 1
const c = 1; c = 2
let u
var w = 1
function f() { }
for (const x of data.qpos) ctx.n += x
for (let i = 0; i < ctx.n; i++) ctx.n += 1
for (let i = 0; i < data.ncon; i++) ctx.n += 1
for (let i = 0; i < 3; i++) i += 1
for (;;) break
do { ctx.n++ } while (ctx.on)
switch (ctx.n) { }
return 1
try { ctx.n = 1 } catch { }
delete ctx.n
ctx.on && (ctx.n = 1)
sim.step(3)
sim.play()
lib.bodyPos('a')[0] = 1
lib.qpos('b', 1)
model.opt = 1
mj.mj_forward(model, model)
mj.mj_loadXML('x')
'use strict'
é = 1
ctx['n'] = 1
a\\u0062 = 1
ctx.n = 010
ctx.n = /x/.test('a')
new Float64Array(3)
this.x = 1
ctx.n = typeof ctx.n
async () => 1
label: ctx.n = 1""".splitlines(),
)
def test_code_without_a_counterpart_in_python_is_refused(code: str) -> None:
    with pytest.raises(UntranslatableError):
        translate_statements(code, CONTEXT, GAIN)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("a => 1", "`=>`"),
        ("new Float64Array(3)", "`new`"),
        ("class C { }", "`class`"),
        ("data?.qpos", "`?.`"),
        ("ctx.n = 'a", "code that cannot be read"),
        ("ctx.n = 010", "the number `010`"),
        ("ctx.n = 1n", "the number `1n`"),
        ("ctx.n = 1e999", "the number `1e999`"),
        ("const s = '\\ud800'", "the escape `\\ud800`"),
        ("const s = '\\u{110000}'", "the escape `\\u{110000}`"),
        ("const s = '\\01'", "the escape `\\01`"),
        ("const s = `a\\\nb`", "the escape `\\\n`"),
        ("const s = '\ud800'", "half of a character"),
        ("const s = f`1`", "a template behind a name or a value"),
        ("ctx.v = [1, , 2]", "an array with holes"),
        ("const é = 1", "a variable `é`"),
        ("let u", "`u` without a value"),
        ("break now", "`now`"),
        ("ctx.n = 1; 2", "an expression that does nothing"),
    ],
)
def test_a_refusal_says_what_has_no_counterpart(code: str, message: str) -> None:
    with pytest.raises(UntranslatableError) as refused:
        translate_statements(code, CONTEXT)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    "code, python",
    [
        ("lib.energy().kinetic", "energy(model, data).kinetic"),
        ("lib.norm(lib.angmom())", "norm(angular_momentum(model, data))"),
        ("lib.norm([data.qvel[0], 1])", "norm([data.qvel[0], 1])"),
        ("lib.qpos('hinge') * 2", 'data.joint("hinge").qpos.item() * 2'),
        ("lib.qpos('ball')[2]", 'data.joint("ball").qpos.copy()[2]'),
        ("data.ncon > 0 ? 'a' : \"b\\n\"", '"a" if data.ncon > 0 else "b\\n"'),
        ("`z = ${data.qpos[2].toFixed(2)} m`", '"z = " + fixed(data.qpos[2], 2) + " m"'),
        ("`${data.time > 1}`", '"true" if data.time > 1 else "false"'),
        ("`${ctx.on ? `on ${`!`}` : 'off}'}`", '"on " + "!" if ctx.on else "off}"'),
        ("`${ctx.on}, ${1}`", '("true" if ctx.on else "false") + ", " + str(1)'),
        ("(data.ncon === 0) === false ? 'a' : ''", '"a" if not data.ncon == 0 else ""'),
        ("Math.abs(ctx.n).toPrecision(3)", "precise(abs(ctx.n), 3)"),
        ("(-5).toExponential(1)", "exponential(-5.0, 1)"),
        ("data.ncon.toFixed()", "fixed(float(data.ncon), 0)"),
        ("Math.hypot(...data.qvel.slice(3, 6))", "math.hypot(*data.qvel[3:6].copy())"),
        ("data.xpos[3 * 2 + 1]", "data.xpos.flat[3 * 2 + 1]"),
        ("model.body_parentid[1]", "int(model.body_parentid[1])"),
        (
            "mj.mj_name2id(model, mj.mjtObj.mjOBJ_BODY.value, 'b')",
            'mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, "b")',
        ),
        ("ctx.on ? ctx.n : null", "ctx.n if ctx.on else math.nan"),
    ],
)
def test_expressions_become_those_of_python(code: str, python: str) -> None:
    assert translate_expression(code, CONTEXT).text == python


@pytest.mark.parametrize("code", ["ctx.on", "data.qpos", "lib.energy()", "1;", "a => 1"])
def test_an_expression_gives_a_number_or_a_text(code: str) -> None:
    with pytest.raises(UntranslatableError):
        translate_expression(code, CONTEXT)


RICH = Path(__file__).with_name("rich.xml")
"""A model with something of nearly every kind, in contact from the first step."""
ARRAY_KINDS = {"f64": "Float64Array", "f32": "Float32Array", "int": "Int32Array"}
LISTED = """
  mj.mj_forward(model, data)
  const found = []
  for (const [owner, object] of [['model', model], ['data', data]])
    for (const name of Object.getOwnPropertyNames(Object.getPrototypeOf(object))) {
      const value = object[name]
      if (ArrayBuffer.isView(value)) found.push([owner, name, value.constructor.name, value.length])
      else if (typeof value === 'number') found.push([owner, name, 'number', value])
    }
  ctx.found = JSON.stringify(found)
"""


@pytest.mark.engine
def test_both_bindings_give_every_array_that_has_a_name(tmp_path: Path) -> None:
    bench, xml = Bench(tmp_path), RICH.read_text()
    lab = make_lab(xml=xml, setup=LISTED, readouts=[{"label": "all", "expr": "ctx.found"}])
    with bench.browser, bench.native:
        reply = bench.trial(lab)
    assert not reply["failures"], reply["failures"]
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    owners = {"model": model, "data": data}
    strange, named = [], 0
    for owner, name, kind, length in json.loads(reply["main"]["pictures"][0]["readouts"][0]):
        value, field = getattr(owners[owner], name, None), engine_field((owner, name))
        if isinstance(field, ArrayField):
            is_bool = isinstance(value, np.ndarray) and value.dtype == bool
            known = "Uint8Array" if is_bool else ARRAY_KINDS[field.element]
            if (known, np.size(value)) != (kind, length):
                strange.append((owner, name, kind, length))
            named += 1
        elif field == "size" and kind == "number":
            strange += [] if value == length else [(owner, name, value, length)]
            named += 1
    assert strange == []
    assert named > 500
    assert all(callable(getattr(mujoco, name)) for name in CALLS)
