"""Fences, divisions and callouts of other tools as Markdown of coursebuild."""

from __future__ import annotations

import contextlib
import json
import re
import textwrap

from msgspec.structs import replace

from coursebuild.api import marks, regex
from coursebuild.core.registry import fence_names, missing_package
from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.features.importer.absent_labs import write_absent_lab
from coursebuild.features.importer.cell_texts import code_for_readers, read_options
from coursebuild.features.importer.cells import write_cell, write_outputs
from coursebuild.features.importer.context import PROOF_LABELS, LessonContext, to_anchor
from coursebuild.features.importer.directives import (
    CALLOUTS,
    Directive,
    convert_directive,
    highlighted_languages,
)
from coursebuild.features.importer.jsx import without_jsx
from coursebuild.features.importer.other_cells import language_of, write_other_cell
from coursebuild.features.importer.prose import rewrite_prose
from coursebuild.features.importer.roles import fill_shortcodes
from coursebuild.features.importer.segments import change_prose, lower_titles, read_markdown
from coursebuild.features.importer.source_files import Segment, find_group
from coursebuild.features.lab.model import BUILT_IN_KINDS

_MAX_DEPTH = 20
"""Blocks that may be around another."""
_DIRECTIVE = regex(r"\{(?P<name>[A-Za-z][\w:.-]*)\}[ \t]*(?P<argument>.*)")
_TITLE = regex(
    r"\b(?:title|tab|filename|package|lst-cap|name)(?:=|:[ ])(?:\"((?:\\.|[^\"\\])*)\"|'([^']*)')"
)
_TAB = "tab", "a title in bold, and what it holds: pages show one tab below the other"
_CAMERA = regex(r'"camera"\s*:\s*\{(?:[^{}])*\}')
_ANGLE = regex(r'("(azimuth|elevation)"\s*:\s*)(-?\d+(?:\.\d+)?)')
_QUOTED_KIND = regex(
    r"^((?:[ \t]*>)+[ \t]*\[!)([\w-]+)(?:[ \t]*\|[^\]\n]*)?(\][-+]?)(?:[ ]+#+(?=[ ]))?",
    re.MULTILINE,
)


def convert_segment(segment: Segment, context: LessonContext) -> str:
    """Return a segment as Markdown; a cell becomes a part of the lesson's script."""
    margin = re.sub(r"\S", " ", segment.indent)  # a tab stays one
    new = textwrap.indent(_convert(segment, context), margin)
    return segment.indent + new.removeprefix(margin)


def _convert(segment: Segment, context: LessonContext) -> str:
    context, head, text = context.at(segment.place), segment.head, segment.text
    if segment.kind != "prose" and segment.mark[0] in "`~":
        text = fill_shortcodes(text, context)
        segment = replace(segment, text=text)

    def name_callouts(text: str) -> str:
        return _QUOTED_KIND.sub(lambda m: m[1] + _callout_kind(m[2], context) + m[3], text)

    if segment.kind == "prose":
        text = rewrite_prose(without_jsx(text, context) if context.is_mdx else text, context)
        return name_callouts(text)
    if form := re.search(r"\.content-(visible|hidden).*?(when|unless)-format=\W?(\w+)", head):
        is_visible = (form[1] == "visible") == (form[2] == "when")
        if is_visible != ("html" in form[3]):
            words = " ".join(text.split()).replace("`", "")
            context.leave("division", f"what is for other forms than a site: `{words}`")
            return ""
    if language := language_of(segment):
        return write_other_cell(segment, language, context)
    if segment.kind == "cell":
        return write_cell(segment, context)
    directive = _DIRECTIVE.fullmatch(segment.head)
    if directive is not None and not context.is_pandoc:
        new = _convert_directive(directive["name"], directive["argument"], text, context)
        return "\n\n".join((new, *write_outputs(segment, context)))
    match segment.mark[0]:
        case ":":
            return _convert_division(head, text, context)
        case ">":
            return name_callouts(marks.block_quote(_convert_nested(text, context)))
        case "=":
            return _write_tab(head, text, context)
        case "!" | "?":
            names, _, title = head.partition('"')
            name = (names.split() or ["details"])[0]
            is_folded = segment.mark == "???"
            title = title.rpartition('"')[0] or " ".join(names.split()[1:])
            title = "" if title in ("inline", "inline end", "end") else title
            return _write_callout(name, title, text, context, is_folded)
        case "/":
            name, _, title = (part.strip() for part in head.partition("|"))
            options = find_group(r"\A((?:[ ]{4}[\w-]+:.*(?:\n|\Z))+)", text)
            text, name = text[len(options) :], find_group(r" type:[ ]*(\S+)", options) or name
            if name == "tab":
                return _write_tab(title, text, context)
            if name in ("html", "define", "") or name.endswith("caption"):
                return _convert_nested(text, context)
            return _write_callout(name, title, text, context, name == "details")
        case _:
            return _convert_fence(head, text, context)


