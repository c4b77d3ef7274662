"""Take out of a text of Docusaurus what is JavaScript: its components, statements and braces.

Such a text is MDX: a tag may be a component, which only its tool can draw. What a component holds
is shown, and so is its label. An attribute whose value is computed has none here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from textwrap import shorten

from coursebuild.api import marks, regex
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.source_files import Segment, find_group

_STRING = r"(?:\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`)"
_QUOTED = rf"(?<=[\s=(\[{{,:?+&|]){_STRING}"
"""A string where one can begin: not at the apostrophe of a word."""
_BRACES = r"\{[^{}]*\}"
for _ in range(8):  # braces in braces; those in strings are text
    _BRACES = rf"\{{(?>(?:(?>[^{{}}\"'`]+)|{_QUOTED}|[\"'`]|{_BRACES})*)\}}"
_ATTRIBUTES = rf"(?P<attributes>(?:[^<>{{}}\"'`]|\"[^\"]*\"|'[^']*'|{_BRACES})*)"
_STATEMENT = (
    r"(?:\A\n*|(?<=\n\n))"  # in a paragraph it is text
    r"(?:import[ ](?:(?:[\w$*{},. \t]|\n(?!\n))+?\sfrom[ ])?['\"]"
    r"|export[ ](?:const|let|function|default)\b)"
    r"[^\n]*(?:\n(?!</)[^\n]+)*\n?"  # not the end of a script element
)
_MDX = regex(rf"{_STATEMENT}|^\{{/\*|<[A-Za-z][^<>]*[ ](?:className=|\w+=\{{)", re.MULTILINE)
"""What only MDX can hold."""
_PART = regex(
    r"(?P<code>(?P<ticks>`+)(?!`).*?(?<!`)(?P=ticks)(?!`))"
    rf"|(?P<statement>{_STATEMENT})"
    r"|\{/\*(?P<comment>.*?)\*/\}"
    r"|(?P<expression>(?<![\\$#\w{}^])\{(?!#)[^{}\n`]+\})"
    r"|<(?P<end>/?)(?P<name>[A-Za-z][\w.]*)"
    rf"{_ATTRIBUTES}>",
    re.MULTILINE | re.DOTALL,
)
COMPONENT = regex(r"[ \t]*</?[A-Z][\w.]*(?:\s[^<>]*)?(?<!/)>[ \t]*")
"""A line of nothing but where a component begins or ends."""
_OPENING = regex(
    r"[ \t]*<(?P<name>[A-Za-z][\w.]*)(?:\s(?:[^<>\n]|\n(?![ \t]*\n))*)?(?<!/)>[ \t]*$", re.MULTILINE
)
"""Lines of nothing but where an element begins."""
_EDGE = regex(r"(?:(?:[-+*]|\d+[.)])[ \t]+)*(?P<mark>`{3,}|~{3,})(?P<info>(?!`)[^`\s]*)[^`]*\Z")
"""The first or last line of code."""
_WORDS = regex(
    rf"<(?P<name>[A-Z]\w*){_ATTRIBUTES}>"
    r"\s*(?P<words>[^\s<>{}](?:[^<>{}\n]|\n(?!\n))*?)\s*</(?P=name)>"
)
"""A component that holds a few words."""
_COMPUTED = regex(rf"\s+[\w-]+=(?:\{{(?P<number>\d+)\}}|{_BRACES})")
_LABELS = [
    regex(rf"\s(?:{names})=(?:\"([^\"]*)\"|'([^']*)')")
    for names in ("label|title|caption|heading|children", "value|alt", "href|to|link")
]
_SENTENCE = regex(
    r"\s(?!class|style)\w+=([\"'])(?=[^\W\d_a-z])"
    r"((?:(?!\1).)*[A-Za-z]{2}[^\"'\w]*[ ](?:(?!\1).)*[A-Za-z]{2}.*?)\1",
    re.DOTALL,
)
"""An attribute of more than a word that begins as a sentence does."""
_VALUE = regex(rf"\s[\w-]+=(?P<value>{_BRACES})")
_DATA = regex(
    rf"(?P<brace>[{{}}])|(?:(?P<key>[\w$-]+)[\"']?\s*:\s*)?"
    rf"(?:(?P<string>{_STRING})|(?P<number>(?<![\w$.])-?\d[\d.]*(?![\w$])))",
    re.DOTALL,
)
"""What matters in a literal of JavaScript: where an object begins or ends, and its values."""
_ESCAPE = regex(r"\\([\"'`\\])")
_NAMES = ("title", "label", "name", "heading")
_ADDRESSES = ("href", "to", "link", "url")
_TARGET = regex(rf"[^{{}}]*?\b(?:{'|'.join(_ADDRESSES)})\s*:\s*[\"']([^\"'\n]*)[\"']")
_ADDRESS = regex(r"(?:require|useBaseUrl)\(\s*[\"']([^\"']+)[\"']\s*\)(?:\.default)?")
"""The address of a picture where it is computed."""


def is_mdx(name: str, segments: Iterable[Segment]) -> bool:
    """Return whether a text is MDX, by the name of its file or by its prose."""
    prose = (segment.text for segment in segments if segment.kind == "prose")
    return name.endswith(".mdx") or any(map(_MDX.search, prose))


def dedent_components(text: str) -> str:
    """Return MDX in which what elements hold stands no further right than their tags.

    Indentation makes no code in MDX.
    """
    element_names = {*re.findall(r"</([A-Za-z][\w.]*)>", text)}
    lines, holders, fence = list[str](), [("", 0)], ""
    opening: tuple[str, int] | None = None
    at = end = 0  # of the line, and of the last tag
    for line in text.split("\n"):
        words = line.lstrip(" \t")
        margin = len(line) - len(words)
        if opening and words and at >= end:
            holders.append((opening[0], holders[-1][1] + max(margin - opening[1], 0)))
            opening = None
        name, shift = holders[-1]
        lines.append(line[min(margin, shift) :])
        if edge := _EDGE.match(words):
            if not fence:
                fence = edge["mark"]
            elif words.startswith(fence) and not edge["info"]:
                fence = ""
        elif not fence and name and f"</{name}>" in words and f"<{name}" not in words:
            holders.pop()
        elif not fence and (tag := _OPENING.match(text, at)) and tag["name"] in element_names:
            opening, end = (tag["name"], margin), tag.end()
        at += len(line) + 1
    return "\n".join(lines)


def without_jsx(text: str, context: LessonContext) -> str:
    """Return prose without JavaScript."""
    text = _WORDS.sub(_write_linked_words, text)
    return _PART.sub(lambda part: _convert_part(part, context), text)


def _write_linked_words(component: re.Match[str]) -> str:
    """Return a component that only leads somewhere as a link."""
    title, value, address = (find_group(label, component["attributes"]) for label in _LABELS)
    is_link = address and not (title or value)
    return f"[{component['words']}]({address})" if is_link else component[0]


def write_component(name: str, attributes: str, context: LessonContext) -> str:
    """Return what the beginning of a component has readers see: a picture, or its label."""
    context.leave("component", f"the component `<{name}>`; what it holds is shown")
    title, value, address = (find_group(label, attributes) for label in _LABELS)
    words = title or value
    if picture := _ADDRESS.search(attributes):
        return f"![{words}]({picture[1]})"
    if number := re.search(r"\snumber=\"([^\"]+)", attributes):
        words = f"{name} {number[1]}: {words}"
    sentences = [text for _, text in _SENTENCE.findall(attributes) if text not in (words, address)]
    address = address if context.is_mdx else address and context.resolve_link(address)
    head = f"[{words}]({address})" if words and address else words
    whole = " ".join([f"**{head}**" if head else "", *sentences]).strip()
    if not attributes.rstrip(" \n>").endswith("/"):  # what it shows stands in it
        return whole
    values = (match["value"][1:-1].strip() for match in _VALUE.finditer(attributes))
    return "\n\n".join(filter(None, (whole, *map(_write_value, values))))


def _write_value(value: str) -> str:
    """Return the texts of a computed value: its code, or an item of a list for each object."""
    if re.fullmatch(r"`[^`]+`", value):
        return value if "\n" not in value else marks.fence("text", value.strip("`").strip("\n"))
    items, depth = [""], 0
    for part in _DATA.finditer(value if value[:1] == "[" else ""):
        if brace := part["brace"]:
            depth += 1 if brace == "{" else -1
            items += [f"{'  ' * (depth - 1)}- "] * (brace == "{")
        elif part["key"] not in _ADDRESSES:
            string = re.sub(r"\\n", " ", (part["string"] or "")[1:-1])
            text = part["number"] or _ESCAPE.sub(r"\1", string)
            if part["key"] in _NAMES and items[-1].endswith("- "):
                target = _TARGET.match(value, part.end())
                items[-1] += f"**[{text}]({target[1]})**: " if target else f"**{text}**: "
            else:
                is_sentence = re.search(r"`|\A[^\w<]*[A-Z][^<]*\w \w\w[^<]*\Z", text)
                items[-1] += f"`{text}` " if part["key"] and not is_sentence else f"{text} "
    return "\n".join(item.rstrip(": ") for item in items if item)


def _convert_part(part: re.Match[str], context: LessonContext) -> str:
    name, attributes = part["name"], part["attributes"]
    if part["code"]:
        return part[0]
    if name is None:
        if part["statement"]:
            message = f"`{shorten(part[0], 300, placeholder='…')}`, which is JavaScript"
            context.leave("statement of JavaScript", message)
        if expression := part["expression"]:
            message = f"`{expression}`, whose value its tool shows; it is code now"
            context.leave("expression of JavaScript", message)
        if (comment := part["comment"]) is not None:
            return f"<!-- {comment.strip().replace('-->', '--›')} -->"
        return f"`{expression}`" if expression else ""
    if name[0].isupper():
        words = "" if part["end"] else write_component(name, attributes, context)
        text, start, end = part.string, part.start(), part.end()
        if text[start - 1 : start] == ">" and text.startswith(
            "</a>", end
        ):  # an icon that is a link
            words = words or find_group(r"\sicon=[\"']([^\"']+)", attributes)
        line = text.rfind("\n", 0, start) + 1
        if not words or text[line:start].strip():
            return words
        line_above = text[text.rfind("\n", 0, max(line - 1, 0)) + 1 : line]
        if line_above.rstrip().endswith(">"):
            words = f"\n\n{words}"  # else it were HTML, too
        below = text[end : end + 2]
        lines = len(below) - len(below.lstrip("\n"))
        return words + "\n" * (2 - lines if below[lines:] else 0)

    def write_attribute(computed: re.Match[str]) -> str:
        address = _ADDRESS.search(computed[0])
        value = address[1] if address else computed["number"]
        return f'{computed[0].partition("=")[0]}="{value}"' if value else ""

    attributes = _COMPUTED.sub(write_attribute, attributes)
    return f"<{part['end']}{name}{attributes.replace('className=', 'class=')}>"
