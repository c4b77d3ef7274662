"""A lab as a Python script: where it is offered, and how its JavaScript is translated.

The cases are `translated.md`; `pytest --rewrite-fixtures` writes what is expected anew.
"""

from __future__ import annotations

import functools
import json
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import indent
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from coursebuild.core.engine.store import Store
from coursebuild.core.run.v8 import Isolate
from coursebuild.features.lab.engines.native import EngineDescription, NativeEngine
from coursebuild.features.lab.export.script import (
    Export,
    ExportMetadata,
    export_script,
    file_name,
    fill_in_values,
    initial_values,
)
from coursebuild.features.lab.export.translate import (
    context_fields,
    translate_expression,
    translate_statements,
)
from coursebuild.features.lab.javascript import UntranslatableError
from coursebuild.features.lab.trial import Engines
from coursebuild.pipeline.options import Options
from support.built_sites import BuiltCourses
from support.fixture_cases import Case, check_cases, fixture_tables, fixture_text
from support.lab_values import Bench, make_lab, try_labs
from support.made_courses import make_course

ROOT = Path(__file__).parents[3]

METADATA = ExportMetadata("lab_1_1_1.py", "a lab of lesson 1.1, “First”", "A course", "3.14.0", 1.0)

PENDULUM = fixture_text("documents/pendulum.xml")
MODEL = {"models/a.xml": PENDULUM.encode()}

RICH: dict[str, Any] = {"xml": PENDULUM, **tomllib.loads(fixture_text("documents/rich_lab.toml"))}


WORD, TRIPLE = "ctx.word = '1'", "ctx.word * 3"
"""The second is 3 in JavaScript and '111' in Python, which the translator cannot know."""
BUTTON = {"type": "button", "label": "b", "run": "ctx.i = 77; data.qvel[ctx.i] += 1"}
SLIDER = {"label": "s", "min": 0, "max": 1, "value": 0, "param": "s"}
EXPORTED_LABS: list[dict[str, Any]] = [
    RICH,
    {"controller": "data.ctrl[0] = Math.sin(3 * data.time) ** 3"},
    {"controller": "model.opt.gravity[0] = sim.time > 0.5 ? 2 : 0"},
    {"xml": PENDULUM.replace('timestep="0.005"', 'timestep="0.0001" iterations="5"'), "verify": {}},
    {"stopAt": 0.333, "verify": {}},
    {"stopAt": 0.2, "verify": {"seconds": 0.5}},
    {"verify": {"seconds": 0.0125}},
]
"""All at once; a function of the C library, which may differ in the last bit; what native MuJoCo
cannot repeat; runs that end at other times."""
REFUSED_LABS: list[tuple[dict[str, Any], str]] = [
    ({"setup": "data.qpos[0] = Math.random()"}, "a call of `Math.random` has no counterpart in"),
    ({"setup": f"{WORD}; data.qvel[0] = {TRIPLE}"}, "its state after 200 steps is apart from the"),
    (
        {
            "setup": WORD,
            "controller": f"model.opt.gravity[0] = {TRIPLE} === '111' ? 2 : sim.time",
        },
        "its state after 200 steps is apart from the lab's by ",
    ),
    (
        {"setup": WORD, "controller": f"if ({TRIPLE} === '111') data.time += 0.005"},
        "it makes 100 steps, and the lab 200",
    ),
    (
        {"readouts": [{"label": "touches", "expr": "`${data.ncon > 0}`"}]},
        "its readout `touches` is False at the start, and that of the lab false",
    ),
    ({"setup": "ctx.far = 1 / 0"}, "the script fails: ZeroDivisionError: division by zero"),
    ({"controls": [BUTTON]}, "the script fails: IndexError: index 77"),
    (
        {"setup": "ctx.far = 1 / (1 - ctx.s)", "controls": [SLIDER]},
        "the script fails: ZeroDivision",
    ),
    ({"setup": f"{WORD}; while ({TRIPLE} === '111') ctx.n = 1"}, "the script took longer than 2 s"),
    ({"expect": [{"t": 0, "expr": "1", "min": 2}]}, ""),
]


