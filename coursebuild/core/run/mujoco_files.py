"""Which files MuJoCo opens for a model, worked out from the text of the model.

This was checked against the system calls of MuJoCo 3.14.0.

1. Includes are read; a relative one is looked for in the folder of the model that was opened first,
   then in the folder of the file that includes it, as that was named, again relative to the first.
2. Attributes of `compiler`, wherever they stand, say in which folders the assets are.
3. An asset that the caller hands over as bytes is not looked for: MuJoCo knows those by the last
   component of their names.
4. A model named by `<model file="..."/>` is a model of its own.

The text is scanned, not parsed: a text that is no XML to MuJoCo may give too many files. It takes
time that grows with the text, however broken or tangled the files are: each is scanned once, and a
text that is too long, or no regular file, is not.
"""

from __future__ import annotations

import functools
import html
import posix
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from typing import Any

_MESH = frozenset(("mesh", "hfield", "skin"))
_CUBE = tuple(f"file{side}" for side in ("right", "left", "up", "down", "front", "back"))
_NAMING = _MESH | {"compiler", "flexcomp", "include", "model", "texture"}
"""The elements that say where files are."""
_DEEPEST = 32
LONGEST = 8 << 20
"""Bytes of a file that is scanned."""
MARKUP = re.compile(
    r"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<(?P<end>/?)(?P<name>[A-Za-z_][\w:.-]*+)"
    r"(?P<rest>(?>(?:[^<>\"']|\"[^\"]*+\"|'[^']*+')*))>",
    re.DOTALL,
)
ATTRIBUTE = re.compile(r"(?<![\w:.-])([\w:.-]++)\s*+=\s*+(?:\"([^\"]*+)\"|'([^']*+)')")


class ModelFiles:
    """Calls `note` with each file that a model is made of, whether it is there or not.

    `given_names` are the names of files that the caller hands over as bytes. Without `assets`, only
    includes are looked for.
    """

    def __init__(
        self, note: Callable[[str], None], given_names: Iterable[str] = (), *, assets: bool = True
    ) -> None:
        self._note = note
        self._given_names = frozenset(map(_base_name, given_names))
        self._assets = assets

    def scan_path(self, path: str | bytes) -> None:
        """Note a model's file and the files that it is made of."""
        self._scan_model(_decode(path) if isinstance(path, bytes) else path, 0, set())

    def scan_text(self, text: str | bytes, folder: str = "") -> None:
        """Note the files of a model given as text; relative ones belong to `folder`."""
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        self._scan_text(data, folder and f"{folder.rstrip('/')}/", 0, set())

    def scan_spec(self, spec: Any) -> None:
        """Note the assets of an `MjSpec`, which are read when it is compiled."""
        self._given_names |= frozenset(map(_base_name, spec.assets))
        find = functools.partial(_asset_candidates, spec.modelfiledir, strip=bool(spec.strippath))
        for kind in ("meshes", "hfields", "skins"):
            for element in getattr(spec, kind):
                self._find_asset(find(spec.meshdir, element.file))
        for element in spec.textures:
            for file in (element.file, *element.cubefiles):
                self._find_asset(find(spec.texturedir, file))

    def _scan_model(self, path: str, depth: int, scanned: set[str]) -> None:
        """`scanned`: the models that have been, to which this is added."""
        if _base_name(path) in self._given_names:
            return
        self._note(path)
        if path in scanned:
            return
        scanned.add(path)
        data = _read_file(path)
        if data is not None:
            self._scan_text(data, path[: path.rfind("/") + 1], depth, scanned)

    def _scan_text(self, data: bytes, folder: str, depth: int, scanned: set[str]) -> None:
        tags = list(self._read_tags(data, folder, "", 0, set()))
        if not self._assets:
            return
        compiler: dict[str, str] = {}
        for tag, attributes in tags:
            if tag == "compiler":
                compiler |= attributes
        asset_folder = compiler.get("assetdir", "")
        mesh_folder = compiler.get("meshdir", asset_folder)
        texture_folder = compiler.get("texturedir", asset_folder)
        strip = compiler.get("strippath") == "true"
        find = functools.partial(_asset_candidates, folder, strip=strip)
        for tag, attributes in tags:
            file = attributes.get("file", "")
            if tag in _MESH:
                self._find_asset(find(mesh_folder, file or attributes.get("filename", "")))
            elif tag == "texture":
                for name in ("file", *_CUBE):
                    self._find_asset(find(texture_folder, attributes.get(name, "")))
            elif tag == "flexcomp":
                self._find_asset([*_join(folder, file), *find(mesh_folder, file)])
            elif tag == "model" and file and depth < _DEEPEST:
                path = self._find_asset([*_join("", file), *_join(folder, file)])
                if path:
                    self._scan_model(path, depth + 1, scanned)

    def _read_tags(
        self, data: bytes, folder: str, subfolder: str, depth: int, included: set[str]
    ) -> Iterator[tuple[str, dict[str, str]]]:
        """The tags that name files, of a text and of what it includes, with their attributes."""
        for name, attributes in _tags(data):
            if name != "include":
                yield name, attributes
                continue
            file = attributes.get("file", "")
            candidates = _join(folder, file)
            if subfolder and file:
                candidates += _join(folder, subfolder + file)
                candidates += _join(folder, subfolder + subfolder.lstrip("/") + file)
            path = self._find_asset(candidates)
            if not path or depth >= _DEEPEST or path in included:  # MuJoCo includes a file once
                continue
            included.add(path)
            if (inner := _read_file(path)) is not None:
                inner_subfolder = path[: path.rfind("/") + 1]
                yield from self._read_tags(inner, folder, inner_subfolder, depth + 1, included)

    def _find_asset(self, candidates: list[str]) -> str:
        """Note these paths up to the first that exists, and return that; empty if none does."""
        if candidates and _base_name(candidates[0]) in self._given_names:
            return ""
        for candidate in candidates:
            self._note(candidate)
            try:
                posix.stat(candidate)
            except (OSError, ValueError):
                continue
            return candidate
        return ""


