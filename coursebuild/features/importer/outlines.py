"""The maps of mdBook, GitBook and Docusaurus, which are a text, a program and a folder.

`SUMMARY.md` is a list of links: those before and after it are pages without a number, headings in
it are parts, an empty address is a chapter that is only planned. `sidebars.js` is read where it is
literal; where it is computed, or says so, the order is that of `sidebar_position`.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from urllib.parse import unquote

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import regex
from coursebuild.features.importer.account import shorten_value
from coursebuild.features.importer.segments import read_front_matter
from coursebuild.features.importer.source_files import (
    TEXTS,
    ImportedLevel,
    ImportedText,
    SourceFiles,
    find_group,
    read_yaml,
    stem_of,
    title_of_file,
    value_at,
)


class Outline(Struct, frozen=True, kw_only=True):
    """The map of a course."""

    title: str
    """Empty where nothing gives it."""
    summary: str = ""
    language: str = ""
    parts: tuple[ImportedText | ImportedLevel, ...]
    pages: tuple[ImportedText, ...] = ()


def read_outline(files: SourceFiles) -> Outline | None:
    """Return the map of a folder; `None` where it has none of these."""
    is_mdbook = "book.toml" in files  # else it may be one of GitBook
    book = value_at(files.settings("book.toml"), "book")
    settings = book if is_mdbook else files.settings("book.json")
    key, usual = ("src", "src") if is_mdbook else ("root", "")
    folder = str(value_at(settings, key) or usual)
    name = str(value_at(settings, "structure", "summary") or "SUMMARY.md")
    places = (posixpath.join(folder, name), "SUMMARY.md", "docs/SUMMARY.md")
    path = next((path for path in map(posixpath.normpath, places) if path in files), "")
    if path:
        files.change("map", "content/course.toml")
        outline = _read_summary(path, str(value_at(settings, "title") or ""), files)
        if not is_mdbook:
            return outline
        for key, value in (settings if isinstance(settings, Mapping) else {}).items():
            if key not in ("title", "src", "language", "description", "multilingual"):
                leave_setting("book.toml", key, value, files)
        keys = ("description", "language")
        summary, language = (str(value_at(settings, key) or "") for key in keys)
        return replace(outline, summary=summary, language=language)
    if "conf.py" in files and "index.md" in files:
        return Outline(
            title=find_group(r"(?m)^project\s*=\s*([\"'])(.+?)\1", files.read_text("conf.py")),
            parts=tuple(_read_toctrees("index.md", files, {"index.md"})),
            pages=(ImportedText(file="index.md"),),
        )
    if not (config := files.docusaurus):
        return None
    pattern = r"(?:^|[{,])\s*[\"']?(title|tagline)[\"']?:\s*([\"'`])(.+?)\2"
    fields = re.findall(pattern, files.read_text(config), re.MULTILINE)
    settings = {key: text for key, _, text in reversed(fields)}  # the first is that of the site
    folder = posixpath.dirname(config)  # its texts may stand beside it
    docs = posixpath.join(folder, "docs")
    docs = docs if any(path.startswith(f"{docs}/") for path in files) else "docs"
    pattern = re.escape(posixpath.join(folder, "sidebars.")) + r"[cm]?[jt]s(?:on)?"
    usual_paths = [path for path in files if re.fullmatch(pattern, path)][:1]
    names = re.findall(r"sidebarPath:[^\n]*?([\w./-]+\.[cm]?[jt]s)\b", files.read_text(config))
    paths = (posixpath.normpath(posixpath.join(folder, path)) for path in names)
    parts: list[ImportedText | ImportedLevel] = []
    for name in usual_paths or [path for path in paths if path in files]:
        files.change("map", "content/course.toml")
        text = files.read_text(name)
        sidebars = _read_literal(_SPREAD.sub("", text))
        if sidebars is None:
            message = "a program: the order of lessons is that of `sidebar_position` and of names"
            files.leave(name, message, "map")
            continue
        for words in _SPREAD.findall(text):
            leave_entry(name, words.rstrip(","), files)
        for sidebar in sidebars.values():
            parts += _read_sidebar(sidebar, name, docs, files)
    parts = parts or [*read_folder(docs, files)]
    summary = settings.get("tagline", "")
    return Outline(title=settings.get("title", ""), summary=summary, parts=tuple(parts))


def find_text(name: object, files: SourceFiles) -> str:
    """Return a text's path, given with or without its extension; empty where there is none."""
    if not isinstance(name, str) or not name:
        return ""
    name = posixpath.normpath(name)
    if path := files.find(name):
        return path if path.endswith(TEXTS) else ""
    return next((path for end in TEXTS if (path := files.find(name + end))), "")


