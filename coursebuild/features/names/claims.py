"""Finds names in a document: what its inline code says that there is, and what its code defines.

Entry points: `document_names`, what `resolve` must know of a document; `claims_of`, the claims of
one piece of inline code; `Claim` and `CodeNames`.

Inline code is a claim only where it has the shape of a name: a call, a dotted name, a word with an
underscore or one that begins as MuJoCo's do, elements and attributes of MJCF, a command or an
option of coursebuild, a table of the course map, a file of the course. Any other word may be one:
it is "plain", and wrong only where it is a name but for a slip of the hand. So is a "token", which
stands between blanks and is more than a word; "torn" is a word that goes on behind its backtick,
and "half" what has one bracket of an element.
"""

from __future__ import annotations

import ast
import functools
import re
from collections import Counter
from collections.abc import Iterator
from typing import Literal, TypeAlias

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.pages.listings import python_nodes
from coursebuild.core.text.source import Span

Kind: TypeAlias = Literal[
    "word",
    "call",
    "path",
    "element",
    "attribute",
    "command",
    "option",
    "table",
    "file",
    "value",
    "plain",
    "token",
    "torn",
    "half",
]

_SHAPE = re.compile(
    r"[A-Za-z0-9]_[A-Za-z0-9]|\w\.[A-Za-z]|\w\(|\b[Mm]j[A-Z]|=[\"]|\A<[/A-Za-z]|>\Z|--\w|/|\[\w"
    r"|->\w|\Acoursebuild "
)
"""What every claim has somewhere, so that most code is passed over quickly."""
ENGINE_WORD = re.compile(r"(?:mj[A-Z]|mj[a-z]{0,2}_|mjt[A-Z]|Mj[A-Z])\w+")
"""A name that only MuJoCo has."""
_ATTRIBUTES = re.compile(r'\s*([A-Za-z_][\w:-]*)\s*=\s*"[^"]*"')
_VALUES = re.compile(r'[A-Za-z_][\w:-]*\s*=\s*"([a-zA-Z]{4,})"')
_TAG = re.compile(rf"<(/?)([A-Za-z]\w*)((?:{_ATTRIBUTES.pattern[:-7]}\"[^\"]*\")*)\s*/?>")
_HALF = re.compile(
    r"(?=.*[<>])(?!<.*>\Z)[^\w\s]?/?[A-Za-z]\w*/?[^\w\s]?|<\w+/\w+>|<<[a-z]+[ >/].*"
    r"|<\w*[^\w\s<>/]\w*>"
)
"""Perhaps an element that lost a bracket."""
_TABLE = re.compile(r"(\[\[?)([a-z][\w.]*)\]\]?(?: (\w+)(?: =.*)?)?")
_FILE = re.compile(r"(?:content|examples|models)/(?!.*[A-Z]{3})[\w./-]*\w\.[a-z]+")
_NEAR_FILE = re.compile(r"(?!.*[A-Z]{3})[\w.-]+/[\w./-]*\w\.(?:md|py|toml|xml)")
"""What is a file of the course only if it is like the name of one."""
_CODE_WORD = re.compile(
    r"\b\w*[A-Za-z0-9]_\w+|(?<=\.)[A-Za-z]\w*|[A-Za-z]\w*(?=\(|\s?=)|[Mm]j[A-Z]\w+"
    r"|(?<=\")[A-Za-z]\w+(?=\")"
)
"""A word of code that inline code could mean."""
_CODE = (
    model.Script | model.PlainCode | model.CodeBlock | model.Mjcf | model.FeatureBlock
) | model.Recording
_PLAIN = re.compile(
    r"(?<![\w.\\/-])(?<!\A[,;])_?[A-Za-z]\w+[^\W_]"
    r"(?:\.(?:md|py|toml|xml)\b)?(?![\w./\\-])"
)
"""A word of inline code that is no part of a path."""
_TOKEN = re.compile(
    r"(?<!\S)(?=\S*[A-Za-z_]{4})(?!\w+(?!\S))\S{6,}(?!\S)"
    r"|(?<!\S)\w*[\\<;,'\[\]]\w{3,}(?!\S)|(?<!\S)\w{3,}[\\'´](?!\S)"
)
"""What stands between blanks, with a word of some length and more than that."""
_TAIL = re.compile(r"(?<!\s`)[A-Za-z0-9]+(?![\w{}=`])")
"""Letters or digits directly after code that are no broken attribute."""
ENDINGS = {
    "en": "s es d ed ing er ers th st nd rd".split(),
    "de": "s es n en e em er t te ten m r".split(),
    "es": "s es n".split(),
    "fr": "s es e".split(),
}
"""What may stand directly behind code, as in "two `geom`s"; other languages have more long ones."""
_MOST_PLAIN = 3
"""How many uses of a plain word are kept of a document: what is used again is no slip."""
_STRUCTURES = {"MjData", "MjModel", "MjSpec"}
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
GUESSES = frozenset("value plain token torn half".split())
"""Kinds of claims that are none where nothing is called like them."""


