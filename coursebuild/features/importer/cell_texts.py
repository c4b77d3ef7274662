"""What a cell holds besides its code: options, and lines that only Jupyter understands."""

from __future__ import annotations

import re
from collections.abc import Mapping

from coursebuild.api import regex
from coursebuild.features.importer.source_files import read_yaml

_OPTION = regex(
    r"\s*(?:(?:#|//|%%)(?:[ ](?=\|[ ]+[\w-]+:[ ]))?\|(.*)"
    r"|:([\w-]+):[ \t]*(.*(?:\n:[ ].*)*))(?:\n|\Z)"
)
"""A line of options of a cell: YAML of Quarto, or one option of MyST."""
_YAML_HEAD = regex(r"---[ \t]*\n(.*?)\n---[ \t]*(?:\n|\Z)", re.DOTALL)
MAGIC = regex(r"^([ \t]*)(?:[%!?]|\w+\?{1,2}[ \t]*$).*$", re.MULTILINE)
_COMMAND = regex(r"!|%(?=pip|conda|time)")
"""What begins a line that says something to readers, too."""
COMMENT = regex(r"^# (?:![ \t]*|%(?=pip|conda)|(?=%))", re.MULTILINE)
"""What stands before such a line where it is a comment, and no part of it for a shell."""


def read_options(text: str) -> tuple[Mapping[str, str], str]:
    """Return the options that begin a cell or directive, by their names, and its other lines.

    They are YAML, between lines of hyphens or behind the marks of Quarto, or lines of MyST.
    """
    head = _YAML_HEAD.match(text)
    at, yaml_lines, options = head.end() if head else 0, list[str](), dict[str, str]()
    while option := _OPTION.match(text, at):
        at = option.end()
        if option[2]:
            value = option[3].replace("\n:", "\n").strip()
            is_quoted = value[:1] in ('"', "'")
            options[option[2]] = str((is_quoted and read_yaml(value)) or " ".join(value.split()))
        else:
            yaml_lines.append(option[1])
    for yaml_text in ("\n".join(yaml_lines), head[1] if head else ""):
        value = read_yaml(yaml_text)
        pending = [value] if isinstance(value, dict) else []
        while pending:
            for name, inner in pending.pop().items():
                if isinstance(inner, dict):
                    pending.append(inner)
                else:
                    words = " ".join(map(str, inner)) if isinstance(inner, list) else str(inner)
                    words = words.lower() if isinstance(inner, bool) else words
                    options[str(name).replace(".", "-")] = words  # as knitr and Quarto call it
    return options, text[at:]


def code_for_readers(text: str) -> str:
    """Return the code of a cell without the lines that only its tool understands."""
    return drop_magics(read_options(text)[1]).strip("\n")


def drop_magics(text: str) -> str:
    """Return code without the lines of Jupyter, of which commands are comments.

    A block that holds only one stays a block.
    """

    def write(magic: re.Match[str]) -> str:
        line = magic[0].strip()
        note = f"# {line}" if _COMMAND.match(line) else ""
        return f"{magic[1]}pass  {note}".rstrip() if magic[1] else note

    return MAGIC.sub(write, text)
