"""Numbers in text: where they are, how they are rounded, and the outputs that they are bound to."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Document, Script, document_blocks
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.model.walk import without_prose
from coursebuild.core.scripts.bindings import PrintedOutputs, check_bindings, dependent_bindings
from coursebuild.core.scripts.compare import verify
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.numbers import Number, round_like, scan, scan_prose
from support.fixture_cases import fixture_tables, fixture_text
from support.growth import processor_time_growth
from support.sample_lessons import course, describe, document, make_run

CASES = fixture_tables("numbers")


def texts(text: str) -> list[str]:
    return [number.text for number in scan(text)]


def test_numbers_are_found() -> None:
    for text, expected in [*CASES["numbers"], ("9" * 1000, ["9" * 1000])]:
        assert texts(text) == expected
        assert [number.text for number in scan_prose(text)] == expected


def test_text_stays_text() -> None:
    assert {text: texts(text) for text in [*CASES["text"], "9" * 1001] if texts(text)} == {}


@pytest.mark.parametrize(("text", "value", "place"), CASES["powers"])
def test_powers_of_ten_in_prose(text: str, value: str, place: int) -> None:
    (number,) = scan_prose(text)
    assert (number.value, number.place, number.is_integer) == (Decimal(value), place, False)
    assert number.text == text


@pytest.mark.parametrize(("sample", "value", "expected"), CASES["rounding"])
def test_rounding_in_the_notation_of_another_number(sample: str, value: str, expected: str) -> None:
    assert round_like(scan(sample)[0], Decimal(value)) == expected


@given(st.text())
def test_scanning_never_fails_and_spans_slice_back(text: str) -> None:
    end = 0
    for number in scan_prose(text):
        assert end <= number.start < number.end
        assert text[number.start : number.end] == number.text
        end = number.end


@given(st.floats(), st.sampled_from(["", ".3f", "e", ".1e", "g", "+.6g", ".0f"]))
def test_every_way_to_print_a_float_is_one_number(value: float, spec: str) -> None:
    printed = format(value, spec)
    numbers: tuple[Number, ...] = scan(f"x: {printed} m")
    assert [n.text for n in numbers] == ([printed] if len(printed) <= 1000 else [])


def test_powers_of_ten_are_rounded_in_their_own_notation() -> None:
    for text, value, expected in (
        ("3.9 × 10⁻¹¹", "4.94e-10", "4.9 × 10⁻¹⁰"),
        ("3.9·10^{-11}", "-9.97e-10", "-1.0·10^{-9}"),
        ("−3.90·10^\u22125", "-0.125", "−1.25·10^\u22121"),
        (r"3\cdot10^{4}", "0.2", r"2\cdot10^{-1}"),
        ("3.9 × 10⁻¹¹", "0", None),
        ("39 × 10⁻¹¹", "4.94e-10", None),
    ):
        (number,) = scan_prose(text)
        assert round_like(number, Decimal(value)) == expected, text


PIECES = ["1-", "00:", "1", "1.1111", "1+", "a", "1 ", "1e", "1f", "-", "1/", ".", "a-1", "nan"]


@pytest.mark.site
def test_scanning_repeated_text_takes_linear_time() -> None:
    """Measured by time: the work of one expression shows in no count of calls."""

    def growth(piece: str) -> float:
        return processor_time_growth(lambda size: scan(piece * (size // len(piece)) + "x"), 2048)

    growths = {piece: growth(piece) for piece in [*PIECES, "1.2.3-"]}
    assert {piece: growth for piece, growth in growths.items() if growth > 24} == {}


OUTPUT = fixture_text("documents/bound_output.txt")


def script(path: str = "examples/a.py") -> str:
    return f"```python file={path}\nprint(1)\n```\n"


def output(text: str = OUTPUT, keys: str = "") -> str:
    return f"\nOutput:\n\n```text {keys}\n{text}```\n"


LESSON = script() + output()


def check(
    text: str, *runs: ScriptRun, documents: tuple[Document, ...] = (), scripts: tuple[str, ...] = ()
) -> tuple[Diagnostic, ...]:
    lesson = document(text)
    paths = [
        block.path
        for each_document in (lesson, *documents)
        for block in document_blocks(each_document)
        if isinstance(block, Script)
    ]
    verdicts = verify(course(lesson, *documents), runs)
    printed = PrintedOutputs(verdicts, runs, [*paths, *scripts])
    findings = check_bindings(lesson, printed)
    assert check_bindings(without_prose(lesson), printed) == findings  # as a whole course is read
    return findings


def find_mistake(binding: str, printed: str = OUTPUT) -> Diagnostic | None:
    diagnostics = check(f"{script()}{output(printed)}\nHere: {binding}\n", make_run(printed))
    assert len(diagnostics) <= 1
    return diagnostics[0] if diagnostics else None


def test_a_printed_value_rounded_to_the_digits_shown() -> None:
    for binding in CASES["bindings"]:
        assert find_mistake(f"`{binding}`{{out}}") is None, binding


def test_text_next_to_the_number_narrows_the_choice() -> None:
    printed = "E 6.0 J\nP 6.04 W\nv=6.1 m/s\n"
    for binding, holds in CASES["context"]:
        assert (find_mistake(f"`{binding}`{{out}}", printed) is None) is holds, binding
    wide_columns = printed.replace("v=", "E" + " " * 100)
    assert find_mistake("`E 6.1`{out}", wide_columns) is None


def test_a_unit_that_is_not_printed_holds_beside_numbers_with_units() -> None:
    printed = "start 20.00 °C\nend 70.19\nforce 5.20 N m\npower 8.00 W\n"
    for binding in ("70.19 °C", "5.20 N·m", "20.00 °C", "70.2 kg"):
        assert find_mistake(f"`{binding}`{{out}}", printed) is None, binding
    for binding in ("8.00 N", "70.18 °C", "20.00 K"):
        assert find_mistake(f"`{binding}`{{out}}", printed) is not None, binding


def test_the_nearest_output_above_counts() -> None:
    text = (
        script() + output("x 1.5\n") + "\n`1.5`{out} `2.5`{out}\n\n" + output("x 2.5\n")
        + "\n`2.5`{out} `1.5`{out}\n"
    )  # fmt: skip
    diagnostics = check(text)
    assert [(d.rule, d.span.text) for d in diagnostics] == [
        ("binding-mismatch", "2.5"),
        ("binding-mismatch", "1.5"),
    ]


def test_a_named_script_is_found_anywhere() -> None:
    second = document(
        script("examples/b.py") + output("y 2.5\n") + output("y 3.5\n"), "content/lessons/1.1-x.md"
    )
    runs = (make_run(OUTPUT), make_run("y 2.5\ny 3.5\n", path="examples/b.py"))
    text = (
        "`+6.6 %`{out=examples/a.py} `2.5`{out=examples/b.py} `3.5`{out=examples/b.py}\n\n" + LESSON
    )
    assert check(text, *runs, documents=(second,)) == ()
    (diagnostic,) = check("`9.9`{out=examples/b.py}\n\n" + LESSON, *runs, documents=(second,))
    assert (diagnostic.rule, diagnostic.label) == (
        "binding-mismatch",
        "the nearest printed value is 3.5",
    )


def test_a_named_script_without_a_recorded_output_counts_by_its_run() -> None:
    text = (
        LESSON + script("examples/c.py") + "\n`1.5`{out=examples/c.py} `1.7`{out=examples/c.py}\n"
    )
    run = make_run("x 1.52\n", path="examples/c.py")
    assert [d.span.text for d in check(text, make_run(OUTPUT), run)] == ["1.7"]
    skipped_run = make_run("", path="examples/c.py", outcome=Outcome.SKIPPED)
    assert check(text, make_run(OUTPUT), skipped_run) == ()
    assert check(text, make_run(OUTPUT)) == ()
    norun = make_run("", path="examples/c.py", outcome=Outcome.NORUN)
    diagnostics = check(text, make_run(OUTPUT), norun)
    assert (
        describe(diagnostics[0])
        == """\