def _write_tabs(text: str, context: LessonContext) -> str:
    """Return a set of tabs of Quarto with their titles, which are headings, in bold."""
    context.change(*_TAB)
    first = find_group(r"(?m)^#{1,6}(?=[ \t])", text)
    pattern = rf"^{first or '#'}[ \t]+(.*?)[ \t]*(?:\{{[^{{}}]*\}})?$"
    return _convert_nested(text, context, re.compile(pattern, re.MULTILINE))


def _write_tab(title: str, text: str, context: LessonContext) -> str:
    context.change(*_TAB)
    return f"**{rewrite_prose(title, context).strip()}**\n\n{_convert_nested(text, context)}"


def _convert_division(head: str, text: str, context: LessonContext) -> str:
    """Convert what stands between colons: a callout of Quarto or Docusaurus, or a division."""
    callout = re.search(r"callout-(\w+)", head)
    plain = None if callout else _PLAIN_CALLOUT.fullmatch(head)
    label = re.search(rf"#({'|'.join(PROOF_LABELS)})-([\w-]+)", head)
    title = find_group(_TITLE, head)
    classes = re.findall(r"\.([\w-]+)", head)
    kind = PROOF_LABELS[label[1]] if label else ""
    kind = kind or next((name for name in classes if name in _PROOF_CLASSES), "")
    if callout is not None:
        kind = callout[1]
    elif plain is not None and plain[1].lower() in CALLOUTS:
        kind, title = plain[1].lower(), plain[2] or plain[3] or ""
    if kind:
        if not (title or plain):
            title, text = _take_heading(text)
        title += f" {{#{label[1]}:{to_anchor(label[2])}}}" if label else ""
        is_folded = kind == "details" or re.search(r"collapse=\"?true", head) is not None
        return _write_callout(kind, title, text, context, is_folded)
    if re.fullmatch(r"[A-Za-z_]\w*(?:\.\w+)+", head):
        context.leave("division", f"documentation that its tool makes from the code of `{head}`")
        return f"`{head}`"
    if "panel-tabset" in classes:
        return _write_tabs(text, context)
    context.change("division", "what it holds, without a frame")
    if figure := re.search(r"#fig-([\w-]+)", head):
        return f'<a id="fig-{to_anchor(figure[1])}"></a>\n\n{_convert_nested(text, context)}'
    return _convert_nested(text, context)


_PLAIN_CALLOUT = regex(r"([A-Za-z][\w-]*)(?:\[(.*)\]|[ \t]+(.*))?")
"""The head of a callout of Docusaurus."""
_PROOF_CLASSES = ("theorem", "lemma", "definition", "proof", "remark", "solution", "exercise")


def _take_heading(text: str) -> tuple[str, str]:
    """Return the heading that begins a text, and the text below it; no heading is empty."""
    heading = re.match(r"\s*#{1,6}[ \t]+(.*?)[ \t]*(?:\{#([\w-]+)\}[ \t]*)?(?:\n|\Z)", text)
    if heading is None:
        return "", text
    anchor = f'<a id="{to_anchor(heading[2])}"></a>\n' if heading[2] else ""
    return heading[1], anchor + text[heading.end() :]


