"""Kills what writes files wherever it changes what a folder holds, and looks at what is left.

A scenario is prepared afresh in a folder and run in a forked child that ends itself, without any
cleaning up, at its first call that makes, renames, links, removes or saves a file or a folder; then
again at its second; and so on until it gets through. A file that is opened to be written has been
emptied by then, or holds half of the first that is written into it. After each death `whole` looks
at what is there, the scenario is run to its end as the next run would, and `done` looks again.
"""

from __future__ import annotations

import builtins
import functools
import io
import itertools
import os
import shutil
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from coursebuild.core.engine import publish as publishing
from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import check_out, publish
from coursebuild.core.files.changes import FileChange, change_files, undo_changes
from coursebuild.core.files.examples import write_examples
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import PREFIX, write_atomic
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile

CALLS = ("fsync", "rename", "replace", "link", "symlink", "unlink", "rmdir", "mkdir")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
DIED = 9


def arm(fatal: int) -> None:
    """Make this process end at its call number `fatal`."""
    counter = itertools.count(1)
    dying = False
    really_open, really_write, really_io_open = os.open, os.write, io.open

    def deadly(really: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            if next(counter) == fatal or dying:
                os._exit(DIED)
            return really(*arguments, **named)

        return call

    def deadly_open(path: Any, flags: int, *rest: Any, **named: Any) -> int:
        nonlocal dying
        if flags & WRITING and next(counter) == fatal:
            dying = True
        return really_open(path, flags, *rest, **named)

    def deadly_write(fd: int, data: Any) -> int:
        if dying:
            really_write(fd, bytes(data)[: len(data) // 2])
            os._exit(DIED)
        return really_write(fd, data)

    def deadly_io_open(file: Any, mode: str = "r", *rest: Any, **named: Any) -> Any:
        opened = really_io_open(file, mode, *rest, **named)
        if not mode.startswith("r") and next(counter) == fatal:
            os._exit(DIED)
        return opened

    for name in CALLS:
        setattr(os, name, deadly(getattr(os, name)))
    os.open, os.write = deadly_open, deadly_write
    io.open = builtins.open = deadly_io_open  # type: ignore[assignment]
    publishing.exchange = deadly(publishing.exchange)


def tree(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and p.name != MARKER
    }


def site(text: str) -> list[OutputFile]:
    names = ("index.html", "a/b/index.html", f"only-in-{text}.html", "a/c.css")
    return [OutputFile(name, f"{text} {name}".encode() * 50) for name in names]


def as_tree(files: list[OutputFile]) -> dict[str, bytes]:
    return {f.path: f.data for f in files}


class Publish:
    """Publish a new site over an old one, by an exchange."""

    old: list[OutputFile] | None = site("old")

    def prepare(self, root: Path) -> None:
        (root / "content").mkdir()
        (root / "content/course.toml").write_text("[course]\n")
        if self.old is not None:
            publish(root, root / "public", self.old)

    def run(self, root: Path) -> None:
        with project_lock(root):
            publish(root, root / "public", site("new"))

    def again(self, root: Path) -> None:
        self.run(root)

    def whole(self, root: Path) -> None:
        assert tree(root / "content") == {"course.toml": b"[course]\n"}
        there = tree(root / "public") if (root / "public").exists() else None
        old = None if self.old is None else as_tree(self.old)
        assert there in (old, as_tree(site("new"))), there and sorted(there)

    def done(self, root: Path) -> None:
        assert tree(root / "public") == as_tree(site("new"))
        names = sorted(p.name for p in root.iterdir())
        assert names == [".coursebuild", "content", "public"], names


class PublishByRenames(Publish):
    """The same where there is no exchange: then the place is empty for an instant, and mended."""

    def run(self, root: Path) -> None:
        really, publishing.exchange = publishing.exchange, lambda a, b: False
        super().run(root)
        publishing.exchange = really

    def whole(self, root: Path) -> None:
        check_out(root, root / "public")
        super().whole(root)


class PublishAgain(Publish):
    """Publish a site that has most files of the old one, and of the one before it."""

    same = tuple(CachedFile(f"a/{k}.html", "same", lambda: b"same") for k in range(5))

    def site(self, text: str) -> list[SiteFile]:
        changed = text.encode() * 50
        own = [CachedFile(n, text, lambda: changed) for n in ("b.html", "c/d.html")]
        return [*self.same, *own]

    def prepare(self, root: Path) -> None:
        (root / "content").mkdir()
        (root / "content/course.toml").write_text("[course]\n")
        for text in ("older", "old"):
            publish(root, root / "public", self.site(text))
        assert (root / ".coursebuild/published/spare").is_dir()

    def run(self, root: Path) -> None:
        with project_lock(root):
            publish(root, root / "public", self.site("new"))

    def as_tree(self, text: str) -> dict[str, bytes]:
        return {f.path: f.make() for f in self.site(text) if isinstance(f, CachedFile)}

    def whole(self, root: Path) -> None:
        assert tree(root / "public") in (self.as_tree("old"), self.as_tree("new"))

    def done(self, root: Path) -> None:
        assert tree(root / "public") == self.as_tree("new")
        assert sorted(p.name for p in root.iterdir()) == [".coursebuild", "content", "public"]
        publish(root, root / "public", self.site("newer"))
        assert tree(root / "public") == self.as_tree("newer")


class PublishFirst(Publish):
    """Publish where there was nothing."""

    old = None


class Update:
    """Replace a lesson."""

    old = "# é\r\nold\r\n".encode() * 100
    new = "# é\r\nnew and longer\r\n".encode() * 100

    def prepare(self, root: Path) -> None:
        (root / "lessons").mkdir()
        (root / "lessons/a.md").write_bytes(self.old)
        (root / "lessons/a.md").chmod(0o640)
        (root / "lessons/b.md").write_bytes(b"another")

    def run(self, root: Path) -> None:
        now = (root / "lessons/a.md").read_bytes()
        write_atomic(root, "lessons/a.md", self.new, expected=now)

    def again(self, root: Path) -> None:
        self.run(root)

    def whole(self, root: Path) -> None:
        assert (root / "lessons/a.md").read_bytes() in (self.old, self.new)
        assert (root / "lessons/a.md").stat().st_mode & 0o777 == 0o640
        assert (root / "lessons/b.md").read_bytes() == b"another"

    def done(self, root: Path) -> None:
        self.whole(root)
        assert (root / "lessons/a.md").read_bytes() == self.new
        assert sorted(p.name for p in (root / "lessons").iterdir()) == ["a.md", "b.md"]


class Create(Update):
    """Make a file that was not there."""

    def prepare(self, root: Path) -> None:
        super().prepare(root)
        (root / "lessons/a.md").unlink()

    def run(self, root: Path) -> None:
        path = root / "lessons/a.md"
        now = path.read_bytes() if path.exists() else None
        write_atomic(root, "lessons/a.md", self.new, expected=now)

    def whole(self, root: Path) -> None:
        if (root / "lessons/a.md").exists():
            assert (root / "lessons/a.md").read_bytes() == self.new
        assert (root / "lessons/b.md").read_bytes() == b"another"


class ChangeTogether(Update):
    """Change a file, make one and remove one, all or none: the next command undoes the rest."""

    before: ClassVar = {"a.md": Update.old, "b.md": b"another"}
    after: ClassVar = {"b.md": b"changed", "c.md": Update.new}

    def run(self, root: Path) -> None:
        if self.lessons(root) != self.after:
            names = sorted({*self.before, *self.after})
            pairs = [(name, self.before.get(name), self.after.get(name)) for name in names]
            changes = [FileChange(f"lessons/{name}", old, new) for name, old, new in pairs]
            change_files(root, changes)

    def lessons(self, root: Path) -> dict[str, bytes]:
        return {p: d for p, d in tree(root / "lessons").items() if not p.startswith(PREFIX)}

    def whole(self, root: Path) -> None:
        undo_changes(root)
        assert self.lessons(root) in (self.before, self.after)

    def done(self, root: Path) -> None:
        assert tree(root / "lessons") == self.after
        assert not (root / ".coursebuild/changes").exists()


class Extract:
    """Change, add and remove scripts beside an author's file and one that was changed by hand."""

    before = (
        ("examples/changed.py", b"old\n"),
        ("examples/removed.py", b"removed\n"),
        ("examples/sub/removed.py", b"removed\n"),
        ("examples/edited.py", b"old\n"),
        ("examples/same.py", b"same\n"),
    )
    after = (
        ("examples/changed.py", b"new\n"),
        ("examples/edited.py", b"new\n"),
        ("examples/same.py", b"same\n"),
        ("examples/sub/added.py", b"added\n"),
    )

    def prepare(self, root: Path) -> None:
        write_examples(root, self.before)
        (root / "examples/edited.py").write_bytes(b"by hand\n")
        (root / "examples/own.py").write_bytes(b"own\n")

    def run(self, root: Path) -> None:
        report = write_examples(root, self.after)
        assert [b.path for b in report.blocked] == ["examples/edited.py"], report

    def again(self, root: Path) -> None:
        self.run(root)

    def whole(self, root: Path) -> None:
        there = {f"examples/{k}": v for k, v in tree(root / "examples").items()}
        assert there["examples/own.py"] == b"own\n"
        assert there["examples/edited.py"] == b"by hand\n"
        assert there["examples/same.py"] == b"same\n"
        assert there["examples/changed.py"] in (b"old\n", b"new\n")
        for path, data in there.items():
            if path.endswith(("removed.py", "added.py")):
                assert data == path.rpartition("/")[2].removesuffix(".py").encode() + b"\n"

    def done(self, root: Path) -> None:
        self.whole(root)
        names = sorted(p.relative_to(root).as_posix() for p in (root / "examples").rglob("*"))
        assert names == [
            "examples/.extracted.json",
            "examples/changed.py",
            "examples/edited.py",
            "examples/own.py",
            "examples/same.py",
            "examples/sub",
            "examples/sub/added.py",
        ], names
        assert (root / "examples/changed.py").read_bytes() == b"new\n"
        # Nothing of ours was forgotten: every script can be changed and removed again.
        report = write_examples(root, [("examples/edited.py", b"newer\n")])
        assert [b.path for b in report.blocked] == ["examples/edited.py"]
        assert sorted(tree(root / "examples")) == [".extracted.json", "edited.py", "own.py"]


class ExtractAndChange(Extract):
    """The same, but the lessons change again before the next run, which must know its files."""

    def again(self, root: Path) -> None:
        newest = tuple((path, b"newest\n") for path, _ in (*self.before, *self.after))
        report = write_examples(root, newest)
        assert [b.path for b in report.blocked] == ["examples/edited.py"], report
        super().again(root)


SCENARIOS = (
    Publish,
    PublishByRenames,
    PublishAgain,
    PublishFirst,
    Update,
    Create,
    ChangeTogether,
    Extract,
    ExtractAndChange,
)


def in_child(action: Callable[[], None]) -> int:
    """The exit status of a forked child that does this and nothing else."""
    child = os.fork()
    if child == 0:
        try:
            action()
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def die(scenario: Publish | Update | Extract, root: Path, fatal: int) -> None:
    arm(fatal)
    scenario.run(root)


def deaths(kind: type[Publish | Update | Extract], folder: Path) -> int:
    """Let a scenario die at each of its calls; how many there were."""
    scenario = kind()
    for fatal in itertools.count(1):
        root = folder / str(fatal)
        root.mkdir()
        scenario.prepare(root)
        status = in_child(functools.partial(die, scenario, root, fatal))
        try:
            assert status in (0, DIED), status
            scenario.whole(root)
            scenario.again(root)
            scenario.done(root)
        except AssertionError as error:
            error.add_note(f"after death at call {fatal}")
            raise
        shutil.rmtree(root)
        if status == 0:
            return fatal - 1
    raise AssertionError
