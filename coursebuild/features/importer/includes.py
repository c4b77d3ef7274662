"""Texts and lines of other files that a text includes, put where it does so.

mdBook writes `{{#include FILE:LINES}}` or `{{#include FILE:ANCHOR}}`, MkDocs `--8<-- "FILE:LINES"`
or `--8<-- "FILE:SECTION"` or `{!FILE!}` or, as code, `{* FILE *}`,
Quarto `{{< include FILE >}}`, MyST a directive with options.
"""

from __future__ import annotations

import ast
import contextlib
import posixpath
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from coursebuild.api import regex
from coursebuild.features.importer.source_files import TEXTS, TOO_MUCH, SourceFiles, find_group

_MAX_DEPTH = 10
"""Files that may include each other in a row."""
_MOST_LINES = 100_000
"""After so many lines of a file no more of it are chosen: some could be chosen again and again."""
_MARK = regex(
    r"\{%-?[ ]*raw[ ]*-?%\}\n?(?P<raw>.*?)\{%-?[ ]*endraw[ ]*-?%\}"
    r"|(?P<escape>\\)?\{\{[ ]*#(?P<command>include|rustdoc_include|playground|title)[ ]+"
    r"(?P<mdbook>[^{}\s][^{}]*?)[ ]*\}\}"
    r"|\{\{<[ ]*include[ ]+(?P<quarto>\S+)[ ]*>\}\}"
    r"|\{%-?\s*include(?:-markdown)?\s+[\"'](?P<markdown>[^\"'\n]+)[\"'][^%]*%\}"
    r"|^\{\*[ ]*(?P<listing>[^\s{}]+)[^{}\n]*\*\}[ \t]*$"
    r"|\{!>?[ \t]*(?P<inclusion>[^{}!\s]+)[^{}!\n]*!\}"
    r"|^(?P<indent>[ \t]*)-{1,}8<-{1,}[ \t]+[\"'](?P<mkdocs>[^\"'\n]+)[\"'][ \t]*$",
    re.MULTILINE | re.DOTALL,
)
_FENCE = regex(r"^[ \t>]*(?:`{3,}|~{3,})", re.MULTILINE)
_ANCHOR = r"^.*?ANCHOR(?P<end>_END)?:[ \t]*(?P<name>[\w-]+).*\n?"
_SECTION = (
    r"^.*?-{1,}8<-{1,}[ \t]*\[[ \t]*(?P<end>end|start)[ \t]*:[ \t]*(?P<name>[\w-]+)[ \t]*\].*\n?"
)


_IMPORT = regex(
    r"^import[ ]+(?P<name>\w+)[ ]+from[ ]+"
    r"['\"](?P<file>!!raw-loader![^'\"\n]+|[^'\"\n]+\.(?:mdx?|png|svg|jpe?g|gif|webp))"
    r"['\"];?[ \t]*(?:\n|\Z)",
    re.MULTILINE,
)
"""What MDX imports from a text or a picture, or as the text of any file."""


def _place_imports(text: str) -> str:
    """Return a text of MDX that names texts and pictures where it uses what it imports."""
    for name, address in _IMPORT.findall(text):
        file = re.sub(r"\\(.)", r"\1", address)
        if file.startswith("!!"):
            block = rf"^[ \t]*<CodeBlock\b([^<>]*)>[ \t\n]*\{{{name}\}}[ \t\n]*</CodeBlock>[ \t]*$"
            for code in re.finditer(block, text, re.MULTILINE):
                language = find_group(r"language=[\"']([\w+-]+)", code[1])
                title = find_group(r"title=\"[^\"]*\"", code[1])
                head = f"{language or 'text'} {title}".rstrip()
                inclusion = f"{{!{file.rpartition('!')[2]}!}}"
                text = text.replace(code[0], f"```{head}\n{inclusion}\n```")
        elif file.endswith((".md", ".mdx")):
            inclusion = f"{{!{file}!}}"
            text = re.sub(rf"<{name}\b[^<>]*(?:/>|>[ \t]*</{name}>)", inclusion, text)
        else:
            text = text.replace(f"{{{name}}}", f'"{file}"')
    return _IMPORT.sub("", text)


