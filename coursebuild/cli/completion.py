"""`coursebuild completion`: print a shell completion script.

The script calls this command with the words of the line behind `--`, to get the completions of the
last word. Where there are none the shell completes names of files.
"""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

from coursebuild.cli.commands import known_commands, parser_of
from coursebuild.cli.unchanged import split_directory
from coursebuild.core.files.course_root import MAP, find_course_root, read_regular
from coursebuild.core.registry import features
from coursebuild.core.syntax.course_schema import schema_roots
from coursebuild.core.text.rules import RULES
from coursebuild.output import CLEAN, write

EXAMPLES = """\
examples:
  eval "$(coursebuild completion bash)"                 in ~/.bashrc
  eval "$(coursebuild completion zsh)"                  in ~/.zshrc, behind compinit
  coursebuild completion fish | source                  in ~/.config/fish/config.fish
"""

_SCRIPTS = {
    "bash": """\
_coursebuild() {
    local IFS=$'\\n'
    COMPREPLY=($(coursebuild completion bash -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _coursebuild coursebuild
""",
    "zsh": """\
_coursebuild() {
    local -a words_known
    words_known=("${(@f)$(coursebuild completion zsh -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    [[ -n $words_known ]] && compadd -- $words_known || _files
}
compdef _coursebuild coursebuild
""",
    "fish": """\
complete -c coursebuild -a '(coursebuild completion fish -- \\
    (commandline -opc)[2..] (commandline -ct) 2>/dev/null)'
""",
}


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=_SCRIPTS, metavar="SHELL", help=", ".join(_SCRIPTS))
    parser.add_argument("line", nargs="*", metavar="WORD", help="words of the line to complete")


def run(arguments: argparse.Namespace) -> int:
    """Print the script, or the completions of a word."""
    if not arguments.line:
        return write(_SCRIPTS[arguments.shell], CLEAN)
    directory, words = split_directory(arguments.line)
    *before, last = words or [""]
    commands = known_commands()
    if not before or before == ["help"]:
        candidates = [*commands, *([] if before else ["help", "--version", "-C"])]
    else:
        actions = parser_of(commands[before[0]])._actions if before[0] in commands else []
        takes_word = (a for a in actions if before[-1] in a.option_strings and a.nargs != 0)
        if last.startswith("-"):
            candidates = [name for action in actions for name in action.option_strings]
        elif (option := next(takes_word, None)) is not None:
            candidates = [*(option.choices or ())]
        else:
            candidates = []
            for action in (action for action in actions if not action.option_strings):
                root = None if action.choices else find_course_root(directory or ".")
                match action.metavar:
                    case _ if action.choices:
                        candidates += action.choices
                    case "LESSON" if root is not None:
                        candidates += _read_ids(Path(root))
                    case "MODEL" | "SCENE" if root is not None:
                        candidates += (path.stem for path in Path(root, "models").glob("*.xml"))
                    case "RULE|PATH[:LINE]":
                        candidates += [*RULES, *(_read_ids(Path(root)) if root is not None else ())]
                    case "SCHEMA":
                        candidates += schema_roots()
                    case "EXPORT":
                        candidates += (e.name for feature in features() for e in feature.exporters)
                    case _:
                        pass
    completions = sorted({word for word in candidates if word.startswith(last)})
    return write("".join(f"{word}\n" for word in completions), CLEAN)


def _read_ids(root: Path) -> list[str]:
    try:
        course = tomllib.loads(read_regular(root / MAP).decode())
        lessons = [lesson["id"] for level in course["level"] for lesson in level["lesson"]]
        return [*lessons, *(page["id"] for page in course.get("page", ()))]
    except (OSError, ValueError, KeyError, TypeError):
        return []
