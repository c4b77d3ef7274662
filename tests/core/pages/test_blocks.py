"""Scripts, outputs, models, callouts, io cards and bound numbers: the exact HTML."""

from __future__ import annotations

from html import unescape
from re import findall, sub

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from support.rendered_course import Make

SCRIPT = """```python file=examples/a.py
print("<one>")
```
"""
OUTPUT = """
Output, in order:

```text
one  <1>
two
```
"""


def receipt(html: str) -> str:
    return html.split('<p class="receipt ')[1].split("</p>")[0].replace('">', ": ")


def test_an_output_apart_from_its_script_names_it(make: Make) -> None:
    html = make(f"{SCRIPT}\nA word between.\n{OUTPUT}").html()
    assert html.count("<figure") == 2
    assert (
        '<figure class="script script-output" data-script="examples/a.py">\n'
        '<figcaption class="bar"><span class="bar-name">Output of examples/a.py</span>'
        "</figcaption>\n"
        '<div class="output" id="a.out">\n'
    ) in html


@pytest.mark.parametrize("shape", ["> {}", "- {}"])
def test_a_script_and_its_output_are_one_object_in_callouts_and_lists_too(
    make: Make, shape: str
) -> None:
    lines = (SCRIPT + OUTPUT).strip().split("\n")
    prefix = shape.format("").rstrip() if shape.startswith(">") else "  "
    text = "\n".join(
        f"{shape.format('') if not i else prefix + ' ' * (prefix == '>')}{line}"
        for i, line in enumerate(lines)
    )
    html = make(text).html()
    assert html.count("<figure") == 1
    assert html.count("<samp>") == 1


def test_an_output_in_the_next_list_item_stays_apart_from_the_script(make: Make) -> None:
    text = "- x\n\n" + "\n".join(f"  {line}" for line in SCRIPT.split("\n"))
    text += "\n- " + "\n  ".join(OUTPUT.strip().split("\n"))
    assert make(text).html().count("<figure") == 2


@pytest.mark.parametrize(
    ("keys", "status", "expected"),
    [
        ("", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "the same text, character by character."),
        (" digits", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to the last digit shown."),
        (" rtol=1e-6", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to a relative 1e-6."),
        (" atol=1e-12", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to within 1e-12."),
        (" rtol=1e-6 atol=0.5", "verified",
         "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to a relative 1e-6 or within 0.5."),
        (" digits ellipsis", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to the last digit shown; “...” stands for text that is not compared."),
        (' volatile="[0-9.]+ s"', "verified",
         "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: the same text, character by "
         "character; what matches [0-9.]+ s varies from run to run and is not compared."),
        (" volatile", "volatile",
         "volatile: Differs by machine. The script ran with MuJoCo 3.14.0, "
         "Python 3.11.7; what it printed is not compared."),
        ("", "unchecked", "unverified: Not verified: the script was not run to its end."),
        ("", "drift", "unverified: Not verified: with MuJoCo 3.14.0, Python 3.11.7 the script "
         "prints something else."),
    ],
)  # fmt: skip
def test_the_receipt_of_an_output_says_how_it_was_compared(
    make: Make, keys: str, status: str, expected: str
) -> None:
    made = make(SCRIPT + OUTPUT.replace("text", f"text{keys}"), status=status)
    assert receipt(made.html()) == expected


@pytest.mark.parametrize(
    ("outcome", "missing", "expected"),
    [
        (Outcome.SKIPPED, ("torch", "mjx"),
         "unverified: Not verified: torch, mjx was not installed when the site was built."),
        (Outcome.NORUN, (),
         "unverified: Not verified: this script is not run when the site is built."),
        (Outcome.TIMEOUT, (), "unverified: Not verified: the script was not run to its end."),
    ],
)  # fmt: skip
@pytest.mark.parametrize("text", [SCRIPT, SCRIPT + OUTPUT])
def test_the_receipt_of_a_script_that_was_not_run_says_why(
    make: Make, outcome: Outcome, missing: tuple[str, ...], expected: str, text: str
) -> None:
    run = ScriptRun("examples/a.py", outcome, 0, "", "", 0.0, missing)
    made = make(text, runs={"examples/a.py": run}, status="unchecked")
    assert receipt(made.html()) == expected


def test_a_long_script_is_folded_and_loses_no_line(make: Make) -> None:
    body = '"""Doc."""\n\nimport math\nimport sys\n\nA = 1\nB = 2\nC = 3\n\n'
    body += "".join(f"def f{i}():\n" + "    return 1\n" * 12 + "\n\n" for i in range(8))
    html = make(f"```python file=examples/a.py\n{body}```\n").html()
    assert "<summary>lines 1–9: docstring, imports, A, B, C</summary>" in html
    assert "<summary>lines 38–127: f2, f3, f4, f5, f6, f7</summary>" in html
    shown = "".join(findall(r"<code class=\"language-python\">(.*?)</code></pre>", html, flags=16))
    assert unescape(sub(r"</?span[^>]*>", "", shown)) == body.rstrip("\n") + "\n"


def test_control_characters_of_an_output_are_shown(make: Make) -> None:
    html = make(SCRIPT + OUTPUT.replace("two", "\x1b[31mtwo\x07")).html()
    assert "␛[31mtwo␇" in html


def test_code_without_a_file_is_shown_with_its_language_escaped(make: Make) -> None:
    assert make("```sh\nls *.py\n```\n").html() == (
        '<div class="code" data-copy>\n<pre tabindex="0" role="group" aria-label="Code">'
        '<code class="language-sh">ls *.py\n</code></pre>\n</div>\n'
    )
    assert 'class="language-python"' in make("```python fragment\nx = (\n```\n").html()
    hostile = make('```"><script>alert(1)</script>\nx\n```\n').html()
    assert "<script" not in hostile
