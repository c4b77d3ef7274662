"""Every command, given in a folder full of traps, from above it and from elsewhere.

Entry point: `trap_tries`.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path

from benchmarks.attack.grounds import Grounds, Try
from coursebuild.core.run import gate
from support.traps import COMMANDS, TrapFolder, tool, variables

PLACES = ("in it", "above it", "elsewhere")
"""Where a command stands as it is given."""


def trap_tries(grounds: Grounds) -> Iterable[Try]:
    """Each command with its options, from each place."""
    for commands in COMMANDS.values():
        for command in commands:
            for place in PLACES:
                name = f"traps: {' '.join(command)}, {place}"
                yield name, functools.partial(_try, grounds, command, place)


def _try(grounds: Grounds, command: tuple[str, ...], place: str) -> str:
    folder = grounds.folder("trapped")
    (folder.root.parent / "marks").unlink(missing_ok=True)
    traps = TrapFolder(folder)
    root = folder.root
    option, stand = {
        "in it": ((), root),
        "above it": (("-C", root.name), root.parent),
        "elsewhere": (("-C", str(root)), Path("/")),
    }[place]
    environment = folder.environment(variables(PYTHONWARNINGS=""))
    done = gate.finish(tool(*option, *command), environment, folder=stand)
    text = (done.output + done.errors).decode("utf-8", "replace")
    violation = grounds.find_violation(done.status, text)
    return f"it ran {', '.join(traps.marks())}" if traps.marks() else violation
