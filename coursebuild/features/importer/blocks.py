"""Fences, directives and callouts of other tools as Markdown of coursebuild.

The cells of a lesson, which share their names, become the parts of one script.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import json
import re
import textwrap
import warnings
from collections.abc import Mapping

from msgspec.structs import replace

from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.pages.marks import block_quote, fence
from coursebuild.core.registry import fence_names, missing_package
from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.features.importer.jsx import without_jsx
from coursebuild.features.importer.prose import (
    LessonContext,
    display_formula,
    rewrite_prose,
    to_anchor,
)
from coursebuild.features.importer.segments import lower_titles, read_markdown
from coursebuild.features.importer.source_files import Segment, read_yaml

_OPTION = re.compile(r"^(?:#\|[ \t]*([\w-]+):|:([\w-]+):)[ \t]*(.*)\n?", re.MULTILINE)
"""An option of a cell, as Quarto and as MyST write it."""
_TIMING = re.compile(r"%%(?:time|timeit|capture|prun)\b.*")
_WINDOW = re.compile(r"^([ \t]*)plt\.show\(\)[ \t;]*$", re.MULTILINE)
"""What opens a window where there is none."""
_FIGURE = re.compile(r"\b(?:plt|ax|axs|axes)\.(?!close|switch_backend)[a-z]\w*\(")
_ESCAPE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]|[\x00-\x08\x0b-\x1f\x7f]")
"""What colours text or moves the cursor in a terminal."""
_MAGIC = re.compile(r"^[ \t]*(?:[%!?]|\w+\?{1,2}[ \t]*$).*$", re.MULTILINE)


def recorded_output(cell: Segment, code: str) -> str:
    """Return what is recorded of a cell which the script has as `code`: what it should print."""
    output = ""
    prints_value = code.count("print(") > cell.text.count("print(")
    for text in (cell.printed, cell.value if prints_value else ""):
        output += text and text.removesuffix("\n") + "\n"
    return _ESCAPE.sub("", output).strip("\n")


def how_shown(cell: Segment) -> str:
    """Return the word for a cell whose code its tool folds or hides, after a blank."""
    options = {quarto or myst: value.strip() for quarto, myst, value in _OPTION.findall(cell.text)}
    tags = cell.head + options.get("tags", "")
    if "remove-input" in tags or options.get("echo") == "false":
        return " hidden"
    return " folded" if "hide-input" in tags or options.get("code-fold") == "true" else ""


def code_for_readers(cell: Segment) -> str:
    """Return a cell's code without the lines that only its tool understands."""
    return _MAGIC.sub("", _OPTION.sub("", cell.text)).strip("\n")


def runnable_code(cell: Segment, context: LessonContext) -> str:
    """Return what the script runs of a cell; empty where that is nothing."""
    context = context.at(cell.place)
    options = {quarto or myst: value.strip() for quarto, myst, value in _OPTION.findall(cell.text)}
    text = _OPTION.sub("", cell.text)
    if "raises-exception" in cell.head + options.get("tags", ""):
        context.add_leftover("a cell that is meant to fail is shown, not run")
        return ""
    if options.get("eval") == "false":
        return ""
    first, _, rest = text.lstrip("\n").partition("\n")
    if _TIMING.fullmatch(first):
        text = rest
        context.add_leftover(f"`{first}`, which is for Jupyter alone")
    elif first.startswith("%%"):
        context.add_leftover(f"a cell of `{first.split()[0]}` is shown and not run")
        return ""
    for magic in _MAGIC.findall(text):
        context.add_leftover(f"`{magic.strip()}`, which is for Jupyter alone")
    text = _MAGIC.sub("", text)
    if _FIGURE.search(text):
        context.add_leftover("a figure: save it by `plt.savefig`, and name it by `figure=`")
        text = _WINDOW.sub(lambda window: window[1] and f"{window[1]}pass", text)
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(text, "cell", "exec", dont_inherit=True)  # `await` outside functions too
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        context.add_leftover(f"a cell that is not Python is shown and not run: {error}")
        return ""
    if cell.shows_value is not False:
        text = _print_last_value(cell, text, tree, context)
    return text.strip()


def _print_last_value(cell: Segment, text: str, tree: ast.Module, context: LessonContext) -> str:
    """Return the code with its last expression printed, since Jupyter shows its value."""
    last = tree.body[-1] if tree.body else None
    if not isinstance(last, ast.Expr) or text.rstrip().endswith(";"):
        return text
    if isinstance(last.value, ast.Call):
        root: ast.expr = last.value.func
        while isinstance(root, ast.Attribute | ast.Call):
            root = root.func if isinstance(root, ast.Call) else root.value
        drawing_names = ("print", "plt", "ax", "axs", "axes", "fig", "display")
        if isinstance(root, ast.Name) and root.id in drawing_names:
            return text
        if not cell.shows_value:
            name = ast.unparse(last.value.func)
            context.add_leftover(f"the value of `{name}(…)` is shown there if it has one")
            return text
    lines = text.split("\n")
    before = "\n".join(lines[: last.lineno - 1])
    lead = lines[last.lineno - 1].encode()[: last.col_offset].decode()
    return f"{before}\n{lead}print({ast.get_source_segment(text, last.value)})"


