"""Attack builds with odd machines, kills and poisoned entries, and count what they survive.

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
from support.mortal_commands import KILLED_STATUS, Mortals, mortal_commands  # noqa: E402
from support.poisoned_values import mutate  # noqa: E402
from support.scratch_course import Folder, block, command, wait_until_alone  # noqa: E402

LESSON = "## One\n\n$a_{1}$\n\n" + block("a.py", "print(1)", "1") + block("b.py", "print(2)", "2")
EDITED_LESSON = LESSON.replace("print(2)", "print(1 + 1)") + "Now $a_{2}$ as well.\n"
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
"""Its name, the function that does it, and whether the site that it leaves may show its data."""


class Attack:
    """A course to attack, and the checks afterwards."""

    def __init__(self, top: Path) -> None:
        self.template = Folder(top / "template")
        (top / "stores").mkdir()
        self.template.root.mkdir()
        self.template.fill([LESSON], top / "stores")
        self.build(self.template)
        self.old = site(self.template)
        self.template.write(self.template.lesson(), EDITED_LESSON)
        self.folder = Folder(top / "victim")
        self.outcome = ""
        self.deaths = 0
        """How many builds were killed; some ended first, as they made fewer calls."""
        self.restore()
        self.build(self.folder)
        self.new = site(self.folder)

    def restore(self) -> None:
        for path in (self.folder.root, self.folder.tmp):
            subprocess.run(["chmod", "-R", "u+rwx", path], stderr=subprocess.DEVNULL)
            shutil.rmtree(path, ignore_errors=True)
        shutil.copytree(self.template.root, self.folder.root, symlinks=True)
        self.folder.tmp.mkdir()

    def build(self, folder: Folder) -> None:
        command = folder.run("build", "-q")
        if command.status != 0:
            raise SystemExit(command.out + command.err)

    def find_violation(self, run: Callable[[], tuple[int, str]], *, trusted: bool = False) -> str:
        """The violation that an attack caused; empty where the build survived.

        An entry of this machine with a true seal may be `trusted`, and shown.
        """
        status, output = run()
        first = (output.strip() or "-").splitlines()[0]
        self.outcome = "built" if status == 0 else f"told: {first[:70]}"
        if "Traceback" in output or status not in (0, 1):
            return f"status {status}: {output[-400:]}"
        if self.folder.text(self.folder.lesson()) != EDITED_LESSON:
            return "the lesson changed"
        if trusted:
            return ""
        if site(self.folder) not in (self.old, self.new):
            return "the site is torn"
        after = self.folder.main("build", "-q")
        if after.status != 0 or site(self.folder) != self.new:
            return f"the next build: status {after.status}: {after.out[-300:]}{after.err[-300:]}"
        return ""

    def build_on(self, oddity: str) -> tuple[int, str]:
        self.restore()
        words = [sys.executable if word == "python" else word for word in command("build", "-q")]
        shell = f'{oddity} "$@"' if oddity.endswith("-i") else f'{oddity} || exit 77; exec "$@"'
        namespace = ["unshare", "--mount"] if "mount" in oddity else []
        process = subprocess.run(
            [*namespace, "bash", "-c", shell, "bash", *words],
            cwd=self.folder.root,
            env=self.folder.environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
        )
        return process.returncode, process.stdout + process.stderr

    def build_with(self, path: str, data: bytes) -> tuple[int, str]:
        self.restore()
        self.folder.write(path, data)
        try:
            result = self.folder.main("build", "-q")
        except Exception:
            return 70, traceback.format_exc()
        return result.status, result.out + result.err

    def calls(self, mortals: Mortals, count: int) -> Iterator[tuple[str, bool, int]]:
        """Calls at which to kill a build, spread over all.

        With and without an exchange of two folders in one step.
        """
        calls = []
        for mortals.exchanges in (True, False):
            self.restore()
            _, names = mortals.run(self.folder, "build", "-q")
            calls += [
                (f"{name}, call {number}", mortals.exchanges, number)
                for number, name in enumerate(names, 1)
            ]
        print(f"a build can be killed at {len(calls)} calls", flush=True)
        count = min(count, len(calls))
        return (calls[len(calls) * number // count] for number in range(count))

    def kill(self, mortals: Mortals, exchanges: bool, fatal: int) -> tuple[int, str]:
        self.restore()
        mortals.exchanges = exchanges
        status, _ = mortals.run(self.folder, "build", "-q", fatal=fatal)
        wait_until_alone(self.folder)
        self.deaths += status == KILLED_STATUS
        return 0 if status == KILLED_STATUS else status, mortals.output

    def entries(self, count: int, seed: int) -> Iterator[tuple[str, bytes, bool]]:
        """Entries of each kind in turn: with a bit wrong, cut, or with a seal and wrong data.

        Each comes with whether its seal is true.
        """
        chance = random.Random(seed)
        kinds: dict[str, list[str]] = {}
        for file in sorted((self.template.root / ".coursebuild").rglob("*")):
            if HASH.fullmatch(file.name) and file.is_file():
                name = file.relative_to(self.template.root).as_posix()
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
                yield path, sealed(name, poison(data, chance)), True


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


def site(folder: Folder) -> dict[str, bytes]:
    """The published site; between two renames, the one that the next build puts back."""
    return folder.tree("public") or folder.tree(".public.coursebuild-old")


class Table:
    """Prints results, and collects violations."""

    def __init__(self, attack: Attack) -> None:
        self.attack = attack
        self.violations: list[str] = []

    def row(self, kind: str, attacks: Iterable[Try], *, verbose: bool = False) -> None:
        """Try attacks of a kind; if `verbose`, each one gets a line."""
        count, before = 0, len(self.violations)
        for name, run, trusted in attacks:
            violation = self.attack.find_violation(run, trusted=trusted)
            count += 1
            if violation:
                self.violations.append(f"{name}: {violation}")
                print(self.violations[-1], flush=True)
            elif verbose:
                print(f"{name:36}{self.attack.outcome}", flush=True)
        survived = count - len(self.violations) + before
        print(f"{kind}: {count} tried, {survived} survived", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=520)
    parser.add_argument("--entries", type=int, default=500)
    parser.add_argument("--seed", type=int, default=21)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as top:
        attack = Attack(Path(top))
        table = Table(attack)
        machines = (
            (name, functools.partial(attack.build_on, oddity), False)
            for name, oddity in MACHINES.items()
        )
        table.row("odd machines", machines, verbose=True)
        mortal = Folder(Path(top) / "mortal")
        mortal.root.mkdir()
        with mortal_commands(mortal) as mortals:
            kills = (
                (name, functools.partial(attack.kill, mortals, exchanges, at), False)
                for name, exchanges, at in attack.calls(mortals, arguments.kills)
            )
            table.row("kills", kills)
            print(f"killed: {attack.deaths}")
        entries = (
            (path[:40], functools.partial(attack.build_with, path, data), trusted)
            for path, data, trusted in attack.entries(arguments.entries, arguments.seed)
        )
        table.row("damaged or poisoned entries", entries)
    return 1 if table.violations else 0


if __name__ == "__main__":
    sys.exit(main())