@pytest.mark.engine
def test_script_is_offered_where_it_does_what_the_lab_does_and_a_reason_where_not(
    tmp_path: Path,
) -> None:
    usual = {"xml": PENDULUM, "verify": {"seconds": 1}}
    labs = [{**usual, **lab} for lab in (*EXPORTED_LABS, *(lab for lab, _ in REFUSED_LABS))]
    fences = (f"```lab\n{json.dumps(lab, ensure_ascii=False)}\n```\n\n" for lab in labs)
    options = Options(tmp_path, 1, Store(tmp_path))
    engines = Engines(tmp_path)
    engines.native = NativeEngine(tmp_path, seconds=2.0)
    results, diagnostics = try_labs(make_course("".join(fences)), options, engines)
    assert [d.rule for d in diagnostics if d.rule != "lab-reset"] == ["lab-expect"]
    lines = [result.line for result in results]
    assert [line.unexported for line in lines[: len(EXPORTED_LABS)]] == [""] * len(EXPORTED_LABS)
    assert lines[2].parity == "compared with native MuJoCo as its Python export"
    parity = "not compared with native MuJoCo: its controller changes the model"
    assert lines[len(EXPORTED_LABS) + 2].parity == parity
    for (lab, reason), result in zip(REFUSED_LABS, results[len(EXPORTED_LABS) :], strict=True):
        assert result.output.script is None
        assert result.line.unexported.startswith(reason), (lab, result.line.unexported)
    name, text = results[0].output.script
    (tmp_path / name).write_text(text)
    printed = run(tmp_path / name, 2, 0.3, -9.81, 0.125, 1, "free").splitlines()
    assert printed[6] in ("state: flies", "state: touches")
    assert printed[8:12] == ["steps: 200", "told: 0.00 m, 200 2", "told too: 0.333m", "time: 1 s"]


def run(path: Path, *values: object) -> str:
    text = path.read_text()
    for i, value in enumerate(values):
        text = text.replace(f"{{{{control:{i}}}}}", repr(value))
    path.write_text(text)
    command = [sys.executable, "-W", "error", str(path)]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return process.stdout


@pytest.mark.long
@pytest.mark.site
def test_scripts_that_the_site_offers_print_what_lesson_4_2_says(
    built_courses: BuiltCourses, tmp_path: Path
) -> None:
    paths = (built_courses["real"].root / "public/assets/labs").glob("*-lab-*.json")
    offers = {path.name: json.loads(path.read_text()).get("exportPython", {}) for path in paths}
    assert None not in offers.values() and {} in offers.values()
    ours = [offers[name] for name in sorted(offers) if name.startswith("4.2-lab-")]
    # One more is an exercise, which has a file of its own, and one of a kind of the course's own.
    assert len([offer for offer in ours if offer]) == len(ours) - 2 == 3
    first = ours[0]
    script = tmp_path / first["name"]
    # Under Euler, option 0, the lesson measures 0.06654 J.
    for integrator, energy in ((1, "0.06240"), (0, "0.06654")):
        script.write_text(first["text"])
        printed = run(script, *[0] * 3, integrator)
        assert f"kinetic energy (J): {energy}\n" in printed and "time: 20 s\n" in printed


