"""The list of commands, and the choice of one by the words of a command line.

Entry points: `run_command`; `known_commands`; `parser_of`, the argument parser of a command.

A command is a name, a summary, and a module with `declare(parser)`, which adds its arguments, and
`run(arguments)`, which gives the exit status. `EXAMPLES` of the module, if there, end its help.
Features have further commands (`core.features.Command`). Only the module of the command that is
run is imported.
"""

from __future__ import annotations

import argparse
import importlib
import re
from collections.abc import Sequence

from coursebuild.cli.output import CLEAN, USAGE, say, write
from coursebuild.core.files.errors import UsageError

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from typing import NoReturn

    from coursebuild.core.features import Command

_OF_OTHER_TOOLS = {
    "clean": "nothing needs it: `build` removes old pages, and `.coursebuild/` may be deleted",
    "list": "`check` names every script and lab",
    "render": "did you mean `build`?",
    "test": "did you mean `check`?",
    "watch": "did you mean `serve`?",
}
"""What to do instead of commands that other tools have."""
_OVERVIEW = """\
usage: coursebuild [-C DIR] COMMAND ...

Build a course of executable lessons: every recorded output is verified.

commands:
{}
anywhere on the line:
  -C DIR         the course's folder (default: the nearest one with content/course.toml)

`coursebuild help COMMAND` says what a command takes, `coursebuild --version` which version this is.
"""


def run_command(directory: str | None, words: Sequence[str]) -> int:
    """Run the command that the words name, in a folder; return the exit status.

    Raises:
        UsageError: there is no such command or option.
    """
    match words:
        case []:
            return say(USAGE, _overview().rstrip())
        case ["-h" | "--help", *_] | ["help"] | ["help", "-h" | "--help" | "help", *_]:
            return write(_overview(), CLEAN)
        case ["-V" | "--version", *_]:
            from coursebuild import __version__

            return write(f"coursebuild {__version__}\n", CLEAN)
        case ["help", name, *_]:
            words = [name, "--help"]
        case _:
            pass
    name, *rest = words
    if name.startswith("-"):
        message = f"`{name}` is not a command; options come after it, and `-C` takes a folder"
        raise UsageError(message)
    command = known_commands(installed=False).get(name) or known_commands().get(name)
    if command is None:
        from coursebuild.core.text.diagnostics import did_you_mean

        help = (
            _OF_OTHER_TOOLS.get(name)
            or did_you_mean(name, known_commands())
            or "`coursebuild help` lists them"
        )
        raise UsageError(f"there is no command `{name}`", help=help)
    arguments = parser_of(command).parse_args(
        rest, argparse.Namespace(root=directory, words=tuple(words))
    )
    return int(importlib.import_module(command.module).run(arguments))


def known_commands(*, installed: bool = True) -> dict[str, Command]:
    """The commands by name: those of the core, and those of installed features."""
    from coursebuild.core.features import Command
    from coursebuild.core.registry import CORE_COMMANDS, installed_features

    commands = [
        Command(name=name, summary=summary, module=f"coursebuild.cli.{name}")
        for name, summary in CORE_COMMANDS.items()
    ]
    if installed:  # finding them takes longer than all the rest
        commands += [command for feature in installed_features() for command in feature.commands]
    return {command.name: command for command in commands}


def parser_of(command: Command) -> argparse.ArgumentParser:
    """Make the argument parser of a command."""
    code = importlib.import_module(command.module)
    parser = _Parser(
        prog=f"coursebuild {command.name}",
        description=f"{command.summary[:1].upper()}{command.summary[1:]}.",
        epilog=getattr(code, "EXAMPLES", None),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("-C", metavar="DIR", dest="root", help="the course's folder")
    code.declare(parser)
    return parser


class _Parser(argparse.ArgumentParser):
    """A parser that proposes the option that was meant."""

    def error(self, message: str) -> NoReturn:
        """Raise a `UsageError` that says what is wrong with the command line."""
        option = re.match("unrecognized arguments: (--[^ =]+)", message)
        if option is None:
            super().error(message)
        from coursebuild.core.text.diagnostics import nearest

        options = [name[2:] for name in self._option_string_actions if name.startswith("--")]
        closest = nearest(option[1][2:], options)
        help = f"did you mean `--{closest}`?" if closest else f"`{self.prog} --help` lists them"
        raise UsageError(f"there is no option `{option[1]}`", help=help)


def _overview() -> str:
    rows = (f"  {command.name:<13}{command.summary}\n" for command in known_commands().values())
    return _OVERVIEW.format("".join(rows))