binding-orphan at 21:2 `1.5`
  `1.5` is bound to `examples/c.py`, which has no recorded output and is not run
  help: record its output below it"""
    )


def test_bindings_to_a_failed_script_are_not_reported() -> None:
    good = (Outcome.OK, Outcome.SKIPPED, Outcome.NORUN)
    failed_runs = [make_run(outcome=outcome) for outcome in Outcome if outcome not in good]
    for run in (*failed_runs, make_run("\n")):
        assert check(LESSON + "\n`99`{out} `98`{out=examples/a.py}\n", run) == ()


def test_recorded_text_counts_where_nothing_ran() -> None:
    text = LESSON + "\n`6.6 %`{out} `99`{out}\n"
    table = "\nOutput, in part:\n\n| a | b |\n| - | - |\n| x | 1 |\n\n`99`{out}\n"
    for runs in ((), (make_run(outcome=Outcome.SKIPPED),), (make_run(outcome=Outcome.NORUN),)):
        assert [d.span.text for d in check(text, *runs)] == ["99"]
        assert check(LESSON + table, *runs) == ()  # a table may leave out what is printed


def test_where_recorded_text_drifted_the_run_counts_too() -> None:
    text = LESSON + "\n`6.6 %`{out} `6.7 %`{out} `6.8 %`{out}\n"
    (diagnostic,) = check(text, make_run(OUTPUT.replace("6.641", "6.702")))
    assert (diagnostic.span.text, diagnostic.label) == (
        "6.8 %",
        "the nearest printed value is +6.702",
    )


def test_bindings_may_show_what_an_ellipsis_leaves_out() -> None:
    text = (
        script() + output("start\n...\nend 1.5\n", "ellipsis") + "\n`1.5`{out} `8`{out} `9`{out}\n"
    )
    assert [d.span.text for d in check(text, make_run("start\nx 7.52\nend 1.5\n"))] == ["9"]


def test_bindings_in_quotes_and_footnotes_are_checked() -> None:
    diagnostics = check(LESSON + "\n> `9.9`{out}[^a]\n\n[^a]: `9.8`{out}\n", make_run(OUTPUT))
    assert [d.span.text for d in diagnostics] == ["9.9", "9.8"]


def test_numbers_of_recorded_tables_count() -> None:
    text = (
        script() + "\nOutput:\n\n| a | b |\n| --- | --- |\n| Euler | **+6.641 %** |\n\n"
        "`+6.6 %`{out} `6.9e-04`{out} `Euler +6.6 %`{out} `7.7 %`{out}\n"
    )
    diagnostics = check(text, make_run(OUTPUT))
    assert [(d.span.text, d.label) for d in diagnostics] == [
        ("7.7 %", "the nearest printed value is +6.641")
    ]


def find_dependents(text: str, printed: str, *documents: Document) -> list[tuple[str, str, str]]:
    lesson = document(text)
    runs = [make_run(printed)]
    verdicts = verify(course(lesson, *documents), runs)
    return [
        (dependent.binding.text, dependent.change.recorded, dependent.change.printed)
        for verdict in verdicts
        for dependent in dependent_bindings(
            verdict, [lesson, *documents], PrintedOutputs(verdicts, runs), {}
        )
    ]


def test_bindings_depend_on_the_values_that_they_show() -> None:
    text = (
        LESSON
        + "\n`+6.6 %`{out} `\u22126.0 %`{out} `4 flips`{out} `0.0733, 0.0267`{out} `RK4`{out}\n"
    )
    new_output = OUTPUT.replace("6.641", "6.702").replace("0.026667", "0.03").replace("RK4", "RK5")
    assert find_dependents(text, new_output) == [
        ("+6.6 %", "+6.641", "+6.702"),
        ("0.0733, 0.0267", "0.026667", "0.03"),
        ("RK4", "RK4", "RK5"),
    ]
    assert find_dependents(text, OUTPUT) == []
    second = document("`+6.6 %`{out=examples/a.py} `6.6`{out}\n", "content/lessons/5.1-x.md")
    table = "\nOutput:\n\n| a | b |\n| --- | --- |\n| `Euler` | **+6.641 %** |\n"
    for lesson in (LESSON, script() + table):
        dependents = find_dependents(lesson, OUTPUT.replace("6.641", "6.702"), second)
        assert dependents == [("+6.6 %", "+6.641", "+6.702")]


@settings(max_examples=50)
@given(st.floats(-1e9, 1e9), st.integers(0, 8), st.integers(0, 8))
def test_fewer_digits_of_what_was_printed_always_hold(
    value: float, printed: int, fewer: int
) -> None:
    text = f"{value:.{printed}f}"
    rounded = Decimal(text).quantize(Decimal(1).scaleb(-min(printed, fewer)), ROUND_HALF_EVEN)
    assert find_mistake(f"`{rounded:f} J`{{out}}", f"E = {text} J, 3 steps\n") is None


def test_words_before_a_number_choose_it() -> None:
    printed = "Euler:\nerror 2.5, h = 0.1 s\nRK4:\nerror 2.5, h = 0.1 s\nrate 1/min 2.5 and 2.5\n"
    for words, holds in CASES["words"]:
        mistake = find_mistake(f'`2.5`{{out="{words}"}}', printed)
        assert (mistake is None) is holds, words
    text = f'{script()}{output(printed)}\nHere $x${{value=2.5 out="Euler error"}}.\n'
    assert check(text, make_run(printed)) == ()
    mistake = find_mistake('`9`{out="robot # #"}', "robot #3: 2.5 N\nrobot #4: 3.5 N\n")
    assert mistake is not None
    edits = [edit.text for note in mistake.notes for edit in note.edits]
    assert edits == ['{out="4"}', '{out="3"}'], "a `#` that is printed is a word"


def test_numbers_with_labels_of_their_own_are_different_quantities() -> None:
    """Those of one label or column, and those that nothing names, are shown together."""
    for printed, is_ambiguous in CASES["labels"]:
        mistake = find_mistake("`2.5`{out}", f"{printed}\n")
        assert (mistake is not None) is is_ambiguous, (printed, mistake)


def test_titles_choose_a_number() -> None:
    """Of a column; what stands above it and the beginning of a row may go with it."""
    for printed, words, holds in CASES["titles"]:
        mistake = find_mistake(f'`2.5`{{out="{words}"}}', f"{printed}\n")
        assert (mistake is None) is holds, (printed, words, mistake)
    mistake = find_mistake("`2.5`{out}", f"{CASES['titles'][-1][0]}\n")
    assert mistake is not None and mistake.rule == "output-ambiguous"
    assert all(note.edits for note in mistake.notes)


def test_choice_in_a_quiz_is_written_as_json_needs_it() -> None:
    printed = "measured 2.5, formula 2.5\n"
    quiz = '{"id": "q", "questions": [{"kind": "open", "q": "`2.5`{out}?", "reference": "Yes."}]}'
    text = f"{script()}{output(printed)}\n```quiz\n{quiz}\n```\n"
    (diagnostic,) = check(text, make_run(printed))
    edits = [edit.text for note in diagnostic.notes for edit in note.edits]
    assert edits == [r"{out=\"measured\"}", r"{out=\"formula\"}"]


def test_a_number_in_a_caption_is_one_of_its_own_output() -> None:
    text = script() + "\nOutput, after `1.5`{out} s:\n\n```text\nt 1.5\n```\n"
    assert check(text, make_run("t 1.5\n")) == ()
    (diagnostic,) = check(text.replace("`1.5`", "`2.5`"), make_run("t 1.5\n"))
    assert diagnostic.rule == "binding-mismatch"


UNIT_PLACES = CASES["unit_places"]


def test_the_unit_of_a_number_may_stand_in_a_header_or_field_beside_it() -> None:
    printed = "depth 33.6 cm, width 2.5 m\n"
    for place in UNIT_PLACES:
        for unit, holds in (("cm", True), ("m", False), ("mm", False)):
            text = f"{script()}{output(printed)}\n{place.format(unit)}\n"
            messages = {d.message for d in check(text, make_run(printed))}
            expected = f"`examples/a.py` printed `33.6 cm`, and the unit here is `{unit}`"
            assert messages == (set() if holds else {expected}), (place, unit)


def test_a_number_with_the_right_unit_is_found_beside_a_table_that_leaves_it_out() -> None:
    printed = "mass 2.000 kg\nspeed (m/s)  way (m)\n1.0  0.17\n2.0  0.68\n"
    rows = "| speed (m/s) | way (m) |\n| --- | --- |\n| 1.0 | 0.17 |\n| 2.0 | 0.68 |"
    text = f"{script()}\nOutput:\n\n{rows}\n\nIt has "
    for binding, holds in (("`2.0 kg`{out}", True), ("`2.0 N`{out}", False)):
        assert (check(text + binding, make_run(printed)) == ()) is holds, binding
