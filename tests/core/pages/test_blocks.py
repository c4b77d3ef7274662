"""Scripts, outputs, models, callouts, io cards and bound numbers: the exact HTML."""

from __future__ import annotations

from html import unescape
from re import findall, sub

import pytest

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


def test_a_script_and_its_output_are_one_object_in_callouts_and_lists_too(make: Make) -> None:
    lines = (SCRIPT + OUTPUT).strip().split("\n")
    for first, indent in (("> ", "> "), ("- ", "  ")):
        html = make(first + f"\n{indent}".join(lines)).html()
        assert html.count("<figure") == 1
        assert html.count("<samp>") == 1


def test_an_output_in_the_next_list_item_stays_apart_from_the_script(make: Make) -> None:
    text = "- x\n\n" + "\n".join(f"  {line}" for line in SCRIPT.split("\n"))
    text += "\n- " + "\n  ".join(OUTPUT.strip().split("\n"))
    assert make(text).html().count("<figure") == 2


@pytest.mark.parametrize(
    ("keys", "status", "expected"),
    [
        (" atol=1e-12", "verified", "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: "
         "every number to within 1e-12."),
        (' volatile="[0-9.]+ s"', "verified",
         "verified: Verified with MuJoCo 3.14.0, Python 3.11.7: the same text, character by "
         "character; what matches [0-9.]+ s varies from run to run and is not compared."),
        ("", "unchecked", "unverified: Not verified: the script was not run to its end."),
        ("", "drift", "unverified: Not verified: with MuJoCo 3.14.0, Python 3.11.7 the script "
         "prints something else."),
    ],
)  # fmt: skip
def test_the_receipt_of_an_output_says_how_it_was_compared(
    make: Make, keys: str, status: str, expected: str
) -> None:
    """`tests/courses/full` has the other comparisons."""
    course = make(SCRIPT + OUTPUT.replace("text", f"text{keys}"), status=status)
    assert receipt(course.html()) == expected


def test_a_keyframe_without_a_name_is_numbered(make: Make) -> None:
    assert "keyframe <code>1</code>" in make('```lab\n{"model": "box", "key": 1}\n```\n').html()


def test_a_long_script_is_folded_and_loses_no_line(make: Make) -> None:
    body = '"""Doc."""\n\nimport math\nimport sys\n\nA = 1\nB = 2\nC = 3\n\n'
    body += "".join(f"def f{i}():\n" + "    return 1\n" * 12 + "\n\n" for i in range(8))
    html = make(f"```python file=examples/a.py\n{body}```\n").html()
    assert "<summary>lines 1–9: docstring, imports, A, B, C</summary>" in html
    assert "<summary>lines 38–127: f2, f3, f4, f5, f6, f7</summary>" in html
    code = "".join(findall(r"<code class=\"language-python\">(.*?)</code></pre>", html, flags=16))
    assert unescape(sub(r"</?span[^>]*>", "", code)) == body.rstrip("\n") + "\n"


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
