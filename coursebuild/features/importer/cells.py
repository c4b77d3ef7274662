"""Cells of code: those of a lesson share their names, and become the parts of one script."""

from __future__ import annotations

import ast
import posixpath
import re
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence

from msgspec.structs import replace

from coursebuild.api import marks, regex
from coursebuild.core.scripts.figures import prepare_figure
from coursebuild.features.importer.anchors import figure_of
from coursebuild.features.importer.cell_texts import (
    COMMENT,
    MAGIC,
    code_for_readers,
    drop_magics,
    read_options,
)
from coursebuild.features.importer.context import LessonContext, to_anchor
from coursebuild.features.importer.prose import rewrite_prose
from coursebuild.features.importer.source_files import Segment, find_group

_TIMING = regex(r"%%(?:time|timeit|capture|prun)\b.*")
_TIMES = regex(r"^(?:CPU times|Wall time|.* per loop \(mean)\b.*\n?", re.MULTILINE)
"""What it prints."""
_WINDOW = regex(
    r"^([ \t]*)(?:display\()?(?:plt|(?:\w+\.)?pyplot)\.show\([^()\n]*\)+[ \t;]*$", re.MULTILINE
)
"""What opens a window where there is none."""
_DISPLAY = regex(r"^([ \t]*)display\(", re.MULTILINE)
"""What Jupyter shows without an import."""
_ESCAPE = regex(r"\x1b\[[0-9;?]*[A-Za-z]|[\x00-\x08\x0b-\x1f\x7f]")
"""What colours text or moves the cursor in a terminal."""


def write_cell(cell: Segment, context: LessonContext) -> str:
    """Return a cell as a part of the lesson's script, with what it prints and draws; or as code."""
    context = context.at(cell.place)
    if re.search(r"\bHTML\([\"']+\s*<style|^\s*%%(?:javascript|js|css)\b|<style", cell.text):
        context.leave("cell", "a cell that changes the look of its page, which the site has itself")
        return ""
    for kind in cell.lost:
        context.leave("output of a cell", f"an output of the kind `{kind}`, which is not recorded")
    code = runnable_code(cell, context)
    if not code:
        magic = re.match(r"\s*%%(\w+).*\n", cell.text)
        shown_code, language = code_for_readers(cell.text), "python"
        if magic is not None:
            shown_code = cell.text[magic.end() :].strip("\n")
            if magic[1] == "writefile":
                shown_code = f"# {magic[0].split()[-1]}\n{shown_code}"
            language = re.sub("writefile|script", "text", magic[1].lower())
        if language == "html":
            return rewrite_prose(shown_code, context)
        holds_commands = magic is None and MAGIC.search(cell.text) is not None
        if holds_commands and not re.search(r"^[^#\n]", shown_code, re.MULTILINE):
            is_of_shell = re.search(r"^[ \t]*(?:!|%[pc])", cell.text, re.MULTILINE)
            language = "sh" if is_of_shell else "python"
            shown_code = COMMENT.sub("", shown_code)
        return show_cell(cell, read_options(cell.text)[0], language, shown_code, context)
    code, figure = _show_columns(_with_new_paths(code, context), context), ""
    options = read_options(cell.text)[0]
    label = find_group(r"\A(fig-.*)", options.get("label", ""))
    draws = _find_drawing(code, context.drawing)
    draws |= bool(label) and code.endswith(";")  # a figure that is no value was drawn
    if _SAVED.search(code):
        code, figure = _take_saved_figures(cell, code, context)
    elif draws if cell.picture is None else cell.picture[1]:
        if pyplot := next(iter(context.drawing.values()), ""):
            code, figure = _save_figure(cell, code, pyplot, context)
        else:
            message = "a figure: save it in the script, and name it by `figure=`"
            context.leave("figure of a cell", message)
            figure = "\n\n".join(write_outputs(replace(cell, printed="", value=""), context))
    word = " part" if context.parts else ""
    context.parts.append(code)
    context.change("cell", "a part of the lesson's script")
    names = ("lst-cap", "tbl-cap", *(() if figure else ("fig-cap",)))
    title = caption_of_code(options, context, names, "" if figure else label)
    label = options.get("lst-label", "").removeprefix("lst-")
    word += how_shown(options, cell.head)
    word += f" {{#lst:{to_anchor(label)}}}" if label else ""
    head, end = f"python file={context.script_path}{word}", f"\n{_END} {len(context.parts)}"
    blocks = [*title, marks.fence(head, code + end)]
    blocks += write_recorded(recorded_output(cell, code), context.script_path, context)
    return "\n\n".join((*blocks, figure) if figure else blocks)


