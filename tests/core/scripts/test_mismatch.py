"""What is proposed for a bound number when its output is recorded anew."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model.results import ScriptRun
from coursebuild.core.scripts.bindings import BindingEvidence, PrintedOutputs, check_bindings
from coursebuild.core.scripts.compare import verify
from coursebuild.core.text.diagnostics import Diagnostic
from support.sample_lessons import course, describe, document, make_run

PENDULUM = "period   2.006 s\nhalf     1.003 s\n"


def lesson(prose: str, output: str, fence: str = "text") -> str:
    body = output if output.startswith("|") else f"```{fence}\n{output}```\n"
    return f"```python file=examples/a.py\nprint(1)\n```\n\nOutput:\n\n{body}\n{prose}\n"


def check(evidence: BindingEvidence, text: str, *runs: ScriptRun) -> tuple[Diagnostic, ...]:
    page = document(text)
    verdicts = verify(course(page), runs)
    return check_bindings(page, PrintedOutputs(verdicts, runs, ["examples/a.py"]), evidence)


def mismatch_after(binding: str, before: str, now: str, fence: str = "text") -> Diagnostic:
    """The diagnostic of a binding after a new output is recorded.

    Before that, the old recording is compared with the new run, as before an update is accepted.
    """
    prose, evidence = f"`{binding}`{{out}}", BindingEvidence()
    assert check(evidence, lesson(prose, before, fence), make_run(before)) == ()
    assert check(evidence, lesson(prose, before, fence), make_run(now)) == ()
    (diagnostic,) = check(evidence, lesson(prose, now, fence), make_run(now))
    proposals = [edit.text for edit in diagnostic.edits]
    assert proposals == ([diagnostic.help[7:-1]] if diagnostic.help.startswith("write `") else [])
    for text in proposals:  # the proposal holds
        assert check(evidence, lesson(f"`{text}`{{out}}", now, fence), make_run(now)) == ()
    return diagnostic


def test_wording_of_a_mismatch() -> None:
    diagnostic = mismatch_after("2.006 s", PENDULUM, "period   2.950 s\nhalf     1.975 s\n")
    assert (
        describe(diagnostic)
        == """\
binding-mismatch at 12:2 `2.006 s`
  `2.006 s` is not what `examples/a.py` printed, rounded to the digits shown
  ^ 2.950 is printed where 2.006 was
  help: write `2.950 s`"""
    )
    diagnostic = mismatch_after("2.006", PENDULUM, "half   1.975 s\nwhole   2.950 s\n")
    assert (
        describe(diagnostic)
        == """\
