"""An editor that saves a lesson while a command changes it: what was saved last is never lost.

Entry point: `Saves`.
"""

from __future__ import annotations

import functools
import itertools
import random
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.attack.grounds import LESSON, PATIENCE, SECOND, Try, Victim
from support.mortal_commands import Mortals
from support.scratch_course import Folder

UNTIDY = SECOND.replace("## Two", "Two\n---") + "*  a\n*  b\n"
WITH_A_FAULT = SECOND + "\nSee [this](lesson:1.1 ).\n\n$ x^2 $\n"
WITH_ANOTHER_CODE = LESSON.replace("print(2)", "print(5)")
COMMANDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (WITH_ANOTHER_CODE, ("update",)),
    (WITH_ANOTHER_CODE, ("undo",)),
    (UNTIDY, ("fmt",)),
    (WITH_A_FAULT, ("check", "--fix")),
    (SECOND, ("rename", "1.1", "1.3", "--leave")),
    (SECOND, ("extract", "--adopt")),
)
"""The text of the lesson that is saved, and a command that writes into it."""


class Saves:
    """Commands, each beside an editor of another pace, in place and by renaming in turn."""

    def __init__(self, victim: Victim, mortals: Mortals, seed: int) -> None:
        self.grounds, self.template, self.mortals = victim.grounds, victim.template, mortals
        self.chance = random.Random(seed)
        self.refusals = 0
        """How many commands did not write since the lesson had been saved meanwhile."""

    def tries(self, count: int) -> Iterable[Try]:
        for number, (text, command) in zip(range(count), itertools.cycle(COMMANDS), strict=False):
            renames = number // len(COMMANDS) % 2 == 1
            pause = 10 ** self.chance.uniform(-3, -0.7)
            saves = self.chance.randint(1, max(1, int(1 / pause)))
            way = "by renaming" if renames else "in place"
            name = f"{' '.join(command)}, {saves} saves {way}, one in {1000 * pause:.0f} ms"
            yield name, functools.partial(self._race, text, command, (saves, pause, renames))

    def note(self) -> str:
        return f"{self.refusals} were told of a save"

    def _race(self, text: str, command: tuple[str, ...], habit: tuple[int, float, bool]) -> str:
        folder = self.grounds.copy(self.template, "raced")
        lesson = folder.root / folder.lesson()
        lesson.write_text(text)
        if command == ("undo",):
            self.mortals.run(folder, "update", patience=PATIENCE)
        with _editor(folder, lesson, text, habit) as numbers:
            violation = self.grounds.run(self.mortals, folder, *command)
        self.refusals += "in the meantime" in self.mortals.output
        if violation or not numbers:
            return violation
        last = _mark(numbers[-1])
        lessons = (folder.root / "content").rglob("*.md")
        is_kept = any(last in path.read_text(errors="replace") for path in lessons)
        return "" if is_kept else f"save {numbers[-1]} is lost"


@contextmanager
def _editor(
    folder: Folder, path: Path, text: str, habit: tuple[int, float, bool]
) -> Iterator[list[int]]:
    """Save the text with a number in it, again and again; give the numbers that were saved."""
    count, pause, renames = habit
    numbers: list[int] = []
    end = threading.Event()

    def save() -> None:
        buffer = folder.root.parent / "buffer.md"
        for number in range(count):
            if end.is_set():
                return
            if renames:
                buffer.write_text(text + _mark(number))
                buffer.replace(path)
            else:
                path.write_text(text + _mark(number))
            numbers.append(number)
            time.sleep(pause)

    thread = threading.Thread(target=save)
    thread.start()
    try:
        yield numbers
    finally:
        end.set()
        thread.join()


def _mark(number: int) -> str:
    return f"\nThis was saved as number {number}.\n"