_END = "#: end of part"
"""What stands for the lines that a cell gets when the texts below it are read."""


def print_values(text: str, context: LessonContext) -> str:
    """Return a lesson whose cells print the values that its text shows."""

    def lines(match: re.Match[str]) -> str:
        prints = context.prints.get(int(match[2]), ())
        return "".join(f"{match[1]}{line}\n" for line in prints)

    return re.sub(rf"^(.*){_END} (\d+)\n", lines, text, flags=re.MULTILINE)


_MAKERS = frozenset(
    "figure subplots subplot subplot_mosaic subplot2grid axes gca gcf polar matshow axhline "
    "axvline bar barbs barh boxplot broken_barh contour contourf ecdf errorbar eventplot fill "
    "fill_between fill_betweenx hexbin hist hist2d hlines imshow loglog pcolor pcolormesh pie "
    "plot quiver scatter semilogx semilogy specgram spy stackplot stairs stem step streamplot "
    "tricontour tricontourf tripcolor triplot violinplot vlines".split()
)
"""Functions of pyplot that make a figure where there is none."""


def _find_drawing(code: str, names: dict[str, str]) -> bool:
    """Return whether a cell makes a figure; `names` get the functions that do, with their pyplot.

    What an earlier cell drew is closed by now: to go on in it shows nothing there either.
    """
    tree = ast.parse(code)
    for node in ast.walk(tree):
        pyplot = imported_names(node).get("matplotlib.pyplot", "")
        if isinstance(node, ast.Attribute) and node.attr == "pyplot":
            pyplot = ast.unparse(node)
        names |= {f"{pyplot}.{maker}": pyplot for maker in _MAKERS if pyplot}
    draws = False
    for statement in tree.body:
        calls = [ast.unparse(n.func) for n in ast.walk(statement) if isinstance(n, ast.Call)]
        pyplot = next((names[call] for call in calls if call in names), "")
        if isinstance(statement, ast.FunctionDef):
            names |= {statement.name: pyplot} if pyplot else {}
        else:
            draws |= bool(pyplot)
    return draws


def imported_names(node: ast.AST) -> Mapping[str, str]:
    """Return the names that an import gives, by what they stand for: `np` by `numpy`."""
    match node:
        case ast.Import(names):
            start = ""
        case ast.ImportFrom(module, names):
            start = f"{module}."
        case _:
            return {}
    return {start + alias.name: alias.asname or alias.name for alias in names}


_SAVED = regex(r"(?P<call>\.(?:savefig|imsave)\(\s*)([\"'])(?P<path>[^\"'\n{}]+\.(?:svg|png))\2")
"""A call that saves a figure under a name."""


def _take_saved_figures(cell: Segment, code: str, context: LessonContext) -> tuple[str, str]:
    """Return code that saves its figures beside the lesson, and the paragraphs that show them."""
    names: dict[str, str] = {}
    for path in dict.fromkeys(match["path"] for match in _SAVED.finditer(code)):
        stem, _, extension = posixpath.basename(path).rpartition(".")
        name = f"{to_anchor(stem)}.{extension}"
        if name in context.figures:
            name = f"{_picture_stem(context)}.{extension}"
        names[path] = name
        context.figures.append(name)
        source = path.removeprefix("content/files/")  # where a file that was there went
        source = source if source in context.files else context.resolve_path(path)
        data = context.files.read(source) if source in context.files else b""
        if cell.picture is not None and cell.picture[0] == f".{extension}":
            data = data or cell.picture[1]
        _copy_figure(name, data, context)
        context.change("figure of a cell", "saved by the script, and recorded")
    code = _SAVED.sub(lambda match: f'{match["call"]}"{names[match["path"]]}"', code)
    return _without_window(code), _write_figures(cell, names.values(), code, context)