def expand_includes(
    text: str, path: str, files: SourceFiles, depth: int = 0, *, lesson: str = ""
) -> str:
    """Return the text of a file with what it includes; what is not in the folder is left.

    `lesson` is the file that includes this one, where another does.
    """

    def expand(mark: re.Match[str]) -> str:
        if mark["escape"]:
            return mark[0][1:]
        if mark["raw"]:
            return mark["raw"]
        if mark["command"] == "title":
            files.account.change("title of the page", "the map has it", mark["mdbook"])
            return ""
        name = mark["mdbook"] or mark["quarto"] or mark["mkdocs"] or mark["inclusion"]
        name = name or mark["markdown"] or mark["listing"]
        line = f"line {text.count(chr(10), 0, mark.start()) + 1}"
        file, _, part = name.strip().partition(" ")[0].partition(":")
        target = _find(file, path, files)
        part_text, problem = None, "which is not in the folder: its name stands in its place"
        if target and depth < _MAX_DEPTH:
            part_text = _part_of(files.read_text(target), part, by_lines=True)
            problem = "the file has no such part"
        if part_text is not None and not files.may_include(part_text, lesson or path):
            part_text, problem = None, TOO_MUCH
        if part_text is None:
            files.leave(path, f"`{name}`: {problem}", "file that is included", line)
            if mark["mkdocs"] and not re.search(r"check_paths\W+true", files.mkdocs):
                return ""  # as there
            before = text[: mark.start()]
            is_in_code = (
                len(_FENCE.findall(before)) % 2 or before.rpartition("\n")[2].count("`") % 2
            )
            return mark[0] if is_in_code else f"`{name}`"
        files.change("file that is included", "its lines stand in the text")
        expanded = expand_includes(part_text, target, files, depth + 1, lesson=lesson or path)
        included = expanded.strip("\n")
        if mark["listing"] or mark["command"] == "playground":
            language = "rust" if mark["command"] else target.rpartition(".")[2]
            return f"```{language}\n{included}\n```"
        indent = mark["indent"] or re.split(r"[^ \t]|\n", text[: mark.start()])[-1]
        return (mark["indent"] or "") + included.replace("\n", f"\n{indent}")

    return _MARK.sub(expand, _SNIPPETS.sub(_name_each, _place_imports(text)))


_SNIPPETS = regex(
    r"^(?P<mark>[ \t]*-{1,}8<-{1,})[ \t]*\n(?P<names>(?:(?![ \t]*-+8<)[^\n]*\n)*)(?P=mark)[ \t]*$",
    re.MULTILINE,
)
"""Files that MkDocs includes one below the other: a name a line, none behind a semicolon."""


def _name_each(block: re.Match[str]) -> str:
    names = (line.strip() for line in block["names"].splitlines())
    return "\n".join(f'{block["mark"]} "{n}"' if n and n[0] != ";" else "" for n in names)


_DEFINITION = regex(
    r"^(?:\*(?P<short>)|[ ]{0,3})\[(?P<label>[^\[\]\n]+)\]:.*(?:\n|\Z)(?:[ \t]+\S.*(?:\n|\Z))*",
    re.MULTILINE,
)


def append_texts(text: str, path: str, files: SourceFiles) -> str:
    """Return a text with those that MkDocs appends to each, but for what these define unused."""
    names = (n for n in files.mkdocs_values("auto_append") if n.strip() and "\n" not in n)
    marks = (f'--8<-- "{name}"\n\n' for name in names if _find(name, path, files) != path)
    appended = expand_includes("".join(marks), path, files)
    folded = text.casefold()

    def keep(definition: re.Match[str]) -> str:
        name = definition["label"].casefold()
        return (
            definition[0] if (name if definition[1] is not None else f"[{name}]") in folded else ""
        )

    if "```" not in appended:  # in code, what looks like a definition is none
        appended = _DEFINITION.sub(keep, appended)
    return f"{text}\n\n{appended}" if appended else text


