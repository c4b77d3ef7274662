"""`update`: it changes outputs and no other byte, and overwrites nobody's work."""

from __future__ import annotations

import platform
import re

import pytest

from support.scratch_course import GOOD, Make, block

pytestmark = pytest.mark.site

FULL_LESSON = """## Everything

Text with trailing spaces,  \n	a tab, a no-break space\xa0 and U+2028\u2028.

```python file=examples/plain.py
print("alpha", 1.5)
print()
print("beta   ", -0.25)
```

Output:

```text
OLD
```

> [!note] In a callout
>
> ```python file=examples/quoted.py
> print("quoted")
> print()
> print("    indented")
> ```
>
> Output:
>
> ```text
> OLD
> lines
> ```

1. In a list

   ```python file=examples/listed.py
   print("listed")
   ```

   ~~~output digits
   ~~~

```python file=examples/clock.py
import time
print(time.perf_counter_ns())
```

Output:

```text volatile
never
```

The end, without a final newline: `1.5`{out=examples/plain.py}"""

UPDATED_LESSON = FULL_LESSON.replace(
    "```text\nOLD\n```\n\n> [!note]",
    "```text\nalpha 1.5\n\nbeta    -0.25\n```\n\n> [!note]",
).replace("> ```text\n> OLD\n> lines\n", "> ```text\n> quoted\n>\n>     indented\n")
UPDATED_LESSON = UPDATED_LESSON.replace("~~~output digits\n", "~~~output digits\n   listed\n")


def test_update_changes_outputs_and_no_other_byte(make: Make) -> None:
    """Not even line ends of Windows or a byte order mark."""
    folder = make(("\ufeff" + FULL_LESSON).replace("\n", "\r\n").encode())
    result = folder.main("update")
    assert result.status == 0, result.out
    text = folder.text(folder.lesson())
    assert text == ("\ufeff" + UPDATED_LESSON).replace("\n", "\r\n").replace("never", clock(text))
    assert folder.main("check").status == 0
    assert folder.main("update").status == 0
    assert folder.text(folder.lesson()) == text  # volatile text too


def clock(text: str) -> str:
    """What stands in the volatile block."""
    return text[text.rindex("volatile") :].split()[1]


def test_update_writes_what_drifted_in_the_chosen_lessons_and_nothing_the_second_time(
    make: Make,
) -> None:
    stale = [f"## {n}\n\n" + block(f"{n}.py", f"print('{n}')", "OLD") for n in "abc"]
    folder = make(*stale, GOOD)
    assert folder.main("check").status == 1
    result = folder.main("update", "1.2", "three", "four")
    assert "\n3 lessons, 0 scripts run, 3 cached" in result.out
    assert folder.text(folder.lesson(1)) == stale[0]
    assert folder.text(folder.lesson(2)) == stale[1].replace("OLD", "b")
    assert folder.text(folder.lesson(3)) == stale[2].replace("OLD", "c")
    once = folder.tree("content")
    times = {path: (folder.root / "content" / path).stat().st_mtime_ns for path in once}
    result = folder.main("update", "1.2", "three", "four")
    assert result.status == 0
    assert "\nevery recorded output is up to date\n" in result.out
    assert "\n3 lessons, 0 scripts run, 3 cached" in result.out
    assert folder.tree("content") == once
    assert {p: (folder.root / "content" / p).stat().st_mtime_ns for p in once} == times


