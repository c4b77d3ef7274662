"""The files of the course that is imported: which there are, and the one way to read them.

Entry point: `SourceFiles`, with `find` and `read`.

1. Hidden files are left out, and what tools have made.
2. A link is followed only to a file that is imported itself, or within a folder that is. All other
   links, and what is no regular file, are leftovers with their reasons.
3. A file is opened from the folder downwards, one part of its real path after the other, and none
   may be a link by then.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.files.errors import UsageError, reason
from coursebuild.features.importer.values import Leftover, stem_of

TEXTS = (".md", ".qmd", ".ipynb", ".myst")
"""Extensions of the files that can be lessons."""
_SKIPPED = (
    "_build",
    "_site",
    "_book",
    "node_modules",
    "site-packages",
    "__pycache__",
    "public",
)
"""Names of folders that tools write."""
_MAX_SIZE = 256 << 20
"""Bytes of a file."""
_BAD_NAME = re.compile("[\x00-\x1f\x7f\ud800-\udfff]")
_OPEN_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OPEN_FILE = os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC


class SourceFiles:
    """The files of a folder by their path in it, sorted; or one file, and what it names beside it.

    Of a single file the folder is not listed: `find` adds what is asked for.
    """

    def __init__(self, source: Path) -> None:
        """List the files.

        Raises:
            UsageError: there is no such folder or text.
        """
        place = Path(os.path.realpath(source))
        self.is_single = place.name.endswith(TEXTS) and place.is_file()
        if not self.is_single and not place.is_dir():
            if not os.path.lexists(source):
                raise UsageError(f"there is no folder or file {source}")
            extensions = f"{', '.join(TEXTS[:-1])} or {TEXTS[-1]}"
            message = f"{source} is neither a folder nor a file with the extension {extensions}"
            raise UsageError(message, help="name the folder of its course")
        self.folder = place.parent if self.is_single else place
        self.name = stem_of(place.name) if self.is_single else place.name
        """What the new folder is called, and the course where nothing else gives it a title."""
        self.leftovers: list[Leftover] = []
        self._real_paths: dict[str, str] = {}
        """The path of each file without links, by its path."""
        if self.is_single:
            self._real_paths[place.name] = place.name
        else:
            self._list()

    def __iter__(self) -> Iterator[str]:
        """Iterate over the paths."""
        return iter(tuple(self._real_paths))

    def __contains__(self, path: str) -> bool:
        """Whether a file has this path."""
        return path in self._real_paths

    def find(self, path: str) -> str:
        """Return the path of a file, given perhaps with links to folders; empty for no file."""
        if path in self._real_paths:
            return path
        real = "" if "\0" in path else self._real_path(path)
        if self.is_single and self._is_found(path, real):
            self._real_paths[real] = real
        return real if real in self._real_paths else ""

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            UsageError: it cannot be read.
        """
        parts = self._real_paths[path].split("/")
        try:
            fd = os.open(self.folder, _OPEN_FOLDER)
            try:
                for number, part in enumerate(parts, 1):
                    flags = _OPEN_FOLDER if number < len(parts) else _OPEN_FILE
                    above, fd = fd, os.open(part, flags, dir_fd=fd)
                    os.close(above)
                if not stat.S_ISREG(os.fstat(fd).st_mode):
                    raise OSError("it is not a regular file")
                with open(fd, "rb", closefd=False) as file:
                    return file.read()
            finally:
                os.close(fd)
        except OSError as error:
            raise UsageError(f"{path} cannot be read: {reason(error)}") from None

    def read_text(self, path: str) -> str:
        """Return a text with LF line ends.

        Raises:
            UsageError: it cannot be read, or is not UTF-8.
        """
        try:
            text = self.read(path).decode("utf-8-sig")
        except UnicodeDecodeError:
            raise UsageError(f"{path} is not UTF-8") from None
        return text.replace("\r\n", "\n").replace("\r", "\n")

    def _list(self) -> None:
        """Find all files; links last, since they lead to others."""
        links, folders = [], {"."}
        pending = [""]
        while pending:
            folder = pending.pop()
            try:
                with os.scandir(self.folder / folder) as iterator:
                    entries = tuple(iterator)
            except OSError as error:
                self._leave(folder or ".", f"a folder that cannot be read: {reason(error)}")
                continue
            for entry in entries:
                path = f"{folder}/{entry.name}".lstrip("/")
                if _is_skipped(entry.name):
                    continue
                if _BAD_NAME.search(entry.name):
                    name = path.encode("unicode_escape").decode()
                    self._leave(name, "the name is not UTF-8, or holds a control character")
                    continue
                try:
                    status = entry.stat(follow_symlinks=False)
                except OSError as error:
                    self._leave(path, reason(error))
                    continue
                if stat.S_ISLNK(status.st_mode):
                    links.append(path)
                elif stat.S_ISDIR(status.st_mode):
                    pending.append(path)
                    folders.add(path)
                elif not stat.S_ISREG(status.st_mode):
                    self._leave(path, "a pipe, socket or device, which is not read")
                elif status.st_size > _MAX_SIZE:
                    self._leave(path, f"a file larger than {_MAX_SIZE >> 20} MiB")
                else:
                    self._real_paths[path] = path
        regular_paths = {*self._real_paths}
        for link in links:
            real = self._real_path(link)
            if real in regular_paths:
                self._real_paths[link] = real
            elif not real:
                self._leave(link, _LINK_OUT)
            elif not os.path.lexists(self.folder / real) or Path(self.folder, real).is_symlink():
                self._leave(link, "a link that leads nowhere")
            elif real not in folders:
                self._leave(link, "a link to what is not imported")
        self._real_paths = dict(sorted(self._real_paths.items(), key=lambda e: e[0].split("/")))

    def _real_path(self, path: str) -> str:
        """Return the path of what all links in a path lead to; empty if it is not in the folder."""
        try:
            real = Path(os.path.realpath(self.folder / path))
        except OSError:  # it was a link a moment ago
            return ""
        return real.relative_to(self.folder).as_posix() if real.is_relative_to(self.folder) else ""

    def _is_found(self, path: str, real: str) -> bool:
        """Whether a single file may take this one along."""
        if not real and not path.startswith("../"):
            self._leave(path, _LINK_OUT)
        is_public = not any(map(_is_skipped, (*path.split("/"), *real.split("/"))))
        return is_public and Path(self.folder, real).is_file()

    def _leave(self, path: str, message: str) -> None:
        leftover = Leftover(path, "", message)
        if leftover not in self.leftovers:
            self.leftovers.append(leftover)


_LINK_OUT = "a link leads out of the folder, and nothing behind it is read"


def _is_skipped(name: str) -> bool:
    return name.startswith(".") or name in _SKIPPED
