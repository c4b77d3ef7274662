"""A lab's code as a module: nothing breaks out, and data arrives as it was written."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.features.lab.compile import LabCode, LabModule, compile_lab, pieces
from coursebuild.features.lab.engines.browser import LabEngine
from support.lab_values import Bench, make_lab

pytestmark = pytest.mark.engine
Form: TypeAlias = Literal["statements", "expression", "target"]


@pytest.fixture(scope="module")
def engine() -> Iterator[LabEngine]:
    with LabEngine() as engine:
        yield engine


def mistakes(engine: LabEngine, given: list[tuple[Form, str]]) -> list[str | None]:
    """Why pieces of code cannot be part of a lab."""
    return engine.mistakes([LabCode(("x",), form, c, form == "target") for form, c in given])


BREAKING_OUT: list[tuple[Form, str]] = [
    ("expression", "1); evil("),
    ("expression", "1)) ; evil(("),
    ("expression", "1]) + ([2"),
    ("expression", "1]; [2"),
    ("expression", "0), globalThis.x = ({}"),
    ("expression", "1\n), (model) => (2"),
    ("expression", "1; 2"),
    ("expression", ""),
    ("expression", "// nothing"),
    ("expression", "...model"),
    ("expression", "1 /*"),
    ("expression", "`"),
    ("expression", "'"),
    ("expression", "x ? `${"),
    ("expression", "/"),
    ("expression", "</script>"),
    ("expression", "return 1"),
    ("expression", "let x"),
    ("expression", "import.meta.url"),
    ("expression", "super.x"),
    ("expression", "new.target"),
    ("expression", "arguments[0]"),
    ("expression", "await model"),
    ("expression", "await (model)"),
    ("expression", "1 <!--2"),
    ("statements", "} ; {"),
    ("statements", "}}; evil(); {{"),
    ("statements", "}, (model) => {"),
    ("statements", "//\u2028 }"),
    ("statements", "//\u2029 } , evil => {"),
    ("statements", "if (1) {"),
    ("statements", "/* open"),
    ("statements", "x = `"),
    ("statements", "'use strict'; ctx.x = 1"),
    ("statements", "with (model) {}"),
    ("statements", "let await = 1"),
    ("statements", "yield"),
    ("statements", "export default 1"),
    ("statements", "import x from 'y'"),
    ("statements", "ctx.x = 010"),
    ("statements", "delete ctx"),
    ("statements", "let data = 1"),
    ("statements", "break"),
    ("statements", "continue outer"),
    ("statements", "ctx.x = 1\n--> ctx.y"),
    ("statements", "#!node"),
    ("target", "data.qpos[0] = 1; x"),
    ("target", "f()"),
    ("target", "(f())"),
    ("target", "model?.opt"),
    ("target", "model.opt, data.time"),
    ("target", "a = b"),
    ("target", "[a, b]"),
    ("target", "{a}"),
    ("target", "1"),
    ("target", "'text'"),
    ("target", "data"),
    ("target", "value"),
    ("target", "timestep"),
    ("target", "eval"),
    ("target", "x => x"),
    ("target", "a) = 1; (b"),
]
FINE: list[tuple[Form, str]] = [
    ("expression", "1 // a comment at the end"),
    ("expression", "/* ) */ 1"),
    ("expression", "data.qpos[0], data.qpos[1]"),
    ("expression", "x => x"),
    ("expression", "({a: 1}).a"),
    ("expression", "`a ${`b ${1}`} </script> <!- `"),
    ("expression", "'\u2028'"),
    ("expression", "'await the landing'"),
    ("expression", "/* await */ data.time"),
    ("expression", "'<!--'"),
    ("expression", "/[)\\]'\"]/.test('x') ? 1 : 0"),
    ("expression", '"\\"); evil(\\""'),
    ("expression", "(function () { return arguments.length })(1)"),
    ("expression", "data\u2028.time"),
    ("statements", "outer: for (const x of [1]) { continue outer }"),
    ("statements", "let n = 3; while (n --> 0) ctx.n = n // counts"),
    ("statements", "let value = 1; ctx.x = value"),
    ("statements", "return"),
    ("statements", "function f() {} f()"),
    ("statements", "ctx.text = 'a\\u2028b' + \"it's\""),
    ("statements", "/* } */"),
    ("target", "model.opt.timestep"),
    ("target", "data.qpos[3] // angle"),
    ("target", "model.opt.gravity[ctx.axis ?? 2]"),
    ("target", "ctx['a b']"),
]


def test_only_what_is_a_piece_by_itself_is_taken(engine: LabEngine) -> None:
    told = mistakes(engine, BREAKING_OUT)
    assert [one for one, why in zip(BREAKING_OUT, told, strict=True) if why is None] == []
    told = mistakes(engine, FINE)
    assert [one for one, why in zip(FINE, told, strict=True) if why is not None] == []


def test_no_piece_is_run_when_it_is_looked_at(engine: LabEngine, tmp_path: Path) -> None:
    runs: list[tuple[Form, str]] = [
        ("expression", "(() => { globalThis.ran = true })()"),
        ("statements", "(() => { globalThis.ran = true })()"),
        ("target", "ctx[globalThis.ran = true]"),
    ]
    assert mistakes(engine, runs) == [None] * 3
    ordinary = make_lab(setup="if (globalThis.ran) throw 'it ran'", verify={"seconds": 0.01})
    bench = Bench(tmp_path, engine)
    with bench.native:
        assert bench.trial(ordinary)["failures"] == []


def test_value_is_only_what_setters_see(engine: LabEngine) -> None:
    for takes_value in (True, False):
        (why,) = engine.mistakes([LabCode(("x",), "statements", "let value = 1", takes_value)])
        assert (why is not None) == takes_value


FULL: dict[str, Any] = {
    "setup": "ctx.n = 0 // none",
    "controller": "ctx.n++ /* one */",
    "controls": [
        {"label": "s", "min": 0, "max": 1, "value": 0, "set": "ctx['a'] // it"},
        {"label": "a", "min": 0, "max": 1, "value": 0, "apply": "ctx.b = value // it"},
        {"label": "p", "min": 0, "max": 1, "value": 0, "param": "p"},
        {"type": "select", "label": "o", "options": [["A", "a"], ["B", 2]], "param": "o"},
        {"type": "button", "label": "b", "run": "ctx.c = 'pressed' // now"},
    ],
    "readouts": [{"label": "r", "expr": "ctx.n // n"}, {"label": "t", "expr": "'it\\'s'"}],
    "plots": [{"ylabel": "y", "traces": [{"label": "t", "expr": "data.time /* s */"}]}],
    "expect": [{"t": 1, "expr": "ctx.n, 5 // last", "min": 0}],
}


def run_module(module: LabModule, script: str, tmp_path: Path) -> Any:
    """Import a module as a browser does, and run a script with it as `m`."""
    (tmp_path / "lab.mjs").write_text(module.code, encoding="utf-8")
    text = f"import * as m from './lab.mjs'\nconsole.log(JSON.stringify(({script})()))\n"
    (tmp_path / "main.mjs").write_text(text, encoding="utf-8")
    done = subprocess.run(["node", "main.mjs"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


USE = """() => {
  const env = {ctx: {}, data: {time: 7}}
  m.setup(env)
  m.controller(env)
  const given = [3, 4, 5, 'a']
  m.controls.forEach((control, i) => (control.set ? control.set(env, given[i]) : control.run(env)))
  const all = (functions) => functions.map((f) => f(env))
  return [env.ctx, all(m.readouts), m.plots.map(all), m.expect[0](env)]
}"""
USED = [{"n": 1, "a": 3, "b": 4, "p": 5, "o": "a", "c": "pressed"}, [1, "it's"], [[7]], 5]


def test_a_module_does_what_its_pieces_say(tmp_path: Path) -> None:
    assert run_module(compile_lab(make_lab(**FULL), "4.2-lab-1"), USE, tmp_path) == USED


def test_the_literal_does_the_same(tmp_path: Path) -> None:
    module = compile_lab(make_lab(**FULL), "4.2-lab-1")
    whole = LabModule("x", f"export const m = {module.literal}", "", "")
    assert run_module(whole, USE.replace("m.", "m.m."), tmp_path) == USED


def test_a_module_is_strict(tmp_path: Path) -> None:
    module = compile_lab(make_lab(setup="misspelt = 1"), "x")
    found = run_module(
        module, "() => { try { m.setup({}) } catch (e) { return e.name } }", tmp_path
    )
    assert found == "ReferenceError"


def test_every_piece_is_the_function_of_the_module() -> None:
    lab = make_lab(**FULL)
    module = compile_lab(lab, "x")
    found = pieces(lab)
    assert [piece.entry for piece in found] == [
        ("setup",),
        ("controller",),
        ("controls", 0, "set"),
        ("controls", 1, "apply"),
        ("controls", 4, "run"),
        ("readouts", 0, "expr"),
        ("readouts", 1, "expr"),
        ("plots", 0, "traces", 0, "expr"),
        ("expect", 0, "expr"),
    ]
    for piece in found:
        assert piece.function in module.code
        assert piece.function in module.literal


def test_a_bare_lab_has_empty_lists_and_no_setup() -> None:
    module = compile_lab(make_lab(), "x")
    assert module.code == (
        "export const controls = [];\nexport const readouts = [];\n"
        "export const plots = [];\nexport const expect = [];\n"
    )


NUMBERS = st.floats(allow_nan=False, allow_infinity=False, width=64)


@settings(max_examples=25, deadline=None)
@given(NUMBERS, st.text(min_size=1).filter(lambda t: t.strip() == t), NUMBERS)
def test_data_arrives_to_the_last_bit(y: float, text: str, other: float) -> None:
    low, high = sorted((y, other))
    if low == high or high - low == float("inf"):
        return
    lab = make_lab(
        title=text,
        controls=[
            {"label": "s", "min": low, "max": high, "value": y, "param": "s", "unit": text},
            {
                "label": text + "!",
                "type": "select",
                "options": [[text, text], ["n" + text, y]],
                "param": "n",
            },
        ],
        plots=[
            {
                "ylabel": text,
                "refLines": [{"y": y, "label": text}],
                "traces": [{"label": text, "expr": "1"}],
            }
        ],
    )
    data = json.loads(compile_lab(lab, "x").config)
    assert data["title"] == text
    slider, select = data["controls"]
    assert (slider["min"], slider["max"], slider["unit"]) == (low, high, text)
    assert str(float(slider["value"])) == str(y), "the sign of a zero too"
    assert select["options"] == [[text, text], ["n" + text, y]]
    assert data["plots"][0]["refLines"] == [{"y": y, "label": text}]


def test_data_is_json_that_any_reader_takes() -> None:
    lab = make_lab(title='</script>"\\ \u2028 \U0001f916 \u00e9', expect=[
        {"after": {"speed": 0.5}, "t": 1, "expr": "1", "min": 0},
        {"after": "kick", "t": 1, "expr": "1", "max": 2},
        {"t": 1, "expr": "1", "max": 2},
        {"after": [{"speed": 1}, "kick"], "t": 1, "expr": "1", "max": 2}],
        controls=[{"label": "speed", "min": 0, "max": 1, "value": 0, "param": "v"},
                  {"type": "button", "label": "kick", "run": "ctx.x = 1"}],
        camera={"azimuth": 10}, key=0)  # fmt: skip
    data = json.loads(compile_lab(lab, "4.2-lab-1").config)
    assert data["id"] == "4.2-lab-1"
    assert data["title"] == lab.fields.title
    assert [claim["after"] for claim in data["expect"]] == [
        [{"speed": 0.5}],
        ["kick"],
        [],
        [{"speed": 1}, "kick"],
    ]
    assert data["camera"] == {"azimuth": 10, "elevation": None, "distance": None, "target": None}
    assert (data["key"], data["stopAt"], data["seed"]) == (0, None, None)


def test_code_is_no_part_of_the_data() -> None:
    lab = make_lab(setup="ctx.marker = 1", readouts=[{"label": "r", "expr": "'marker'"}])
    assert "marker" not in compile_lab(lab, "x").config