def test_dry_run_shows_the_difference_and_writes_nothing(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159\n", "hello 3.14158\n"), GOOD.replace("hello", "two"))
    folder.main("extract")
    before = folder.tree()
    result = folder.main("update", "--dry-run")
    assert result.status == 0
    assert (
        f"would update {folder.lesson()}\n"
        f"--- {folder.lesson()}\n"
        f"+++ {folder.lesson()}\n"
        "@@ -9,3 +9,3 @@\n"
        " ```text\n"
        "-hello 3.14158\n"
        "+hello 3.14159\n"
        " ```\n"
    ) in result.out
    assert folder.tree() == before


def test_a_script_that_fails_is_told_at_its_line_as_it_is_now(make: Make) -> None:
    folder = make(
        "## One\n\n"
        + block("grows.py", "for i in range(9):\n    print(i)", "0")
        + block("fails.py", "print('a')\n1/0", "OLD")
    )
    result = folder.main("update")
    assert result.status == 1
    line = folder.text(folder.lesson()).splitlines().index("1/0") + 1
    assert line > 20
    assert f"--> {folder.lesson()}:{line}:1\n" in result.out
    assert "OLD" in folder.text(folder.lesson())
    assert "up to date" not in result.out


def test_an_update_of_a_course_with_other_mistakes(make: Make) -> None:
    latin = b"## One\n\ncaf\xe9\n\n" + block("x.py", "print(1)", "OLD").encode()
    folder = make(latin, GOOD.replace("hello 3.14159\n", "OLD\n") + "[gone](lesson:7.7)\n")
    result = folder.main("update")
    assert result.status == 1
    assert "error[link-lesson]" in result.out
    assert "error[file-encoding]: byte 0xe9 is not UTF-8" in result.out
    assert folder.read(folder.lesson(1)) == latin
    assert "hello 3.14159\n" in folder.text(folder.lesson(2))


def test_update_writes_the_parts_of_files_that_a_lesson_shows(make: Make) -> None:
    fence = "   ```python show=src/ball.py#Ball.fall\n{}   ```\n"
    folder = make("## One\n\n1. It falls:\n\n" + fence.format("") + "\n" + GOOD)
    folder.write(
        "src/ball.py", "class Ball:\n    @property\n    def fall(self):\n\n        return 1\n"
    )
    result = folder.main("check")
    assert (result.status, result.out.count("error[")) == (1, 1)
    assert "this differs from what `src/ball.py` holds" in result.out
    assert folder.main("update").status == 0
    part = "   @property\n   def fall(self):\n\n       return 1\n"
    assert fence.format(part) in folder.text(folder.lesson())
    assert folder.main("build").status == 0
    assert "src/ball.py" in folder.text("public/lessons/1.1-one.html")
    folder.replace("src/ball.py", "return 1", "return 2")
    result = folder.main("build")
    assert "it has `return 2` here" in result.out


TRAIN = """
import os
from pathlib import Path

print(Path("models/data.txt").read_text(), len(os.listdir("models")))
Path("runs").mkdir(exist_ok=True)
Path("runs/count").open("a").write("+")
"""


def test_long_work_is_run_only_when_that_is_asked_for(make: Make) -> None:
    info = "record=once writes=runs/"
    folder = make(
        "## One\n\n" + block("train.py", TRAIN, "OLD 12", info=info) + "It has `12`{out}.\n"
    )
    folder.write("models/data.txt", "12")

    def rules(*command: str) -> list[str]:
        return re.findall(r"error\[([\w-]+)\]", folder.main(*command).out)

    assert rules("check") == ["recorded-run"]
    assert rules("update") == ["recorded-run"]
    assert not (folder.root / "runs").exists()
    assert rules("update", "--long") == []
    assert "12 1\n" in folder.text(folder.lesson())
    assert folder.text("runs/count") == "+", "it runs once"
    assert folder.main("build", "--no-cache").status == 0
    assert folder.text("runs/count") == "+"
    page = folder.text("public/lessons/1.1-one.html")
    assert "Recorded once (" in page and platform.machine() in page
    lesson = folder.text(folder.lesson())
    for path, old, new, rule in (
        (folder.lesson(), "len(os", "1 * len(os", "recorded-run"),
        ("models/data.txt", "12", "13", "recorded-run"),
        (folder.lesson(), "12 1", "12 2", "output-drift"),
        (folder.lesson(), "`12`", "`15`", "binding-mismatch"),
    ):
        folder.replace(path, old, new)
        assert rules("check") == [rule], new
        folder.replace(path, new, old)
    assert rules("update") == [] and folder.text(folder.lesson()) == lesson
    folder.write("models/data.txt", "13")
    assert rules("check", "--long") == ["recorded-run", "output-drift"]
    assert rules("update", "--long") == ["binding-mismatch"]
    assert folder.text("runs/count") == "++"