def _without_window(code: str) -> str:
    """Return code without what stands at its end for a window."""
    return re.sub(r"^pass\s*\Z", "", code, flags=re.MULTILINE).rstrip("\n")


def _write_figures(cell: Segment, names: Collection[str], code: str, context: LessonContext) -> str:
    """Return the paragraphs that show what a cell draws; a label is that of a single figure."""
    options, title = read_options(cell.text)[0], _DRAWN_TITLE.search(code)
    words = "" if title is None else title[3]
    if title and title[1] != "r":
        words = re.sub(r"\\(n|[\\'\"])", lambda sign: " " if sign[1] == "n" else sign[1], words)
    caption = options.get("fig-cap") or options.get("caption") or words
    caption = " ".join(caption.strip("\"' ").split())
    caption = rewrite_prose(caption or context.title, context).rstrip()
    alt = " ".join(options.get("fig-alt", options.get("alt", "")).strip("\"' ").split()) or caption
    alt = re.sub(r"\]\([^()]*\)|[\[\]`*_$\\]", "", alt)
    label = find_group(r"\A(fig-.*)", options.get("label", "")) if len(names) == 1 else ""
    return "\n\n".join(figure_of(name, caption, label, alt) for name in names)


_DRAWN_TITLE = regex(
    r"\.(?:set_)?(?:sup)?title\(\s*(r|f(?!.*\{))?([\"'])((?:\\.|(?!\2)[^\\])+)\2\s*[,)]"
)
"""A title that is not computed."""


def _save_figure(cell: Segment, code: str, pyplot: str, context: LessonContext) -> tuple[str, str]:
    """Return code that saves what it draws, and the paragraph that shows it."""
    name = _keep_picture(cell, context) or f"{_picture_stem(context)}.svg"
    context.figures.append(name)
    context.change("figure of a cell", "saved by the script, and recorded")
    code = f'{_without_window(code)}\n{pyplot}.savefig("{name}")\n{pyplot}.close("all")'.lstrip()
    return code, _write_figures(cell, [name], code, context)


def show_cell(
    cell: Segment, options: Mapping[str, str], language: str, code: str, context: LessonContext
) -> str:
    """Return a cell that is not run: its code, unless readers did not see it, and its outputs."""
    blocks = [marks.fence(language, code)] if code else []
    if blocks and how_shown(options, cell.head) == " hidden":
        blocks = []
        context.leave("cell", "the code of a cell that is not run here: readers did not see it")
    return "\n\n".join((*blocks, *write_outputs(cell, context)))


def write_outputs(cell: Segment, context: LessonContext) -> Iterator[str]:
    """Yield what is recorded below code that is only shown: its text, its picture."""
    if text := plain_output(f"{cell.printed}{cell.value}"):
        context.change("output of code that is shown", "a block of text")
        yield marks.fence("text", text)
    if name := _keep_picture(cell, context):
        yield f"![{context.title}]({name})"


def write_recorded(printed: str, script: str, context: LessonContext) -> Iterator[str]:
    """Yield what a script printed, as it is recorded, if anything is."""
    if output := plain_output(printed):
        context.files.account.taken["output that is recorded"] += 1
        context.notebook_outputs.append((script, output))
        yield marks.fence("output", output)


def _picture_stem(context: LessonContext) -> str:
    stem = context.script_path.removeprefix("examples/").removesuffix(".py").replace("_", "-")
    copies = map(posixpath.basename, context.copies)
    pictures = [name for name in copies if re.fullmatch(rf"{re.escape(stem)}-\d+\.\w+", name)]
    return f"{stem}-{len({*pictures, *context.figures}) + 1}"


def _keep_picture(cell: Segment, context: LessonContext) -> str:
    """Copy the picture that is recorded below a cell, and return its name; empty for none."""
    extension, data = cell.picture or ("", b"")
    name = f"{_picture_stem(context)}{extension}"
    return name if _copy_figure(name, data, context) else ""