class Claim(Struct, frozen=True, array_like=True):
    """A name in inline code."""

    kind: Kind
    name: str
    """Parts of a path are joined by dots; `()` and `[]` after one say that it is called or
    indexed. An attribute has the elements before it, as in `joint damping`; a torn name has a
    blank before its letters behind the backtick."""
    linked: bool
    """Whether the whole code can link to what this name means."""


class CodeNames(Struct, frozen=True):
    """The names of a document, but for their places."""

    claims: tuple[Claim, ...]
    words: frozenset[str]
    """Words of its blocks of code, which the text may use."""
    definitions: dict[str, tuple[str, int]]
    """The names that its scripts define, each with the script's path and the line."""
    imports: dict[str, str]
    """The modules and the parts of modules that they import, by the names that they have there."""
    variables: dict[str, str]
    """Variables that hold a structure of MuJoCo, each with its class."""
    members: dict[str, frozenset[str]]
    """The attributes that scripts use of each of their variables."""


class DocumentNames(Struct, frozen=True, dict=True):
    """The names of a document as they are kept, since all documents are asked for words."""

    data: bytes
    codes: tuple[Span, ...]
    """Of each claim the place of its inline code."""
    places: tuple[Span, ...]
    """Of each claim its own."""

    @functools.cached_property
    def names(self) -> CodeNames:
        return msgspec.json.decode(self.data, type=CodeNames)

    @property
    def claims(self) -> Iterator[tuple[Claim, Span, Span]]:
        """Each claim with the place of its code and its own."""
        return zip(self.names.claims, self.codes, self.places, strict=True)


def names_of(document: model.Document) -> DocumentNames | None:
    """Return the names of a document that the course has read."""
    names = (document.summaries or {}).get("names")
    return names if isinstance(names, DocumentNames) else None


def course_names(course: model.Course) -> tuple[CodeNames, ...]:
    """Return the names of each document of a course."""
    return tuple(note.names for note in map(names_of, course.documents) if note is not None)


@functools.lru_cache(maxsize=256)
def words_of(text: str) -> frozenset[str]:
    """Return the words of code."""
    return frozenset(re.findall(r"[A-Za-z]\w*", text))


def document_names(document: model.Document) -> DocumentNames | None:
    """Return the names of a document; `None` if it has neither claims nor code."""
    claims: list[Claim] = []
    codes: list[Span] = []
    places: list[Span] = []
    words: set[str] = set()
    names = CodeNames((), frozenset(), {}, {}, {}, {})
    inner: set[int] = set()
    plain_counts = Counter[str]()
    for block in model.document_blocks(document):
        if isinstance(block, model.FeatureBlock):
            inner |= {id(part) for part in model.walk_blocks(block.child_blocks())}
        # A heading, an option of a quiz and a title may stand in a link or a button.
        may_link = isinstance(block, model.Paragraph | model.Table) and id(block) not in inner
        if isinstance(block, _CODE):
            text = block.span.text
            if isinstance(block, model.FeatureBlock):  # its inline code makes claims of its own
                text = re.sub(r"(?<!`)`[^`\n]+`(?!`)", "", text)
            words.update(_CODE_WORD.findall(text))
        if isinstance(block, model.Script):
            _read_script(block, names)
        link_parts: set[int] = set()
        for inline in model.walk_inlines(model.block_inlines(block)):
            if isinstance(inline, model.Link):
                link_parts |= {id(child) for child in model.walk_inlines(inline.children)}
            elif isinstance(inline, model.CodeSpan) and not inline.literal:
                for claim, place in claims_of(inline):
                    if claim.kind == "plain":
                        plain_counts[claim.name] += 1
                        if plain_counts[claim.name] > _MOST_PLAIN:
                            continue
                    claims.append(
                        replace(
                            claim, linked=may_link and claim.linked and id(inline) not in link_parts
                        )
                    )
                    codes.append(inline.span)
                    places.append(place)
    if not (claims or words):
        return None
    names = replace(names, claims=tuple(claims), words=frozenset(words))
    data = msgspec.json.encode(names, order="deterministic")
    return DocumentNames(data, tuple(codes), tuple(places))


