"""`update`: new outputs by span, every other byte as it was, and nobody's work overwritten."""

from __future__ import annotations

import ctypes
import os
import signal
import stat
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from coursekit import GOOD, Folder, block, command, ended

Make = Callable[..., Folder]

EVERYTHING = """## Everything

Text with trailing spaces,  \n	a tab, a form feed\x0c, a no-break space\xa0 and U+2028\u2028.

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

   ~~~~python file=examples/listed.py
   print("```")
   print("~~~")
   ~~~~

   Output, here:

   ~~~~text
   OLD
   ~~~~

   - deeper

     ```python file=examples/deep.py
     print("deep")
     ```

     Output:

     ```text
     ```

```python file=examples/mixed.py
print("same", 3.0)
print("took 5.25 ms")
print("last line")
```

Output:

```text ellipsis
same 2.0
took ... ms
...
```

```python file=examples/table.py
for name, error in (("Euler", 1.25e-2), ("RK4", 3.5e-9)):
    print(f"{name:8} {error:.2e} {-error:.1e}")
```

Output with a table:

| method | error   | with a sign |
| :----- | ------: | --- |
| Euler  | 9.99e-02 | \u22129.9e-02 |
| RK4 | 3.50e-09 | \u22123.5e-09 |

```python file=examples/clock.py
import time
print(time.perf_counter_ns())
```

Output:

```text volatile
never
```

The end, without a final newline: `1.5`{out=examples/plain.py}"""

UPDATED = (
    EVERYTHING.replace(
        "```text\nOLD\n```\n\n> [!note]",
        "```text\nalpha 1.5\n\nbeta    -0.25\n```\n\n> [!note]",
    )
    .replace("> ```text\n> OLD\n> lines\n", "> ```text\n> quoted\n>\n>     indented\n")
    .replace("   ~~~~text\n   OLD\n", "   ~~~~text\n   ```\n   ~~~\n")
    .replace("     ```text\n     ```", "     ```text\n     deep\n     ```")
    .replace("same 2.0", "same 3.0")
    .replace("9.99e-02", "1.25e-02")
    .replace("\u22129.9e-02", "\u22121.3e-02")
)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_every_form_byte_for_byte(make: Make, newline: str, mark: str) -> None:
    folder = make((mark + EVERYTHING).replace("\n", newline).encode())
    done = folder.main("update")
    assert done.status == 0, done.out
    got = folder.text(folder.lesson())
    assert got == (mark + UPDATED).replace("\n", newline).replace("never", clock(got))
    assert folder.main("check").status == 0
    assert folder.main("update").status == 0
    again = folder.text(folder.lesson())
    assert again == got.replace(clock(got), clock(again))


def clock(text: str) -> str:
    """What stands in the volatile block."""
    return text[text.rindex("volatile") :].split()[1]


def test_twice_changes_nothing(make: Make) -> None:
    steady = EVERYTHING[: EVERYTHING.index("```python file=examples/clock.py")]
    folder = make(steady, GOOD)
    assert folder.main("update").status == 0
    once = folder.tree("content")
    times = {path: (folder.root / "content" / path).stat().st_mtime_ns for path in once}
    done = folder.main("update")
    assert done.status == 0
    assert "\nevery recorded output is up to date\n" in done.out
    assert folder.tree("content") == once
    assert {p: (folder.root / "content" / p).stat().st_mtime_ns for p in once} == times