def leave_setting(path: str, key: str, value: object, files: SourceFiles) -> None:
    """Note that a setting of a course is left."""
    message = f"the setting `{key}` ({shorten_value(value)}), which a course does not have"
    files.leave(path, message, "setting")


def leave_entry(path: str, name: str, files: SourceFiles, place: str = "") -> None:
    """Note that a map names what is no text of the folder."""
    message = f"the map names `{name}`, which is not in the folder or no text"
    files.leave(path, message, "entry of the map", place)


def group(title: str, lessons: Sequence[ImportedText]) -> Iterator[ImportedText | ImportedLevel]:
    """Yield lessons as a level with a title; one by one where there is no title."""
    if title and lessons:
        yield ImportedLevel(title=title, lessons=tuple(lessons))
    else:
        yield from lessons


# --- mdBook, GitBook

_ENTRY = regex(
    r"(?P<indent>[ \t]*)(?P<item>[-*+][ \t]+)?\[(?P<title>(?:[^\[\]\\]|\\.|\[[^\[\]]*\])*)\]"
    r"\((?:<(?P<spaced>[^<>\n]*)>|(?P<file>[^()<>\s]*))(?:[ \t]+\"[^\"]*\")?\)[ \t]*"
)
_PART = regex(r"#{1,3}[ \t]+(.*?)[ \t]*#*[ \t]*")


_Entry = tuple[int, ImportedText]
"""The blanks before it, -1 outside of the list; and the chapter."""


def _read_summary(path: str, title: str, files: SourceFiles) -> Outline:
    groups: list[tuple[str, list[_Entry]]] = [("", [])]
    is_first = True
    for number, line in enumerate(re.sub(r"<!--.*?-->", "", files.read_text(path)).split("\n"), 1):
        entry, heading = _ENTRY.fullmatch(line), _PART.fullmatch(line)
        if heading is not None:
            if not is_first or not line.startswith("# "):  # the first is the title of the list
                groups.append((heading[1], []))
            is_first = False
        elif entry is not None:
            is_first = False
            address = unquote(entry["spaced"] or entry["file"] or "")
            name = posixpath.join(posixpath.dirname(path), address.partition("#")[0])
            file = find_text(name, files) if address else ""
            if address and not file:
                leave_entry(path, address, files, f"line {number}")
            words = re.sub(r"\\(.)", r"\1", entry["title"]).replace("`", "")
            depth = len(entry["indent"].expandtabs(4)) if entry["item"] else -1
            groups[-1][1].append((depth, ImportedText(file=file, title=words)))
        elif line.strip() and not re.fullmatch(r"[ \t]*-{3,}[ \t]*", line):
            files.leave(
                path, f"`{line.strip()}`, which is no entry", "entry of the map", f"line {number}"
            )
    pages = [text for _, entries in groups for depth, text in entries if depth < 0 and text.file]
    parts: list[ImportedText | ImportedLevel] = []
    for name, entries in groups:
        lessons = [entry for entry in entries if entry[0] >= 0]
        parts += group(name, [text for _, text in lessons]) if name else _group_by_depth(lessons)
    return Outline(title=title, parts=tuple(parts), pages=tuple(pages))


def _group_by_depth(entries: Iterable[_Entry]) -> Iterator[ImportedText | ImportedLevel]:
    """Yield chapters, one that has others below it as a level with them."""
    groups: list[list[ImportedText]] = []
    for depth, text in entries:
        if depth == 0 or not groups:
            groups.append([])
        groups[-1].append(text)
    for texts in groups:
        yield from group(texts[0].title if texts[1:] else "", texts)


# --- Sphinx

_TOCTREE = regex(
    r"^(?P<mark>`{3,}|:{3,})\{toctree\}[ \t]*\n(?P<body>.*?)^(?P=mark)[ \t]*$",
    re.MULTILINE | re.DOTALL,
)
_CAPTION = regex(r"^:?caption:[ \t]*[\"']?(.*?)[\"']?[ \t]*$", re.MULTILINE)