binding-mismatch at 12:2 `2.006`
  `2.006` is not what `examples/a.py` printed, rounded to the digits shown
  ^ it is not certain what is printed in place of 2.006 now; the nearest printed value is 1.975"""
    )


@pytest.mark.parametrize(
    ("binding", "before", "now", "label", "help_text"),
    [
        # swapped, as lines and as values: the one beside the same words counts
        ("1.5", "a 1.5\nb 2.5", "b 1.6\na 2.6", "2.6 is printed where 1.5 was", "2.6"),
        ("1.5", "a 1.5\nb 2.5", "a 2.4\nb 1.4", "2.4 is printed where 1.5 was", "2.4"),
        # a line more and one fewer
        ("2.5", "x 1\na 2.5", "a 3.5\nb 2.4", "3.5 is printed where 2.5 was", "3.5"),
        # inside a line
        ("2.0", "a 1.0 b 2.0 c 3.0", "a 2.1 b 7.0 c 2.2", "7.0 is printed where 2.0 was", "7.0"),
        ("1, 2.0", "[1.0 2.0 3.0]", "[3.1  4.0 1.1]", "3.1, 4.0 are printed where 1.0, 2.0 were",
            "3, 4.0"),
        # columns get wider, numbers get signs, minus signs are real ones, exponents move
        ("6.6 %", "E  6.641 %  p 6.2", "E -12.700 %  p 6.5", "-12.700 is printed where 6.641 was",
            "-12.7 %"),
        ("\u22120.5", "a \u22120.5\nb 0.6", "a \u22120.9\nb \u22120.6",
            "\u22120.9 is printed where \u22120.5 was", "\u22120.9"),
        ("3.9e-11", "a 3.9e-11\nb 1e-3", "a 1.23E-07\nb 3.8e-11",
            "1.23E-07 is printed where 3.9e-11 was", "1.2e-07"),
        ("+6.6", "a +6.641", "a +7.25", "+7.25 is printed where +6.641 was", "+7.2"),
        ("4 flips", "a 4 flips\nb 9 flips", "a 12 flips\nb 5 flips", "12 is printed where 4 was",
            "12 flips"),
        # rounded as the author rounds; where digits would be lost there is nothing to write
        ("3.9 × 10⁻¹¹", "a 3.9e-11 b 5", "a 4.9e-11 b 5", "4.9e-11 is printed where 3.9e-11", ""),
        ("2.5", "a 2.5\nb 3", "a nan\nb 3", "nan is printed where 2.5 was", ""),
        ("2.01", "a 2.00613", "a 0.00314", "0.00314 is printed where 2.00613 was", ""),
        ("12", "a 12", "a 0", "0 is printed where 12 was", "0"),
        # with its unit it would be another one
        ("2.5 J", "a 2.5\nb 3", "a 3.5\nb 4 J", "3.5 is printed where 2.5 was", ""),
        # two places that are one number
        ("2.5", "a 2.5 2.50", "a 3.5 3.50", "3.5 is printed where 2.5 was", "3.5"),
        # the unit chooses the place
        ("2.5 J", "a 2.5 m 2.5 J", "a 3.5 m 4.5 J", "4.5 is printed where 2.5 was", "4.5 J"),
        # nothing is printed any more
        ("2.5", "a 2.5", "nothing here", "no number was printed", ""),
        ("2.5, 3.5", "a 2.5 3.5", "a 2.5\nb 3.6", "no printed line has 2 numbers one after", ""),
    ],
)  # fmt: skip
def test_the_number_in_the_same_place_is_proposed(
    binding: str, before: str, now: str, label: str, help_text: str
) -> None:
    diagnostic = mismatch_after(binding, before + "\n", now + "\n")
    assert diagnostic.label.startswith(label)
    assert diagnostic.help == (help_text and f"write `{help_text}`")


@pytest.mark.parametrize(
    ("before", "now", "successor"),
    [
        # headings tell lines that are alike apart, wherever they stand
        ("Euler:\nerr 2.5\nRK4:\nerr 1", "RK4:\nerr 2.4\nEuler:\nerr 7.5", "7.5"),
        ("Euler:\nerr 2.5\nRK4:\nerr 1", "Euler:\nerr 7.5\nMid:\nerr 2.4\nRK4:\nerr 1", "7.5"),
        ("Euler:\nerr 2.5\nRK4:\nerr 1", "Euler:\nerr 7.5", "7.5"),
        # one that is gone may have been what the number was about
        ("Euler:\nerr 2.5\nRK4:\nerr 1", "Midpoint:\nerr 7.5\nRK4:\nerr 1", None),
        ("Euler:\nerr 2.5", "Euler:\nsteps\nerr 7.5", None),
        ("Euler:\nerr 2.5\nRK4:\nE 1", "Euler:\nE 1\nRK4:\nerr 7.5", None),
        # rows are known by the number that they begin with
        ("dt err\n0.1 2.5\n0.2 9", "dt err\n0.05 2\n0.1 7.5\n0.2 9", "7.5"),
        ("dt err\n0.1 2.5\n0.2 9", "dt err\n0.05 2\n0.1 7.5", "7.5"),
        ("n err\n0 10 3.5\n0 20 2.5", "n err\n0 10 8\n0 20 7.5", None),
        ("n err\n10 3.5\n20 2.5\n40 4.5", "n err\n10 3.1\n30 2.1\n40 4.1", None),
        ("1 0 2.5\n2 1 9", "2 0 8\n1 1 7.5", "7.5"),
        ("dt 0.1\nerr 2.5\ndt 0.2\nerr 9", "dt 0.05\nerr 2.4\ndt 0.1\nerr 7.5", None),
        ("err 2.5", "err 2.6\nerr 2.7", None),
        # another wording is another quantity
        ("period 2.5 s", "frequency 2.6 s", None),
        ("period 2.5 s", "period 2.6 ms", None),
    ],
)  # fmt: skip
def test_which_line_is_the_same(before: str, now: str, successor: str | None) -> None:
    diagnostic = mismatch_after("2.5", before + "\n", now + "\n")
    if successor is None:
        assert diagnostic.label.startswith(
            "it is not certain what is printed in place of 2.5 now; the "
        )
        assert (diagnostic.help, diagnostic.edits) == ("", ())
    else:
        assert diagnostic.label == f"{successor} is printed where 2.5 was"
        assert diagnostic.help == f"write `{successor}`"


def test_lines_left_out_by_an_ellipsis_are_evidence_too() -> None:
    evidence, prose = BindingEvidence(), "`7.5`{out}"
    recorded = "start\n...\nend 1.5\n"
    text = lesson(prose, recorded, "text ellipsis")
    assert check(evidence, text, make_run("start\nx 7.52\nend 1.5\n")) == ()
    (diagnostic,) = check(evidence, text, make_run("start\nx 9.52\ny 7.6\nend 1.5\n"))
    assert (diagnostic.label, diagnostic.help) == ("9.52 is printed where 7.52 was", "write `9.5`")


def test_with_another_number_of_outputs_the_evidence_does_not_count() -> None:
    evidence, now = BindingEvidence(), "period 2.950 s\nhalf 1.975 s\n"
    assert check(evidence, lesson("`2.006`{out}", PENDULUM), make_run(PENDULUM)) == ()
    two_outputs = lesson("\nOutput:\n\n```text\n" + now + "```\n`2.006`{out}", now)
    (diagnostic,) = check(evidence, two_outputs, make_run(now))
    assert diagnostic.label == "the nearest printed value is 1.975"


@pytest.mark.parametrize(
    ("binding", "printed", "nearest", "better"),
    [
        # proposed where no other number can be meant
        ("2.5", "a 2.6 2.60", "2.6", "2.6"),
        ("2.5", "a 2.6 9.1", "2.6", ""),
        ("b 2.5", "a 2.4 b 9.1", "9.1", "b 9.1"),
        ("2.5 J", "a 2.4 J b 9.1", "2.4", "2.4 J"),
        ("2.5 s", "energy 2.4 J", "2.4", ""),
        ("−1.5e-3", "1.6e-03", "1.6e-03", "1.6e-3"),
        ("1.50, 2.0", "-1.50 -2.00", "-1.50, -2.00", "-1.50, -2.0"),
        # the nearest by its size, then by its sign
        ("829.030", "work -829.030 J, 263.1 W", "-829.030", ""),
        ("829.030", "-829.031 829.031", "829.031", ""),
        ("1.50, -2.0", "1.50 2.00\n1.50 -2.1", "1.50, 2.00", ""),
        ("0.1", "0.0001 0.5", "0.5", ""),
        ("5.1", "nan inf 9.0", "9.0", ""),
    ],
)
def test_without_evidence_the_nearest_number_is_named(
    binding: str, printed: str, nearest: str, better: str
) -> None:
    text = lesson(f"`{binding}`{{out}}", printed + "\n")
    (diagnostic,) = check(BindingEvidence(), text, make_run(printed + "\n"))
    assert (
        diagnostic.label.replace("values are", "value is")
        == f"the nearest printed value is {nearest}"
    )
    assert diagnostic.help == (better and f"write `{better}`")
    assert [edit.text for edit in diagnostic.edits] == [better][: bool(better)]


NUMBER = st.integers(1000, 9999).map(lambda n: f"{n / 100:.2f}")


@settings(max_examples=50)
@given(
    st.lists(NUMBER, min_size=2, max_size=6, unique=True), st.randoms(use_true_random=False),
    st.data(),
)  # fmt: skip
def test_a_named_number_is_never_taken_for_another(
    numbers: list[str], random: object, data: st.DataObject
) -> None:
    """Lines with names of their own, in any order, with others between them."""
    names = [f"{chr(97 + k)} is" for k in range(len(numbers))]
    before = "".join(f"{name} {number}\n" for name, number in zip(names, numbers, strict=True))
    new_numbers = data.draw(st.lists(NUMBER, min_size=len(names), max_size=len(names), unique=True))
    rows = [f"{name} {number}\n" for name, number in zip(names, new_numbers, strict=True)]
    rows += data.draw(st.lists(st.sampled_from(["done\n", "more 17\n"]), max_size=2, unique=True))
    now = "".join(data.draw(st.permutations(rows)))
    if numbers[0] in new_numbers:
        return
    diagnostic = mismatch_after(numbers[0], before, now)
    if diagnostic.edits:
        assert (diagnostic.label, diagnostic.edits[0].text) == (
            f"{new_numbers[0]} is printed where {numbers[0]} was", new_numbers[0],
        )  # fmt: skip
