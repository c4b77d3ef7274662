"""What odd machines, kills and poisoned entries do to a build: what was tried and survived.

Run: python benchmarks/attacks.py [--kills 500] [--entries 500] [--seed 21]

Each attack begins with a course whose site is built, and whose lesson has changed since. A build
survives if it ends with status 0 or 1 and a message, without a traceback; if the lesson is as it
was, and the site is the old one or the new one, whole; and if the next build, on a machine that is
not odd, makes the new one.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import itertools
import json
import random
import shutil
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import msgspec  # noqa: E402

from coursebuild.core.engine.memo import HASH, sealed, unsealed  # noqa: E402
from support.mortal_commands import DIED, Mortals, mortal_commands  # noqa: E402
from support.poisoned_values import changed  # noqa: E402
from support.scratch_course import Folder, block, command, wait_until_alone  # noqa: E402

LESSON = "## One\n\n$a_{1}$\n\n" + block("a.py", "print(1)", "1") + block("b.py", "print(2)", "2")
CHANGED = LESSON.replace("print(2)", "print(1 + 1)") + "Now $a_{2}$ as well.\n"
MACHINES: dict[str, str] = {
    **{f"{count} open files": f"ulimit -n {count}" for count in (12, 24, 48, 64, 80)},
    **{f"{size} MiB of addresses": f"ulimit -v {size << 10}" for size in (256, 512, 2048, 8192)},
    **{f"files of {size} kiB": f"ulimit -f {size}" for size in (0, 1, 16, 64, 512)},
    **{f"{size} kiB of stack": f"ulimit -s {size}" for size in (512, 2048)},
    "10 s of processor time": "ulimit -t 10",
    "no locked memory": "ulimit -l 0",
    "no HOME": "unset HOME",
    "no TMPDIR": "unset TMPDIR",
    "a TMPDIR that is not there": "export TMPDIR=/nowhere/at/all",
    "a TMPDIR that is a file": "export TMPDIR=/etc/passwd",
    "no PATH": "unset PATH",
    "an empty environment": "exec env -i",
    "the locale C": "export LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0",
    "a locale that is not there": "export LC_ALL=xx_YY.latin-1",
    "no standard output": "exec >&-",
    "no standard error": "exec 2>&-",
    "no standard input": "exec <&-",
    "standard output full": "exec > /dev/full",
    "a terminal of no columns": "export COLUMNS=0 TERM=dumb",
    "a umask of 777": "umask 777",
    "a clock of 1970": "export SOURCE_DATE_EPOCH=0 TZ=Nowhere/Land",
    "bytecode that cannot be kept": "export PYTHONDONTWRITEBYTECODE=1",
    "a full disk for temporary files": "mount -t tmpfs -o size=16k none $TMPDIR",
    "a full disk for the course": "mount -t tmpfs -o size=400k none .coursebuild",
    "a read-only course": "mount --bind . . && mount -o remount,ro,bind . && cd .",
    "no /proc": "umount -l /proc",
    "no /dev/shm": "mount -t tmpfs -o size=0,ro none /dev/shm",
}
"""What a shell does before it starts the build, in a mount namespace of its own where it can."""


Try: TypeAlias = tuple[str, Callable[[], tuple[int, str]], bool]
"""Its name, what does it, and whether what it leaves may be believed."""


class Attack:
    """A course to attack, and what must be true afterwards."""

    def __init__(self, top: Path) -> None:
        self.template = Folder(top / "template")
        (top / "stores").mkdir()
        self.template.root.mkdir()
        self.template.fill([LESSON], top / "stores")
        self.build(self.template)
        self.old = site(self.template)
        self.template.write(self.template.lesson(), CHANGED)
        self.folder = Folder(top / "victim")
        self.outcome = ""
        self.deaths = 0
        """How many builds were killed: some got through before, as they made fewer calls."""
        self.again()
        self.build(self.folder)
        self.new = site(self.folder)

    def again(self) -> None:
        for path in (self.folder.root, self.folder.tmp):
            subprocess.run(["chmod", "-R", "u+rwx", path], stderr=subprocess.DEVNULL)
            shutil.rmtree(path, ignore_errors=True)
        shutil.copytree(self.template.root, self.folder.root, symlinks=True)
        self.folder.tmp.mkdir()

    def build(self, folder: Folder) -> None:
        done = folder.run("build", "-q")
        if done.status != 0:
            raise SystemExit(done.out + done.err)

    def wrong(self, run: Callable[[], tuple[int, str]], *, believed: bool = False) -> str:
        """What an attack did that it must not; empty where it was survived.

        An entry of this machine with a true seal may be `believed`, and shown.
        """
        status, said = run()
        first = (said.strip() or "-").splitlines()[0]
        self.outcome = "built" if status == 0 else f"told: {first[:70]}"
        if "Traceback" in said or status not in (0, 1):
            return f"status {status}: {said[-400:]}"
        if self.folder.text(self.folder.lesson()) != CHANGED:
            return "the lesson changed"
        if believed:
            return ""
        if site(self.folder) not in (self.old, self.new):
            return "the site is torn"
        after = self.folder.main("build", "-q")
        if after.status != 0 or site(self.folder) != self.new:
            return f"the next build: status {after.status}: {after.out[-300:]}{after.err[-300:]}"
        return ""

    def machine(self, oddity: str) -> tuple[int, str]:
        self.again()
        words = [sys.executable if word == "python" else word for word in command("build", "-q")]
        shell = f'{oddity} "$@"' if oddity.endswith("-i") else f'{oddity} || exit 77; exec "$@"'
        alone = ["unshare", "--mount"] if "mount" in oddity else []
        done = subprocess.run(
            [*alone, "bash", "-c", shell, "bash", *words],
            cwd=self.folder.root,
            env=self.folder.environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
        )
        return done.returncode, done.stdout + done.stderr

    def entry(self, path: str, data: bytes) -> tuple[int, str]:
        self.again()
        self.folder.write(path, data)
        try:
            done = self.folder.main("build", "-q")
        except Exception:
            return 70, traceback.format_exc()
        return done.status, done.out + done.err

    def calls(self, mortals: Mortals, count: int) -> Iterator[tuple[str, bool, int]]:
        """Calls at which to kill a build, spread over all.

        With and without an exchange of two folders in one step.
        """
        found = []
        for mortals.exchanges in (True, False):
            self.again()
            _, names = mortals.run(self.folder, "build", "-q")
            found += [
                (f"{name}, call {number}", mortals.exchanges, number)
                for number, name in enumerate(names, 1)
            ]
        print(f"a build can be killed at {len(found)} calls", flush=True)
        count = min(count, len(found))
        return (found[len(found) * number // count] for number in range(count))

    def killed(self, mortals: Mortals, exchanges: bool, fatal: int) -> tuple[int, str]:
        self.again()
        mortals.exchanges = exchanges
        status, _ = mortals.run(self.folder, "build", "-q", fatal=fatal)
        wait_until_alone(self.folder)
        self.deaths += status == DIED
        return 0 if status == DIED else status, mortals.said

    def entries(self, count: int, seed: int) -> Iterator[tuple[str, bytes, bool]]:
        """Entries of each kind in turn: with a bit wrong, cut, or with a seal and wrong data.

        With each it is said whether its seal is true.
        """
        chance = random.Random(seed)
        kinds: dict[str, list[str]] = {}
        for path in sorted((self.template.root / ".coursebuild").rglob("*")):
            if HASH.fullmatch(path.name) and path.is_file():
                name = path.relative_to(self.template.root).as_posix()
                kinds.setdefault(name.split("/")[1], []).append(name)
        for number, kind in zip(range(count), itertools.cycle(kinds), strict=False):
            path = chance.choice(kinds[kind])
            whole = self.template.read(path)
            name = path.removeprefix(".coursebuild/")
            data = unsealed(name, whole)
            at = chance.randrange(len(whole))
            damage = chance.random()
            if damage < 0.1 or data is None:
                flipped = bytes([whole[at] ^ 1 << number % 8])
                yield path, whole[:at] + flipped + whole[at + 1 :], False
            elif damage < 0.2:
                yield path, whole[:at], False
            else:
                yield path, sealed(name, poisoned(data, chance)), True


def poisoned(data: bytes, chance: random.Random) -> bytes:
    """Data that still looks like what it is: one value in it is another, often of another type."""
    for decode, encode in (
        (json.loads, lambda value: json.dumps(value).encode()),
        (msgspec.msgpack.decode, msgspec.msgpack.encode),
    ):
        with contextlib.suppress(ValueError, TypeError, RecursionError, msgspec.MsgspecError):
            value = decode(data)
            while True:
                with contextlib.suppress(OverflowError, UnicodeEncodeError):
                    return encode(changed(value, chance))
    return data[: len(data) // 2]


def site(folder: Folder) -> dict[str, bytes]:
    """What is published; between two renames it is what the next build puts back."""
    return folder.tree("public") or folder.tree(".public.coursebuild-old")


class Table:
    """What was tried, and what was not survived."""

    def __init__(self, attack: Attack) -> None:
        self.attack = attack
        self.failed: list[str] = []

    def row(self, what: str, attacks: Iterable[Try], *, every: bool = False) -> None:
        """Try attacks of a kind; `every` one gets a line."""
        tried, before = 0, len(self.failed)
        for name, run, believed in attacks:
            wrong = self.attack.wrong(run, believed=believed)
            tried += 1
            if wrong:
                self.failed.append(f"{name}: {wrong}")
                print(self.failed[-1], flush=True)
            elif every:
                print(f"{name:36}{self.attack.outcome}", flush=True)
        survived = tried - len(self.failed) + before
        print(f"{what}: {tried} tried, {survived} survived", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=520)
    parser.add_argument("--entries", type=int, default=500)
    parser.add_argument("--seed", type=int, default=21)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as top:
        attack = Attack(Path(top))
        table = Table(attack)
        machines = (
            (name, functools.partial(attack.machine, oddity), False)
            for name, oddity in MACHINES.items()
        )
        table.row("odd machines", machines, every=True)
        mortal = Folder(Path(top) / "mortal")
        mortal.root.mkdir()
        with mortal_commands(mortal) as mortals:
            kills = (
                (name, functools.partial(attack.killed, mortals, exchanges, at), False)
                for name, exchanges, at in attack.calls(mortals, chosen.kills)
            )
            table.row("kills", kills)
            print(f"killed: {attack.deaths}")
        entries = (
            (path[:40], functools.partial(attack.entry, path, data), believed)
            for path, data, believed in attack.entries(chosen.entries, chosen.seed)
        )
        table.row("damaged or poisoned entries", entries)
    return 1 if table.failed else 0


if __name__ == "__main__":
    sys.exit(main())
