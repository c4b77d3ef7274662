"""Killed or interrupted at any moment, a command leaves the last good site and the files whole."""

from __future__ import annotations

import re
import shutil
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.cli import main
from support.fixture_cases import fixture_text
from support.mortal_commands import Mortals, mortal_commands
from support.run_code import run_code
from support.scratch_course import GOOD, Folder, Make, block

pytestmark = pytest.mark.site


STRUCTURAL = ("open", "mkdir", "link", "rename", "replace", "unlink", "rmdir", "exchange")
"""Calls that change what a folder holds."""

OLD = "## One\n\n" + block("kept.py", "print(1)", "1") + block("gone.py", "print(2)", "2")
NEW = OLD.replace("gone.py", "new.py").replace("print(1)", "print(1)  # edited") + "Edited.\n"


@pytest.fixture(scope="module")
def module_mortals(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mortals]:
    folder = Folder(tmp_path_factory.mktemp("mortals"))
    with mortal_commands(folder) as mortals:
        yield mortals


@pytest.fixture(params=[True])
def mortals(module_mortals: Mortals, request: pytest.FixtureRequest) -> Mortals:
    module_mortals.exchanges = request.param
    return module_mortals


def points(calls: list[str]) -> list[int]:
    """The calls at which to die, counted from 1: changes of folders, and the first write by half.

    Of consecutive calls of the same kind, only the last.
    """
    structural = [number for number, name in enumerate(calls, 1) if name in STRUCTURAL]
    last: dict[tuple[str, str], int] = {}
    before = ""
    for number in structural:
        name = calls[number - 1]
        last[before, name] = number
        before = name
    return sorted({*last.values(), calls.index("write") + 1})


class Trials:
    """A command that dies again and again, each time in a copy of the template."""

    def __init__(self, mortals: Mortals, template: Folder, place: Path, *command: str) -> None:
        self.mortals, self.template, self.command = mortals, template, command
        self.folder = Folder(place / "mortal")
        self.begin()
        status, self.calls = mortals.run(self.folder, *command)
        assert status == 0
        self.new = self.folder.tree()

    def begin(self) -> None:
        for root in (self.folder.root, self.folder.tmp):
            shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(self.template.root, self.folder.root, symlinks=True)
        self.folder.tmp.mkdir()

    def deaths(self, first: str = "") -> Iterator[tuple[str, dict[str, bytes]]]:
        """Yield the call at which the command died, and what that left, from a kind of call on."""
        since = self.calls.index(first) if first else 0
        for fatal in points(self.calls):
            if fatal > since:
                self.begin()
                self.mortals.die(self.folder, *self.command, fatal=fatal)
                place = f"killed before call {fatal}, {self.calls[fatal - 1]}"
                yield place, self.folder.tree()

    def run(self, *command: str) -> int:
        """The status of the next command, by default the same one."""
        return self.mortals.run(self.folder, *(command or self.command))[0]

    def leftovers(self) -> list[str]:
        """Files that no command leaves at its end; half-written entries of the store go later."""
        root = self.folder.root
        parts = ("tmp", ".new-", ".coursebuild-new", ".coursebuild-old", "__pycache__")
        return [
            name
            for name in (path.relative_to(root).as_posix() for path in root.rglob("*"))
            if any(part in name for part in parts) and not name.startswith(".coursebuild/")
        ]


def part(tree: dict[str, bytes], top: str) -> dict[str, bytes]:
    return {name: data for name, data in tree.items() if name.startswith(top)}