def _copy_figure(name: str, data: bytes, context: LessonContext) -> bool:
    picture = prepare_figure(name, data) if data else ""
    if isinstance(picture, bytes):
        context.copies[f"{context.folder}/{name}"] = picture
    return isinstance(picture, bytes)


def _with_new_paths(code: str, context: LessonContext) -> str:
    """Return code that opens the files of the folder where they are in the new course."""
    lines = code.encode().split(b"\n")
    literals = [n for n in ast.walk(ast.parse(code)) if isinstance(n, ast.Constant)]
    for literal in sorted(literals, key=lambda n: (n.lineno, n.col_offset), reverse=True):
        value, at = literal.value, literal.lineno - 1
        if not isinstance(value, str) or literal.lineno != literal.end_lineno:
            continue
        path, line = context.resolve_data(value), lines[at]
        start, end = literal.col_offset, literal.end_col_offset or 0
        is_plain = line[start:end] in (f'"{value}"'.encode(), f"'{value}'".encode())
        if path and path != value and is_plain:
            lines[at] = line[:start] + f'"{path}"'.encode() + line[end:]
            context.change("path in a cell", "the new place of the file")
    return b"\n".join(lines).decode()


def _show_columns(code: str, context: LessonContext) -> str:
    """Return code in which pandas prints as many columns of a table as a notebook shows."""
    lines, parts = code.split("\n"), "".join((*context.parts, code))
    for statement in ast.parse(code).body if "max_columns" not in parts else ():
        if name := imported_names(statement).get("pandas"):
            line = f'{name}.set_option("display.max_columns", 20)  # as a notebook shows'
            lines.insert(statement.end_lineno or 0, line)
            context.change("table of pandas", "printed with as many columns as a notebook shows")
            break
    return "\n".join(lines)


def _without_host(text: str, context: LessonContext) -> str:
    """Return code without the statements that import or use what only Google's Colab has."""
    try:
        statements = ast.parse(text, "").body
    except (SyntaxError, ValueError, RecursionError):
        return text
    lines, names = text.split("\n"), set[str]()
    needless = ("google.colab", "myst_nb.", *(["__future__."] if context.parts else []))  # too late
    for statement in statements:
        match statement:
            case ast.Import() | ast.ImportFrom() if any(
                module.startswith(needless) for module in imported_names(statement)
            ):
                names |= {*imported_names(statement).values()}
            case ast.Expr(ast.Call(ast.Name("glue"), [ast.Constant(str(name)), value, *_])):
                text_of_value = ast.get_source_segment(text, value)
                lines[statement.lineno - 1] = f'print("{name}:", {text_of_value})'
                first, end = statement.lineno, statement.end_lineno or statement.lineno
                lines[first:end] = [""] * (end - first)
                change = "printed by its cell: bind the number where the text has it"
                context.change("value that is glued", change)
                continue
            case ast.Expr() if names & {
                n.id for n in ast.walk(statement) if isinstance(n, ast.Name)
            }:
                pass
            case _:
                continue
        end = statement.end_lineno or statement.lineno
        message = f"`{lines[statement.lineno - 1].strip()}`, which only its tool has"
        context.leave("statement of a cell", message)
        lines[statement.lineno - 1 : end] = [""] * (end - statement.lineno + 1)
    return "\n".join(lines)


def recorded_output(cell: Segment, code: str) -> str:
    """Return what is recorded of a cell which the script has as `code`: what it should print."""
    output = ""
    prints_value = code.count("print(") > cell.text.count("print(")
    printed = cell.printed
    if _TIMING.match(cell.text.lstrip("\n")):
        printed = _TIMES.sub("", printed)
    for text in (printed, cell.value if prints_value else ""):
        output += text and text.removesuffix("\n") + "\n"
    return output


def plain_output(text: str) -> str:
    """Return what is recorded without what colours it or moves the cursor."""
    return _ESCAPE.sub("", text).strip("\n")


