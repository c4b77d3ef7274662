"""Fences become blocks according to their kind: scripts, code that is only shown, models.

Fences of features are read by the features.
"""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable

from msgspec.structs import replace

from coursebuild.core.model import (
    Block,
    CodeBlock,
    Mjcf,
    PlainCode,
    Script,
    ScriptPart,
    Show,
    SourcePart,
)
from coursebuild.core.model.blocks import PYTHON, FigureName, Labelled
from coursebuild.core.registry import fence_kind
from coursebuild.core.syntax.fence import (
    Fence,
    FenceKeys,
    TextParser,
    Word,
    split_words,
    with_line_end,
)
from coursebuild.core.syntax.other_tools import check_kind
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.python_syntax import check_syntax
from coursebuild.core.syntax.recording import check_stray_keys, record_fence
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Note, Parsed, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

DEFAULT_TIMEOUT, MAX_TIMEOUT = 60.0, 86400.0
"""Seconds."""

_VALUES = ("timeout", "requires", "args", "writes", "record", "figure", "download")
_FLAGS = ("norun", "diverges", "deep")
_PROGRAM_VALUES = ("timeout", "args", "writes", "record")
_SHOWS: tuple[Show, ...] = ("open", "folded", "hidden")
_WHOLE_STATEMENTS = "a part holds whole statements: a function or a loop stands in one part"
_NUMBER = regex(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")
_PORTABLE = regex(
    r"(?!(?:aux|con|nul|prn|com[0-9¹²³]|lpt[0-9¹²³])(?:\.|\Z))(?! ).*[^. ]", re.IGNORECASE
)
_UNPORTABLE = regex(r'[\x00-\x1f\x7f<>:"|?*;&$!#%`{}\'\\\ud800-\udfff]')
_UNUSABLE_NAMES = (frozenset(sys.stdlib_module_names) | {"mjcourse", "mujoco", "numpy"}) - set(
    "code test this".split()
)
_PATH = regex(r"\w[\w.-]*(?:/\w[\w.-]*)*")
_FOLDER = regex(rf"(?!(?:content|models|examples|features|public)(?:/|\Z)){_PATH.pattern}/*")
_FIGURE = regex(r"[A-Za-z0-9][\w-]*(?:\.[\w-]+)*\.(?:svg|png|csv)", re.ASCII)
_ELEMENTS = regex(r"[A-Za-z_][\w-]*(?:/[A-Za-z_][\w-]*)*")


def parse_python(fence: Fence) -> Parsed[Script | ScriptPart | PlainCode]:
    """A `python` fence: a script or a part of one if it has a valid `file=`, else `PlainCode`."""
    flags = (*_FLAGS, "part", *_SHOWS)
    keys = fence.keys(values=("file", "show", *_VALUES), flags=flags)
    diagnostics = list(keys.diagnostics)
    file, show = keys.value.get("file"), keys.value.get("show")
    has_file = any(word.key == "file" for word in split_words(fence.info).value)
    if file is None and not diagnostics:
        for word in (keys.value.get(key) for key in (*_VALUES, *_FLAGS, "part", *_SHOWS)):
            if word is not None:
                message = f"`{word.key}` is said of a script, and this block has no `file`"
                help = "add `file=examples/….py`, or leave it out"
                diagnostics.append(diagnose("fence-key-value", word.key_span, message, help=help))
    if show is not None and has_file:
        message = "a block shows a part of a file, or it is a script of its own"
        diagnostics.append(diagnose("fence-key-value", show.span, message))
    elif has_file:  # what is only shown may be incomplete, a session or of another version
        for mistake in check_syntax(fence.body):
            is_part, help = keys.value.get("part") is not None, mistake.help
            help = help or (_WHOLE_STATEMENTS if is_part else "")
            diagnostics.append(replace(mistake, help=help))
    script: Script | ScriptPart | None = None
    if file is not None:
        build = _build_script if keys.value.get("part") is None else _build_part
        script = build(fence, file, keys.value, diagnostics)
    source = None
    if show is not None and not has_file:
        path = (show.value or "").partition("#")[0]
        if _PATH.fullmatch(path) and not fence.nested:
            source = _source_part(fence, show)
        else:
            message = f"`{path}` is not the path of a file of the project"
            if fence.nested:
                message = "a text of a quiz or lab cannot show a file"
            help = "name it from the project's folder, as in `show=src/pkg/x.py#function`"
            diagnostics.append(diagnose("fence-key-value", show.value_span, message, help=help))
    code = PlainCode(fence.span, fence.body, source)
    return Parsed(script or code, tuple(diagnostics))


def parse_program(fence: Fence) -> Parsed[Script | PlainCode | None]:
    """A fence of another language: a script if it has a `file` in `examples/`, or a shown file.

    `None` if it is neither: then it is only code, whatever its first line says.
    """
    first = {word.key: word.value or "" for word in reversed(split_words(fence.info).value)}
    file_path = first.get("file", "")
    if file_path.startswith("examples/") and not file_path.endswith(".py"):  # of Python
        keys = fence.keys(values=("file", *_PROGRAM_VALUES), flags=("norun", *_SHOWS))
        diagnostics, file = list(keys.diagnostics), keys.value.get("file")
        script = None if file is None else _build_script(fence, file, keys.value, diagnostics)
        return Parsed(
            script or PlainCode(fence.span, fence.body, None, fence.kind), (*diagnostics,)
        )
    path = first.get("show", "").partition("#")[0]
    if fence.nested or not _PATH.fullmatch(path) or not {"/", "."} & {*path}:
        return Parsed(None, ())
    keys = fence.keys(values=("show",))
    word = keys.value.get("show")
    source = None if word is None else _source_part(fence, word)
    return Parsed(PlainCode(fence.span, fence.body, source, fence.kind), keys.diagnostics)


def _source_part(fence: Fence, word: Word) -> SourcePart:
    path, _, part = (word.value or "").partition("#")
    return SourcePart(path, part, word.value_span, fence.body_span, fence.prefix)


def _build_part(
    fence: Fence, file: Word, keys: FenceKeys, diagnostics: list[Diagnostic]
) -> ScriptPart | None:
    for word in (keys.get(key) for key in (*_VALUES, *_FLAGS)):
        if word is not None:
            message = f"`{word.key}` is said of the whole script"
            help = "write it on the block that begins the script"
            diagnostics.append(diagnose("fence-key-value", word.key_span, message, help=help))
    show = _read_show(keys, diagnostics)
    if not _check_path(fence, file, diagnostics):
        return None
    path, place, code = file.value or "", file.value_span, with_line_end(fence.body)
    return ScriptPart(fence.span, path, place, code, fence.prefix, fence.body_span, show)


def _check_path(fence: Fence, file: Word, diagnostics: list[Diagnostic]) -> bool:
    path = file.value or ""
    mistake = path_mistake(path, is_python=fence.kind == PYTHON)
    help = "write `examples/` and a name of its own, for example `examples/l4_2_inertia.py`"
    if fence.nested:
        mistake, help = "a text of a quiz or lab cannot hold a script", ""
    if mistake:
        if "is not below" in mistake and not fence.nested:
            help = Fix(help, f"examples/{path.rpartition('/')[2]}", path)
        diagnostics.append(diagnose("script-path", file.value_span, mistake, help=help))
    return not mistake


def _read_show(keys: FenceKeys, diagnostics: list[Diagnostic]) -> Show:
    shows = [show for show in _SHOWS if keys.get(show) is not None]
    for show in shows[1:]:
        message = f"`{show}` contradicts `{shows[0]}`"
        place = keys.place(show)
        assert place is not None
        diagnostics.append(diagnose("fence-key-value", place, message))
    return shows[0] if shows else "open"


def _build_script(
    fence: Fence, file: Word, keys: FenceKeys, diagnostics: list[Diagnostic]
) -> Script | None:
    has_path = _check_path(fence, file, diagnostics)
    timeout = _read_timeout(keys.get("timeout"), diagnostics)
    requires = [part.text for part in _read_list("requires", keys, diagnostics)]
    writes = [part.text.rstrip("/") for part in _read_list("writes", keys, diagnostics)]
    args: list[str] = []
    try:
        args = shlex.split(keys.value("args") or "")
    except ValueError as error:
        message = f"the arguments cannot be split: {str(error).lower()}"
        place = keys.place("args") or fence.head
        diagnostics.append(diagnose("fence-key-value", place, message))
    for key, only_value, use, help in (
        ("record", "once", "record", "write `record=once`"),
        ("download", "zip", "hand a script over", "write `download=zip`, or nothing for one file"),
    ):
        word = keys.get(key)
        if word is not None and word.value != only_value:
            message, fix = f"`{word.value}` is not a way to {use}", Fix(help, only_value)
            diagnostics.append(diagnose("fence-key-value", word.value_span, message, help=fix))
    figures = _read_list("figure", keys, diagnostics)
    show = _read_show(keys, diagnostics)
    if not has_path:
        return None
    return Script(
        fence.span,
        file.value or "",
        file.value_span,
        with_line_end(fence.body),
        fence.prefix,
        timeout,
        tuple(dict.fromkeys(requires)),
        tuple(args),
        keys.get("norun") is not None,
        fence.body_span,
        keys.get("diverges") is not None,
        keys.get("deep") is not None,
        tuple(writes),
        once=keys.get("record") is not None,
        figures=tuple(FigureName(name.text, name.span()) for name in figures),
        show=show,
        archive=keys.get("download") is not None,
        language=fence.kind,
    )


def _read_timeout(word: Word | None, diagnostics: list[Diagnostic]) -> float:
    if word is None or word.value is None:
        return DEFAULT_TIMEOUT
    seconds = float(word.value) if _NUMBER.fullmatch(word.value) else 0.0
    if 0 < seconds <= MAX_TIMEOUT:
        return seconds
    message = f"`{word.value}` is not a number of seconds above 0, of a day at most"
    diagnostics.append(diagnose("fence-key-value", word.value_span, message))
    return DEFAULT_TIMEOUT


def _read_list(key: str, keys: FenceKeys, diagnostics: list[Diagnostic]) -> list[Excerpt]:
    """The right names in the value of a key of `_LISTS`."""
    accepts, message, help = _LISTS[key]
    word = keys.get(key)
    parts = [] if word is None else word.parts()
    for part in parts:
        if word is not None and key == "requires" and not part.text:
            place, missing = word.value_span, "a name of a module is missing"
            diagnostics.append(diagnose("fence-key-value", place, missing, help=help))
        elif not accepts(part.text):
            text = message.format(part.text)
            diagnostics.append(diagnose("fence-key-value", part.span(), text, help=help))
    return [part for part in parts if accepts(part.text)]


_LISTS: dict[str, tuple[Callable[[str], bool], str, str]] = {
    "figure": (
        lambda name: bool(_FIGURE.fullmatch(name)),
        "`{}` is not a name for a figure",
        "it is a file name that ends in `.svg` or `.png`, as in `figure=flip.svg`, or in `.csv` "
        "for the data of the figure with this name",
    ),
    "requires": (
        lambda name: all(piece.isidentifier() for piece in name.split(".")),
        "`{}` is not the name of a module",
        "write names with commas between them, for example `requires=torch,mjx`",
    ),
    "writes": (
        lambda path: bool(_FOLDER.fullmatch(path)),
        "`{}` is not a folder that a script may write into",
        "name a folder of the project that holds nothing else, for example `writes=runs/`",
    ),
}
"""Keys with a list of names: which are right, and the message and the help for others."""


def path_mistake(path: str, *, is_python: bool = True) -> str:
    """Why a script cannot have this path; empty if it can."""
    folder, *parts = path.split("/")
    stem = path.rpartition("/")[2].removesuffix(".py")
    if folder != "examples" or not parts:
        return f"`{path}` is not below `examples/`"
    if is_python and not path.endswith(".py"):
        return f"`{path}` does not end in `.py`"
    if not is_python and path.lower().endswith((".py", ".pyc", ".pyd", ".so")):
        return f"`{path}` would be imported by Python scripts beside it"
    is_portable = stem and not _UNPORTABLE.search(path) and all(map(_PORTABLE.fullmatch, parts))
    if not is_portable or max(len(part.encode()) for part in parts) > 255:
        return f"`{path}` has a part that is no file name on every system"
    if is_python and stem in _UNUSABLE_NAMES:
        return f"`{path}` would be imported in place of the module `{stem}` by its neighbours"
    return ""


_HEAD_RULES = frozenset(
    {"fence-info", "fence-key-repeated", "fence-key-unknown", "fence-key-value", "script-path"}
)
"""Mistakes that may be why a block is no script."""


def read_block(fence: Fence, state: ParsingState, texts: TextParser) -> Block:
    """The block of a fence, with the label on its first line."""
    block, braces = _read_kind(fence, state, texts), fence.label
    if braces is None or not fence.is_closed:
        return block
    feature_kind = fence_kind(fence.kind)
    kind = "lst" if feature_kind is None else feature_kind.label
    if fence.nested:
        message = "a block in a text of a quiz or lab has no label"
        state.reject_label(braces, message, "label blocks of the lesson's text")
    elif fence.kind == "output":
        help = "write `{#lst:name}` on the first line of its script"
        state.reject_label(braces, "an output has no label", help)
    elif not kind:
        message = f"a block of kind `{fence.kind}` has no label"
        state.reject_label(braces, message, "labels stand on scripts, code and labs")
    elif isinstance(block, Labelled):
        return replace(block, label=state.take_label(braces, kind))
    return block


def _read_kind(fence: Fence, state: ParsingState, texts: TextParser) -> Block:
    if not fence.is_closed or fence.inner is not None:
        return _read_unclosed(fence, state)
    match fence.kind:
        case "python":
            python = parse_python(fence)
            state.diagnostics += python.diagnostics
            return _place_script(fence, python, state)
        case "output" if fence.nested:
            message = "a text of a quiz or lab cannot hold a recorded output"
            state.report(diagnose("fence-info", fence.head, message))
            return fence.code()
        case "output":
            return record_fence((), fence.head, fence, state) or fence.code()
        case "text":
            check_stray_keys(fence, state)
            return fence.code()
        case "mjcf":
            parsed_keys = fence.keys(values=("fragment", "error"))
            state.diagnostics += parsed_keys.diagnostics
            keys, fragment = parsed_keys.value, parsed_keys.value.get("fragment")
            if fragment is not None and not _ELEMENTS.fullmatch(fragment.value or ""):
                message = f"`{fragment.value}` is not the name of an element"
                help = 'name the element that it goes into, for example `fragment="worldbody"`'
                state.report(diagnose("fence-key-value", fragment.value_span, message, help=help))
                return fence.code()
            if parsed_keys.diagnostics:
                return fence.code()
            return Mjcf(
                fence.span,
                fence.body,
                keys.value("fragment"),
                keys.value("error"),
                keys.place("error"),
            )
        case name if (kind := fence_kind(name)) is not None and fence.nested and not kind.nested:
            message = f"a text of a quiz or lab cannot hold a {name}"
            state.report(diagnose("fence-info", fence.head, message))
            return fence.code()
        case _ if kind is not None:
            block = kind.parse(fence, texts)
            state.diagnostics += block.diagnostics
            return block.value or fence.code()
        case _ if (program := parse_program(fence)).value is not None:
            state.diagnostics += program.diagnostics
            return _place_script(fence, program, state)
        case _:
            state.diagnostics += check_kind(fence)
            return fence.code()


def _place_script(
    fence: Fence, result: Parsed[Script | ScriptPart | PlainCode | None], state: ParsingState
) -> Block:
    """The block, after which outputs are those of its script, and figures may be its figures."""
    block = result.value
    assert block is not None, "what is only code is placed nowhere"
    is_invalid = any(d.rule in _HEAD_RULES for d in result.diagnostics)
    if isinstance(block, ScriptPart) and block.path not in state.parts:
        message = f"no block above this part begins `{block.path}`"
        help = "the parts of a script stand in one lesson, in the order of the file; "
        help += "the first one does not say `part`"
        state.report(diagnose("script-part", block.path_span, message, help=help))
        block, is_invalid = PlainCode(fence.span, fence.body), True
    match block:
        case Script():
            state.parts[block.path] = 0
            names = (figure.name for figure in block.figures)
            state.figures += [name for name in names if not name.endswith(".csv")]
            state.script, state.has_invalid_script = block.path, False
        case ScriptPart():
            state.parts[block.path] += 1
            state.script, state.has_invalid_script = block.path, False
        case PlainCode() if is_invalid and not fence.nested:
            state.script, state.has_invalid_script = None, True
        case _:
            pass
    return block


def _read_unclosed(fence: Fence, state: ParsingState) -> CodeBlock:
    """Report a fence without end, and show it as code; its content is not checked."""
    marks = fence.head.text[: len(fence.head.text) - len(fence.head.text.lstrip("`~"))]
    name = "backticks" if marks[0] == "`" else "tildes"
    help = f"close it with a line of {len(marks)} {name} in the same quote or list item"
    message, notes = "this code fence is never closed", []
    if fence.inner is not None:
        message = "this code fence is not closed before another one begins"
        notes = [Note("this line is read as text of the fence above it", fence.inner)]
    state.report(diagnose("fence-unclosed", fence.head, message, help=help, notes=notes))
    if fence.kind == "python" or fence.inner is not None:
        state.script, state.has_invalid_script = None, True
    return fence.code()
