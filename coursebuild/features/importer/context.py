"""What a lesson names, while it is converted: files, other lessons, anchors, sources."""

from __future__ import annotations

import contextlib
import posixpath
import re
from base64 import b64decode
from collections.abc import Mapping, Sequence
from urllib.parse import unquote, urlsplit

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.api import regex
from coursebuild.core.drawing.safe_svg import without_refused
from coursebuild.core.values import fingerprint
from coursebuild.features.importer.account import shorten_value
from coursebuild.features.importer.source_files import TEXTS, SourceFiles, stem_of


class JoinedCells(Struct):
    """Cells of a text that go on from each other, as one script."""

    path: str
    lines: list[str] = field(default_factory=list)
    printed: str = ""
    """What is recorded below them."""

    def add(self, code: str, printed: str) -> str:
        """Add a cell, and return the name of its lines in the script."""
        first = len(self.lines) + 1
        self.lines += code.split("\n")
        if printed:
            self.printed += printed.removesuffix("\n") + "\n"
        return f"L{first}-L{len(self.lines)}"


class LessonContext(Struct, frozen=True, kw_only=True):
    """Resolves what a lesson names while it is converted, and collects files and leftovers.

    Lessons of a course, and places in a lesson, have contexts that collect together.
    """

    targets: Mapping[str, str]
    """New addresses of lessons and pages, by the path of the old file without extension."""
    ids: Mapping[str, str]
    """New ids of lessons, by the old ones."""
    labels: Mapping[str, str]
    """The address of the lesson or page that sets an anchor, by the anchor."""
    files: SourceFiles
    models: Mapping[str, str]
    """New paths of models and of what lies beside them, by their paths."""
    camera_is_position: bool
    path: str = ""
    """The lesson's file, relative to the folder that is imported."""
    folder: str = ""
    """The folder of the new file, such as `content/lessons`."""
    place: str = ""
    """The place in the lesson that is converted, as `line 12` or `cell 3`."""
    substitutions: Mapping[str, str] = {}
    """What names between double braces stand for, as settings say."""
    is_mdx: bool = False
    """Whether tags of the lesson may be components of JavaScript."""
    depth: int = 0
    """How many blocks are around the place."""
    copies: dict[str, bytes] = field(default_factory=dict)
    """The files and pictures that the lesson uses, by their new paths."""
    references: frozenset[str] = frozenset()
    """The labels of links by reference that the lesson defines, in lower case."""
    title: str = ""
    """The heading above the place, by which a figure is called that has no caption."""
    script_path: str = ""
    """Of the script that the lesson's cells become."""
    parts: list[str] = field(default_factory=list)
    """The cells that are parts of it by now."""
    scripts: list[str] = field(default_factory=list)
    """The scripts that its cells of other languages are."""
    joined: dict[str, JoinedCells] = field(default_factory=dict)
    """The scripts that its cells of other languages are together, by language."""
    single_languages: frozenset[str] = frozenset()
    """The languages of which it has a single cell."""
    drawing: dict[str, str] = field(default_factory=dict)
    """The functions by which its cells make figures, each with the name of its pyplot."""
    figures: list[str] = field(default_factory=list)
    """The files that it draws."""
    notebook_outputs: list[tuple[str, str]] = field(default_factory=list)
    """The outputs that are recorded in notebooks, each with the path of its script."""
    sources: Mapping[str, str] = {}
    """The authors of the works in the BibTeX files of the folder, by their keys."""
    cited: set[str] = field(default_factory=set)
    """The sources that a text cites."""
    notes: list[str] = field(default_factory=list)
    """The texts of notes that stand within a line."""
    labs: dict[str, dict[str, object]] = field(default_factory=dict)
    """The fields of labs that coursebuild does not have, each with a value, by kind."""
    callouts: dict[str, str] = field(default_factory=dict)
    """Labels of kinds of callouts that coursebuild does not have, by kind."""
    macros: dict[str, str] = field(default_factory=dict)
    """Those of formulas that the texts use, by name."""

    prints: dict[int, list[str]] = field(default_factory=dict)
    """The lines of the lesson's script that print values for its text, by the number of parts."""
    values: dict[str, tuple[int, str]] = field(default_factory=dict)
    """The names that these values are printed with; each with its place, and what it is."""

    def at(self, place: str) -> LessonContext:
        """Return the context of a place in the lesson."""
        return replace(self, place=place)

    def line_below(self, lines: int) -> LessonContext:
        """Return the context of so many lines further down; a cell is a single place."""
        kind, _, number = self.place.partition(" ")
        return self.at(f"line {int(number) + lines}") if kind == "line" else self

    def leave(self, kind: str, message: str) -> None:
        """Note that something has no counterpart, why, and what to do."""
        self.files.leave(self.path, message, kind, self.place)

    def change(self, kind: str, change: str, count: int = 1) -> None:
        """Note that things of a kind were changed in a way."""
        self.files.change(kind, change, count)

    def print_value(self, language: str, code: str) -> str:
        """Let the cells above print a value that the text shows, and return its name; or nothing.

        The name is of words: by these a number of the text finds what was printed.
        """
        lines, place = self.prints.setdefault(len(self.parts), []), len(self.parts)
        if language != "python":
            lines = self.joined[language].lines if language in self.joined else []
            place = len(lines)
        if not place:
            return ""
        words = re.sub(r"\bf(?=[\"'])|:[^{}:]*(?=\})", "", code)
        words = name = " ".join(re.findall(r"[^\W\d]\w*", words)) or "value"
        while self.values.setdefault(name, (place, code)) != (place, code):
            name = f"{words} {len(self.values)}"
        if (line := PRINTS[language].format(name, code)) not in lines:
            lines.append(line)
        return name

    def add_note(self, words: str) -> str:
        """Return the mark of a note that stands at the end of the lesson."""
        self.notes.append(words)
        return f"[^note-{len(self.notes)}]"

    def resolve_link(self, address: str) -> str:
        """Return the new address of a link; empty where nothing in the course has it."""
        route = re.fullmatch(r"#?/lessons?/([^#?/]+)/?(#.*)?", address)
        if route is not None:
            id = self.ids.get(unquote(route[1]))
            if id is None:
                message = f"a link to `{address}`, a lesson that the map does not have"
                self.leave("link", message)
            return "" if id is None else f"lesson:{id}{route[2] or ''}"
        if re.match("(?:inv|xref):|@ref ", address):  # of Sphinx, MyST and Doxygen
            if resolved := self.resolve_anchor(to_anchor(address.removeprefix("@ref "))):
                return resolved
            self.leave("link", f"a link to `{address}`, which its tool finds elsewhere")
            return ""
        if address.startswith("eq") and (resolved := self.resolve_formula(address)):
            return resolved
        parts = urlsplit(re.sub("^(?:project|path):", "", address))
        if parts.scheme in ("javascript", "data"):
            self.leave("link", f"a link to `{shorten_value(address)}`, a program or data")
            return ""
        if parts.scheme or parts.netloc or not parts.path:  # a label may hold a colon
            return (parts.path and self.resolve_anchor(to_anchor(address))) or parts.geturl()
        path = self.resolve_path(parts.path)
        anchor = f"#{parts.fragment}" if parts.fragment else ""
        stem = stem_of(path)  # the first text of a folder is often called by the folder
        folder = path if stem == path else stem.removesuffix("/index")
        own_route = path.removeprefix("docs/")
        has_order = without_order(parts.path) != parts.path  # of another text, if no file has it
        bare = stem if has_order else without_order(stem)
        names = [stem, path, f"{folder}/index", f"{folder}/README", own_route, bare]
        if self.files.mkdocs:  # from the address of its own page, which is a folder
            page = re.sub(r"(?:^|/)(?:index|README)\Z", "", stem_of(self.path))
            below = posixpath.normpath(posixpath.join(page, parts.path))
            names = [below, f"{below}/index", *names]
        target = next(filter(None, map(self.targets.get, names)), None)
        if target is None and address.startswith("/"):  # the folder of a site's texts is no route
            ends = (f"/{bare}", f"/{bare}/index")
            links = {link for stem, link in self.targets.items() if f"/{stem}".endswith(ends)}
            target = links.pop() if len(links) == 1 else None
        if target is not None:
            return target + anchor
        if path in self.files:
            return self.add_file(path)
        if resolved := self.resolve_anchor(to_anchor(address)):
            return resolved
        self.leave("link", f"a link to `{address}`, which is not in the folder")
        return ""

    def are_sources(self, keys: Sequence[str]) -> bool:
        """Whether all these are keys of sources; they are cited then."""
        if not self.sources.keys() >= {*keys}:
            return False
        self.cited.update(keys)
        return True

    @property
    def has_citations(self) -> bool:
        """Whether its tool may read `[@key]` as a citation."""
        files = self.files
        return bool(self.sources) or not (files.mkdocs or files.docusaurus or "book.toml" in files)

    def cite_in_words(self, key: str, place: str = "") -> str:
        """Return a source of the list as a part of a sentence: its authors, and the source."""
        self.cited.add(key)
        return f"{self.sources[key]} [@{key}{place and f', {place}'}]".lstrip()

    @property
    def has_marks(self) -> bool:
        """Whether its tool reads `~` and `^` as what lowers and raises, and commands of LaTeX."""
        return self.is_pandoc or bool(self.files.mkdocs)

    @property
    def is_pandoc(self) -> bool:
        """Whether Pandoc reads it."""
        return self.path.endswith((".qmd", ".Rmd"))

    def resolve_picture(self, source: str) -> str:
        """Return the new address of a picture or file; empty where none here has it."""
        if data := _DATA.fullmatch(source):
            with contextlib.suppress(ValueError):
                name = f"{stem_of(self.path)}/{fingerprint(source)[:8]}.{data['kind']}"
                return self._add_copy(name, b64decode(data["text"]))
        path = self.resolve_path(urlsplit(source).path)
        return self.add_file(path) if path in self.files and not path.endswith(TEXTS) else ""

    def resolve_anchor(self, anchor: str) -> str:
        """Return the address of an anchor; empty where no text of the course sets it."""
        names = (anchor, *(f"{kind}:{anchor}" for kind in NUMBERED))
        anchor = next((name for name in names if name in self.labels), anchor)
        target = self.labels.get(anchor)
        if target is None:
            return ""
        is_here = target == self.targets.get(stem_of(self.path))
        return f"#{anchor}" if is_here else f"{target}#{anchor}"

    def resolve_formula(self, label: str) -> str:
        """Return the address of a formula by its label; empty where no text has it."""
        return self.resolve_anchor(f"eq:{label_anchor(label)}")

    def resolve_path(self, path: str) -> str:
        """Return a path that the lesson names, relative to the folder that is imported."""
        path = unquote(path.removeprefix("@site"))
        folder = "" if path.startswith("/") else posixpath.dirname(self.path)
        resolved = posixpath.normpath(posixpath.join(folder, path.lstrip("/")))
        if file := self.files.find(resolved):
            return file
        if stem_of(resolved) in self.targets:
            return resolved
        return next((f for f in self.files if f"/{f}".endswith("/" + path.lstrip("./"))), resolved)

    def resolve_data(self, name: str) -> str:
        """Return the new path of a file that a script names; empty where the folder lacks it."""
        if "." not in name or "\n" in name or len(name) > 200 or re.match(r"\w+://|/", name):
            return ""
        folder = posixpath.dirname(self.path)
        path = self.files.find(posixpath.normpath(posixpath.join(folder, name)))
        if not path or path.endswith((".py", *TEXTS)):
            return ""
        if path in self.models:
            return self.models[path]
        self.add_file(path)
        return f"content/files/{path}"

    def add_file(self, path: str) -> str:
        """Copy a file of the folder, and return its new address."""
        return self._add_copy(path, self.files.read(path))

    def _add_copy(self, name: str, data: bytes) -> str:
        path = f"content/files/{name}"
        if path not in self.copies and name.lower().endswith(".svg"):
            data, parts = without_refused(data)
            if parts:
                words = f"{name}: {', '.join(dict.fromkeys(parts))}"
                self.files.account.change("drawing", "without what none here may hold", words)
        self.copies.setdefault(path, data)
        return posixpath.relpath(path, self.folder).replace(" ", "%20")