def _read_script(script: model.Script, names: CodeNames) -> None:
    members: dict[str, set[str]] = {}
    for node in python_nodes(script.code.text.rstrip("\n")):
        definition = ""
        if type(node) is ast.Name:
            definition = node.id if type(node.ctx) is ast.Store else ""
        elif type(node) is ast.Attribute:
            if type(node.value) is ast.Name:
                members.setdefault(node.value.id, set()).add(node.attr)
        elif type(node) is ast.arg:
            definition = node.arg
        elif isinstance(node, _DEFINITIONS):
            definition = node.name
        elif type(node) is ast.Import:
            for alias in node.names:
                name = alias.asname or alias.name.partition(".")[0]
                names.imports[name] = alias.name if alias.asname else name
        elif type(node) is ast.ImportFrom:
            if node.module and not node.level:
                for alias in node.names:
                    names.imports[alias.asname or alias.name] = f"{node.module}.{alias.name}"
        elif type(node) is ast.Assign and type(node.value) is ast.Call:
            target, class_name = node.targets[0], _find_structure(node.value.func)
            if class_name and type(target) is ast.Name and len(node.targets) == 1:
                names.variables[target.id] = class_name
        if definition:
            line = getattr(node, "lineno", 1)
            names.definitions.setdefault(definition, (script.path, line))
    for name, attributes in members.items():
        names.members[name] = names.members.get(name, frozenset()) | attributes


def _find_structure(function: ast.expr) -> str:
    """Return the structure of MuJoCo in a function's name, as in `mujoco.MjData`; else nothing."""
    node: ast.AST | None = function
    while node is not None:
        name: str = getattr(node, "attr", getattr(node, "id", ""))
        if name in _STRUCTURES:
            return name
        node = getattr(node, "func", getattr(node, "value", None))
    return ""


def claims_of(code: model.CodeSpan) -> Iterator[tuple[Claim, Span]]:
    """Yield the claims of a piece of inline code, each with its place."""
    text = code.text.strip()
    finds: list[tuple[Kind, str, str]] = []
    if _SHAPE.search(text) or ENGINE_WORD.fullmatch(text):
        finds += _find(text)
    used_words = {word for _, name, part in finds for word in re.findall(r"\w+", f"{name} {part}")}
    tail, last = _TAIL.match(code.span.source.text, code.span.end), re.search(r"\w+\Z", text)
    if tail is not None and last is not None:
        finds.append(("torn", f"{last[0]} {tail[0]}", last[0]))
    is_markup = "`" in text  # it shows how inline code is written
    plain = (w for w in _PLAIN.findall(text) if w not in used_words and not is_markup)
    finds += (("plain", word, word) for word in dict.fromkeys(plain))
    finds += (("token", token, token) for token in _TOKEN.findall(text))
    for number, (kind, name, part) in enumerate(finds):
        start = code.span.start + code.span.text.find(part)
        has_part = start >= code.span.start
        span = code.span.source.span(start, start + len(part)) if has_part else code.span
        yield Claim(kind, name, not number and kind not in GUESSES), span


def _find(text: str) -> Iterator[tuple[Kind, str, str]]:
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
    elif table := _TABLE.fullmatch(text):
        yield "table", f"{table[1]}{table[2]} {table[3] or ''}", table[3] or table[2]
    elif _HALF.fullmatch(text):
        yield "half", text, text
    elif text.startswith("<"):
        for tag in _TAG.finditer(text):
            yield "element", tag[2], tag[2]
            for attribute in _ATTRIBUTES.findall(tag[3]):
                yield "attribute", f"{tag[2]} {attribute}", attribute
        yield from (("value", value, value) for value in _VALUES.findall(text))
    elif re.fullmatch(rf"(?:{_ATTRIBUTES.pattern})+", text):
        for attribute in _ATTRIBUTES.findall(text):
            yield "attribute", f" {attribute}", attribute
        yield from (("value", value, value) for value in _VALUES.findall(text))
    elif _FILE.fullmatch(text) or _NEAR_FILE.fullmatch(text):
        yield "file", text, text
    elif not re.search(r"\.(?:py|xml|toml|md|json|js|svg|csv|txt|ya?ml|html|rst|css)\b", text):
        yield from _find_python(text)


def _find_python(text: str) -> Iterator[tuple[Kind, str, str]]:
    try:
        tree = ast.parse(text.replace("…", "_").replace("->", "."))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        for word in ENGINE_WORD.findall(text):
            yield "word", word, word
        return
    parts: set[int] = set()
    targets = {
        n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    }
    for node in ast.walk(tree):
        if id(node) in parts:
            continue
        if isinstance(node, ast.Attribute | ast.Call):
            path = _path(node, parts)
            if path is not None and "." in path:
                yield "path", path, re.split(r"[.(\[]", path)[0]
            elif path is not None and not path.startswith("_"):
                name = path.removesuffix("()")
                yield ("word" if _is_telling(name) else "call"), name, name
        elif isinstance(node, ast.Name) and node.id not in targets and _is_telling(node.id):
            yield "word", node.id, node.id


def _is_telling(name: str) -> bool:
    """Whether a word has the shape of a name by itself."""
    return bool(re.search(r"[A-Za-z0-9]_[A-Za-z0-9]", name) or ENGINE_WORD.fullmatch(name))


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
