"""Recognizes a command that has nothing to do, before its arguments are parsed.

1. A command is identified by its arguments as they were given, and by whatever else decides what it
   prints. Parsing arguments takes longer than looking at the files of a course; so a command that
   is spelled in another way counts as another command.
2. It depends on whole folders (the course's, the tool's), on single files that scripts read, on the
   folders that packages are installed in, and on its own outputs (the extracted scripts, the site).
   One hash is taken over all of them: names, modes, sizes, times and inodes.
3. The hash is kept only if nothing changed while the command worked, nor so shortly before that the
   clock of the file system could not show it. In doubt the next run does all its work.

A run with nothing to do loads only this module, so it imports little: paths are strings.
"""

from __future__ import annotations

import hashlib
import os
import resource
import stat
import sys
import time
from collections.abc import Iterator

from coursebuild.core.files import trust
from coursebuild.core.files.course_root import (
    DECISIVE,
    FOLDERS,
    find_course_root,
    is_dropping,
    read_regular,
)
from coursebuild.output import terminal_style

_NO_CACHE = "--no-cache"
_ARGUMENT_VARIABLES = ("COURSEBUILD_CACHE", "COURSEBUILD_CACHE_KEY", "COURSEBUILD_CACHE_SIZE")
"""Environment variables that replace arguments."""
_HEADER = "coursebuild up to date 1"
_FINE = 50_000_000
"""ns: a file changed longer ago than this would get another time by another change."""
_COARSE = 2_100_000_000
"""The same on a file system that counts whole milliseconds or longer."""
_PACKAGES = ("site-packages", "dist-packages")
"""What folders with installed packages are called."""
_VARIABLES = (*DECISIVE, "PYTHONPATH", "VIRTUAL_ENV")


def split_directory(all_words: list[str]) -> tuple[str | None, list[str]]:
    """Return the folder that `-C DIR` names, anywhere before `--`, and all other words."""
    directory, words = None, []
    rest = iter(all_words)
    for word in rest:
        if word == "--":
            words += [word, *rest]
        elif word[:2] != "-C":
            words.append(word)
        elif word != "-C":
            directory = word[2:]
        elif (folder := next(rest, None)) is not None:
            directory = folder
        else:  # the parser reports it
            words.append(word)
    return directory, words


def previous_output(directory: str | None, words: list[str]) -> str | None:
    """Return what this command printed when all was as it is now; `None` if that is unknown."""
    command = identify_command(words)
    if command is None or _NO_CACHE in words:  # most commands store nothing
        return None
    try:
        root = find_course_root(".") if directory is None else directory or "."
        return unchanged(os.path.realpath(root), command) if root else None
    except OSError:  # the working directory is gone, for one
        return None


def identify_command(words: list[str]) -> tuple[str, ...] | None:
    """The identity of a command; `None` where it cannot have one.

    The course is no part of it, since its folder holds what was printed.
    """
    relevant_words = [word for word in words if word != _NO_CACHE]
    is_terminal = sys.stdout is not None and sys.stdout.isatty()
    style = terminal_style(is_terminal=is_terminal)
    addresses = resource.getrlimit(resource.RLIMIT_AS)[0]  # without enough, there is no V8
    conditions = [*style, addresses, *map(os.environ.get, _ARGUMENT_VARIABLES)]
    if any("/" in w or os.sep in w or os.path.exists(w) for w in relevant_words):
        try:
            conditions.append(os.getcwd())  # from where paths are meant
        except OSError:
            return None
    return (*relevant_words, *map(repr, conditions))


class _UnclearError(Exception):
    """Something here may have changed without a sign of it."""


class Watcher:
    """The state of what a command depends on, taken before it begins and when it is done."""

    def __init__(self, root: str, command: tuple[str, ...]) -> None:
        self.root = root
        self.command = command
        self.began = time.time_ns()
        try:
            self.before: str | None = _State(root, self.began).digest()
        except (OSError, _UnclearError):
            self.before = None

    def keep(self, message: str, files: tuple[str, ...], outputs: tuple[str, ...]) -> bool:
        """Record the state, if it is certainly the one that the command saw; return whether it was.

        `message` is what a later run with nothing to do prints instead of working. `files` are
        further ones that the command depends on, `outputs` what it made, absolute or relative to
        the root; they need not exist.
        """
        input_paths = sorted({os.path.join(self.root, path) for path in files})
        output_paths = sorted(os.path.join(self.root, path) for path in outputs)
        if any("\n" in path for path in (*input_paths, *output_paths)):
            return False
        try:
            state = _State(self.root, self.began)
            if state.digest() != self.before:
                return False
            state.add_paths(input_paths, self.began)
            state.add_paths(output_paths)
        except (OSError, _UnclearError):
            return False
        body = "\n".join((_HEADER, state.digest(), *input_paths, *output_paths, "", message))
        data = body.encode("utf-8", "surrogateescape")
        name = _name(self.command)
        store, reason = trust.find_store(self.root)
        if reason and reason != trust.FOREIGN:  # it is worth a warning, in the next run too
            return False
        path = os.path.join(store, name)
        try:
            trust.make_store(store, self.root)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            trust.replace_file(path, trust.seal(name, data, trust.store_key(self.root)))
        except OSError:
            return False
        return True


