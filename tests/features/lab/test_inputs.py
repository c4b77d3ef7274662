"""Edits of a lab count if its trial depends on them, and only then."""

from __future__ import annotations

from coursebuild.core.features import Trial
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.script_environment import engine_version
from coursebuild.features.lab.engines.native import engine_digest
from coursebuild.features.lab.inputs import trial_inputs
from support.lab_values import lab_of

LAB = (
    '{"title": "T", "model": "ball", "height": 200, "toggles": ["frames"], "note": "A note.",\n'
    ' "setup": "ctx.a = 1", "controller": "ctx.b = 2",\n'
    ' "controls": [{"label": "s", "min": 0, "max": 1, "value": 0.5, "param": "p"}],\n'
    ' "readouts": [{"label": "r", "expr": "ctx.a"}],\n'
    ' "verify": {"seconds": 0.2}}'
)
NEUTRAL = [
    ("Text.", "Another text."),
    ('"title": "T"', '"title": "Another"'),
    ('"height": 200', '"height": 300'),
    ('"toggles": ["frames"]', '"toggles": ["com"]'),
    ('"note": "A note."', '"note": "Another *note*."'),
    ('{"title"', '{ "dock": true,\n\n "title"'),
    ('"setup": "ctx.a = ', '"setup": "ctx.a \\u003d '),
]
"""Edits that change nothing that a trial depends on."""
EDITS = [
    ('"ctx.a = ', '"ctx.a = 100 + '),
    ("ctx.b = 2", "ctx.b = 3"),
    ('"max": 1', '"max": 2'),
    ('"value": 0.5', '"value": 0.6'),
    ('"expr": "ctx.a"', '"expr": "ctx.a + 1"'),
    ('"seconds": 0.2', '"seconds": 0.3'),
    ('"seconds": 0.2', '"seconds": 0.2, "rtol": 0'),
    ('"height"', '"camera": {"azimuth": 3}, "height"'),
    ('"height"', '"seed": 3, "height"'),
    ('"height"', '"stopAt": 3, "height"'),
    ('"height"', '"expect": [{"t": 0, "expr": "1", "min": 1}], "height"'),
    ('"height"', '"key": 0, "height"'),
]
"""Edits after which a lab must be tried again."""


def inputs_of(text: str) -> Inputs:
    """Return what the trial of a lesson's lab depends on besides files."""
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
    assert engine_digest().startswith(conditions["the browser's engine and its trial"])
