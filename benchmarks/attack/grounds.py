"""Where attacks take place: courses, what lies beside them, and what counts as a violation.

Entry points: `Grounds`, `Victim`, `Table`.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeAlias

from coursebuild.core.files.examples import MANIFEST
from coursebuild.core.files.trust import TEMPORARY
from coursebuild.core.files.write import PREFIX
from coursebuild.core.run import gate
from support.mortal_commands import KILLED_STATUS, Mortals
from support.scratch_course import Folder, block, wait_until_alone

SECONDS, MEGABYTES = 10.0, 1000.0
"""Processor time and memory of its largest process that a command may take with any input."""
PATIENCE = 600
"""Seconds after which a command hangs, however busy the machine is."""
SECRET = "dear to its user, and nobody else's"
"""What lies beside the courses, and may be shown nowhere."""
LESSON = "## One\n\n$a_{1}$\n\n" + block("a.py", "print(1)", "1") + block("b.py", "print(2)", "2")
SECOND = "## Two\n\nLesson 1.1 comes first.\n\n" + block("c.py", "print(3)", "3")
EDITED_LESSON = LESSON.replace("print(2)", "print(1 + 1)") + "Now $a_{2}$ as well.\n"

_TRACEBACK = re.compile(r"^(?:Traceback|Exception ignored)", re.MULTILINE)
"""The tool's own; that of a script stands indented in its diagnostic."""

Files: TypeAlias = dict[str, bytes]
Try: TypeAlias = tuple[str, Callable[[], str]]
"""Its name, and the function that does it and returns the violation, empty if there was none."""


class Grounds:
    """A folder for courses, with a home and a state folder of its own for their user."""

    def __init__(self, top: Path) -> None:
        self.top = top
        self.beside = top / "beside"
        for path in ("home/.ssh/key", "repository/HEAD", "site/index.html", "folder/deep/file"):
            (self.beside / path).parent.mkdir(parents=True, exist_ok=True)
            (self.beside / path).write_text(SECRET)
        (self.beside / "folder/link").symlink_to("deep")
        self.state = top / "state/coursebuild"
        os.environ |= {
            "HOME": str(self.beside / "home"),
            "XDG_STATE_HOME": str(self.state.parent),
        }
        os.environ.pop("COURSEBUILD_STORE_KEY", None)
        # Scripts with Matplotlib make folders in the home; these are there before any runs.
        (self.beside / "home/.config/matplotlib").mkdir(parents=True)
        gate.finish(gate.python_command("-c", "import matplotlib.font_manager"), gate.environment())
        self.stores = top / "stores"
        self.stores.mkdir()
        self.before = self._look()
        self.seconds = self.megabytes = 0.0
        """The most that a command took so far."""

    def folder(self, name: str) -> Folder:
        """A folder in which nothing is yet."""
        folder = Folder(self.top / name)
        for path in (folder.root, folder.tmp):
            gate.finish(["chmod", "-R", "u+rwx", str(path)], gate.environment())
            shutil.rmtree(path, ignore_errors=True)
            path.mkdir()
        return folder

    def copy(self, template: Folder, name: str) -> Folder:
        folder = self.folder(name)
        shutil.copytree(template.root, folder.root, symlinks=True, dirs_exist_ok=True)
        return folder

    def find_violation(self, status: int, output: str, statuses: Sequence[int] = (0, 1, 2)) -> str:
        """What is wrong with how a command ended, or with what lies beside its course."""
        if _TRACEBACK.search(output) or status not in statuses:
            return f"status {status}: {output[-600:]}"
        if SECRET in output:
            return "it shows what lies beside the course"
        after = self._look()
        if after != self.before:
            changed = {name for name, _ in after.items() ^ self.before.items()}
            self.before = after  # it is told once
            return f"changed beside the course: {sorted(changed)}"
        return ""

    def run(self, mortals: Mortals, folder: Folder, *arguments: str) -> str:
        """Run a command, and return what is wrong with it, with its time and its memory."""
        status, _ = mortals.run(folder, *arguments, patience=PATIENCE)
        self.seconds = max(self.seconds, mortals.seconds)
        self.megabytes = max(self.megabytes, mortals.megabytes)
        if mortals.seconds > SECONDS or mortals.megabytes > MEGABYTES:
            return f"it took {mortals.seconds:.1f} s and {mortals.megabytes:.0f} MB"
        return self.find_violation(status, mortals.output)

    def _look(self) -> dict[str, tuple[int, bytes]]:
        """All that no command may change: what lies beside the courses, by path."""
        entries = {}
        for path in [self.beside, *self.beside.rglob("*")]:
            mode = path.lstat().st_mode
            data = os.fsencode(path.readlink()) if stat.S_ISLNK(mode) else b""
            entries[str(path)] = (mode, path.read_bytes() if stat.S_ISREG(mode) else data)
        own_names = ("coursebuild", "environments", "key", "journals", "stores")
        for path in [*self.state.parent.glob("*"), *self.state.glob("*")]:
            if path.name not in own_names:
                entries[str(path)] = (0, b"")
        return entries


