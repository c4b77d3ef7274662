"""Stores and journals that somebody else wrote, or that are damaged.

Entry point: `Foreigners`.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import random
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec

from benchmarks.attack.grounds import EDITED_LESSON, SECRET, Grounds, Try, Victim, all_files
from coursebuild.core.engine.store import HASH
from coursebuild.core.files.trust import seal, store_key, unseal
from coursebuild.core.files.write import FileChange, journal_path
from support.mortal_commands import Mortals
from support.poisoned_values import mutate
from support.workflows import git

COMMANDS = (
    *(("build", "-q"), ("check", "-q"), ("fmt", "--check"), ("extract",), ("update",)),
    *(("explain", "1.1"), ("doctor",), ("rename", "1.1", "1.1")),
)
"""Commands that find a journal; none has a reason to change the lesson."""
FOREIGN_KEY = b"of a stranger"


class Foreigners:
    """Attacks on a course by entries of its store, its whole store, and journals."""

    def __init__(self, grounds: Grounds, mortals: Mortals, victim: Victim, seed: int) -> None:
        self.grounds, self.mortals, self.victim = grounds, mortals, victim
        self.chance = random.Random(seed)
        self.key = store_key(str(victim.template.root))
        self.kinds: dict[str, list[str]] = {}
        root = victim.template.root
        for file in sorted((root / ".coursebuild").rglob("*")):
            if HASH.fullmatch(file.name) and file.is_file() and not file.parent.is_symlink():
                name = file.relative_to(root).as_posix()
                self.kinds.setdefault(name.split("/")[1], []).append(name)

    def entries(self, count: int) -> Iterable[Try]:
        """Entries of each kind in turn, damaged in each way in turn."""
        ways = itertools.cycle(
            ("wrong key", "no key", "a bit", "cut", "cut and sealed", "poisoned")
        )
        for _, way, kind in zip(range(count), ways, _uneven(self.kinds), strict=False):
            path = self.chance.choice(self.kinds[kind])
            yield f"{way}, {path[:50]}", lambda path=path, way=way: self._damage(path, way)

    def _damage(self, path: str, way: str) -> str:
        folder = self.victim.restore()
        whole = folder.read(path)
        name = path.removeprefix(".coursebuild/")
        data = unseal(name, whole, self.key)
        assert data is not None, f"{path} has no seal"
        at = self.chance.randrange(len(whole))
        match way:
            case "wrong key" | "no key":
                new = seal(name, poison(data, self.chance), FOREIGN_KEY if way[0] == "w" else b"")
            case "a bit":
                new = whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1 :]
            case "cut":
                new = whole[:at]
            case "cut and sealed":
                new = seal(name, data[: self.chance.randrange(len(data) + 1)], self.key)
            case _:
                new = seal(name, poison(data, self.chance), self.key)
        folder.write(path, new)
        violation = self.grounds.run(self.mortals, folder, "build", "-q")
        trusted = way in ("cut and sealed", "poisoned")
        return violation or self.victim.find_violation(self.mortals, trusted=trusted)

    # --- whole stores

    def stores(self, count: int) -> Iterable[Try]:
        """Stores that came along with a course; what is in them is neither used nor changed."""
        ways = itertools.cycle(("mark of a stranger", "no mark", "tracked by Git", "a link"))
        for number, way in zip(range(count), ways, strict=False):
            yield f"store {number}, {way}", lambda way=way: self._bring_store(way)

    def _bring_store(self, way: str) -> str:
        folder = self.victim.restore()
        shutil.rmtree(folder.root / "public")
        store = folder.root / ".coursebuild"
        for entry in [path for path in store.rglob("*") if path.is_file()]:
            if self.chance.random() < 0.5 and HASH.fullmatch(entry.name):
                name = entry.relative_to(store).as_posix()
                data = poison(entry.read_bytes()[32:], self.chance)
                entry.write_bytes(seal(name, data, FOREIGN_KEY))
        match way:
            case "mark of a stranger":
                (store / "owner").write_bytes(seal("owner", b"", FOREIGN_KEY))
            case "no mark":
                (store / "owner").unlink()
            case "tracked by Git":
                git(folder.root, "init", "--quiet")
                git(folder.root, "add", "--force", ".coursebuild/owner")
            case _:
                shutil.rmtree(store)
                store.symlink_to(self.grounds.beside / "folder")
        before = _entries(store)
        violation = self.grounds.run(self.mortals, folder, "build", "-q")
        if not violation and _entries(store) != before:
            return "a foreign store was changed"
        shutil.rmtree(folder.root / ".git", ignore_errors=True)
        shutil.rmtree(self.grounds.state / "stores", ignore_errors=True)
        if not violation and folder.tree("public") != self.victim.new:
            return f"another site than without a store: {self.mortals.output[-300:]}"
        return violation or self.victim.find_violation(self.mortals)

    # --- journals

    def journals(self, count: int) -> Iterable[Try]:
        """Journals in the course's folder, damaged ones in the user's own, with each command."""
        ways: tuple[Callable[[Path], None], ...] = (
            self._bring_journals,
            self._seal_with_another_key,
            self._cut_journal,
            self._flip_bit,
            self._seal_what_is_no_journal,
            self._seal_paths_that_are_closed,
        )
        cycle = itertools.cycle(ways)
        for number, way, command in zip(
            range(count), cycle, _uneven(COMMANDS, len(ways)), strict=False
        ):
            name = f"journal {number}, {way.__name__[1:]}, {' '.join(command)}"
            yield name, lambda way=way, command=command: self._leave_journal(way, command)

    def _leave_journal(self, way: Callable[[Path], None], command: tuple[str, ...]) -> str:
        folder = self.victim.restore()
        git(folder.root, "init", "--quiet")
        way(folder.root)
        before = all_files(folder)
        violation = self.grounds.run(self.mortals, folder, *command)
        products = ("public/", "examples/")
        after = all_files(folder)
        changed = [
            path for path, _ in after.items() ^ before.items() if not path.startswith(products)
        ]
        shutil.rmtree(self.grounds.state / "journals", ignore_errors=True)
        shutil.rmtree(folder.root / ".git")
        if not violation and changed:
            return f"changed: {sorted(set(changed))}"
        return violation or self.victim.find_violation(self.mortals)

    def _orders(self, root: Path) -> bytes:
        """The changes of a journal in the true format; undoing any of them would be a violation."""
        outside = self.grounds.beside
        dear = SECRET.encode()
        changes = [
            FileChange("../beside/repository/HEAD", None, dear),
            FileChange(str(outside / "site/index.html"), b"owned", dear),
            FileChange("content/../../beside/folder/deep/file", b"owned", dear),
            FileChange(".git/config", b"[core]\n", (root / ".git/config").read_bytes()),
            FileChange(".git/hooks/post-checkout", b"#!/bin/sh\n", None),
            FileChange(".venv/lib/python3.11/site-packages/zz.pth", b"import os", None),
            FileChange("content/lessons/1.1-one.md", b"## Owned\n", EDITED_LESSON.encode()),
        ]
        self.chance.shuffle(changes)
        return msgspec.msgpack.encode(tuple(changes[: self.chance.randint(1, len(changes))]))

    def _bring_journals(self, root: Path) -> None:
        data = self._orders(root)
        texts = (data, *(seal("changes", data, key) for key in (b"", FOREIGN_KEY, self.key)))
        journal = self._journal(root)
        for path in (
            "changes",
            "journal",
            "journals/changes",
            f"journals/{journal.name}",
            journal.name,
        ):
            full = root / ".coursebuild" / path
            full.parent.mkdir(exist_ok=True)
            full.write_bytes(self.chance.choice(texts))

    def _seal_with_another_key(self, root: Path) -> None:
        self._journal(root).write_bytes(seal("changes", self._orders(root), FOREIGN_KEY))

    def _cut_journal(self, root: Path) -> None:
        whole = seal("changes", self._orders(root), self.key)
        self._journal(root).write_bytes(whole[: self.chance.randrange(len(whole))])

    def _flip_bit(self, root: Path) -> None:
        whole = bytearray(seal("changes", self._orders(root), self.key))
        whole[self.chance.randrange(len(whole))] ^= 1 << self.chance.randrange(8)
        self._journal(root).write_bytes(whole)

    def _seal_what_is_no_journal(self, root: Path) -> None:
        data = self._orders(root)
        part = data[: self.chance.randrange(len(data))]
        text = self.chance.choice((part, poison(b"[]", self.chance), b"\xc1", b"\x91" * 100_000))
        self._journal(root).write_bytes(seal("changes", text, self.key))

    def _seal_paths_that_are_closed(self, root: Path) -> None:
        """As if another program of the user's had made one: paths are checked all the same."""
        changes = msgspec.msgpack.decode(self._orders(root), type=list[FileChange])
        orders = [change for change in changes if not change.path.startswith("content/lessons")]
        data = msgspec.msgpack.encode(orders)
        self._journal(root).write_bytes(seal("changes", data, self.key))

    def _journal(self, root: Path) -> Path:
        journal = journal_path(root)
        assert journal is not None
        journal.parent.mkdir(exist_ok=True)
        return journal


def _uneven(kinds: Iterable[object], period: int = 6) -> Iterable[object]:
    """All in turn, so that each meets each of as many ways as the period has."""
    kinds = list(kinds)
    for number in itertools.count():
        yield kinds[(number + number // period) % len(kinds)]


def _entries(store: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def poison(data: bytes, chance: random.Random) -> bytes:
    """Data of the same form with one value changed, often to another type."""
    for decode, encode in (
        (json.loads, lambda value: json.dumps(value).encode()),
        (msgspec.msgpack.decode, msgspec.msgpack.encode),
    ):
        with contextlib.suppress(ValueError, TypeError, RecursionError, msgspec.MsgspecError):
            value = decode(data)
            while True:
                with contextlib.suppress(OverflowError, UnicodeEncodeError):
                    return encode(mutate(value, chance))
    return data[: len(data) // 2]