_CALLOUTS = {
    **{name: name for name in CALLOUTS},
    **dict.fromkeys(("hint",), "tip"),
    **dict.fromkeys(("attention", "failure", "bug"), "caution"),
    **dict.fromkeys(("danger", "error"), "warning"),
    **dict.fromkeys(("seealso", "info", "abstract", "summary", "quote", "topic"), "note"),
    **dict.fromkeys(("admonition", "margin", "sidebar", "dropdown", "example"), "note"),
    **dict.fromkeys(("exercise", "question"), "try"),
    **dict.fromkeys(("answer", "success"), "solution"),
}
_MAX_DEPTH = 20
"""Blocks that may be around another."""
_TITLED_DIRECTIVES = ("admonition", "dropdown", "sidebar", "topic", "exercise", "example", "margin")
"""Directives whose argument is a title; that of others is their first line."""
_DIRECTIVE = re.compile(r"\{(?P<name>[A-Za-z][\w:.-]*)\}[ \t]*(?P<argument>.*)")
_TITLE = re.compile(r"\b(?:title|tab|filename)=(?:\"([^\"]*)\"|'([^']*)')")
_MYST_OPTION = re.compile(r":([\w-]+):[ \t]*(.*)")
_CAMERA = re.compile(r'"camera"\s*:\s*\{(?:[^{}])*\}')
_ANGLE = re.compile(r'("(azimuth|elevation)"\s*:\s*)(-?\d+(?:\.\d+)?)')
_QUOTED_KIND = re.compile(r"^((?: {0,3}>)+[ \t]*\[!)([\w-]+)(\])", re.MULTILINE)


def convert_segment(segment: Segment, context: LessonContext) -> str:
    """Return a segment outside cells, or a cell within another block, as Markdown."""
    return textwrap.indent(_convert(segment, context), segment.indent)


def _convert(segment: Segment, context: LessonContext) -> str:
    context, head, text = context.at(segment.place), segment.head, segment.text
    if segment.kind == "prose":
        text = rewrite_prose(without_jsx(text, context) if context.is_mdx else text, context)
        return _QUOTED_KIND.sub(lambda m: m[1] + _callout_kind(m[2], context) + m[3], text)
    if segment.kind == "cell":
        context.add_leftover("a cell inside another block is shown and not run")
        return fence("python", code_for_readers(segment))
    directive = _DIRECTIVE.fullmatch(segment.head)
    if directive is not None:
        return _convert_directive(directive["name"], directive["argument"], segment.text, context)
    match segment.mark[0]:
        case ":":
            # a callout of Quarto, or a plain division
            callout = re.search(r"callout-(\w+)", segment.head)
            if callout is None:
                return _convert_nested(text, context)
            attribute = _TITLE.search(segment.head)
            title = (attribute[1] or attribute[2] or "") if attribute else ""
            heading = re.match(r"\s*#{1,6}[ \t]+(.*)\n?", text)
            if not title and heading is not None:
                title, text = heading[1].strip(), text[heading.end() :]
            fold_mark = "-" if re.search(r"collapse=\"?true", segment.head) else ""
            return _write_callout(callout[1], title, text, context, fold_mark=fold_mark)
        case ">":
            quotation = block_quote(_convert_nested(text, context))
            return _QUOTED_KIND.sub(lambda m: m[1] + _callout_kind(m[2], context) + m[3], quotation)
        case "=":
            return f"**{rewrite_prose(head, context)}**\n\n{_convert_nested(text, context)}"
        case "!" | "?":
            name, _, title = segment.head.partition(" ")
            return _write_callout(name, title.strip().strip('"'), segment.text, context)
        case _:
            kind = head.partition(" ")[0]
            if raw := re.fullmatch(r"\{?=(\w+)\}?", head):
                if raw[1] == "markdown":
                    return _convert_nested(text, context)
                return text if raw[1] == "html" else fence("text", text)
            if kind == "lab" and context.camera_is_position:
                text = _CAMERA.sub(_reverse_camera, text)
            if package := missing_package(kind):
                message = f"a block of `{kind}` is shown as text: install {package}, and name it so"
                context.add_leftover(message)
            if kind in ("output", "text") or package:  # of a block that is not run here
                head = "text illustration" if "illustration" in head else "text"
            elif kind in ("mjcf", *fence_names()) or (kind == "python" and "file=" in head):
                return fence(head, text)
            else:
                head = head.strip("{}. ").partition(" ")[0].rstrip(",}")
                with contextlib.suppress(ValueError, RecursionError):
                    if head != "json" and isinstance(json.loads(text), dict):
                        context.add_leftover(f"a block `{head}`, which is shown as JSON")
                        head = "json"
            title = _TITLE.search(segment.head)
            words = re.sub(r"(?<!\\)[_*`]", r"\\\g<0>", title[1] or title[2] or "") if title else ""
            return (f"**{words}**\n\n" if words else "") + fence(head, text)