def _find(name: str, path: str, files: SourceFiles) -> str:
    """Return the path of a file that a text names, from its own folder or another that may be."""
    folders = files.mkdocs_values("base_path", "include_dir")
    for folder in (*map(str, PurePosixPath(path).parents), *folders):
        path = posixpath.normpath(posixpath.join(folder, name.lstrip("/")))
        if place := files.find(path, is_hidden=path.endswith((*TEXTS, ".txt"))):
            return place
    return ""


def _part_of(text: str, part: str, *, by_lines: bool) -> str | None:
    """Return lines `2:5`, `:5`, `2:` or `2` of a text, or those of an anchor; else all of them.

    Marks of anchors are left out. `None`: there is no such anchor.
    """
    text = text if text.endswith("\n") else f"{text}\n"
    lines = text.splitlines(keepends=True)
    if by_lines and part and (numbers := _read_range(part, ":", lines)) is not None:
        text, part = "".join(lines[numbers.start : numbers.stop]), ""
    if not part:
        return re.sub(_SECTION, "", re.sub(_ANCHOR, "", text, flags=re.M), flags=re.M)
    for pattern in (_ANCHOR, _SECTION):
        marks = [m for m in re.finditer(pattern, text, re.MULTILINE) if m["name"] == part]
        if marks:
            end = marks[1].start() if len(marks) > 1 else len(text)
            return _part_of(text[marks[0].end() : end], "", by_lines=False)
    return None


def _read_range(words: str, mark: str, lines: Sequence[str]) -> range | None:
    """Return the indices of the lines that numbers with a mark between them choose."""
    bounds = re.fullmatch(rf"\s*(\d*)\s*({mark}?)\s*(\d*)\s*", words)
    if bounds is None:
        return None
    first = int(bounds[1] or 1)
    last = int(bounds[3]) if bounds[3] else len(lines) if bounds[2] else first
    return range(first - 1, min(last, len(lines)))


def lines_of(text: str, options: Mapping[str, str]) -> str:
    """Return the lines of a text that the options of a directive of Sphinx choose."""
    lines = text.splitlines()
    if name := options.get("pyobject"):
        with contextlib.suppress(SyntaxError, ValueError):
            for node in ast.walk(ast.parse(text, "")):
                if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
                    lines = lines[node.lineno - 1 : node.end_lineno]
                    break
    first, last = (options.get(f"{end}-line", "") for end in ("start", "end"))
    if re.fullmatch(r"-?\d*,-?\d*", f"{first},{last}"):
        lines = lines[int(first or 0) : int(last) if last else None]
    for option in ("start-after", "start-at", "end-before", "end-at"):
        words = options.get(option)
        at = next((n for n, line in enumerate(lines) if words and words in line), None)
        if at is None:
            continue
        at += option in ("start-after", "end-at")
        lines = lines[at:] if option.startswith("start") else lines[:at]
    if selection := options.get("lines", ""):
        numbers = list[int]()
        for part in selection.split(","):
            if (indices := _read_range(part, "-", lines)) and len(numbers) < _MOST_LINES:
                numbers += indices
        lines = [lines[number] for number in numbers]
    text = "\n".join(lines)
    return textwrap.dedent(text) if "dedent" in options else text


def without_hidden_lines(text: str, marks: Mapping[str, str]) -> str:
    """Return a text without the lines of code that readers do not see, by what begins these."""

    def show(block: re.Match[str]) -> str:
        mark = block["own"] or marks.get(block["language"])
        if not mark:
            return block[0]
        is_rust = block["language"] == "rust"  # there an attribute begins with `#`, too
        line = rf"^[ \t]*{re.escape(mark)}{'(?:[ ].*)?' if is_rust else '.*'}\n"
        body = re.sub(line, "", block["body"], flags=re.MULTILINE)
        if is_rust:
            body = re.sub(r"^([ \t]*)##", r"\1#", body, flags=re.MULTILINE)
        return block["head"] + body + block["end"]

    return _CODE.sub(show, text) if marks else text


_CODE = regex(
    r"^(?P<head>(?P<mark>[ \t]*`{3,})(?P<language>\w+)\b"
    r"(?:[^\n]*\bhidelines=(?P<own>[^\s,]+))?[^\n]*\n)(?P<body>.*?)(?P<end>^(?P=mark)[ \t]*$)",
    re.MULTILINE | re.DOTALL,
)