@functools.lru_cache(maxsize=8)
def _tags(data: bytes) -> tuple[tuple[str, dict[str, str]], ...]:
    """The tags of a text that name files, with their attributes: many may include the same text."""
    return tuple(
        (
            tag["name"],
            {
                key: html.unescape(double_quoted or single_quoted)
                for key, double_quoted, single_quoted in ATTRIBUTE.findall(tag["rest"])
            },
        )
        for tag in MARKUP.finditer(_decode(data))
        if tag["name"] in _NAMING and not tag["end"]
    )


def _asset_candidates(folder: str, inner: str, file: str, *, strip: bool) -> list[str]:
    if not file:
        return []
    if strip:
        file = _base_name(file)
    if inner and not inner.endswith("/"):
        inner += "/"
    return _join(folder, inner + file if not file.startswith("/") else file)


def _join(folder: str, file: str) -> list[str]:
    if not file:
        return []
    if not folder or file.startswith("/"):
        return [file]
    return [folder + file if folder.endswith("/") else f"{folder}/{file}"]


def _base_name(path: str) -> str:
    return path.replace("\\", "/").rpartition("/")[2]


def _read_file(path: str) -> bytes | None:
    try:  # to open a pipe may take for ever, and a device may have no end
        fd = posix.open(path, posix.O_RDONLY | posix.O_CLOEXEC | posix.O_NONBLOCK)
    except (OSError, ValueError):
        return None
    try:
        state = posix.fstat(fd)
        if not stat.S_ISREG(state.st_mode) or state.st_size > LONGEST:
            return None
        parts = []
        while part := posix.read(fd, 1 << 20):
            parts.append(part)
        return b"".join(parts)
    except OSError:
        return None
    finally:
        posix.close(fd)


def _decode(data: bytes) -> str:
    return data.decode("utf-8", "surrogateescape")