def _read_toctrees(
    path: str, files: SourceFiles, paths: set[str]
) -> Iterator[ImportedText | ImportedLevel]:
    """Yield what the trees of a text name, each with what its own trees name; each text once."""
    for tree in _TOCTREE.finditer(files.read_text(path)):
        parts: list[ImportedText | ImportedLevel] = []
        for line, title, target, children in read_tree(tree["body"], path, files):
            if not children and target != "self":
                leave_entry(path, line, files)
            for child in children:
                if child not in paths:
                    paths.add(child)
                    parts.append(ImportedText(file=child, title=title))
                    parts += _read_toctrees(child, files, paths)
        caption = find_group(_CAPTION, tree["body"])
        yield from make_level(caption, parts, path, files) if caption else parts


def read_tree(
    tree: str, path: str, files: SourceFiles
) -> Iterator[tuple[str, str, str, Sequence[str]]]:
    """Yield the lines of a tree with their titles, what they name, and the texts that this is."""
    for line in re.sub(r"(?s)\A---\n.*?\n---\n", "", tree).split("\n"):
        entry = re.fullmatch(
            r"(?:(?P<title>.*\S)\s+<(?P<target>[^<>]+)>|(?P<name>\S.*))", line.strip()
        )
        if entry is None or line.lstrip().startswith((":", "#")):
            continue
        target = entry["target"] or entry["name"]
        pattern = posixpath.normpath(posixpath.join(posixpath.dirname(path), target.lstrip("/")))
        names = [f for f in files if f.endswith(TEXTS) and fnmatchcase(stem_of(f), pattern)]
        file = find_text(pattern, files)
        yield line.strip(), entry["title"] or "", target, [file] if file else names


# --- Docusaurus

_DOTS = r"(?<![^\s\[{,])\.{3}"
_SPREAD = regex(rf"{_DOTS}[\w.]+(?:\([^()]*\))?,?")
"""What a program adds to an object or a list of JavaScript; `More...` is a text."""


def _read_literal(text: str) -> Mapping[str, object] | None:
    """Return the value of an object of JavaScript; `None` where it is not literal."""
    comments = r"/\*(?s:.*?)\*/|^[ \t]*//.*$|(?<=[,\[{\]}])[ \t]*//.*$"
    text = re.sub(comments, "", text, flags=re.MULTILINE)
    start = re.search(
        r"(?:module\.exports\s*=|sidebars\b[^=\n]*=|export default|\A)\s*(?=\{)", text
    )
    end = text.rfind("}")
    if start is None or re.search(rf"{_DOTS}|=>", text[start.end() : end]):
        return None
    # An object of JavaScript whose values are literal is a value of YAML, but for blanks.
    literal = re.sub(r"([\"'\w])\s*:(?=\S)", r"\1: ", text[start.end() : end + 1]).replace(
        "\t", " "
    )
    value = read_yaml(re.sub(r"(?<=[{,])\s*\?", "", literal))
    return value if isinstance(value, dict) else None


def _read_sidebar(
    items: object, name: str, docs: str, files: SourceFiles
) -> Iterator[ImportedText | ImportedLevel]:
    if isinstance(items, str):
        if path := _find_doc(items, docs, files):
            yield ImportedText(file=path)
        else:
            leave_entry(name, items, files)
    elif isinstance(items, list):
        for item in items:
            yield from _read_sidebar(item, name, docs, files)
    elif isinstance(items, Mapping):
        match items.get("type"):
            case "doc" | "ref":
                yield from _read_sidebar(items.get("id"), name, docs, files)
            case "autogenerated":
                folder = posixpath.normpath(f"{docs}/{items.get('dirName', '.')}")
                yield from read_folder(folder, files)
            case "category":
                link = items.get("link")
                first, summary = (value_at(link, key) for key in ("id", "description"))
                inside = items.get("items")
                if first:
                    inside = [first, *(inside if isinstance(inside, list) else [])]
                parts = _read_sidebar(inside, name, docs, files)
                label = str(items.get("label") or "")
                yield from make_level(label, parts, name, files, str(summary or ""))
            case None:
                for label, inside in items.items():
                    yield from make_level(
                        str(label), _read_sidebar(inside, name, docs, files), name, files
                    )
            case kind:
                words = items.get("label") or items.get("href") or kind
                files.leave(name, f"`{words}` of the map, which is no text", "entry of the map")


def make_level(
    title: str,
    parts: Iterable[ImportedText | ImportedLevel],
    path: str,
    files: SourceFiles,
    summary: str = "",
) -> Iterator[ImportedLevel]:
    """Yield the level of these parts if they have lessons; a part within a part is none here."""
    parts = tuple(parts)
    for part in parts:
        if isinstance(part, ImportedLevel):
            words = f"“{part.title}”{part.summary and f' ({part.summary})'}"
            message = f"the part {words} within a part: its lessons are in that one"
            files.leave(path, message, "entry of the map")
    # A sidebar may name a text once as a category, and again within it
    if lessons := {lesson.file or lesson.title: lesson for lesson in flatten(parts)}:
        yield ImportedLevel(title=title, summary=summary, lessons=tuple(lessons.values()))


