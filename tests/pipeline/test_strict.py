"""Strict checks, and scripts that prove nothing because they were not run."""

from __future__ import annotations

import json

import pytest

from support.scratch_course import FIRST, Folder, Make, block

pytestmark = pytest.mark.site

SKIP = "\n#### Deep\n"
"""A heading that gets a warning."""
TORCH = (
    "## Two\n\n"
    + block("two.py", "import no_torch", "2.99", info="requires=no_torch")
    + "It is `2.99`{out}, or `3.0`{out=examples/two.py}, of 17.5.\n"
)
NORUN = "## Three\n\n" + block("three.py", "print(3)", "7.77", info="norun")


def verify(folder: Folder, text: str) -> None:
    """Write the table `[verify]` of the map, or another one at its end."""
    name = "content/course.toml"
    map = folder.text(name).partition("\n[verify]")[0]
    folder.write(name, f"{map}\n[verify]\n{text}")


def last_line(text: str) -> str:
    return text.splitlines()[-1]


def test_strict_shows_a_warning_as_an_error_in_every_format(make: Make) -> None:
    folder = make(FIRST + SKIP)
    plain = folder.main("check")
    strict = folder.main("check", "--strict")
    assert (plain.status, strict.status) == (0, 1)
    assert plain.out.startswith("warning[heading-skip]: ")
    assert strict.out.partition("\n\n")[0] == plain.out.partition("\n\n")[0].replace(
        "warning[", "error["
    )
    assert last_line(strict.out) == "1 lesson, 0 scripts run, 1 cached: 1 error"
    parts = {
        "json": '"severity": "error"',
        "junit": '<failure type="heading-skip"',
        "sarif": '"level": "error"',
        "github": "::error file=content/lessons/1.1-one.md,line=14,",
    }
    for form, part in parts.items():
        result = folder.main("check", "--strict", "--format", form)
        assert (result.status, part in result.out) == (1, True), form
        assert part not in folder.main("check", "--format", form).out, form


@pytest.mark.parametrize("is_option", (True, False))
def test_strict_build_publishes_nothing_while_there_is_a_warning(
    make: Make, is_option: bool
) -> None:
    folder = make(FIRST + SKIP)
    option = ("--strict",) if is_option else ()
    verify(folder, "" if is_option else "strict = true\n")
    result = folder.main("build", *option)
    assert (result.status, (folder.root / "public").exists()) == (1, False)
    assert "nothing was published" in result.out
    folder.write(folder.lesson(), FIRST)
    assert folder.main("build", *option).status == 0
    assert (folder.root / "public/index.html").exists()


def test_a_run_with_nothing_to_do_keeps_the_verdict_of_strict_apart(make: Make) -> None:
    folder = make(FIRST + SKIP)
    expected = {(): 0, ("--strict",): 1}
    for _ in range(2):
        for option, status in expected.items():
            assert folder.main("check", *option).status == status
    verify(folder, "strict = true\n")
    assert folder.main("check").status == 1
    verify(folder, "strict = false\n")
    assert folder.main("check").status == 0


def test_strict_leaves_what_is_silenced_or_only_listed(make: Make) -> None:
    folder = make(FIRST + SKIP + "\nIt weighs 17.5 kg.\n")
    silence = '[[silence]]\nrule = "heading-skip"\nreason = "a list of tasks"\n'
    verify(folder, f"strict = true\n\n{silence}")
    result = folder.main("check", "--truth")
    assert result.status == 0
    assert result.out.startswith("warning[number-unproven]: nothing proves `17.5`")
    assert last_line(result.out) == "1 lesson, 1 script run: 1 warning (1 silenced)"


def test_a_script_that_lacks_a_package_proves_nothing(make: Make) -> None:
    folder = make(FIRST, TORCH)
    result = folder.main("check")
    assert result.status == 0
    assert last_line(result.out) == (
        "2 lessons, 1 script run: holds, but for 1 script that was not run (no_torch)"
    )
    report = json.loads(folder.main("check", "--format", "json").out)
    summary, script = report["summary"], report["scripts"][1]
    assert (summary["unproven"], summary["reasons"]) == (1, ["no_torch"])
    assert (script["unproven_outputs"], script["unproven_numbers"]) == (1, 2)
    strict = folder.main("check", "--strict", "--format", "github")
    assert strict.status == 1
    assert strict.out.startswith("::error file=content/lessons/1.2-two.md,line=3,col=1,")
    truth = folder.main("check", "--truth").out
    assert "1.2: 0.0 % of 3 numbers proven: 0 bound, 0 computed, 0 given with a source;" in truth
    verify(folder, "truth = 0.5\n")
    assert "error[truth-share]: 0.0 % of the numbers are proven" in folder.main("check").out
    verify(folder, "")
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.2-two.html")
    doubt = "Not verified: no_torch was not installed when the site was built."
    for number in ("2.99", "3.0"):
        assert f'<span class="bound unverified" title="{doubt}">{number}</span>' in page


def test_several_scripts_that_were_not_run_are_counted_with_their_reasons(make: Make) -> None:
    again = TORCH.replace("two.py", "again.py")
    folder = make(FIRST, TORCH, again)
    result = folder.main("check")
    assert last_line(result.out).endswith(": holds, but for 2 scripts that were not run (no_torch)")
    folder.write(folder.lesson(3), NORUN + SKIP)
    result = folder.main("check")
    assert last_line(result.out).endswith(
        ": 1 warning, and 2 scripts that were not run (no_torch, norun)"
    )


def test_the_map_lets_scripts_pass_by_name(make: Make) -> None:
    folder = make(FIRST, TORCH, NORUN)
    verify(folder, 'strict = true\nunproven = ["examples/three.py"]\n')
    result = folder.main("check")
    assert result.status == 1
    assert "examples/three.py` was not run" not in result.out
    assert last_line(result.out).endswith(
        ": 1 error, and 2 scripts that were not run (no_torch, norun)"
    )
    verify(folder, 'strict = true\nunproven = ["examples/three.py", "examples/two.py"]\n')
    for command in ("check", "build"):
        result = folder.main(command)
        assert result.status == 0
        assert last_line(result.out).endswith(
            ": holds, but for 2 scripts that were not run (no_torch, norun)"
        )


def test_a_course_whose_only_scripts_are_let_pass_is_clean(make: Make) -> None:
    folder = make(TORCH)
    verify(folder, 'strict = true\nunproven = ["examples/two.py"]\n')
    assert folder.main("check").status == 0
    verify(folder, "strict = true\n")
    result = folder.main("check")
    assert result.status == 1
    assert "error[no-scripts]" in result.out