def caption_of_code(
    options: Mapping[str, str], context: LessonContext, names: Sequence[str], label: str
) -> list[str]:
    """Return the anchor that a label sets, and the caption that one of these options gives."""
    captions = (options.get(name) for name in names)
    words = " ".join(next(filter(None, captions), "").split())
    anchor = [f'<a id="{to_anchor(label)}"></a>'] if label else []
    return [*anchor, f"**{rewrite_prose(words, context)}**"] if words else anchor


def how_shown(options: Mapping[str, str], tags: str) -> str:
    """Return the word for a cell whose code its tool folds or hides, after a blank."""
    tags += options.get("tags", "")
    is_hidden = "false" in (options.get("echo"), options.get("include"))
    if is_hidden or re.search("remove[-_](?:input|cell)", tags):
        return " hidden"
    is_folded = re.search("hide[-_](?:input|cell)", tags) or options.get("code-fold") == "true"
    return " folded" if is_folded else ""


def _find_fault(text: str) -> str:
    """Return why a text is no Python; empty where it is."""
    try:
        with warnings.catch_warnings(action="ignore"):
            # Also `await` outside functions. For the line of a mistake, Python opens what is named.
            compile(text, "/dev/null/cell", "exec", dont_inherit=True)
    except (SyntaxError, ValueError, RecursionError) as error:
        return str(error)
    return ""


def runnable_code(cell: Segment, context: LessonContext) -> str:
    """Return what the script runs of a cell; empty where that is nothing."""
    options, text = read_options(cell.text)
    tags = cell.head + options.get("tags", "")
    if "raises-exception" in tags or options.get("error") == "true":
        context.leave("cell", "a cell that is meant to fail is shown, not run")
        return ""
    if options.get("eval", "").lower() == "false":
        context.leave("cell", "a cell that its tool does not run")
        return ""
    first, _, rest = text.lstrip("\n").partition("\n")
    if _TIMING.fullmatch(first):
        text = rest
        context.leave("magic", f"`{first}`, which is for Jupyter alone")
    elif first.startswith("%%"):
        context.leave("cell", f"a cell of `{first.split()[0]}` is shown and not run")
        return ""
    if _find_fault(text):  # else a line that begins with `%` goes on from the one before
        for magic in MAGIC.finditer(text):
            context.leave("magic", f"`{magic[0].strip()}`, which is for Jupyter alone")
        text = drop_magics(text)
    text = _DISPLAY.sub(r"\1print(", _WINDOW.sub(r"\1pass", text))
    text = _without_host(text, context)
    if fault := _find_fault(text):
        context.leave("cell", f"a cell that is not Python is shown and not run: {fault}")
        return ""
    if cell.shows_value is not False:
        text = _print_last_value(cell, text, ast.parse(text), context)
    return text.strip() if re.search(r"^[ \t]*[^#\s]", text, re.MULTILINE) else ""


def _print_last_value(cell: Segment, text: str, tree: ast.Module, context: LessonContext) -> str:
    """Return the code with its last expression printed, since Jupyter shows its value."""
    last = tree.body[-1] if tree.body else None
    if not isinstance(last, ast.Expr) or text.rstrip().endswith(";"):
        return text
    if ast.unparse(last) == "None":  # so that nothing is shown
        return text
    if isinstance(last.value, ast.Call):
        name = ast.unparse(last.value.func)
        if re.match(r"(?:print|plt|ax|axs|axes|fig)\b", name):
            return text
        if not cell.shows_value:
            context.leave(
                "value of a cell", f"the value of `{name}(…)` is shown there if it has one"
            )
            return text
    lines = text.split("\n")
    before = "\n".join(lines[: last.lineno - 1])
    lead = lines[last.lineno - 1].encode()[: last.col_offset].decode()
    value = ast.get_source_segment(text, last.value) or ""
    *_, end = lines[: last.end_lineno]
    below = [end.encode()[last.end_col_offset :].decode(), *lines[last.end_lineno :]]
    if isinstance(last.value, ast.Tuple) and value[0] != "(":
        value = f"({value})"
    if re.match(r"['\"]|[A-Za-z_][\w.]*\(", cell.value.lstrip()):  # `array([…])`, a text
        value = f"repr({value})"
    return f"{before}\n{lead}print({value})" + "\n".join(below)
