"""The list of commands, the choice of one by the words of a command line, and how it ends.

A command is a name, a summary, and a module with `declare(parser)`, which adds its arguments, and
`run(arguments)`, which gives the exit status. `EXAMPLES` of the module, if there, end its help.
Features have further commands (`core.features.Command`). Only the module of the command that is
run is imported.

Ctrl-C and SIGTERM raise `KeyboardInterrupt` wherever the command is, so that it ends what it has
begun. A library in C may make another exception of it, such as a failed import: the signal counts.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import importlib
import re
import resource
import signal
import threading
from typing import TYPE_CHECKING, NoReturn

from coursebuild import MANUAL
from coursebuild.core.files.errors import (
    EffectError,
    LackError,
    PublishRefusedError,
    UsageError,
    lacking,
)
from coursebuild.core.files.locks import remove_abandoned_folders
from coursebuild.output import CLEAN, FAILURE, USAGE, fail, say, write

if TYPE_CHECKING:  # asking for the version loads nothing heavy
    from coursebuild.core.features import Command

_OPTIONS_OF_PACKAGES = {"--cluster": "run `pip install 'coursebuild[cluster]'`"}
"""Where options come from that are not of the core."""
_FILES_NEEDED = 64
"""For pipes of processes, the store, event loops, and what scripts open."""
_SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}

_OVERVIEW = """\
usage: coursebuild [-C DIR] COMMAND ...

Build a course of executable lessons: every recorded output is verified.

commands:
{}
anywhere on the line:
  -C DIR         the course's folder (default: the nearest one with content/course.toml)

Run `coursebuild help COMMAND` for the arguments of a command, `coursebuild explain RULE` for the
meaning of a message, `coursebuild --version` for the version.
"""
if MANUAL:
    _OVERVIEW += f"The manual: {MANUAL}\n"


def run(directory: str | None, words: list[str], *, alone: bool) -> int:
    """Run the command that the words name; `alone`: this process ends with it."""
    thresholds, handlers = gc.get_threshold(), {}
    # The objects of a command live until its end, and hardly any are in cycles: collecting garbage
    # takes time for nothing, most of all when the process ends.
    gc.set_threshold(1_000_000 if alone else 200_000, 50, 50)
    received: list[int] = []

    def interrupt(number: int, frame: object) -> NoReturn:
        received.append(number)
        raise KeyboardInterrupt

    try:
        try:
            if threading.current_thread() is threading.main_thread():
                for number in _SIGNALS:
                    if signal.getsignal(number) is not signal.SIG_IGN:  # as in the background
                        handlers[number] = signal.signal(number, interrupt)
            limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
            if limit < _FILES_NEEDED:
                text = f"only {limit} files may be open at a time, and {_FILES_NEEDED} are needed"
                return fail(USAGE, text, f"`ulimit -n {4 * _FILES_NEEDED}` raises the limit")
            if not resource.getrlimit(resource.RLIMIT_FSIZE)[0]:
                text = "nothing may be written into any file"
                return fail(USAGE, text, "`ulimit -f unlimited` removes the limit")
            remove_abandoned_folders()
            return _choose_command(directory, words)
        except UsageError as error:
            return fail(USAGE, str(error))
        except EffectError as error:
            is_refused = isinstance(error, PublishRefusedError | LackError)
            return fail(USAGE if is_refused else FAILURE, error.message, error.help)
        except (MemoryError, OSError, RuntimeError) as error:
            lack = lacking(error)
            if lack is None:
                raise
            return fail(USAGE, lack.message, lack.help)
        finally:
            if not alone:
                gc.set_threshold(*thresholds)
            for number, handler in handlers.items():
                signal.signal(number, signal.SIG_IGN if alone else handler)
    except BaseException as error:
        if not received and not isinstance(error, KeyboardInterrupt):
            raise
        number = signal.Signals(received[-1]) if received else signal.SIGINT
        return say(128 + number, _SIGNALS[number])


def _choose_command(directory: str | None, words: list[str]) -> int:
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

        help = did_you_mean(name, known_commands()) or "`coursebuild help` lists them"
        raise UsageError(f"there is no command `{name}`", help=help)
    with contextlib.ExitStack() as resources:  # what has been started by the arguments ends here
        namespace = argparse.Namespace(root=directory, words=tuple(words), resources=resources)
        arguments = parser_of(command).parse_args(rest, namespace)
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
    def print_help(self, file: object = None) -> NoReturn:
        self.exit(write(self.format_help(), CLEAN))

    def error(self, message: str) -> NoReturn:
        option = re.match("unrecognized arguments: (--[^ =]+)", message)
        if option is None:
            super().error(message)
        from coursebuild.core.text.near import nearest

        options = [name[2:] for name in self._option_string_actions if name.startswith("--")]
        closest = nearest(option[1][2:], options)
        help = f"did you mean `--{closest}`?" if closest else f"`{self.prog} --help` lists them"
        help = _OPTIONS_OF_PACKAGES.get(option[1], help)
        raise UsageError(f"there is no option `{option[1]}`", help=help)


def _overview() -> str:
    rows = (f"  {command.name:<13}{command.summary}\n" for command in known_commands().values())
    return _OVERVIEW.format("".join(rows))
