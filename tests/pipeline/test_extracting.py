"""`extract`: the files in `examples/`, and edits made there brought back into the lesson."""

from __future__ import annotations

import pytest

from support.scratch_course import GOOD, Make, block

pytestmark = pytest.mark.site

TWO_SCRIPTS = "## Two\n\n" + block("a.py", "print('a')", "a") + block("sub/b.py", "print('b')", "b")
SHAPES = {
    "plain": "```python file=examples/x.py\nprint(1)\n```\n\nAfter.\n",
    "quote": "> ```python file=examples/x.py\n> print(1)\n> ```\n>\n> After.\n",
    "list": "1. item\n\n   ~~~python file=examples/x.py\n   print(1)\n   ~~~\n\n   After.\n",
    "indented": "  ```python file=examples/x.py\n  print(1)\n  ```\n\nAfter.\n",
    "deep": "> - item\n>\n>   ````python file=examples/x.py\n>   print(1)\n>   ````\n>\n> After.\n",
    "last": "```python file=examples/x.py\nprint(1)\n```",
}
EDITED_SCRIPT = (
    'def f():\n\t"""A text\n\n      with ``` inside\n    """\n'
    '\tif True:\n\t\treturn "ü"\n\n\n# end\n'
)


def test_files_are_written_once_and_removed_with_their_scripts(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    result = folder.main("extract")
    assert result.status == 0
    assert "wrote examples/a.py\nwrote examples/sub/b.py\n" in result.out
    assert folder.read("examples/a.py") == b"print('a')\n"
    times = {p: (folder.root / "examples" / p).stat().st_mtime_ns for p in folder.tree("examples")}
    for options in ((), ("--adopt",)):
        result = folder.main("extract", *options)
        assert (result.status, "every script is extracted already" in result.out) == (0, True)
    assert times == {p: (folder.root / "examples" / p).stat().st_mtime_ns for p in times}
    assert folder.text(folder.lesson()) == TWO_SCRIPTS
    folder.write("examples/mine.txt", "not extracted")
    folder.write(folder.lesson(), GOOD)
    result = folder.main("extract")
    assert result.status == 0
    assert "removed examples/sub/b.py, which no lesson has any more" in result.out
    assert set(folder.tree("examples")) == {".extracted.json", "hello.py", "mine.txt"}
    assert not (folder.root / "examples/sub").exists()


# --- adopting


SAVED_SCRIPTS = (
    EDITED_SCRIPT,
    EDITED_SCRIPT.replace("\n", "\r\n"),
    "\ufeff" + EDITED_SCRIPT,
    EDITED_SCRIPT.rstrip("\n"),
    EDITED_SCRIPT + "\n\n",
)


def test_edit_is_adopted_into_a_block_of_every_shape(make: Make) -> None:
    """One lesson for each shape, with line ends of Windows."""
    newline = "\r\n"
    texts = [
        ("## One\n\n" + shape.replace("/x.py", f"/x{number}.py")).replace("\n", newline)
        for number, shape in enumerate(SHAPES.values(), 1)
    ]
    folder = make(*texts)
    for file in SAVED_SCRIPTS:
        for number, text in enumerate(texts, 1):
            folder.write(folder.lesson(number), text)
            (folder.root / f"examples/x{number}.py").unlink(missing_ok=True)
        assert folder.main("extract").status == 0
        for number in range(1, len(texts) + 1):
            folder.write(f"examples/x{number}.py", file)
        result = folder.main("extract", "--adopt")
        assert result.status == 0, result.out
        for number, (shape, text) in enumerate(zip(SHAPES, texts, strict=True), 1):
            before, _, after = text.partition("print(1)" + newline)
            lead = before.rpartition(newline)[2]
            body = [(lead + line if line else lead.rstrip()) for line in EDITED_SCRIPT.splitlines()]
            block_text = before[: len(before) - len(lead)] if lead else before
            whole = block_text + newline.join(body) + newline + after
            assert folder.text(folder.lesson(number)) == whole, (shape, file)
            assert folder.text(f"examples/x{number}.py") == EDITED_SCRIPT, (shape, file)
            assert f"updated {folder.lesson(number)}\n" in result.out, shape
        assert "every script is extracted already" in folder.main("extract", "--adopt").out


def test_several_edits_of_one_lesson_are_adopted_at_once(make: Make) -> None:
    folder = make(TWO_SCRIPTS + block("c.py", "print('c')", "c"), GOOD)
    folder.main("extract")
    folder.replace(folder.lesson(), "print('c')", "print('C')")  # an edit, which stays
    folder.write("examples/a.py", "print('a')\nprint('more')\n")
    folder.write("examples/sub/b.py", "# b\n\nprint('b')\n")
    assert folder.main("extract", "--adopt").status == 0
    adopted = TWO_SCRIPTS.replace("print('a')\n", "print('a')\nprint('more')\n").replace(
        "print('b')\n", "# b\n\nprint('b')\n"
    )
    assert folder.text(folder.lesson()) == adopted + block("c.py", "print('C')", "c")
    assert folder.read("examples/c.py") == b"print('C')\n"
    assert folder.main("check", "1.1").status == 1  # it does not print what is recorded
    assert folder.main("update", "1.1").status == 0
    assert folder.main("check").status == 0


def test_edit_that_a_block_cannot_hold_is_left_alone(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    for data, says in (
        (b"caf\xe9\n", "it is not UTF-8"),
        (b"\n\n", "it is empty"),
        (b"x = '''\n```\n'''\n", "one of its lines would close the fence, or begin another"),
        (b"a\0b\n", "it holds a NUL"),
    ):
        folder.write("examples/a.py", data)
        result = folder.main("extract", "--adopt")
        assert result.status == 1
        assert f"examples/a.py cannot be brought into the lesson: {says}" in result.out
        assert folder.read("examples/a.py") == data
        assert folder.text(folder.lesson()) == TWO_SCRIPTS


def test_of_two_edits_neither_is_lost(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    folder.write("examples/a.py", "print('a')  # by hand\n")
    folder.replace(folder.lesson(), "print('a')", "print('A')")
    lesson = folder.read(folder.lesson())
    for command in (["extract"], ["extract", "--adopt"], ["check"]):
        result = folder.main(*command)
        assert result.status == 1
        assert "-print('A')\n            +print('a')  # by hand\n" in result.out
        assert "the block was changed as well" in result.out
        assert "--adopt" not in result.out
        assert folder.read("examples/a.py") == b"print('a')  # by hand\n"
        assert folder.read(folder.lesson()) == lesson
    folder.replace(folder.lesson(), "print('A')", "print('A')  # by hand")
    (folder.root / "examples/a.py").unlink()
    assert folder.main("extract").status == 0


def test_a_read_only_example_is_adopted_and_settled(make: Make) -> None:
    """An example is derived from its lesson: it is replaced whatever its mode."""
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    folder.write("examples/a.py", b"print('edited')\r\n")
    (folder.root / "examples/a.py").chmod(0o444)
    assert folder.main("extract", "--adopt").status == 0
    assert "print('edited')\n" in folder.text(folder.lesson())
    assert folder.read("examples/a.py") == b"print('edited')\n"
    assert "every script is extracted already" in folder.main("extract").out