def _convert_fence(head: str, text: str, context: LessonContext) -> str:
    kind = head.partition(" ")[0].strip("{}")
    if raw := re.fullmatch(r"\{?=(\w+)\}?", head):
        if raw[1] == "markdown":
            return _convert_nested(text, context)
        if raw[1] == "html":
            return rewrite_prose(text, context)
        context.leave("block that is raw", f"a block of raw {raw[1]}, shown as text")
        return marks.fence("text", text)
    if kind == "admonish":
        title = find_group(r"[\s=]\"([^\"]*)\"", head.replace('type="', ""))
        name = next(iter(re.findall(r"\b(?:type=[\"'])?([a-z]+)\b", head)[1:]), "note")
        is_folded = "collapsible=true" in head
        return _write_callout(name, title, text, context, is_folded)
    if listing := re.search(r"\bfile=((?!examples/)\S+)", head) if kind == "python" else None:
        context.change("listing of a file", "its name, and its code, not run")
        return f"**`{listing[1]}`**\n\n{marks.fence('python', text)}"
    if kind in ("lab", "quiz") and context.camera_is_position:
        text = _CAMERA.sub(_reverse_camera, text)
    if (
        kind == "lab"
        and (name := head.partition(" ")[2].split(" ")[0])
        and name not in BUILT_IN_KINDS
    ):
        return write_absent_lab(name, text, context)
    if package := missing_package(kind):
        message = f"a block of `{kind}` is shown as text: install {package}, and name it so"
        context.leave(f"block of `{kind}`", message)
    if kind in ("mjcf", *fence_names()) or (kind == "python" and "file=" in head):
        context.files.account.taken[f"block of `{kind}`"] += 1
        return marks.fence(head, text)
    classes = re.search(r"(?:^|\s)\.([\w+-]+)", head.strip("{} "))
    language = classes[1] if classes else re.split(r"[\s,{}]", head.strip("{}. "), maxsplit=1)[0]
    language = "" if re.search("[=#]", language) and language.lower() != "c#" else language
    if language not in highlighted_languages() and language.lower() in highlighted_languages():
        language = language.lower()
    if language in ("python", "py", "python3") and re.match(r"\s*>>> ", text):
        language = "pycon"
    with contextlib.suppress(ValueError, RecursionError):
        if language != "json" and isinstance(json.loads(text), dict):
            message = f"a block `{language}`, which is shown as JSON"
            context.leave(f"block of `{language}`", message)
            language = "json"
    if re.match(r"\{\w", head) and (options := read_options(text)[0]):
        text = code_for_readers(text)
        caption = options.get("fig-cap") or options.get("lst-cap") or ""
        head += f' title="{caption}"' if caption else ""
    signs, title = r"(\$[^$]+\$)|([][_*`{}<])", find_group(_TITLE, head)
    words = re.sub(signs, lambda sign: sign[1] or f"\\{sign[2]}", re.sub(r"\\(.)", r"\1", title))
    if kind in ("output", "text") or package:  # of a block that is not run here
        language = "text illustration" if "illustration" in head else "text"
    kind = f"block of `{language}`" if language else "block without a kind"
    listing = re.search(r"#lst-([\w-]+)", head)
    label = f" {{#lst:{to_anchor(listing[1])}}}" if listing else ""
    new = marks.fence(f"{language or 'text' * bool(label)}{label}", text)
    context.files.account.convert(kind, "without what its tool adds", head, lambda: language)
    return (f"**{words}**\n\n" if words else "") + new


def _convert_nested(text: str, context: LessonContext, title: re.Pattern[str] | None = None) -> str:
    """Return what a block holds; `title` is a heading in it that is a paragraph in bold."""
    if context.depth == _MAX_DEPTH:
        message = f"blocks that nest more than {_MAX_DEPTH} deep, shown as written"
        context.leave("block in blocks", message)
        return marks.fence("text", text)
    context = replace(context, depth=context.depth + 1)

    def lower(prose: str) -> str:
        return lower_titles(title.sub(r"\n**\1**\n", prose) if title else prose)

    parts = change_prose(read_markdown(text, place=context.place), lower)
    texts = (convert_segment(part, context).strip("\n") for part in parts)
    return "\n\n".join(text for text in texts if text.strip())


def _callout_kind(kind: str, context: LessonContext) -> str:
    callout_kind = CALLOUTS.get(kind.lower())
    if callout_kind is None:
        callout_kind = slug_of(kind).lstrip("0123456789-") or "note"
        if callout_kind not in CALLOUTS:
            label = kind if kind.isprintable() else callout_kind
            context.callouts[callout_kind] = label.replace("-", " ").capitalize()
    return callout_kind


def _write_callout(
    kind: str, title: str, text: str, context: LessonContext, is_folded: bool = False
) -> str:
    title, brace, label = title.partition("{#")
    title = " ".join(f"{rewrite_prose(title, context)} {brace}{label}".split())
    head = f"[!{_callout_kind(kind, context)}]{'-' * is_folded} {title}".rstrip()
    context.change("callout", "a quotation that begins with its kind")
    return marks.block_quote(f"{head}\n{_convert_nested(text, context)}".rstrip("\n"))


def _convert_directive(name: str, argument: str, text: str, context: LessonContext) -> str:
    options, body = read_options(text) if text.lstrip()[:1] in (":", "-") else ({}, text)
    directive = Directive(
        name.lower(),
        argument,
        options,
        body,
        nested=lambda text: _convert_nested(text, context),
        callout=lambda kind, title, text, is_folded: _write_callout(
            kind, title, text, context, is_folded
        ),
    )
    return context.files.account.convert(
        f"directive `{{{name}}}`",
        "Markdown",
        f"{{{name}}} {argument}\n{text}",
        lambda: convert_directive(directive, context),
    )


def _reverse_camera(camera: re.Match[str]) -> str:
    """Turn a camera given by its position into one given by the direction it looks in."""

    def reverse_angle(match: re.Match[str]) -> str:
        angle = float(match[3])
        return f"{match[1]}{angle % 360 - 180 if match[2] == 'azimuth' else -angle:g}"

    return _ANGLE.sub(reverse_angle, camera[0])