def unchanged(root: str, command: tuple[str, ...]) -> str | None:
    """The message of the command's last run; `None` where anything has changed since."""
    try:
        name = _name(command)
        store, reason = trust.find_store(root)
        if reason and reason != trust.FOREIGN:
            return None
        sealed = read_regular(os.path.join(store, name))
        body = trust.unseal(name, sealed, trust.store_key(root)) or b""
        head, _, message = body.decode("utf-8", "surrogateescape").partition("\n\n")
        header, *lines = head.split("\n")
        if header != _HEADER:
            return None
        state = _State(root)
        state.add_paths(lines[1:])
        return message if state.digest() == lines[0] else None
    except (OSError, ValueError, _UnclearError):
        return None


class _State:
    """A hash over the stat of all that a command depends on: the course, the tool, added paths.

    Raises:
        _UnclearError: there is a link to a folder, whose content is elsewhere; or a file was
            changed after `began`, or so shortly before that its time proves nothing.
        OSError: something cannot be read.
    """

    def __init__(self, root: str, began: int | None = None) -> None:
        self._hash = hashlib.blake2b(digest_size=32)
        self._add(sys.version, sys.executable, *(os.environ.get(name, "") for name in _VARIABLES))
        package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        source = os.path.dirname(package)
        paths = [os.path.join(root, name) for name in FOLDERS]
        paths += (folder for folder in sys.path if folder.endswith(_PACKAGES))
        paths.append(package)
        if os.path.isdir(os.path.join(source, "site", "dist")):
            paths += (os.path.join(source, n) for n in ("mjcourse", "templates", "site/dist"))
        self.add_paths(paths, began)

    def add_paths(self, paths: list[str], began: int | None = None) -> None:
        for path in paths:
            for row in _rows(path, began):
                self._add(*row)

    def _add(self, *parts: object) -> None:
        row = "\0".join(map(str, (*parts, ""))) + "\n"
        self._hash.update(row.encode("utf-8", "surrogateescape"))

    def digest(self) -> str:
        """The hash of what has been added until now."""
        return self._hash.hexdigest()


def _rows(path: str, began: int | None) -> Iterator[tuple[object, ...]]:
    """What is at a path, a row each; a folder with everything in it."""
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        yield path, "nothing"
        return
    if path.endswith(_PACKAGES):  # each package has a folder with its version in the name
        yield path, status.st_mtime_ns, status.st_ino
        return
    if not stat.S_ISDIR(status.st_mode):
        yield path, *_numbers(status, began)
        return
    folders = [path]
    for folder in folders:
        yield folder, "folder"
        with os.scandir(folder) as entries:
            contents = [entry for entry in entries if not is_dropping(entry.name)]
        for entry in sorted(contents, key=lambda entry: entry.name):
            if entry.is_dir(follow_symlinks=False):
                folders.append(entry.path)
            elif not entry.is_symlink():
                yield entry.name, *_numbers(entry.stat(follow_symlinks=False), began)
            elif entry.is_dir():
                raise _UnclearError
            else:
                yield entry.name, os.readlink(entry.path)
                yield from _rows(entry.path, began)


def _numbers(status: os.stat_result, began: int | None) -> tuple[int, ...]:
    modified = status.st_mtime_ns
    if began is not None and modified > began - (_FINE if modified % 1_000_000 else _COARSE):
        raise _UnclearError
    # With the time of the last change of any kind, as an edit may set the modification time back.
    return status.st_mode, status.st_size, modified, status.st_ctime_ns, status.st_ino


def _name(command: tuple[str, ...]) -> str:
    text = "\0".join(command).encode("utf-8", "surrogateescape")
    return f"unchanged/{hashlib.blake2b(text, digest_size=32).hexdigest()}"
