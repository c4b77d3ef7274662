"""Labs as code for the page, and which edits of one its trial depends on."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast

import pytest

from coursebuild.core.features import Trial
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.script_environment import engine_version
from coursebuild.features.lab.compile import compile_lab, trial_inputs
from coursebuild.features.lab.engines.native import TRIAL, WASM, asset_digest
from coursebuild.features.lab.model import LabCode
from support.fixture_cases import check_lines, fixture_tables, fixture_text
from support.lab_values import Bench, lab_of, make_lab

Form: TypeAlias = Literal["statements", "setter", "expression", "target"]


def check_code(bench: Bench, pieces: list[tuple[Form, str]]) -> list[str | None]:
    return bench.browser.check_code([LabCode(("x",), form, code) for form, code in pieces])


@pytest.mark.engine
def test_only_what_is_a_piece_by_itself_is_taken(bench: Bench, rewriting: bool) -> None:
    def convert(piece: str) -> list[str]:
        form, code = piece.split(": ", 1)
        (message,) = check_code(bench, [(cast(Form, form), code)])
        return [message or "is taken"]

    check_lines(Path(__file__).with_name("pieces.md"), convert, rewriting=rewriting)


@pytest.mark.engine
def test_no_piece_is_run_when_it_is_looked_at(bench: Bench) -> None:
    mark = "(() => { globalThis.ran = true })()"
    runs: list[tuple[Form, str]] = [
        ("expression", mark),
        ("statements", mark),
        ("target", f"ctx[{mark}]"),
        ("statements", "if (globalThis.ran) throw 'it ran'"),
    ]
    assert check_code(bench, runs) == [None] * len(runs)
    assert bench.trial(make_lab(setup=runs[-1][1], verify={"seconds": 0.01}))["failures"] == []


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


USE = fixture_text("documents/used_lab.txt")
EXPECTED_REPLY = [{"n": 1, "a": 3, "b": 4, "p": 5, "o": "a", "c": "pressed"}, [1, "it's"], [[7]], 5]


def test_a_module_and_its_literal_do_what_its_pieces_say_and_are_strict(tmp_path: Path) -> None:
    module = compile_lab(make_lab(**FULL), "4.2-lab-1")
    (tmp_path / "lab.mjs").write_text(module.code, encoding="utf-8")
    misspelt = compile_lab(make_lab(setup="misspelt = 1"), "x")
    (tmp_path / "misspelt.mjs").write_text(misspelt.code)
    main = f"""import * as m from './lab.mjs'
    import {{setup}} from './misspelt.mjs'
    const use = {USE}
    let thrown
    try {{ setup({{}}) }} catch (error) {{ thrown = error.name }}
    console.log(JSON.stringify([use(m), use({module.literal}), thrown]))
    """
    (tmp_path / "main.mjs").write_text(main, encoding="utf-8")
    process = subprocess.run(["node", "main.mjs"], cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert json.loads(process.stdout) == [EXPECTED_REPLY, EXPECTED_REPLY, "ReferenceError"]


def test_data_is_json_without_the_code() -> None:
    low, high = -5e-324, 1.7976931348623157e308
    slider = {"label": "speed", "min": low, "max": high, "value": -0.0, "param": "v"}
    lab = make_lab(
        title='</script>"\\ \u2028 \U0001f916 \u00e9',
        setup="ctx.marker = 1",
        controls=[
            slider,
            {"label": "n", "type": "select", "options": [["é", 0.1], ["</", 0.3]], "param": "n"},
            {"type": "button", "label": "kick", "run": "ctx.x = 1"},
        ],
        plots=[{"refLines": [{"y": 0.1, "label": "<"}], "traces": [{"label": "m", "expr": "1"}]}],
        expect=[
            {"after": {"speed": 0.5}, "t": 1, "expr": "1", "min": 0},
            {"after": "kick", "t": 1, "expr": "1", "max": 2},
            {"t": 1, "expr": "1", "max": 2},
            {"after": [{"speed": 1}, "kick"], "t": 1, "expr": "'marker'", "max": 2},
        ],
        camera={"azimuth": 10},
        key=0,
    )
    config = json.dumps(compile_lab(lab, "4.2-lab-1").config, allow_nan=False)
    assert "marker" not in config
    data = json.loads(config)
    assert (data["id"], data["title"]) == ("4.2-lab-1", lab.fields.title)
    steps = [[{"speed": 0.5}], ["kick"], [], [{"speed": 1}, "kick"]]
    assert [claim["after"] for claim in data["expect"]] == steps
    speed, choice, _ = data["controls"]
    assert {name: repr(speed[name]) for name in slider} == {n: repr(v) for n, v in slider.items()}
    assert (choice["options"], choice["value"]) == ([["é", 0.1], ["</", 0.3]], 0.1)
    assert data["plots"][0]["refLines"] == [{"y": 0.1, "label": "<"}]
    assert data["camera"] == {"azimuth": 10, "elevation": None, "distance": None, "target": None}
    assert (data["key"], data["stopAt"], data["seed"]) == (0, None, None)


LAB = fixture_text("documents/compiled_lab.json")
NEUTRAL = fixture_tables("lab_edits")["neutral"]
"""Edits that change nothing that a trial depends on."""
EDITS = fixture_tables("lab_edits")["edits"]
"""Edits after which a lab must be tried again."""


def inputs_of(text: str) -> Inputs:
    inputs = trial_inputs(Trial("1.2-lab-1", "1.2", lab_of(text)))
    assert inputs is not None
    return inputs


def test_an_edit_counts_exactly_where_a_trial_depends_on_it() -> None:
    text = f"Text.\n\n```lab simlab\n{LAB}\n```\n"
    before = inputs_of(text)
    edits = (*NEUTRAL, *EDITS)
    effective_edits = [edit for edit in edits if inputs_of(text.replace(*edit, 1)) != before]
    assert effective_edits == EDITS
    conditions = dict(before.conditions)
    assert conditions["MuJoCo"] == engine_version()
    digest = asset_digest(WASM, TRIAL)
    assert digest.startswith(conditions["the browser's engine and its trial"])
