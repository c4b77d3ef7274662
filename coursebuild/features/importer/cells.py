"""Cells of Python, which share their names, as one script of a lesson.

Entry points: `runnable_code` of a cell, `join_cells`, `join_outputs`, `code_for_readers`.

Scripts of coursebuild are complete. So all cells of a lesson become one script, which stands where
the last of them stood; the ones before are shown where they stood, as parts of it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.values import Segment

_OPTION = re.compile(r"^(?:#\|[ \t]*([\w-]+):|:([\w-]+):)[ \t]*(.*)\n?", re.MULTILINE)
"""An option of a cell, as Quarto and as MyST write it."""
_DEFINITION = re.compile(r"(?:@|(?:async )?def |class )")
_TIMING = re.compile(r"%%(?:time|timeit|capture|prun)\b.*")
_WINDOW = re.compile(r"^plt\.show\(\)[ \t]*\n?", re.MULTILINE)
"""What opens a window where there is none."""
_FIGURE = re.compile(r"\b(?:plt|ax|axs|axes)\.(?!close|switch_backend)[a-z]\w*\(")
_ESCAPE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]|[\x00-\x08\x0b-\x1f\x7f]")
"""What colours text or moves the cursor in a terminal."""
_MAGIC = re.compile(r"^[ \t]*(?:[%!?]|\w+\?{1,2}[ \t]*$).*$", re.MULTILINE)


def join_cells(codes: Iterable[str], title: str) -> str:
    """Return the script of a lesson with this title, from the code of its cells."""
    summary = re.sub(r'[\\"]', "", title).strip().rstrip(".") or "The cells of this lesson"
    script = f'"""{summary}."""\n'
    before = ""
    for code in codes:
        ends_indented = before.split("\n")[-1].startswith((" ", "\t"))
        is_apart = ends_indented or _DEFINITION.match(code)
        script += ("\n\n" if before and is_apart else "\n") + code + "\n"
        before = code
    return script


def join_outputs(codes: Iterable[tuple[Segment, str]]) -> str:
    """Return what is recorded of the cells whose code the script has: what it should print."""
    output = ""
    for cell, code in codes:
        prints_value = code.count("print(") > cell.text.count("print(")
        for text in (cell.printed, cell.value if prints_value else ""):
            output += text and text.removesuffix("\n") + "\n"
    return _ESCAPE.sub("", output).strip("\n")


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
        text = _WINDOW.sub("", text)
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        context.add_leftover(f"a cell that is no Python is shown and not run: {error}")
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
        if _shows_itself(last.value):
            return text
        if not cell.shows_value:
            name = ast.unparse(last.value.func)
            context.add_leftover(f"the value of `{name}(…)` is shown there if it has one")
            return text
    lines = text.split("\n")
    before = "\n".join(lines[: last.lineno - 1])
    lead = lines[last.lineno - 1].encode()[: last.col_offset].decode()
    return f"{before}\n{lead}print({ast.get_source_segment(text, last.value)})"


def _shows_itself(call: ast.Call) -> bool:
    """Whether a call draws or prints, so that its value is of no interest."""
    root: ast.expr = call.func
    while isinstance(root, ast.Attribute | ast.Call):
        root = root.func if isinstance(root, ast.Call) else root.value
    name = root.id if isinstance(root, ast.Name) else ""
    return name in ("print", "plt", "ax", "axs", "axes", "fig", "display")