def test_dry_run_writes_nothing_and_shows_what_it_would(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159\n", "hello 3.14158\n"), GOOD.replace("hello", "two"))
    folder.main("extract")
    before = folder.tree()
    done = folder.main("update", "--dry-run")
    assert done.status == 0
    assert (
        f"would update {folder.lesson()}\n"
        f"--- {folder.lesson()}\n"
        f"+++ {folder.lesson()}\n"
        "@@ -9,3 +9,3 @@\n"
        " ```text\n"
        "-hello 3.14158\n"
        "+hello 3.14159\n"
        " ```\n"
    ) in done.out
    assert folder.tree() == before


def test_only_the_chosen_lessons(make: Make) -> None:
    stale = [f"## {n}\n\n" + block(f"{n}.py", f"print('{n}')", "OLD") for n in "abc"]
    folder = make(*stale)
    assert folder.main("update", "1.2", "three").status == 0
    assert folder.text(folder.lesson(1)) == stale[0]
    assert "b\n```" in folder.text(folder.lesson(2))
    assert "c\n```" in folder.text(folder.lesson(3))


def test_an_unstable_output_is_refused_and_the_others_are_written(make: Make) -> None:
    unstable = "import os\nprint('steady')\nprint('pid', os.getpid())"
    lesson = "## One\n\n" + block("a.py", unstable, "OLD") + block("b.py", "print(2)", "OLD")
    folder = make(lesson)
    done = folder.main("update")
    assert done.status == 1
    assert "error[output-unstable]: two runs of the script printed different lines" in done.out
    assert "line 2: `pid " in done.out
    assert folder.text(folder.lesson()) == lesson.replace("OLD\n```\n\n", "2\n```\n\n").replace(
        "2\n```\n\n", "OLD\n```\n\n", 1
    )


def test_a_script_that_fails_is_told_at_its_line_as_it_is_now(make: Make) -> None:
    folder = make(
        "## One\n\n"
        + block("grows.py", "for i in range(9):\n    print(i)", "0")
        + block("fails.py", "print('a')\n1/0", "OLD")
    )
    done = folder.main("update")
    assert done.status == 1
    line = folder.text(folder.lesson()).splitlines().index("1/0") + 1
    assert line > 20
    assert f"--> {folder.lesson()}:{line}:1\n" in done.out
    assert "OLD" in folder.text(folder.lesson())
    assert "up to date" not in done.out


def test_a_script_that_fails_only_the_second_time(make: Make) -> None:
    code = (
        "from pathlib import Path\nonce = Path('once')\n"
        "print(1)\nif once.exists():\n    1/0\nonce.touch()"
    )
    folder = make("## One\n\n" + block("x.py", code, "OLD"))
    done = folder.main("update")
    assert done.status == 1
    assert "error[script-failed]" in done.out
    assert "OLD" in folder.text(folder.lesson())
    assert "up to date" not in done.out


def test_prose_that_becomes_false_is_told(make: Make) -> None:
    folder = make(
        "## One\n\n"
        + block("x.py", "print('mass', 2.25)", "mass 2.75")
        + "The mass is `2.75`{out}, or `3`{out} in short.\n",
        "## Two\n\n" + block("y.py", "print(1)", "1") + "It was `2.75`{out=examples/x.py}.\n",
    )
    assert "error[output-drift]" in folder.main("check").out
    done = folder.main("update")
    assert done.status == 1
    assert done.out.count("error[binding-mismatch]") == 3
    assert "help: write `2.25`" in done.out
    assert "mass 2.25\n" in folder.text(folder.lesson())
    assert "`2.75`{out}" in folder.text(folder.lesson())


@pytest.mark.parametrize(
    ("code", "how", "says"),
    [
        ("print('a\\n```\\nb')", "", "the output has a line that would close this fence"),
        ("print('a\\0b')", "", "NUL character"),
        ("pass", "", "printed nothing"),
        ("print('new', 1)", "ellipsis", "cannot be brought up to date here"),
    ],
)
def test_what_cannot_be_recorded(make: Make, code: str, how: str, says: str) -> None:
    lesson = "## One\n\n" + block("x.py", code, "old ... line\nother", how)
    folder = make(lesson)
    done = folder.main("update")
    assert done.status == 1
    assert says in done.out
    assert folder.text(folder.lesson()) == lesson


def test_an_update_of_a_course_with_other_mistakes(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159\n", "OLD\n") + "[gone](lesson:7.7)\n")
    done = folder.main("update")
    assert done.status == 1
    assert "error[link-lesson]" in done.out
    assert "hello 3.14159\n" in folder.text(folder.lesson())


def test_a_lesson_that_is_not_utf8_is_left_alone(make: Make) -> None:
    stale = b"## One\n\ncaf\xe9\n\n" + block("x.py", "print(1)", "OLD").encode()
    folder = make(stale, "## Two\n\n" + block("y.py", "print(2)", "OLD"))
    done = folder.main("update")
    assert done.status == 1
    assert "error[file-encoding]: byte 0xe9 is not UTF-8" in done.out
    assert folder.read(folder.lesson()) == stale
    assert "2\n```" in folder.text(folder.lesson(2))


def test_a_lesson_saved_meanwhile_is_not_overwritten(make: Make) -> None:
    saves = "from pathlib import Path\np = Path('{}')\np.write_text(p.read_text() + 'saved')\n"
    folder = make(
        "## One\n\n" + block("x.py", "print(1)", "OLD"),
        "## Two\n\n" + block("y.py", saves.format("content/lessons/1.1-one.md"), "OLD"),
    )
    folder.replace(folder.lesson(2), "'saved')", "'saved')\nprint(2)")
    before = folder.text(folder.lesson(1))
    done = folder.main("update")
    assert done.status == 1
    assert f"{folder.lesson(1)} was changed in the meantime" in done.out
    assert "run the command again" in done.out
    assert folder.text(folder.lesson(1)) == before + "savedsaved"
    assert "2\n```" in folder.text(folder.lesson(2))
    assert f"updated {folder.lesson(2)}" in done.out


def test_a_lesson_removed_meanwhile_is_not_made_again(make: Make) -> None:
    code = "from pathlib import Path\nPath('content/lessons/1.1-one.md').unlink(missing_ok=True)"
    folder = make("## One\n\n" + block("x.py", code + "\nprint(1)", "OLD"))
    done = folder.main("update")
    assert done.status == 1
    assert "was removed in the meantime" in done.out
    assert not (folder.root / folder.lesson()).exists()


def test_a_linked_lesson_stays_a_link(make: Make) -> None:
    folder = make(GOOD)
    stale = GOOD.replace("hello 3.14159\n", "OLD\n")
    folder.write("drafts/hello.md", stale)
    (folder.root / folder.lesson()).unlink()
    (folder.root / folder.lesson()).symlink_to("../../drafts/hello.md")
    assert folder.main("update").status == 0
    assert (folder.root / folder.lesson()).is_symlink()
    assert folder.text("drafts/hello.md") == GOOD
    assert [path.name for path in (folder.root / "drafts").iterdir()] == ["hello.md"]


def test_a_lesson_linked_from_outside_is_never_written(make: Make) -> None:
    folder = make(GOOD)
    outside = folder.root.parent / "outside.md"
    outside.write_text(GOOD.replace("hello 3.14159\n", "OLD\n"))
    (folder.root / folder.lesson()).unlink()
    (folder.root / folder.lesson()).symlink_to(outside)
    done = folder.main("update")
    assert done.status == 1
    assert "leads out of the project" in done.out
    assert "OLD" in outside.read_text()


@pytest.mark.parametrize("mode", [0o600, 0o444, 0o755])
def test_permissions_stay(make: Make, mode: int) -> None:
    folder = make(GOOD.replace("hello 3.14159\n", "OLD\n"))
    (folder.root / folder.lesson()).chmod(mode)
    assert folder.main("update").status == 0
    assert folder.text(folder.lesson()) == GOOD
    assert stat.S_IMODE((folder.root / folder.lesson()).stat().st_mode) == mode


def _as_an_ordinary_user() -> None:
    """Root may write everywhere but for these capabilities, which are dropped at exec."""
    drop, override, search = 24, 1, 2  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
    libc = ctypes.CDLL(None)
    for capability in (override, search):
        libc.prctl(drop, capability, 0, 0, 0)


def test_a_folder_that_cannot_be_written(make: Make) -> None:
    stale = GOOD.replace("hello 3.14159\n", "OLD\n")
    folder = make(stale)
    folder.main("extract")
    lessons = folder.root / "content/lessons"
    lessons.chmod(0o555)
    try:
        done = subprocess.run(
            command("update"),
            cwd=folder.root,
            env=folder.environment(),
            capture_output=True,
            text=True,
            preexec_fn=_as_an_ordinary_user,
        )
    finally:
        lessons.chmod(0o755)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"{folder.lesson()} cannot be written: permission denied" in done.stdout
    assert folder.text(folder.lesson()) == stale
    assert [path.name for path in lessons.iterdir()] == ["1.1-one.md"]


def test_a_lesson_that_cannot_be_read(make: Make) -> None:
    folder = make(GOOD, "## Two\n\n" + block("y.py", "print(2)", "2"))
    (folder.root / folder.lesson()).chmod(0)
    done = subprocess.run(
        command("check"),
        cwd=folder.root,
        env=folder.environment(),
        capture_output=True,
        text=True,
        preexec_fn=_as_an_ordinary_user,
    )
    assert done.returncode == 1
    assert f"error[file-unreadable]: {folder.lesson()} cannot be read: permission denied" in (
        done.stdout
    )
    assert "error[lesson-missing]" not in done.stdout


def test_two_at_once_take_turns(make: Make) -> None:
    """A build and an update, begun together: one waits, and each is whole."""
    slow = "import time\ntime.sleep(0.2)\nprint(1)"
    folder = make("## One\n\n" + block("x.py", slow, "OLD"), GOOD)
    with (
        ended(folder.start("update", stdout=subprocess.PIPE, stderr=subprocess.PIPE)) as update,
        ended(folder.start("build", stdout=subprocess.PIPE, stderr=subprocess.PIPE)) as build,
    ):
        updated, built = update.communicate(timeout=60), build.communicate(timeout=60)
    assert update.returncode == 0
    waited = [b"waiting for it" in err for _, err in (updated, built)]
    assert waited.count(True) == 1
    assert build.returncode == (0 if waited[1] else 1)  # drift, where it came first
    assert "1\n```" in folder.text(folder.lesson())
    assert folder.main("build").status == 0
    assert not [name for name in folder.beside() if "tmp" in name or ".new" in name]


def test_two_builds_at_once(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    site = folder.tree()
    done = threading.Event()
    torn: list[str] = []

    def watch() -> None:
        """The site is there and whole at every moment."""
        index = folder.root / "public/index.html"
        while not done.is_set():
            try:
                if index.read_bytes() != site["public/index.html"]:
                    torn.append("changed")
            except FileNotFoundError:
                torn.append("gone")
            time.sleep(0)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        builds = [folder.start("build", "-q", stdout=subprocess.DEVNULL) for _ in range(3)]
        for build in builds:
            with ended(build):
                assert build.wait(60) == 0
    finally:
        done.set()
        watcher.join()
    assert torn == []
    assert folder.tree() == site
    assert not [name for name in folder.beside() if name.startswith(".public")]


def test_a_build_does_not_wait_for_a_dead_one(make: Make) -> None:
    folder = make("## One\n\n" + block("x.py", "import time\ntime.sleep(0.1)\nprint(1)", "1"))
    first = folder.start("build", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with ended(first):
        while not (folder.root / ".coursebuild/lock").exists():
            time.sleep(0.01)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
    began = time.monotonic()
    assert folder.main("build").status == 0
    assert time.monotonic() - began < 20


def test_an_editor_that_saves_all_the_time(make: Make, tmp_path: Path) -> None:
    """Whatever the moment of a save, its text is what stands in the lesson afterwards."""
    folder = make("## One\n\n" + block("x.py", "print(1)", "OLD"))
    stop = threading.Event()
    saved: list[bytes] = []

    def save() -> None:
        number = 0
        while not stop.wait(0.002):
            number += 1
            text = "## One\n\n" + block("x.py", "print(1)", "OLD") + f"Edit {number}.\n"
            fresh = tmp_path / "fresh"
            fresh.write_text(text)
            saved.append(text.encode())
            fresh.replace(folder.root / folder.lesson())

    editor = threading.Thread(target=save)
    editor.start()
    try:
        statuses = {folder.main("update").status for _ in range(4)}
    finally:
        stop.set()
        editor.join()
    left = folder.read(folder.lesson())
    assert statuses <= {0, 1}
    assert left.replace(b"\n1\n", b"\nOLD\n") == saved[-1]
