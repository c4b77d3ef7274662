"""Finds names in a document: what its inline code may name, and what its code defines.

Entry points: `document_names`, what `resolve` must know of a document; `claims_of`, the claims of
one piece of inline code; `Claim` and `DocumentNames`.

Inline code may be a name where it has the shape of one: a call, a dotted name, a word with an
underscore or one that begins as MuJoCo's do, elements and attributes of MJCF, a command or an
option of coursebuild, a table of the course map, a script of the course.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Span, model, regex
from coursebuild.core.text import python_code

Kind: TypeAlias = Literal[
    "word",
    "call",
    "path",
    "element",
    "attribute",
    "mjcf",
    "defined",
    "command",
    "option",
    "table",
    "file",
]
"""`mjcf` is an element, perhaps with an attribute, in code that begins with `<mujoco`; `defined` a
function in a link to a script."""

_SHAPE = regex(
    r"[A-Za-z0-9]_[A-Za-z0-9]|\w\.[A-Za-z]|\w\(|\b[Mm]j[A-Z]|=[\"]|\A<[/A-Za-z]|>\Z|--\w|/|\[\w"
    r"|->\w|\Acoursebuild "
)
"""What every claim has somewhere, so that most code is passed over quickly."""
ENGINE_WORD = regex(r"(?:mj[A-Z]|mj[a-z]{0,2}_|mjt[A-Z]|Mj[A-Z])\w+")
"""A name that only MuJoCo has."""
_ATTRIBUTES = regex(r'\s*([A-Za-z_][\w:-]*)\s*=\s*"[^"]*"')
_TAG = regex(rf"<(/?)([A-Za-z]\w*)((?:{_ATTRIBUTES.pattern[:-7]}\"[^\"]*\")*)\s*/?>")
_TABLE = regex(r"(\[\[?)([a-z][\w.]*)\]\]?(?: (\w+)(?: =.*)?)?")
_FILE = regex(r"examples/[\w./-]*\w\.[a-z]+")
_CALLED = regex(r"([A-Za-z_]\w*)\(.*\)")
_STRUCTURES = {"MjData", "MjModel", "MjSpec"}


class Claim(Struct, frozen=True, array_like=True):
    """A name in inline code."""

    kind: Kind
    name: str
    """Parts of a path are joined by dots; `()` and `[]` after one say that it is called or
    indexed. An attribute has its element before it, as in `joint damping`, and a defined name the
    path of its script."""
    linked: bool
    """Whether the whole code can link to what this name means."""


class DocumentNames(Struct, frozen=True):
    """The names of a document."""

    claims: tuple[tuple[Claim, Span, Span], ...]
    """Each with the place of its inline code and its own."""
    definitions: dict[str, tuple[str, int]]
    """The names that its scripts define, each with the script's path and the line."""
    imports: dict[str, str]
    """The modules and the parts of modules that they import, by the names that they have there."""
    variables: dict[str, str]
    """Variables of its scripts, each with the class of MuJoCo of which it always is; empty for one
    that may be anything else."""


def course_names(course: model.Course) -> Iterator[DocumentNames]:
    """Yield the names of each document of a course."""
    return filter(None, (document.summary_of(DocumentNames) for document in course.documents))


def document_names(document: model.Document) -> DocumentNames | None:
    """Return the names of a document; `None` if it has none."""
    claims: list[tuple[Claim, Span, Span]] = []
    names = DocumentNames((), {}, {}, {})
    for script in model.document_scripts(document):
        _read_script(script, names)
    inner: set[int] = set()
    for block, inlines in model.inlines_by_block(document):
        if isinstance(block, model.FeatureBlock):
            inner |= {id(part) for part in model.walk_blocks(block.child_blocks())}
        # A heading, an option of a quiz and a title may stand in a link or a button.
        may_link = isinstance(block, model.Paragraph | model.Table) and id(block) not in inner
        link_parts: set[int] = set()
        for inline in inlines:
            path = ""
            if isinstance(inline, model.Link):
                link_parts |= {id(child) for child in model.walk_inlines(inline.children)}
                if isinstance(inline.target, model.ExampleTarget) and len(inline.children) == 1:
                    path, inline = inline.target.path, inline.children[0]
            if isinstance(inline, model.CodeSpan) and not inline.literal:
                is_free = may_link and id(inline) not in link_parts
                for claim, place in claims_of(inline, path):
                    claim = replace(claim, linked=claim.linked and is_free)
                    claims.append((claim, inline.span, place))
    names = replace(names, claims=tuple(claims))
    return names if claims or names.definitions or names.imports else None


