"""What the tool believes of its own: data that this user's tool wrote, and nothing else.

1. A key lies in the user's own state folder, never in a course. It is made when it is first needed.
   With `COURSEBUILD_STORE_KEY` in the environment it is made of that secret, so that a store can
   travel from machine to machine.
2. The store of a course is `.coursebuild` in its folder, if the file `owner` there proves that it
   was made with this key. One that came with the course, or that belongs to another user, is set
   aside: nothing in it is read, written or removed. A folder in the state folder takes its place.
3. What is kept is sealed with the key. Without the right seal it counts as not there.

A run with nothing to do loads this module, so it imports little: paths are strings.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import stat
import sys

FOLDER = ".coursebuild"
"""The folder of the store in a course's folder."""
FOREIGN = "was not made by this user's coursebuild"
"""Why a store is set aside that another machine or an archive brought; not worth a warning."""
TEMPORARY = ".new-"
"""What the names of files begin with while they are written."""
_SECRET = "COURSEBUILD_STORE_KEY"
_OWNER = "owner"
_SIZE = hashlib.sha256().digest_size
_NOWHERE = os.devnull
"""A folder that is not there and that nobody can make."""


def seal(name: str, data: bytes, key: bytes) -> bytes:
    """Data, preceded by a seal of it and of its name, which only those with the key can make."""
    return hmac.digest(key, b"%s\0%s" % (name.encode(), data), "sha256") + data


def unseal(name: str, sealed: bytes, key: bytes) -> bytes | None:
    """The data that was sealed under this name; `None` if the seal is wrong or there is no key."""
    data = sealed[_SIZE:]
    return data if key and hmac.compare_digest(sealed, seal(name, data, key)) else None


def state_folder(root: str) -> str | None:
    """The user's own folder for what no course should hold; it may not be there yet.

    `None` where the user has none, none outside of the course in `root`, or one that others can
    write: what lies there is run, as the environments are.
    """
    base = os.environ.get("XDG_STATE_HOME", "")
    if not os.path.isabs(base):
        home = "Library/Application Support" if sys.platform == "darwin" else ".local/state"
        base = os.path.join(os.path.expanduser("~"), home)
    folder = os.path.realpath(os.path.join(base, "coursebuild"))
    inside = f"{os.path.realpath(root)}{os.sep}"
    if not os.path.isabs(base) or f"{folder}{os.sep}".startswith(inside):
        return None
    try:
        status = os.stat(folder)
    except OSError:  # there is none yet
        return folder
    others_may_write = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return None if status.st_uid != os.geteuid() or others_may_write else folder


def store_key(root: str) -> bytes:
    """The key of this user's stores; empty where there is no place for one."""
    secret = os.environ.get(_SECRET)
    if secret:
        return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).digest()
    folder = state_folder(root)
    if folder is None:
        return b""
    path = os.path.join(folder, "key")
    new = f"{path}.{os.getpid()}"
    try:
        if key := _read_key(path):
            return key
        os.makedirs(folder, mode=0o700, exist_ok=True)
        descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
        try:
            os.write(descriptor, os.urandom(_SIZE))
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        try:
            os.link(new, path)  # unlike a rename it never replaces the key of another process
        except OSError as error:
            # The key that is there is cut, or another user's; or the file system has no links.
            if not isinstance(error, FileExistsError) or not _read_key(path):
                os.replace(new, path)
        if os.path.lexists(new):
            os.unlink(new)
        return _read_key(path)
    except OSError:
        return b""


def _read_key(path: str) -> bytes:
    data = _read(path, os.geteuid())
    return data if len(data) == _SIZE else b""


def _read(path: str, user: int | None = None) -> bytes:
    """A regular file of a user, no larger than a seal, that no link leads to; else empty."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return b""
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_size > _SIZE:
            return b""
        return b"" if user not in (None, status.st_uid) else file.read()


# --- the store of a course


def find_store(root: str) -> tuple[str, str]:
    """The folder of a course's store, and why it is not `.coursebuild` there, mostly empty.

    The folder may not be there yet: see `make_store`. It is one that cannot be made where the user
    has no place for a key, since what is kept without one could never be believed.
    """
    folder = os.path.join(root, FOLDER)
    key = store_key(root)
    if not key:
        reason = "needs a key of its user's own, and there is nowhere to keep it"
        return _NOWHERE, f"{reason}: set HOME, XDG_STATE_HOME or {_SECRET}"
    reason = _strangeness(folder, key)
    if not reason:
        return folder, ""
    state = state_folder(root)
    if state is None:
        return _NOWHERE, reason
    name = hashlib.sha256(os.fsencode(os.path.realpath(root))).hexdigest()
    return os.path.join(state, "stores", name), reason


def _strangeness(folder: str, key: bytes) -> str:
    """Why the folder may not be this user's own store; empty where it is, or can be made."""
    try:
        status = os.lstat(folder)
        if not stat.S_ISDIR(status.st_mode):
            return FOREIGN
        if status.st_uid != os.geteuid():
            return "belongs to another user"
        mark = _read(os.path.join(folder, _OWNER))
        if mark:
            return "" if unseal(_OWNER, mark, key) is not None else FOREIGN
        # Somebody may be about to put a mark into a new folder.
        is_new = all(name.startswith(TEMPORARY) for name in os.listdir(folder))
        return "" if is_new else FOREIGN
    except FileNotFoundError:
        return ""
    except OSError:
        return FOREIGN


def make_store(folder: str, root: str) -> None:
    """Make the folder that `find_store` has found, with the mark of its owner."""
    os.makedirs(folder, exist_ok=True)
    for name, data in ((_OWNER, seal(_OWNER, b"", store_key(root))), (".gitignore", b"*\n")):
        path = os.path.join(folder, name)
        if not os.path.lexists(path):
            replace_file(path, data)


def replace_file(path: str, data: bytes) -> None:
    """Make or replace a file in an existing folder, whole or not at all."""
    new = os.path.join(os.path.dirname(path), f"{TEMPORARY}{os.urandom(8).hex()}")
    try:
        with open(new, "xb") as file:
            file.write(data)
        os.replace(new, path)
    except BaseException:
        try:
            os.unlink(new)
        except OSError:
            pass
        raise