def _convert_nested(text: str, context: LessonContext) -> str:
    if context.depth == _MAX_DEPTH:
        context.add_leftover(f"blocks that nest more than {_MAX_DEPTH} deep, shown as written")
        return fence("text", text)
    context = replace(context, depth=context.depth + 1)
    parts = (
        replace(part, text=lower_titles(part.text)) if part.kind == "prose" else part
        for part in read_markdown(text, place=context.place)
    )
    texts = (convert_segment(part, context).strip("\n") for part in parts)
    return "\n\n".join(text for text in texts if text.strip())


def _callout_kind(kind: str, context: LessonContext) -> str:
    callout_kind = _CALLOUTS.get(kind.lower())
    if callout_kind is None:
        callout_kind = slug_of(kind).lstrip("0123456789-") or "note"
        if callout_kind not in _CALLOUTS:
            label = kind if kind.isprintable() else callout_kind
            context.callouts[callout_kind] = label.replace("-", " ").capitalize()
    return callout_kind


def _write_callout(
    kind: str, title: str, text: str, context: LessonContext, *, fold_mark: str = ""
) -> str:
    title = rewrite_prose(title, context)
    head = f"[!{_callout_kind(kind, context)}]{fold_mark} {title}".rstrip()
    return block_quote(f"{head}\n{_convert_nested(text, context)}".rstrip("\n"))


def _split_options(text: str) -> tuple[Mapping[str, str], str]:
    """Return the options that begin a directive (`:name: value`, or YAML), and its other lines."""
    if text.startswith("---\n") and "\n---" in text[4:]:
        head, _, rest = text[4:].partition("\n---")
        value = read_yaml(head)
        options = value if isinstance(value, dict) else {}
        return {str(name): str(option) for name, option in options.items()}, rest.lstrip("-\n")
    options, lines = {}, text.split("\n")
    while lines and (option := _MYST_OPTION.fullmatch(lines[0].strip())) is not None:
        options[option[1]] = option[2]
        del lines[0]
    return options, "\n".join(lines)


def _convert_directive(name: str, argument: str, text: str, context: LessonContext) -> str:
    options, text = _split_options(text)
    label = options.get("name") or options.get("label")
    if label and name != "math":
        options = {key: value for key, value in options.items() if value != label}
        block = _write_directive(name, argument, options, text, context)
        return f'<a id="{to_anchor(label)}"></a>\n\n{block}'
    return _write_directive(name, argument, options, text, context)


def _write_directive(
    name: str, argument: str, options: Mapping[str, str], text: str, context: LessonContext
) -> str:
    match name:
        case "math":
            tex = "\n".join(part for part in (argument, text) if part.strip())
            return display_formula(tex, options.get("label", options.get("name", "")))
        case "figure" | "image":
            caption = "\n\n" + _convert_nested(text, context) if text.strip() else ""
            alt = options.get("alt", "")
            if not argument.strip():  # what it shows is in it
                return caption
            return rewrite_prose(f"![{alt}]({argument.strip()})", context) + caption
        case "code" | "code-block" | "sourcecode":
            return fence(argument or "text", text)
        case "tableofcontents" | "toctree" | "contents":
            return ""  # the map says it
        case "epigraph" | "pull-quote" | "blockquote":
            return block_quote(_convert_nested(text, context))
        case "div" | "container" | "card" | "grid" | "grid-item" | "tab-set" | "tab-item":
            return _convert_nested(text, context)
        case _ if name in _CALLOUTS:
            fold_mark = "-" if "dropdown" in options.get("class", name) else ""
            title = argument if name in _TITLED_DIRECTIVES else ""
            text = text if title else f"{argument}\n{text}"
            return _write_callout(name, title, text, context, fold_mark=fold_mark)
        case _ if name in _highlighted_languages():
            context.add_leftover(f"a block of `{name}` is shown and not run")
            return fence(name, text)
        case _:
            message = f"the directive `{{{name}}}`, whose text is shown as it was written"
            context.add_leftover(message)
            return fence("text", f"{argument}\n{text}".strip("\n"))


@functools.cache
def _highlighted_languages() -> frozenset[str]:
    from pygments.lexers import get_all_lexers

    return frozenset(alias for _, aliases, _, _ in get_all_lexers() for alias in aliases)


def _reverse_camera(camera: re.Match[str]) -> str:
    """Turn a camera given by its position into one given by the direction it looks in."""

    def reverse_angle(match: re.Match[str]) -> str:
        angle = float(match[3])
        return f"{match[1]}{angle % 360 - 180 if match[2] == 'azimuth' else -angle:g}"

    return _ANGLE.sub(reverse_angle, camera[0])
