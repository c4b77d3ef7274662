"""Take out of a text of Docusaurus what is JavaScript: its components, statements and braces.

Such a text is MDX: a tag may be a component, which only its tool can draw. What a component holds
is shown, and so is its label. An attribute whose value is computed has none here.
"""

from __future__ import annotations

import re

from coursebuild.features.importer.context import LessonContext

_BRACES = r"\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\}"
_STATEMENT = (
    r"(?:\A\n*|(?<=\n\n))"  # in a paragraph it is text
    r"(?:import[ ](?:(?:[\w$*{},. \t]|\n(?!\n))+?\sfrom[ ])?['\"]"
    r"|export[ ](?:const|let|function|default)\b)"
    r"[^\n]*(?:\n(?!</)[^\n]+)*\n?"  # not the end of a script element
)
_MDX = re.compile(rf"{_STATEMENT}|<[A-Za-z][^<>]*[ ](?:className=|\w+=\{{)", re.MULTILINE)
_PART = re.compile(
    r"(?P<code>(?P<ticks>`+)(?!`).*?(?<!`)(?P=ticks)(?!`))"
    rf"|(?P<statement>{_STATEMENT})"
    r"|(?P<comment>\{/\*.*?\*/\})"
    r"|<(?P<end>/?)(?P<name>[A-Za-z][\w.]*)"
    rf"(?P<attributes>(?:[^<>{{}}\"'`]|\"[^\"]*\"|'[^']*'|{_BRACES})*)>",
    re.MULTILINE | re.DOTALL,
)
_COMPUTED = re.compile(rf"\s+[\w-]+={_BRACES}")
_LABEL = re.compile(r"\s(?:label|title|value)=[\"']([^\"']*)[\"']")


def is_mdx(text: str) -> bool:
    """Whether a text holds what only MDX can hold."""
    return _MDX.search(text) is not None


def without_jsx(text: str, context: LessonContext) -> str:
    """Return prose without JavaScript."""
    return _PART.sub(lambda part: _convert_part(part, context), text)


def _convert_part(part: re.Match[str], context: LessonContext) -> str:
    name, attributes = part["name"], part["attributes"]
    if part["code"]:
        return part[0]
    if name is None:
        if part["statement"]:
            message = f"`{part[0].strip().splitlines()[0]}`, which is JavaScript"
            context.leave("statement of JavaScript", message)
        return ""
    if name[0].isupper():
        if not part["end"]:
            context.leave("component", f"the component `<{name}>`; what it holds is shown")
        label = _LABEL.search(attributes)
        return f"**{label[1]}**" if label else ""
    attributes = _COMPUTED.sub("", re.sub(r"=\{(\d+)\}", r'="\1"', attributes))
    return f"<{part['end']}{name}{attributes.replace('className=', 'class=')}>"
