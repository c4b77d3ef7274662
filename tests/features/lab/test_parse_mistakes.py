"""What is wrong between fields of a `lab` fence; one alone is told as `fixtures/texts/fields`."""

from __future__ import annotations

import pytest

from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.lab_fences import parse, told

LAB = '{"model": "m", %s}'
SLIDER = LAB % '"controls": [{"label": "a", "min": 0, "max": 2, "value": 1, %s}]'
SELECT = LAB % '"controls": [{"type": "select", "label": "a", "options": %s, "set": "x"%s}]'
CLAIM = LAB % (
    '"controls": [{"label": "m", "min": 0, "max": 1, "value": 1, "set": "q"},'
    ' {"type": "button", "label": "Go", "run": "x"},'
    ' {"type": "select", "label": "int", "options": [["x", 1], ["y", "b"]], "set": "i"}],\n'
    '"expect": [{%s}]'
)
GOAL = CLAIM.replace('"expect": [{%s}]', '"goal": {"text": "Up", "expr": "up", %s}')


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("{}", "2:1-2 field-missing: `model` or `xml` is missing"),
        ('{"model": null}', "2:1-2 field-missing: `model` or `xml` is missing"),
        ('{"model": "m", "xml": "<mujoco/>"}',
         "2:16-21 field-value: `model` and `xml` exclude each other [leave one of them out]"),
        (LAB % '"toggles": ["com", "com"]',
         "2:35-40 field-value: the overlay `com` is named twice"),
        # controls
        (LAB % '"controls": [{"label": "a", "max": 2, "value": 1, "set": "x"}]',
         "2:29-30 field-missing: `min` is missing [`min`: the left end]"),
        (SLIDER % '"step": 3, "set": "x"',
         "2:84-85 field-value: `step` is larger than the range from `min` to `max`, 2"),
        (SLIDER % '"digits": 1',
         "2:29-30 field-missing: `set`, `apply` or `param` is missing"),
        (SLIDER % '"set": "x", "param": "y"',
         "2:88-95 field-value: `set` and `param` exclude each other [leave one of them out]"),
        (LAB % '"controls": [{"label": "a", "min": 2, "max": 2, "value": 2, "set": "x"}]',
         "2:61-62 field-value: `max` must be greater than `min`, which is 2"),
        (LAB % '"controls": [{"label": "a", "min": 0, "max": 2, "value": 3, "set": "x"}]',
         "2:73-74 field-value: `value` must lie between `min` and `max`: 0 to 2"),
        (LAB % '"controls": [{"type": "button", "label": "a", "run": "x"},'
         ' {"type": "button", "label": "a", "run": "y"}]',
         "2:103-106 field-value: two controls are called `a`"),
        (SELECT % ('[["x", 1], ["x", 2]]', ""), "2:85-88 field-value: two options are called `x`"),
        (SELECT % ('[["x", 1], ["y", 1.0]]', ""),
         "2:90-93 field-value: two options have the value `1`"),
        (SELECT % ('[["x", 1], ["y", 2]]', ', "value": "x"'), "2:116-119 field-value: `value`"
         " cannot be `x`: no option has this value"
         " [`x` is the label of an option whose value is `1`]"),
        (SELECT % ('[["x", 1], ["y", 2]]', ', "value": 3'), "2:116-117 field-value: `value`"
         " cannot be `3`: no option has this value [the options have `1`, `2`]"),
        # readouts and plots
        (LAB % '"plots": [{"ymin": 1, "ymax": 1, "traces": [{"label": "a", "expr": "b"}]}]',
         "2:46-47 field-value: `ymax` must be greater than `ymin`, which is 1"),
        # claims
        (CLAIM % '"t": 1, "expr": "1"', "3:12-13 field-missing: `min` or `max` is missing"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "max": 1',
         "3:51-52 field-value: `max` must be at least `min`, which is 2"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": "Goo"',
         "3:53-58 lab-name: the lab has no button `Goo` [did you mean `Go`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": "int"',
         '3:53-58 lab-name: `int` is no button [give the value that it is set to: `{"int": …}`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {}',
         "3:53-54 field-value: `after` names no control"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"mm": 1}',
         "3:54-58 lab-name: the lab has no control `mm` [did you mean `m`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"Go": 1}',
         '3:54-58 lab-name: `Go` is a button and has no value [write `"Go"`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": 1, "Go": 1}',
         "3:62-66 lab-name: `Go` is a button and has no value"
         ' [press it in a step of its own: `"Go"`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": 1.5}',
         "3:59-62 field-value: `m` goes from 0 to 1, and cannot be `1.5`"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": "x"}',
         "3:59-62 field-value: `m` is a slider: its value is a number"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"int": "q"}', "3:61-64 field-value:"
         " `int` cannot be `q`: no option has this value [the options have `1`, `b`]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": ["Go", {}]',
         "3:60-61 field-value: `after[1]` names no control"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": [{"m": 0},\n{"m": 1.5}]',
         "4:7-10 field-value: `m` goes from 0 to 1, and cannot be `1.5`"),
        # goals
        (GOAL % '"log": [{"t": 0, "do": "Goo"}]',
         "3:61-66 lab-name: the lab has no button `Goo` [did you mean `Go`?]"),
        (GOAL % '"log": [{"t": 0, "do": {"int": "x"}}]', "3:69-72 field-value: `int` cannot be `x`:"
         " no option has this value [`x` is the label of an option whose value is `1`]"),
        (GOAL % '"log": [{"t": 0.5, "do": "Go"}, {"t": 0.25, "do": {"m": 1}}]',
         "3:76-80 field-value: `t` must be at least that of the entry before, 0.5"),
    ],
)  # fmt: skip
def test_what_an_author_is_told(body: str, expected: str) -> None:
    assert told(body) == [expected]
    assert parse(body).value is None


