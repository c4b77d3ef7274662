"""Inputs that nobody should have to read: files, folders to import, drawings, scripts.

Entry points: `Mutants`, `drawing_tries`, `probe_tries`.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import random
import re
import resource
import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from playwright.sync_api import sync_playwright

from benchmarks.attack.grounds import MEGABYTES, SECONDS, SECRET, Grounds, Try
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import ScriptJob
from coursebuild.core.run.sandbox import find_sandbox
from coursebuild.core.run.script_server import ScriptServer
from support.chromium import Browsers
from support.hostile_svg import HARMLESS, HOSTILE, mutants
from support.mortal_commands import Mortals
from support.opened_drawings import Drawings, published_files
from support.poisoned_values import mutate
from support.sandbox_probes import ATTEMPTS, EXCESSES, answers, attempts_script, surroundings
from support.scratch_course import ROOT, Folder, wait_until_alone

SPICES: tuple[bytes, ...] = (
    *(b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\x1b[2J", b"\x0c", b"\t", "\u202e".encode()),
    *b"` ``` ~~~~ $ $$ > >[!note] [ ]( ![ < &# | * _ \\ { } \" ' : # === --- % [[ ]]".split(),
    *b".. ../beside/home/.ssh/key /etc/passwd file:/// javascript: %2e%2e/ null true -1".split(),
    *b"1e400 999999999999999999999 <script> <!-- --> <![CDATA[ &x; <<: {{x}} {%x%}".split(),
    *(b"- ", b"1. ", b'include="../beside/home/.ssh/key"', b"<!DOCTYPE x ["),
    *(b"!!python/object/apply:os.system [id]", b"&a [*a, *a]", b"\n"),
)
_FENCE = rb"^(?:```|~~~)"
_SCRIPT = re.compile(_FENCE + rb"[^\n]*(?:python|code-cell)(?s:.*?)" + _FENCE, re.MULTILINE)
"""A script, which is left as it is: what code does is judged elsewhere."""


class Mutants:
    """Courses, and folders to import, in which a file or an entry is changed at random."""

    def __init__(self, grounds: Grounds, mortals: Mortals, seed: int) -> None:
        self.grounds, self.mortals = grounds, mortals
        self.chance = random.Random(seed)
        self.statuses: dict[int, int] = {}

    def note(self) -> str:
        counts = sorted(self.statuses.items())
        self.statuses = {}
        return ", ".join(f"{count} with status {status}" for status, count in counts)

    def checks(self, count: int) -> Iterable[Try]:
        """Mutants of a course that `init` wrote and one file of each further kind."""
        template = self.grounds.folder("checked-template")
        if template.main("init").status != 0:
            raise SystemExit("no course to change")
        source = ROOT / "tests/features/importer/levels/source"
        template.write(
            "content/lessons/ball.svg", (source / "content/images/ball.svg").read_bytes()
        )
        lesson = "content/lessons/1.1-pendulum.md"
        extra = "\n![A ball](ball.svg)\n\n| a | b |\n|---|--:|\n| 1 | *2* |\n\n"
        template.write(lesson, template.text(lesson) + extra)
        result = template.main("check", "-q")
        if result.status != 0:
            raise SystemExit(result.out)
        folder = self.grounds.copy(template, "checked")
        names = ["content/course.toml", lesson, lesson, lesson, "models/pendulum.xml"]
        names += ["content/lessons/ball.svg", "content/lessons/swing.svg", "matplotlibrc"]
        for number in range(count):
            path = self.chance.choice(names)
            yield (
                f"check, mutant {number} of {path}",
                lambda path=path: self._check(template, folder, path),
            )

    def _check(self, template: Folder, folder: Folder, path: str) -> str:
        change = self._change(folder.root, path)
        before = _look(folder.root)
        violation = self._run(folder, "check", "-q")
        after = _look(folder.root)
        _remove(folder.root / path)
        folder.write(path, template.read(path))
        if not violation and after != before:
            changed = {name for name, _ in after.items() ^ before.items()}
            violation = f"`check` changed the course: {sorted(changed)}"
        return violation and f"{change}: {violation}"

    def imports(self, count: int) -> Iterable[Try]:
        """Mutants of the courses of other tools that the tests import."""
        cases = ROOT / "tests/features/importer"
        sources = sorted(path for path in cases.glob("*/source"))
        for number in range(count):
            source = self.chance.choice(sources)
            name = f"import, mutant {number} of {source.parent.name}"
            yield name, lambda source=source: self._import(source)

    def _import(self, source: Path) -> str:
        folder = self.grounds.folder("importing")
        shutil.copytree(source, folder.root / "source")
        paths = [
            path.relative_to(folder.root).as_posix()
            for path in sorted((folder.root / "source").rglob("*"))
            if path.suffix != ".py"
        ]
        path = self.chance.choice(paths)
        change = self._change(folder.root, path)
        before = _look(folder.root / "source")
        violation = self._run(folder, "import", "source", "--out", "course", "-q")
        if not violation and _look(folder.root / "source") != before:
            violation = "`import` changed what it reads"
        if not violation and {p.name for p in folder.root.iterdir()} - {"source", "course"}:
            violation = "it wrote elsewhere"
        course = _look(folder.root / "course")
        if not violation and any(SECRET.encode() in data for data in course.values()):
            violation = "it took what lies outside of the folder"
        links = [path for path, data in course.items() if data.startswith(b"-> ")]
        if not violation and links:
            violation = f"it made links: {links}"
        return violation and f"{path} {change}: {violation}"

    def _run(self, folder: Folder, *arguments: str) -> str:
        violation = self.grounds.run(self.mortals, folder, *arguments)
        status = self.mortals.status
        self.statuses[status] = self.statuses.get(status, 0) + 1
        return violation

    def _change(self, root: Path, path: str) -> str:
        """Change an entry; return how."""
        full = root / path
        if full.is_file() and self.chance.random() < 0.85:
            data = full.read_bytes()
            if full.suffix in (".json", ".ipynb") and self.chance.random() < 0.5:
                with contextlib.suppress(ValueError, OverflowError):
                    full.write_bytes(json.dumps(_mutate_text(data, self.chance)).encode())
                    return "with another value"
            new = self._edit(data)
            full.write_bytes(new)
            return f"edited ({len(data)} to {len(new)} bytes)"
        outside = self.grounds.beside
        ways: dict[str, Callable[[], object]] = {
            "gone": lambda: None,
            "a link to a file outside": lambda: full.symlink_to(outside / "home/.ssh/key"),
            "a link to a folder outside": lambda: full.symlink_to("../" * 9 + str(outside)[1:]),
            "a link to itself": lambda: full.symlink_to(full.name),
            "a folder": lambda: full.mkdir(),
            "a pipe": lambda: os.mkfifo(full),
            "a device": lambda: full.symlink_to("/dev/zero"),
            "empty": full.touch,
        }
        way = self.chance.choice(list(ways))
        _remove(full)
        ways[way]()
        return f"is {way}"

    def _edit(self, data: bytes) -> bytes:
        """Some edits outside of scripts; in one of ten a piece comes again and again."""
        for _ in range(self.chance.choice((1, 1, 2, 3, 8))):
            scripts = [match.span() for match in _SCRIPT.finditer(data)]
            at = self.chance.randrange(len(data) + 1)
            if any(start < at < end for start, end in scripts):
                continue
            limit = min((start for start, _ in scripts if start >= at), default=len(data))
            end = min(at + self.chance.choice((0, 0, 1, 4, 30)), limit)
            piece = self.chance.choice(SPICES)
            kind = self.chance.random()
            if kind < 0.1:
                piece = data[at : min(at + 40, limit)]
                piece = (piece or b"x") * self.chance.choice((2, 50, 2000))
            elif kind < 0.2:
                piece = self.chance.choice(SPICES) * self.chance.choice((50, 5000))
            elif kind < 0.3:
                piece = bytes([self.chance.randrange(256)])
            elif kind < 0.35 and not scripts:
                return data[:at]
            data = data[:at] + piece + data[end:]
        return data


def _mutate_text(data: bytes, chance: random.Random) -> object:
    return mutate(json.loads(data), chance)


def _look(folder: Path) -> dict[str, bytes]:
    """All in a folder but its store and scripts, by path; links by where they lead."""
    entries = {}
    for base, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if name not in (".coursebuild", "examples")]
        for name in (*folders, *files):
            path = Path(base, name)
            if path.is_symlink():
                entries[str(path)] = b"-> " + os.fsencode(path.readlink())
            else:
                entries[str(path)] = path.read_bytes() if path.is_file() else b""
    return entries


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


# --- drawings


def drawing_tries(grounds: Grounds, count: int, seed: int) -> Iterable[Try]:
    """Hostile drawings and mutants are judged, until so many of what passes were opened."""
    count_opened = 0
    folder = grounds.folder("drawings")
    with sync_playwright() as playwright:
        browsers = Browsers(playwright)
        with contextlib.closing(browsers), Drawings(browsers["plain"], folder.root) as drawings:
            hostile = dict(HOSTILE)
            if not drawings.open(hostile["script"]) or not drawings.open(hostile["onclick"]):
                raise SystemExit("the browser does not tell of what a drawing does")
            mutated_files = mutants(1000 * count, seed)
            for name, data in itertools.chain(HOSTILE, HARMLESS, mutated_files):
                files, violation = _judge(data)
                if (name, data) in HARMLESS:
                    files = files[:1]  # these are there for their mutants
                if violation:
                    yield f"drawing {name}, judged", lambda violation=violation: violation
                for file in files:
                    if count_opened == count:
                        return
                    count_opened += 1
                    yield f"drawing {name}", lambda file=file: "; ".join(drawings.open(file))


def _judge(data: bytes) -> tuple[list[bytes], str]:
    start = time.process_time()
    files = published_files(data)
    seconds = time.process_time() - start
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    slow = seconds > SECONDS or megabytes > MEGABYTES
    return files, f"it took {seconds:.1f} s, {megabytes:.0f} MB" if slow else ""


# --- the sandbox


def probe_tries(grounds: Grounds) -> Iterable[Try]:
    """All that scripts try in the sandbox; none where this machine has no sandbox."""
    root = grounds.folder("confined").root
    (root / "examples").mkdir()
    try:
        sandbox = find_sandbox(root)
    except EffectError as error:
        print(f"no sandbox here, and nothing ran: {error.message}", flush=True)
        return
    home = grounds.folder("confined-home").root
    (home / "secret").write_text("hush")
    os.environ["HOME"], real = str(home), os.environ["HOME"]
    with surroundings(root, home) as names, ScriptServer(sandbox=sandbox) as server:
        (root / "examples/x.py").write_text(attempts_script(names))
        job = ScriptJob("examples/x.py", (), 120.0, (), writes=("runs",))
        (run,) = server.run(root, [job], parallel=1)
        failures = answers(run)
        if "hush" in run.stdout + run.stderr:
            failures["all"] = "it reads a secret"
    os.environ["HOME"] = real
    for attempt in ATTEMPTS:
        line = failures.get(attempt, failures.get("all", ""))
        yield f"probe {attempt}", lambda line=line: line
    for name, excess in EXCESSES.items():
        (root / "examples/x.py").write_text(excess.code)
        job = ScriptJob("examples/x.py", (), excess.timeout, (), memory=excess.memory)
        with ScriptServer(sandbox=sandbox) as server:
            (run,) = server.run(root, [job], parallel=1)
        is_held = run.outcome is excess.outcome and excess.message in run.stderr
        yield f"probe {name}", lambda is_held=is_held, run=run: "" if is_held else repr(run)[:300]
    wait_until_alone(Folder(root))
