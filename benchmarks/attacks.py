"""Attack coursebuild in every way that its page about security names, and count what it survives.

Run: python benchmarks/attacks.py [--kills 500] [--entries 500] [--journals 240] [--stores 40]
         [--mutants 2000] [--drawings 60] [--saves 200] [--only KIND …] [--seed 36]

Courses, and what lies beside them, are in a folder of their own, as are the home and the state
folder of their user. An attack is survived if its command ends with a message and without a
traceback, in 10 s of processor time and 1 GB of memory; if nothing changes but what the command may
write, and that is old or new, whole; if nothing that somebody else wrote is published; and if the
next command is none the wiser.
"""

from __future__ import annotations

import argparse
import functools
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from benchmarks.attack.foreign import Foreigners  # noqa: E402
from benchmarks.attack.grounds import Grounds, Killings, Table, Try, Victim  # noqa: E402
from benchmarks.attack.inputs import Mutants, drawing_tries, probe_tries  # noqa: E402
from benchmarks.attack.saves import Saves  # noqa: E402
from benchmarks.attack.traps import trap_tries  # noqa: E402
from coursebuild.core.run import gate  # noqa: E402
from support.mortal_commands import Mortals, mortal_commands  # noqa: E402
from support.scratch_course import command  # noqa: E402

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


SOURCE = ROOT / "tests/features/importer/mkdocs/source"
"""The course whose import is killed."""


def machine_tries(victim: Victim, mortals: Mortals) -> Iterable[Try]:
    for name, oddity in MACHINES.items():
        yield name, functools.partial(_build_on, victim, mortals, name, oddity)


def _build_on(victim: Victim, mortals: Mortals, name: str, oddity: str) -> str:
    folder = victim.restore()
    words = [sys.executable if word == "python" else word for word in command("build", "-q")]
    shell = f'{oddity} "$@"' if oddity.endswith("-i") else f'{oddity} || exit 77; exec "$@"'
    namespace = ["unshare", "--mount"] if "mount" in oddity else []
    build = gate.finish(
        [*namespace, "bash", "-c", shell, "bash", *words], folder.environment(), folder=folder.root
    )
    output = (build.output + build.errors).decode("utf-8", "replace")
    first = (output.strip() or "-").splitlines()[0]
    print(f"{name:36}{'built' if build.status == 0 else f'told: {first[:70]}'}", flush=True)
    violation = victim.grounds.find_violation(build.status, output)
    return violation or victim.find_violation(mortals)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, count in {
        "kills": 500,
        "entries": 500,
        "journals": 240,
        "stores": 40,
        "mutants": 2000,
        "drawings": 60,
        "saves": 200,
    }.items():
        parser.add_argument(f"--{name}", type=int, default=count, metavar="N")
    kinds = ("machines", "kills", "entries", "stores", "journals", "checks", "imports")
    parser.add_argument(
        "--only",
        nargs="+",
        choices=(*kinds, "drawings", "probes", "saves", "traps"),
        metavar="KIND",
    )
    parser.add_argument("--seed", type=int, default=36)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="attacks-") as top:
        grounds = Grounds(Path(top))
        table = Table(grounds)
        victim = Victim(grounds)
        runner = grounds.folder("runner")
        runner.tmp.rmdir()
        with mortal_commands(runner) as mortals:
            killings = Killings(grounds, mortals, victim, SOURCE)
            foreigners = Foreigners(grounds, mortals, victim, arguments.seed)
            inputs = Mutants(grounds, mortals, arguments.seed)
            saves = Saves(victim, mortals, arguments.seed)
            half = arguments.mutants // 2
            rows: dict[str, tuple[str, Iterable[Try], Callable[[], str]]] = {
                "machines": ("Odd machines", machine_tries(victim, mortals), str),
                "kills": (
                    "Commands that write, killed at a call that changes a file",
                    killings.tries(arguments.kills),
                    lambda: f"{killings.deaths} were killed before they ended",
                ),
                "entries": ("Entries of the store", foreigners.entries(arguments.entries), str),
                "stores": ("Stores of strangers", foreigners.stores(arguments.stores), str),
                "journals": ("Journals", foreigners.journals(arguments.journals), str),
                "checks": (
                    "Mutants, checked",
                    inputs.checks(arguments.mutants - half),
                    inputs.note,
                ),
                "imports": ("Mutants, imported", inputs.imports(half), inputs.note),
                "drawings": (
                    "Drawings opened in Chromium",
                    drawing_tries(grounds, arguments.drawings, arguments.seed),
                    str,
                ),
                "probes": ("Probes of the sandbox", probe_tries(grounds), str),
                "saves": (
                    "Commands that write, beside an editor that saves",
                    saves.tries(arguments.saves),
                    saves.note,
                ),
                "traps": ("Commands in a folder of traps", trap_tries(grounds), str),
            }
            for kind, (title, tries, note) in rows.items():
                if kind in (arguments.only or rows):
                    table.row(title, tries, note)
    print("", "| What | Tried | Survived | |", "| --- | --- | --- | --- |", *table.rows, sep="\n")
    return 1 if table.violations else 0


if __name__ == "__main__":
    sys.exit(main())