def flatten(parts: Iterable[ImportedText | ImportedLevel]) -> Iterator[ImportedText]:
    """Yield the lessons of levels, and those outside of any."""
    for part in parts:
        yield from (part,) if isinstance(part, ImportedText) else part.lessons


def _find_doc(id: str, docs: str, files: SourceFiles) -> str:
    """Return the text with an id of Docusaurus, which has no number that only gives an order."""
    if path := find_text(f"{docs}/{id}", files):
        return path
    for path in files:
        if path.startswith(f"{docs}/") and path.endswith(TEXTS):
            parts = path.removeprefix(f"{docs}/").split("/")
            plain = "/".join(re.sub(r"^\d+[\s._-]+", "", part) for part in parts)
            own_id = _front_matter(path, files).get("id")
            folder = posixpath.dirname(plain)
            if id in (stem_of(plain), posixpath.join(folder, str(own_id))):
                return path
    return ""


# --- MkDocs, and folders of Docusaurus


def read_nav(
    entries: object, folder: str, files: SourceFiles, name: str, rest: Iterable[str] = ()
) -> Iterator[ImportedText | ImportedLevel]:
    """Yield the entries of a `nav`: a file or folder, or a title with one or further entries.

    `name` is that of the map, and `rest` what stands for `...` in it.
    """
    for entry in entries if isinstance(entries, list) else ():
        for title, value in entry.items() if isinstance(entry, Mapping) else [("", entry)]:
            path = posixpath.normpath(posixpath.join(folder, str(value)))
            if value == "...":
                yield from read_nav([*rest], folder, files, name)
            elif isinstance(value, list):
                yield from make_level(
                    str(title), read_nav(value, folder, files, name, rest), name, files
                )
            elif below := [*read_folder(path, files)]:
                category = _category(path, files)
                label = title or category.get("label") or category.get("title")
                words = str(value_at(category, "link", "description") or "")
                yield from make_level(str(label or title_of_file(path)), below, path, files, words)
            elif file := find_text(path, files):
                yield ImportedText(file=file, title=str(title))
            else:
                leave_entry(name, f"{title}: {value}" if title else str(value), files)


def read_folder(folder: str, files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    """Yield what is in a folder, as `nav` of its `.pages` says, or by `sidebar_position`, or names.

    The text that is called as the folder's index is its first.
    """
    entries: list[tuple[float, str]] = []
    start = f"{folder}/".removeprefix("./")
    texts = (path for path in files if path.startswith(start) and path.endswith(TEXTS))
    for child in {path[len(start) :].partition("/")[0] for path in texts}:
        path = f"{start}{child}"
        if path not in files:
            position = _category(path, files).get("position")
        elif not child.startswith("_"):
            position = _front_matter(path, files).get("sidebar_position")
        else:
            continue
        number = re.match(r"\d+", child)
        usual = -1 if stem_of(child) == "index" else int(number[0]) if number else 1e9
        entries.append((position if isinstance(position, int | float) else usual, child))
    names = [child for _, child in sorted(entries)]
    nav = _category(folder, files).get("nav")
    if not isinstance(nav, list):
        nav = names
    values = [value for e in nav for value in (e.values() if isinstance(e, Mapping) else [e])]
    rest = (name for name in names if name not in values)
    yield from read_nav(nav, folder, files, f"{start}.pages", rest)


def _category(folder: str, files: SourceFiles) -> Mapping[str, object]:
    """Return what a file of a folder says of it: its title, its place, or the order within it."""
    names = (*(f"_category_.{end}" for end in ("json", "yml", "yaml")), ".pages")
    paths = (files.find(posixpath.join(folder, name), is_hidden=True) for name in names)
    path = next(filter(None, paths), "")
    value = read_yaml(files.read_text(path)) if path else None  # JSON is YAML
    return value if isinstance(value, dict) else {}


def _front_matter(path: str, files: SourceFiles) -> Mapping[str, object]:
    text = files.read(path).decode("utf-8-sig", "replace").replace("\r\n", "\n")
    files.read_paths.discard(path)  # it is not taken by that
    return read_front_matter(text)[0] if path.endswith((".md", ".mdx")) else {}