def test_a_wrong_control_hides_nothing_else() -> None:
    body = LAB % (
        '"controls": [\n'
        '{"label": "a", "min": 0, "max": 1, "value": "x", "set": "q"},\n'
        '{"label": "b", "min": 3, "max": 1, "value": 2, "set": "q"},\n'
        '{"type": "button", "label": "a", "run": "x"}],\n'
        '"expect": [{"t": 1, "expr": "e", "min": 0, "after": {"a": 7}},\n'
        '{"t": 1, "expr": "e", "min": 0, "after": "c"}],\n'
        '"plots": [{"traces": [], "window": 0}]'
    )
    assert [line.split(" [")[0] for line in told(body)] == [
        "3:45-48 field-type: `value` must be a number, not a string",
        "4:33-34 field-value: `max` must be greater than `min`, which is 3",
        "5:29-32 field-value: two controls are called `a`",
        "6:54-57 lab-name: `a` is a button and has no value",
        "7:42-45 lab-name: the lab has no button `c`",
        "8:22-23 field-value: `traces` is empty",
        "8:36-37 field-value: `window` must be greater than 0, not 0",
    ]


def test_a_step_as_long_as_its_range_and_a_claim_of_one_value_are_good() -> None:
    assert told(SLIDER % '"step": 2, "set": "x"') == []
    assert told(CLAIM % '"t": 1, "expr": "1", "min": 1, "max": 1') == []


@pytest.mark.parametrize("key", ["height=5", "seconds=0", "rtol=x", "diverges=-1", "height=\udc80"])
def test_keys_of_an_edited_model_have_values_that_they_can_have(key: str) -> None:
    source = Source("content/lessons/1.1-x.md", f"```lab mjcf {key}\n<mujoco/>\n```\n")
    parsed = parse_document(source, frozenset(), lesson=True)
    assert "fence-key-value" in {wrong.rule for wrong in parsed.diagnostics}
