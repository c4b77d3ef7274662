"""Which files MuJoCo opens for a model, worked out from the text of the model.

Entry point: `ModelFiles`. Checked against the system calls of MuJoCo 3.14.0.

1. Includes are read; a relative one is looked for beside the model that was opened first, then in
   the folder of the file that includes it, as that was named, again relative to the model's.
2. Attributes of `compiler`, wherever they stand, say in which folders the assets are.
3. An asset that the caller hands over as bytes is not looked for: MuJoCo knows those by the last
   component of their names.
4. A model named by `<model file="..."/>` is a model of its own.

The text is scanned, not parsed: what is no XML to MuJoCo gives its own file and perhaps too many.
"""

from __future__ import annotations

import functools
import html
import posix
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

_MESH = frozenset(("mesh", "hfield", "skin"))
_CUBE = tuple(f"file{side}" for side in ("right", "left", "up", "down", "front", "back"))
_DEEPEST = 32
_COMMENTS = re.compile(rb"<!--.*?-->", re.DOTALL)
_TAGS = re.compile(rb"<([A-Za-z_][\w:.-]*)((?:[^<>\"']|\"[^\"]*\"|'[^']*')*)>")
_ATTRIBUTES = re.compile(rb"([\w:.-]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")


class ModelFiles:
    """Finds the files of models; `note` is told of each, whether it is there or not.

    `given` are the names of files that are handed over as bytes. Without `assets` only includes are
    looked for.
    """

    def __init__(
        self, note: Callable[[str], None], given: Iterable[str] = (), *, assets: bool = True
    ) -> None:
        self._note = note
        self._given = frozenset(map(_last, given))
        self._assets = assets

    def of_path(self, path: str | bytes) -> None:
        """The files of the model in a file, with that file."""
        self._model(_decode(path) if isinstance(path, bytes) else path, 0)

    def of_text(self, text: str | bytes, folder: str = "") -> None:
        """The files of a model that is a text, relative to the working folder or another one."""
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        self._scan(data, folder and f"{folder.rstrip('/')}/", 0)

    def of_spec(self, spec: Any) -> None:
        """The assets of an `MjSpec`, which are read when it is compiled."""
        self._given |= frozenset(map(_last, spec.assets))
        strip = bool(spec.strippath)
        mesh = functools.partial(_places, spec.modelfiledir, spec.meshdir, strip=strip)
        texture = functools.partial(_places, spec.modelfiledir, spec.texturedir, strip=strip)
        for kind in ("meshes", "hfields", "skins"):
            for each in getattr(spec, kind):
                self._asset(mesh(each.file))
        for each in spec.textures:
            for file in (each.file, *each.cubefiles):
                self._asset(texture(file))

    def _model(self, path: str, depth: int) -> None:
        if _last(path) in self._given:
            return
        self._note(path)
        data = _contents(path)
        if data is not None:
            self._scan(data, path[: path.rfind("/") + 1], depth)

    def _scan(self, data: bytes, folder: str, depth: int) -> None:
        tags = list(self._included(data, folder, "", 0))
        if not self._assets:
            return
        compiler: dict[str, str] = {}
        for tag, attributes in tags:
            if tag == "compiler":
                compiler |= attributes
        both = compiler.get("assetdir", "")
        strip = compiler.get("strippath") == "true"
        mesh = functools.partial(_places, folder, compiler.get("meshdir", both), strip=strip)
        texture = functools.partial(_places, folder, compiler.get("texturedir", both), strip=strip)
        for tag, attributes in tags:
            file = attributes.get("file", "")
            if tag in _MESH:
                self._asset(mesh(file or attributes.get("filename", "")))
            elif tag == "texture":
                for name in ("file", *_CUBE):
                    self._asset(texture(attributes.get(name, "")))
            elif tag == "flexcomp":
                self._asset([*_join(folder, file), *mesh(file)])
            elif tag == "model" and file and depth < _DEEPEST:
                found = self._asset([*_join("", file), *_join(folder, file)])
                if found:
                    self._model(found, depth + 1)

    def _included(
        self, data: bytes, folder: str, here: str, depth: int
    ) -> Iterator[tuple[str, dict[str, str]]]:
        """Every tag of a text and of what it includes, with its attributes."""
        for tag in _TAGS.finditer(_COMMENTS.sub(b"", data)):
            name = _decode(tag[1])
            attributes = {
                _decode(key): html.unescape(_decode(one or two))
                for key, one, two in _ATTRIBUTES.findall(tag[2])
            }
            if name != "include":
                yield name, attributes
                continue
            file = attributes.get("file", "")
            candidates = _join(folder, file)
            if here and file:
                candidates += _join(folder, here + file)
                candidates += _join(folder, here + here.lstrip("/") + file)
            path = self._asset(candidates)
            if path and depth < _DEEPEST and (inner := _contents(path)) is not None:
                below = path[: path.rfind("/") + 1]
                yield from self._included(inner, folder, below, depth + 1)

    def _asset(self, candidates: list[str]) -> str:
        """Note a file, which is the first of these that is there; it, or nothing."""
        if candidates and _last(candidates[0]) in self._given:
            return ""
        for candidate in candidates:
            self._note(candidate)
            try:
                posix.stat(candidate)
            except (OSError, ValueError):
                continue
            return candidate
        return ""


def _places(folder: str, inner: str, file: str, *, strip: bool) -> list[str]:
    """Where an asset is looked for, whose kind has a folder of its own; nowhere without a name."""
    if not file:
        return []
    if strip:
        file = _last(file)
    if inner and not inner.endswith("/"):
        inner += "/"
    return _join(folder, inner + file if not file.startswith("/") else file)


def _join(folder: str, file: str) -> list[str]:
    if not file:
        return []
    if not folder or file.startswith("/"):
        return [file]
    return [folder + file if folder.endswith("/") else f"{folder}/{file}"]


def _last(path: str) -> str:
    return path.replace("\\", "/").rpartition("/")[2]


def _contents(path: str) -> bytes | None:
    try:
        fd = posix.open(path, posix.O_RDONLY | posix.O_CLOEXEC)
    except (OSError, ValueError):
        return None
    try:
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