_DATA = regex(r"data:\w+/(?P<kind>\w+)[\w.+-]*;base64,(?P<text>.+)")
"""A file that a text holds itself."""
PRINTS = {
    "python": 'print("{}:", {})  # for the text',
    "r": 'cat("{}:", format({}), "\\n")  # for the text',
    "julia": 'println("{}: ", {})  # for the text',
}
"""What prints a value with a name, by the languages of cells."""
PROOF_LABELS = {
    "thm": "theorem",
    "lem": "lemma",
    "cor": "corollary",
    "prp": "proposition",
    "cnj": "conjecture",
    "def": "definition",
    "exm": "example",
    "exr": "exercise",
    "sol": "solution",
    "rem": "remark",
    "alg": "algorithm",
    "nte": "note",
    "tip": "tip",
    "wrn": "warning",
    "imp": "important",
    "cau": "caution",
}
"""Kinds of callouts by the labels that Quarto numbers them by."""
NUMBERED = frozenset(
    "theorem lemma definition algorithm axiom proof remark corollary proposition example property "
    "criterion conjecture observation assumption exercise solution lst".split()
)
"""Kinds of which MyST numbers what has a label: callouts, and listings."""


def script_path_of(document: str) -> str:
    """Return the path of the script that the cells of a lesson or page become, by its own path."""
    words = re.findall("[a-z0-9]+", posixpath.basename(stem_of(document)).lower())
    return f"examples/{'' if words and words[0].isalpha() else 'l'}{'_'.join(words)}.py"


def without_order(path: str) -> str:
    """Return a path without the numbers that only order its names; many tools' links lack them."""
    return re.sub(r"(?:^|(?<=/))\d+[-_.]+(?=[^\W\d])", "", path)


def label_anchor(label: str) -> str:
    """Return the anchor of what has a number, without what other tools put before its name."""
    return to_anchor(re.sub(r"^(?:eq|fig|tab|tbl)[-:._]", "", label))


def to_anchor(name: str) -> str:
    """Turn a name, in any script, into an anchor."""
    return re.sub(r"[\W_]+", "-", name).strip("-").lower() or "x"