def test_a_script_reads_well(tmp_path: Path, engine: EngineDescription) -> None:
    lab = make_lab(**RICH)
    export = export_script(lab, METADATA, engine, MODEL)
    assert isinstance(export, Export)
    assert export.buttons == ("kick", "again")
    text = fill_in_values(export, initial_values(lab))
    assert text.startswith("# /// script\n# requires-python = ")
    assert '"""A \'lab\' with / everything: a lab of lesson 1.1, “First”, as a script.\n' in text
    assert "# The control “gain” (N m), from 0 to 4\nGAIN = 2\n" in text
    assert "\nINTEGRATOR = 1\n" in text and '\nMODE = "free"\n' in text
    assert "def reset(model, data, ctx):" in text
    assert "normal_force" in text and "def linear_momentum" in text
    ruff = [sys.executable, "-m", "ruff"]
    path = tmp_path / "lab.py"
    path.write_text(text)
    process = subprocess.run(
        [*ruff, "check", "--isolated", "--line-length", "130", "--select", "E,F", str(path)],
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stdout


@pytest.mark.parametrize(
    "fields, reason",
    [
        ({"readouts": [{"label": "x", "expr": "ctx.unknown"}]}, "`ctx.unknown`"),
        ({"readouts": [{"label": "{{control:0}}", "expr": "1"}]}, "a text that no script can hold"),
    ],
)
def test_what_cannot_be_translated_has_no_script(
    engine: EngineDescription, fields: dict[str, Any], reason: str
) -> None:
    export = export_script(make_lab(**fields), METADATA, engine, MODEL)
    assert export == f"{reason} has no counterpart in Python"


def test_code_that_is_nested_too_deeply_or_a_model_with_binary_files_has_no_script(
    engine: EngineDescription,
) -> None:
    for depth in (250, 20_000):
        deep = make_lab(setup=f"data.qpos[0] = {'Math.abs(' * depth}1{')' * depth}")
        reason = "code that is nested too deeply has no counterpart in Python"
        assert export_script(deep, METADATA, engine, MODEL) == reason
    reason = "its model has files that are no text"
    binary = {**MODEL, "models/m.stl": b"\xff\xfe"}
    assert export_script(make_lab(), METADATA, engine, binary) == reason


def test_a_model_of_several_files_stands_in_the_script(
    engine: EngineDescription, tmp_path: Path
) -> None:
    whole = '<mujoco model="whole"><include file="parts/arm.xml"/></mujoco>'
    arm = "<mujoco><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>"
    model = {"models/whole.xml": whole.encode(), "models/parts/arm.xml": arm.encode()}
    export = export_script(make_lab(), METADATA, engine, model)
    assert isinstance(export, Export)
    (tmp_path / "lab.py").write_text(fill_in_values(export, initial_values(make_lab())))
    assert "qpos: [0.0]" in run(tmp_path / "lab.py")


def test_names_of_files() -> None:
    names = ["4.2-lab-1", "about-lab-2", "Ü b-lab-10"]
    assert [file_name(name) for name in names] == ["lab_4_2_1.py", "lab_about_2.py", "lab_b_10.py"]


def test_the_page_fills_a_script_as_the_build_does() -> None:
    source = (ROOT / "site" / "js" / "lab" / "page" / "export.js").read_text()
    isolate = Isolate(
        source.replace("\nexport ", "\n")
        + "globalThis.fill = (json) => fillScript(...JSON.parse(json))"
    )
    values: dict[int, float | str] = {0: 1.0, 1: -0.25, 2: 1e-7, 3: 1e21, 4: 'a "b" \\', 5: 1.5e300}
    text = "\n".join(f"{{{{control:{i}}}}}" for i in values)
    theirs = isolate.call("fill", json.dumps([text, list(values.values())]), 10.0).splitlines()
    isolate.close()
    ours = fill_in_values(Export("x.py", text, ()), values).splitlines()
    assert [eval(line) for line in theirs] == [eval(line) for line in ours] == [*values.values()]
    assert theirs[0] == ours[0] == "1"


FIELDS = ("n", "on", "v", "k")


@pytest.fixture(scope="session")
def engine(bench: Bench) -> EngineDescription:
    return bench.native.description


def python(engine: EngineDescription, code: str) -> str:
    value = "GAIN" if "value" in code else None
    return "\n".join(translate_statements(engine, code, FIELDS, value))


def refusal(engine: EngineDescription, code: str) -> str:
    with pytest.raises(UntranslatableError) as refused:
        translate_statements(engine, code, FIELDS)
    return str(refused.value)


TRANSLATORS: dict[str, Callable[[EngineDescription, str], str]] = {
    "statements": python,
    "expressions": lambda engine, code: translate_expression(engine, code, FIELDS),
    "code without a counterpart in Python is refused": refusal,
}


def test_code_becomes_python_or_is_refused(engine: EngineDescription, rewriting: bool) -> None:
    def translate_pieces(case: Case) -> str:
        blocks = re.split(r"\n\n(?=\S)", case.expected.rstrip("\n"))
        pieces = [re.sub(r"\n(    .*|)(?=\n|$)", "", block) for block in blocks]
        translate = TRANSLATORS[case.title]
        return "\n".join(f"{code}\n{indent(translate(engine, code), '    ')}\n" for code in pieces)

    check_cases(Path(__file__).with_name("translated.md"), translate_pieces, rewriting=rewriting)


def test_what_only_concerns_the_page_is_left_out_of_buttons(engine: EngineDescription) -> None:
    code = "sim.reset(); sim.play()"
    lines = translate_statements(engine, code, FIELDS, button=True)
    assert lines == ["reset(model, data, ctx)"]


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
def test_values_are_those_of_v8(v8: Isolate, engine: EngineDescription, code: str) -> None:
    lines = translate_statements(engine, f"const x = 3.5, y = -7.25\nctx.n = {code}", FIELDS)
    ctx, data = SimpleNamespace(), SimpleNamespace(qpos=np.array([2.5, -1]))
    try:
        with np.errstate(divide="raise", invalid="raise"):
            exec("\n".join(lines), {"np": np, "math": math, "data": data, "ctx": ctx})
    except (ZeroDivisionError, FloatingPointError):  # which is said when the script is tried
        return
    theirs = float(v8.call("run", code, 10.0).replace("Infinity", "inf"))
    assert math.isclose(ctx.n, theirs, rel_tol=1e-9, abs_tol=1e-9)


@pytest.mark.parametrize("code", fixture_tables("javascript")["functions"])
def test_functions_and_arrays_do_what_they_do_in_v8(
    v8: Isolate, engine: EngineDescription, code: str
) -> None:
    theirs = float(v8.call("run", f"{{ const ctx = {{}}; {code}; globalThis.n = ctx.n }} n", 10.0))
    ctx = SimpleNamespace(n=math.nan, v=math.nan, k=math.nan)
    data = SimpleNamespace(qpos=np.array([2.5, -1]))
    lines = translate_statements(engine, code, FIELDS)
    body = indent("\n".join(lines), "    ")
    values = {"np": np, "math": math, "functools": functools, "data": data, "ctx": ctx}
    values["missing"] = lambda value: isinstance(value, float) and math.isnan(value)
    exec(f"def run():\n{body}\nrun()", values)
    assert float(ctx.n) == pytest.approx(theirs, rel=1e-12)


@pytest.mark.parametrize("code", fixture_tables("javascript")["texts"])
def test_texts_are_those_of_v8(v8: Isolate, engine: EngineDescription, code: str) -> None:
    assert eval(translate_expression(engine, code, FIELDS)) == v8.call("run", code, 10.0)