class Victim:
    """A course whose site is built and whose lesson has changed since, and what a build makes."""

    def __init__(self, grounds: Grounds) -> None:
        self.grounds = grounds
        self.template = grounds.folder("template")
        self.template.fill([LESSON, SECOND], grounds.stores)
        self._run(self.template, "build")
        self.old = site(self.template)
        self.template.write(self.template.lesson(), EDITED_LESSON)
        self._run(self.template, "update")  # writes what its outputs were recorded with
        self.folder = self.restore()
        self._run(self.folder, "build")
        self.new = site(self.folder)

    def restore(self) -> Folder:
        self.folder = self.grounds.copy(self.template, "victim")
        return self.folder

    def _run(self, folder: Folder, command: str) -> None:
        result = folder.run(command, "-q")
        if result.status != 0:
            raise SystemExit(result.out + result.err)

    def find_violation(self, mortals: Mortals, *, trusted: bool = False) -> str:
        """What is wrong with a course after an attack on it, and after its next build.

        What this user's key has sealed is `trusted`, and shown.
        """
        if self.folder.text(self.folder.lesson()) != EDITED_LESSON:
            return "the lesson changed"
        if trusted:
            return ""
        if site(self.folder) not in (self.old, self.new):
            return "the site is torn"
        violation = self.grounds.run(mortals, self.folder, "build", "-q")
        if not violation and site(self.folder) != self.new:
            return f"the next build makes another site: {mortals.output[-300:]}"
        return violation


