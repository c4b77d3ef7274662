"""Fences, directives and callouts of other tools as Markdown of coursebuild.

Entry point: `block_text`.
"""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Mapping

from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.pages.marks import fence, quoted
from coursebuild.core.registry import CORE_FENCES, fence_names
from coursebuild.features.importer.cells import shown_text
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.prose import displayed, rewrite
from coursebuild.features.importer.segments import read_markdown
from coursebuild.features.importer.values import Segment, read_yaml

_CALLOUTS = {
    **{callout.name: callout.name for callout in CALLOUTS},
    **dict.fromkeys(("hint",), "tip"),
    **dict.fromkeys(("attention", "failure", "bug"), "caution"),
    **dict.fromkeys(("danger", "error"), "warning"),
    **dict.fromkeys(("seealso", "info", "abstract", "summary", "quote", "topic"), "note"),
    **dict.fromkeys(("admonition", "margin", "sidebar", "dropdown", "example"), "note"),
    **dict.fromkeys(("exercise", "question"), "try"),
    **dict.fromkeys(("answer", "success"), "solution"),
}
_TITLED = ("admonition", "dropdown", "sidebar", "topic", "exercise", "example", "margin")
"""Directives whose argument is a title, and not the first line."""
_DIRECTIVE = re.compile(r"\{(?P<name>[A-Za-z][\w:.-]*)\}[ \t]*(?P<argument>.*)")
_TITLE = re.compile(r"title=(?:\"([^\"]*)\"|'([^']*)')")
_OPTION = re.compile(r":([\w-]+):[ \t]*(.*)")
_CAMERA = re.compile(r'"camera"\s*:\s*\{(?:[^{}])*\}')
_ANGLE = re.compile(r'("(azimuth|elevation)"\s*:\s*)(-?\d+(?:\.\d+)?)')
_QUOTED_KIND = re.compile(r"^((?: {0,3}>)+[ \t]*\[!)([\w-]+)(\])", re.MULTILINE)


def block_text(segment: Segment, context: LessonContext) -> str:
    """A segment that is no cell, as Markdown."""
    if segment.kind == "prose":
        text = rewrite(segment.text, context, segment.place)
        return _QUOTED_KIND.sub(lambda m: m[1] + _kind(m[2], context) + m[3], text)
    if segment.kind == "cell":
        context.leave(segment.place, "a cell inside another block is shown and not run")
        return fence("python fragment", shown_text(segment))
    directive = _DIRECTIVE.fullmatch(segment.head)
    if directive is not None:
        return _directive(directive["name"], directive["argument"], segment, context)
    match segment.mark[0]:
        case ":":
            return _div(segment, context)
        case "!" | "?":
            name, _, title = segment.head.partition(" ")
            return _callout(name, title.strip().strip('"'), segment.text, segment, context)
        case _:
            return _fence(segment, context)


def _inside(text: str, segment: Segment, context: LessonContext) -> str:
    parts = read_markdown(text, place=segment.place)
    return "\n\n".join(block_text(part, context).strip("\n") for part in parts)


def _kind(kind: str, context: LessonContext) -> str:
    known = _CALLOUTS.get(kind.lower())
    if known is None:
        context.callouts[kind.lower()] = kind.replace("-", " ").capitalize()
    return known or kind.lower()


def _callout(
    kind: str, title: str, text: str, segment: Segment, context: LessonContext, *, folded: str = ""
) -> str:
    title = rewrite(title, context, segment.place)
    head = f"[!{_kind(kind, context)}]{folded} {title}".rstrip()
    return quoted(f"{head}\n{_inside(text, segment, context)}".rstrip("\n"))


def _div(segment: Segment, context: LessonContext) -> str:
    """What stands between lines of colons."""
    kind = re.search(r"callout-(\w+)", segment.head)
    text = segment.text
    if kind is None:
        return _inside(text, segment, context)
    titled = _TITLE.search(segment.head)
    title = (titled[1] or titled[2] or "") if titled else ""
    heading = re.match(r"\s*#{1,6}[ \t]+(.*)\n?", text)
    if not title and heading is not None:
        title, text = heading[1].strip(), text[heading.end() :]
    folded = "-" if re.search(r"collapse=\"?true", segment.head) else ""
    return _callout(kind[1], title, text, segment, context, folded=folded)


def _options_of(text: str) -> tuple[Mapping[str, str], str]:
    """The options at the beginning of a directive (`:name: value`, or YAML), and the rest."""
    if text.startswith("---\n") and "\n---" in text[4:]:
        head, _, rest = text[4:].partition("\n---")
        found = read_yaml(head)
        options = found if isinstance(found, dict) else {}
        return {str(key): str(value) for key, value in options.items()}, rest.lstrip("-\n")
    options, lines = {}, text.split("\n")
    while lines and (option := _OPTION.fullmatch(lines[0].strip())) is not None:
        options[option[1]] = option[2]
        del lines[0]
    return options, "\n".join(lines)


def _directive(name: str, argument: str, segment: Segment, context: LessonContext) -> str:
    options, text = _options_of(segment.text)
    place = segment.place
    match name:
        case "math":
            tex = "\n".join(part for part in (argument, text) if part.strip())
            return displayed(tex, options.get("label", options.get("name", "")))
        case "figure" | "image":
            caption = "\n\n" + _inside(text, segment, context) if text.strip() else ""
            alt = options.get("alt", "")
            return rewrite(f"![{alt}]({argument.strip()})", context, place) + caption
        case "code" | "code-block" | "sourcecode":
            return fence(argument or "text", text)
        case "tableofcontents" | "toctree" | "contents":
            return ""  # the map says it
        case "epigraph" | "pull-quote" | "blockquote":
            return quoted(_inside(text, segment, context))
        case "div" | "container" | "card" | "grid" | "grid-item" | "tab-set" | "tab-item":
            return _inside(text, segment, context)
        case _ if name in _CALLOUTS:
            folded = "-" if "dropdown" in options.get("class", name) else ""
            title = argument if name in _TITLED else ""
            text = text if title else f"{argument}\n{text}"
            return _callout(name, title, text, segment, context, folded=folded)
        case _ if name in _languages():
            context.leave(place, f"a block of `{name}` is shown and not run")
            return fence(name, text)
        case _:
            what = f"the directive `{{{name}}}`, whose text is shown as it was written"
            context.leave(place, what)
            return fence("text", f"{argument}\n{text}".strip("\n"))


@functools.cache
def _languages() -> frozenset[str]:
    """Names of languages that are highlighted."""
    from pygments.lexers import get_all_lexers

    return frozenset(alias for _, aliases, _, _ in get_all_lexers() for alias in aliases)


def _fence(segment: Segment, context: LessonContext) -> str:
    head, text = segment.head, segment.text
    kind = head.partition(" ")[0]
    if kind == "lab" and context.camera_is_position:
        text = _CAMERA.sub(_directed, text)
    if kind not in (*CORE_FENCES, *fence_names()):
        head = head.strip("{}. ").partition(" ")[0].rstrip(",}")
        if head != "json" and _is_json(text):
            context.leave(segment.place, f"a block `{head}`, which is shown as JSON")
            head = "json"
    return fence(head, text)


def _is_json(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _directed(camera: re.Match[str]) -> str:
    """A camera by its direction: the other way round."""

    def turned(match: re.Match[str]) -> str:
        angle = float(match[3])
        return f"{match[1]}{angle % 360 - 180 if match[2] == 'azimuth' else -angle:g}"

    return _ANGLE.sub(turned, camera[0])