def _read_script(script: model.Script, names: DocumentNames) -> None:
    nodes = python_code.python_nodes(script.code.text)
    for node in nodes:
        if type(node) is ast.Import:
            for alias in node.names:
                name = alias.asname or alias.name.partition(".")[0]
                names.imports[name] = alias.name if alias.asname else name
        elif type(node) is ast.ImportFrom and node.module and not node.level:
            for alias in node.names:
                names.imports[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    structures: dict[int, str] = {}
    for node in nodes:
        if type(node) is ast.Assign and len(node.targets) == 1:
            structures[id(node.targets[0])] = _find_structure(node.value, names.imports)
        definition = None if isinstance(node, ast.alias) else python_code.bound_name(node)
        if definition is not None:
            line = getattr(node, "lineno", 1)
            names.definitions.setdefault(definition, (script.path, line))
    for node in nodes:
        if type(node) is ast.Name and type(node.ctx) is ast.Store:
            class_name = structures.get(id(node), "")
            if names.variables.setdefault(node.id, class_name) != class_name:
                names.variables[node.id] = ""


def _find_structure(value: ast.expr, imports: Mapping[str, str]) -> str:
    """The class of MuJoCo that makes a value, as in `mujoco.MjModel.from_xml_path(…)`."""
    if not isinstance(value, ast.Call):
        return ""
    path = (_path(value.func, set()) or "").split(".")
    parts = [*imports.get(path[0], "").split("."), *path[1:]]
    is_made = len(parts) == 2 or (len(parts) == 3 and parts[2].startswith("from_"))
    return parts[1] if is_made and parts[0] == "mujoco" and parts[1] in _STRUCTURES else ""


def claims_of(code: model.CodeSpan, script: str = "") -> Iterator[tuple[Claim, Span]]:
    """Yield the claims of a piece of inline code, each with its place; it may link to a script."""
    text = code.text.strip()
    finds: list[tuple[Kind, str, str]] = []
    if script and (called := _CALLED.fullmatch(text)):
        finds = [("defined", f"{script} {called[1]}", called[1])]
    elif _SHAPE.search(text) or ENGINE_WORD.fullmatch(text):
        finds = list(_find(text, code.span.source.text))
    for number, (kind, name, part) in enumerate(finds):
        start = code.span.start + code.span.text.find(part)
        has_part = start >= code.span.start
        span = code.span.source.span(start, start + len(part)) if has_part else code.span
        yield Claim(kind, name, not number), span


def _find(text: str, page: str) -> Iterator[tuple[Kind, str, str]]:
    """Yield the kind of each claim, its name, and the part of the text that is reported."""
    words = text.split()
    if words[0] == "coursebuild" or text.startswith("--"):
        is_command = words[0] == "coursebuild" and len(words) > 1
        command = words[1] if is_command and re.fullmatch("[a-z]+", words[1]) else ""
        if command:
            yield "command", command, command
        for word in words:
            option = re.match(r"--[a-z][a-z-]*", word)
            if option is not None:
                yield "option", f"{command} {option[0]}", option[0]
    elif "course.toml" in page and (table := _TABLE.fullmatch(text)):
        yield "table", f"{table[1]}{table[2]} {table[3] or ''}", table[3] or table[2]
    elif text.startswith("<"):
        is_mjcf = re.match(r"<mujoco[\s>]", text) is not None
        for tag in _TAG.finditer(text):
            yield "mjcf" if is_mjcf else "element", tag[2], tag[2]
            for attribute in _ATTRIBUTES.findall(tag[3]):
                yield "mjcf" if is_mjcf else "attribute", f"{tag[2]} {attribute}", attribute
    elif re.fullmatch(rf"(?:{_ATTRIBUTES.pattern})+", text):
        for attribute in _ATTRIBUTES.findall(text):
            yield "attribute", f" {attribute}", attribute
    elif _FILE.fullmatch(text):
        yield "file", text, text
    elif not re.search(r"\.(?:py|xml|toml|md|json|js|svg|csv|txt|ya?ml|html|rst|css)\b", text):
        yield from _find_python(text)


def _find_python(text: str) -> Iterator[tuple[Kind, str, str]]:
    nodes = python_code.python_nodes(text.replace("…", "_").replace("->", "."))
    for word in () if nodes else ENGINE_WORD.findall(text):
        yield "word", word, word
    parts: set[int] = set()
    targets = {python_code.bound_name(node) for node in nodes}
    for node in nodes:
        if id(node) in parts:
            continue
        if isinstance(node, ast.Attribute | ast.Call):
            path = _path(node, parts)
            if path is not None and "." in path:
                yield "path", path, re.split(r"[.(\[]", path)[0]
            elif path is not None and not path.startswith("_"):
                name = path.removesuffix("()")
                yield ("word" if name == path else "call"), name, name
        elif (
            isinstance(node, ast.Name)
            and node.id not in targets
            # with the shape of a name by itself
            and (re.search(r"[A-Za-z0-9]_[A-Za-z0-9]", node.id) or ENGINE_WORD.fullmatch(node.id))
        ):
            yield "word", node.id, node.id


def _path(node: ast.expr, parts: set[int]) -> str | None:
    """The dotted name that an expression is, down to its root; its nodes are added to `parts`."""
    names: list[str] = []
    suffix = ""
    while True:
        parts.add(id(node))
        match node:
            case ast.Attribute():
                names.append(node.attr + suffix)
                node, suffix = node.value, ""
            case ast.Call():
                node, suffix = node.func, "()" + suffix
            case ast.Subscript():
                node, suffix = node.value, "[]" + suffix
            case ast.Name():
                return ".".join(reversed([*names, node.id + suffix]))
            case _:
                return None