class Killings:
    """Commands that write, each killed at calls that are spread over all that it makes."""

    def __init__(self, grounds: Grounds, mortals: Mortals, victim: Victim, source: Path) -> None:
        self.grounds, self.mortals = grounds, mortals
        self.deaths = 0
        """How many commands were killed; some ended first, as they made fewer calls."""
        drifted = grounds.copy(victim.template, "drifted")
        drifted.write(drifted.lesson(), LESSON.replace("print(2)", "print(5)"))
        drifted.write(drifted.lesson(2), SECOND.replace("print(3)", "print(6)"))
        untidy = grounds.copy(victim.template, "untidy")
        untidy.write(untidy.lesson(), LESSON.replace("## One", "One\n---") + "*  a\n*  b\n")
        untidy.write(untidy.lesson(2), SECOND + "+ a\n+ b\n")
        empty = grounds.folder("empty")
        shutil.copytree(source, empty.root / "source")
        empty.tmp.mkdir(exist_ok=True)
        self.commands: tuple[tuple[Folder, bool, tuple[str, ...]], ...] = (
            (victim.template, True, ("build", "-q")),
            (victim.template, False, ("build", "-q")),
            (drifted, True, ("update",)),
            (victim.template, True, ("extract",)),
            (victim.template, True, ("rename", "1.1", "1.3", "--leave")),
            (untidy, True, ("fmt",)),
            (victim.template, True, ("new", "lesson", "1.3", "Large swings")),
            (victim.template, True, ("new", "model", "pendulum")),
            (victim.template, True, ("new", "template", "base.html")),
            (victim.template, True, ("new", "feature", "timeline")),
            (empty, True, ("import", "source", "--out", "course", "-q")),
            (empty, True, ("init", "course")),
        )
        """A template, whether two folders can be swapped in one step, and the command."""

    def tries(self, count: int) -> Iterable[Try]:
        """So many kills, shared out among the commands as far as these make calls."""
        calls = []
        for template, exchanges, arguments in self.commands:
            folder = self.grounds.copy(template, "mortal")
            self.mortals.exchanges = exchanges
            status, names = self.mortals.run(folder, *arguments)
            if status != 0:
                raise SystemExit(f"{arguments}: {self.mortals.output}")
            calls.append((names, (template, exchanges, arguments, all_files(folder))))
        print(f"{sum(len(n) for n, _ in calls)} calls of {len(calls)} commands change something")
        calls.sort(key=lambda item: len(item[0]))
        for left, (names, command) in zip(range(len(calls), 0, -1), calls, strict=True):
            share = min(len(names), -(-count // left))
            count -= share
            for index in range(share):
                fatal = len(names) * index // share + 1
                name = f"{' '.join(command[2])}, call {fatal} ({names[fatal - 1]})"
                yield name, lambda fatal=fatal, command=command: self._kill(fatal, *command)

    def _kill(
        self,
        fatal: int,
        template: Folder,
        exchanges: bool,
        arguments: tuple[str, ...],
        new: Files,
    ) -> str:
        folder = self.grounds.copy(template, "mortal")
        self.mortals.exchanges = exchanges
        status, _ = self.mortals.run(folder, *arguments, fatal=fatal, patience=PATIENCE)
        wait_until_alone(folder)
        self.deaths += status == KILLED_STATUS
        violation = self.grounds.find_violation(status, self.mortals.output, (0, KILLED_STATUS))
        if violation:
            return violation
        old = all_files(template)
        left = all_files(folder)
        torn = [
            path
            for path in left.keys() | old.keys() | new.keys()
            if not is_temporary(path) and left.get(path) not in (old.get(path), new.get(path))
        ]
        if torn:
            return f"neither old nor new: {sorted(torn)}"
        sites = [site(template), {k[7:]: v for k, v in new.items() if k.startswith("public/")}]
        if site(folder) not in sites:
            return "the site is torn"
        violation = self.grounds.run(self.mortals, folder, *arguments)
        after = all_files(folder)
        if not violation and after != new:
            changed = {path for path, _ in after.items() ^ new.items()}
            return f"said again, it leaves another course: {sorted(changed)}"
        return violation


class Table:
    """Prints results, and collects violations."""

    def __init__(self, grounds: Grounds) -> None:
        self.grounds = grounds
        self.violations: list[str] = []
        self.rows: list[str] = []

    def row(self, kind: str, attacks: Iterable[Try], note: Callable[[], str] = str) -> None:
        """Try attacks of a kind; `note` gives what the row says of them afterwards."""
        count, before = 0, len(self.violations)
        self.grounds.seconds = self.grounds.megabytes = 0.0
        for name, attack in attacks:
            violation = attack()
            count += 1
            if violation:
                self.violations.append(f"{name}: {violation}")
                print(self.violations[-1], flush=True)
        survived = count - len(self.violations) + before
        most = ""
        if self.grounds.seconds:
            most = f"at most {self.grounds.seconds:.1f} s, {self.grounds.megabytes:.0f} MB"
        notes = "; ".join(filter(None, (note(), most)))
        self.rows.append(f"| {kind} | {count} | {survived} | {notes} |")
        print(self.rows[-1], flush=True)


def site(folder: Folder) -> Files:
    """The published site; between two renames, the one that the next build puts back."""
    return folder.tree("public") or folder.tree(".public.coursebuild-old")


def all_files(folder: Folder) -> Files:
    """Files of the author and of the site, without the store."""
    return folder.tree()


def is_temporary(path: str) -> bool:
    """Whether a killed command may leave a file of this name in any form, for the next to mend."""
    marks = (PREFIX, TEMPORARY, ".coursebuild-new", ".coursebuild-old")
    # In the manifest a script has its old and its new hash until it is written.
    is_made = path.startswith("public/") or path == MANIFEST
    return is_made or any(mark in path for mark in marks)