@pytest.mark.parametrize(
    "mortals",
    [
        pytest.param(True, id="exchange"),
        pytest.param(False, id="two renames", marks=pytest.mark.long),
    ],
    indirect=True,
)
def test_build_killed_at_any_call_leaves_old_or_new_site(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    """Without an exchange of folders there is no site for an instant; the next build restores it.

    If a lesson changes before that, the build still knows which scripts it had written.
    """
    template = make(NEW)
    assert mortals.run(template, "check", "-q")[0] == 0  # so that no script runs later on
    template.write(template.lesson(), OLD)
    assert mortals.run(template, "build", "-q")[0] == 0
    old = template.tree()
    template.write(template.lesson(), NEW)
    trials = Trials(mortals, template, tmp_path, "build", "-q")
    new, folder = trials.new, trials.folder
    changed_paths = {
        path for path in {*old} ^ {*new} if not path.startswith("public/assets/search/")
    }
    assert changed_paths == {
        f"{place}examples/{name}.py" for place in ("", "public/") for name in ("gone", "new")
    }
    swap = "exchange" if mortals.exchanges else "rename"
    assert {swap, "replace", "link", "write", "unlink"} <= {*trials.calls}
    # Until the sites are swapped, how they are swapped makes no difference.
    for number, (moment, left) in enumerate(trials.deaths("" if mortals.exchanges else "rename")):
        assert part(left, "content/") == part(new, "content/"), moment
        site = part(left, "public/")
        if not site and not mortals.exchanges:
            aside = part(left, ".public.coursebuild-old/").items()
            site = {name.replace(".public.coursebuild-old", "public"): data for name, data in aside}
        assert site in (part(old, "public/"), part(new, "public/")), moment
        for name, data in part(left, "examples/").items():
            if name.endswith(".py"):
                assert data in (b"", old.get(name), new.get(name)) or "tmp" in name, moment
        if number % 4 == 3:
            folder.replace(folder.lesson(), "# edited", "# edited again")
            assert trials.run() == 0, moment
            folder.replace(folder.lesson(), "# edited again", "# edited")
        assert trials.run() == 0, moment
        assert (folder.tree(), trials.leftovers()) == (new, []), moment


@pytest.mark.long
@pytest.mark.parametrize("fault", ["files", pytest.param("memory", marks=pytest.mark.slow)])
def test_build_without_files_or_memory_says_so_and_leaves_old_or_new_site(
    make: Make, mortals: Mortals, tmp_path: Path, fault: str
) -> None:
    """From some call on, no file can be opened and no process started; the next build succeeds.

    asyncio prints an exception itself where it gets no sockets.
    """
    template = make(OLD + "$a_{23}$\n")
    assert mortals.run(template, "build", "-q")[0] == 0
    old = template.tree()
    template.write(template.lesson(), NEW + "$a_{24}$\n")
    trials = Trials(mortals, template, tmp_path, "build", "-q")
    new, folder = trials.new, trials.folder
    trials.begin()
    _, calls = mortals.run(folder, "build", "-q", fault=fault)
    places = dict(zip(reversed(calls), range(len(calls), 0, -1), strict=True))
    assert len(places) > 30
    messages = ("too many open files", "cannot allocate memory", "not enough memory", "new thread")
    before: dict[str, int] = {}
    for moment, fatal in sorted(places.items(), key=lambda place: place[1]):
        trials.begin()
        status, _ = mortals.run(folder, "build", "-q", fault=fault, fatal=fatal)
        assert status in (0, 1, 2), moment
        assert status == 0 or any(words in mortals.output.lower() for words in messages), moment
        assert "Traceback" not in mortals.output, (moment, mortals.output)
        left = folder.tree()
        assert part(left, "content/") == part(new, "content/"), moment
        assert part(left, "public/") in (part(old, "public/"), part(new, "public/")), moment
        state = {str(p): p.lstat().st_size for p in folder.root.rglob("*") if p.is_file()}
        if state != before:  # the next build from the same files was tried already
            before = state
            assert trials.run() == 0, moment
            assert (folder.tree(), trials.leftovers()) == (new, []), moment


def test_update_killed_at_any_call_leaves_old_or_new_lessons(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    stale = "## One\n\n" + block("a.py", "print(1)", "OLD") + block("b.py", "print(2)", "OLD")
    template = make(stale, GOOD.replace("hello 3.14159\n", "OLD\n"))
    assert mortals.run(template, "check", "-q")[0] == 1  # so that each script runs only once more
    trials = Trials(mortals, template, tmp_path, "update", "-q")
    old, new = part(template.tree(), "content/"), part(trials.new, "content/")
    assert {"replace", "write", "fsync"} <= {*trials.calls}
    for number, (place, left) in enumerate(trials.deaths()):
        assert all(left[name] in (old[name], new[name]) for name in old), place
        if number % 3 == 0:  # a build clears up as well
            trials.run("build", "-q")
            assert trials.leftovers() == [], place
        assert trials.run() == 0, place
        assert (part(trials.folder.tree(), "content/"), trials.leftovers()) == (new, []), place


def test_rename_killed_at_any_call_changes_all_files_or_none(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    """The next command undoes the changes."""
    template = make(OLD, "## Two\n\nSee [one](lesson:1.1).\n")
    assert mortals.run(template, "check", "-q")[0] == 0
    trials = Trials(mortals, template, tmp_path, "rename", "1.1", "1.7")
    old, new = part(template.tree(), "content/"), part(trials.new, "content/")
    assert len({*old.items()} ^ {*new.items()}) == 6  # the map, a lesson and its name, a link
    for place, _ in trials.deaths():
        assert trials.run("check", "-q") == 0, place
        left = part(trials.folder.tree(), "content/")
        assert left in (old, new), place
        assert left == new or trials.run() == 0, place
        assert (part(trials.folder.tree(), "content/"), trials.leftovers()) == (new, []), place


def test_adopting_killed_at_any_call_leaves_old_or_new_lesson(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    template = make(OLD)
    assert mortals.run(template, "extract", "-q")[0] == 0
    edit, lesson = b"print(1)\r\n# by hand\r\n", template.lesson()
    template.write("examples/kept.py", edit)
    trials = Trials(mortals, template, tmp_path, "extract", "--adopt", "-q")
    new = trials.new
    assert b"# by hand" in new[lesson]
    for place, left in trials.deaths():
        assert left[lesson] in (OLD.encode(), new[lesson]), place
        assert left[lesson] == new[lesson] or left["examples/kept.py"] == edit, place
        assert trials.run() == 0, place
        assert (trials.folder.tree(), trials.leftovers()) == (new, []), place


@pytest.mark.long
def test_import_killed_at_any_call_is_completed_by_the_same_command(
    mortals: Mortals, tmp_path: Path
) -> None:
    """What it wrote so far is no obstacle, and neither the course nor the report differs."""
    template = Folder(tmp_path / "template")
    clock = "import time\nprint(time.time_ns())"
    template.write("old/1-one.md", "# One\n\n![x](x.png)\n\n" + python_cell(clock))
    cells = ("1 / 0", "print(missing)")
    template.write("old/2-two.md", "# Two\n\n" + python_cell("import nowhere_to_be_found"))
    template.write("old/3-three.md", "# Three\n\n" + "\n".join(map(python_cell, cells)))
    template.write("old/part/x.png", b"\x89PNG")
    template.write("new/mine.txt", "Mine.")
    trials = Trials(mortals, template, tmp_path, "import", "old", "--out", "new", "--prove")
    new, report = trials.new, remarks(mortals)
    assert "requires=nowhere_to_be_found" in report
    assert "examples/l1_1_one.py: two runs differ, so an output is `volatile`" in report
    assert {"replace", "link", "write", "mkdir", "unlink"} <= {*trials.calls}
    lesson, states = "new/content/lessons/1.1-one.md", set()
    text = re.sub(rb"\d{9,}", b"", new[lesson])
    assert b"```output volatile" in text
    for place, left in trials.deaths():
        assert left["new/mine.txt"] == b"Mine.", place
        had_printed = b"```output" in left.get(lesson, b"")
        states.add((lesson in left, had_printed))
        assert trials.run() == 0, (place, mortals.output)
        assert remarks(mortals) == report, place
        tree = trials.folder.tree()
        assert re.sub(rb"\d{9,}", b"", tree[lesson]) == text, place  # whichever run's time it says
        assert {**tree, lesson: new[lesson]} == new, place
        store = "new/.coursebuild/"
        assert all(name.startswith(store) for name in trials.leftovers()), place
    assert states == {(False, False), (True, False), (True, True)}


def python_cell(code: str) -> str:
    return f"```{{code-cell}} python\n{code}\n```\n"


def remarks(mortals: Mortals) -> str:
    """What an import says of its files."""
    first_words = ("wrote", "left:", "examples/")
    return "\n".join(line for line in mortals.output.split("\n") if line.startswith(first_words))


numbers = pytest.mark.parametrize(
    ("number", "status", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
COMMAND = fixture_text("scripts/killed_command.txt")
"""A command; its last arguments: a module during whose import something happens, and a signal."""


@numbers
def test_signal_ends_a_command_wherever_it_is(
    number: signal.Signals, status: int, word: str
) -> None:
    """Libraries in C make another exception of it, as in an import that fails."""
    becomes_another = (
        "try: signal.raise_signal(number)\n"
        "        except KeyboardInterrupt: raise ImportError('not expected ever') from None"
    )
    for code in ("signal.raise_signal(number)", becomes_another):
        code = COMMAND.format(code, "signal.default_int_handler")
        result = run_code(code, "schema", "coursebuild.core.syntax.course_schema", int(number))
        assert (result.returncode, result.stdout, result.stderr) == (status, "", f"{word}\n")


def test_ctrl_c_while_the_tool_is_loaded_ends_it_without_a_word() -> None:
    """A traceback through imports is of no use to anybody; there is nothing to clean up yet."""
    code = COMMAND.format("signal.raise_signal(number)", "signal.default_int_handler")
    for module in ("coursebuild.cli.unchanged", "hashlib", "coursebuild.cli.commands", "argparse"):
        result = run_code(code, "check", module, int(signal.SIGINT))
        assert (result.returncode, result.stdout, result.stderr) == (-signal.SIGINT, "", ""), module


def test_ctrl_c_is_ignored_where_it_was_before() -> None:
    """As under `nohup`, or in the background of a shell: the command goes on and ends well."""
    code = COMMAND.format("signal.raise_signal(number)", "signal.SIG_IGN")
    for module in ("coursebuild.cli.unchanged", "coursebuild.core.syntax.course_schema"):
        result = run_code(code, "schema", module, int(signal.SIGINT))
        assert result.returncode == 2
        assert result.stderr.startswith(f"coursebuild: there is no schema '{module}'")


def test_signal_does_not_change_the_status_of_a_command_that_is_through() -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        result = run_code(
            "import atexit, signal, sys\n"
            "atexit.register(signal.raise_signal, int(sys.argv.pop()))\n"
            "from coursebuild.cli import main\n"
            "sys.exit(main())\n",
            "schema",
            "quiz",
            int(number),
        )
        assert (result.returncode, result.stderr) == (0, "")


def test_afterwards_all_is_as_it_was() -> None:
    """Also in a thread, where no signal can be handled."""
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    statuses = [main(["--version"])]
    thread = threading.Thread(target=lambda: statuses.append(main(["--version"])))
    thread.start()
    thread.join()
    assert statuses == [0, 0]
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
