"""What travels between the command and its workers, as bytes of msgspec.

Entry points: `pack`, `unpack`; `Request`, which a list of `Answer` answers; `WorkerFacts`,
`Piece`. Decoding makes values of the declared types only and runs no code.
"""

from __future__ import annotations

import json
from typing import TypeVar

import msgspec
from msgspec import Struct

from coursebuild.api import Dependency, ScriptJob, ScriptRun

Message = TypeVar("Message")


class WorkerFacts(Struct, frozen=True):
    """What must be the same on a worker as here, by name."""

    versions: dict[str, str]


class Piece(Struct, frozen=True):
    """A part of a file, or all of it."""

    digest: str
    """Of the whole file."""
    offset: int
    data: bytes
    is_last: bool


class Work(Struct, frozen=True):
    """A script to run, or a function to call with a task."""

    sandbox: bool = False
    job: ScriptJob | None = None
    function: str = ""
    task: bytes = b""


class Request(Struct, frozen=True):
    """Work that is done one after the other, each in the course as it was."""

    course: str
    """The digest of a packed `CourseCopy`, which the worker has."""
    environment: dict[str, str]
    """The variables that decide results, as they are here."""
    works: tuple[Work, ...]


class Answer(Struct, frozen=True):
    """What became of a work."""

    run: ScriptRun | None = None
    dependencies: tuple[Dependency, ...] = ()
    """What the run looked at, in the state that it has on the worker."""
    places: tuple[tuple[str, str], ...] = ()
    """The worker's folders by name, as in `States.places`."""
    written: tuple[tuple[str, bytes], ...] = ()
    """Files of the course that the script has written where it may."""
    result: bytes = b""
    refusal: str = ""
    """Why the worker cannot do it, with what helps in `help`."""
    help: str = ""
    bug: str = ""
    """The traceback of an exception."""
    is_lost: bool = False
    """Whether the process that did it has died."""


def pack(message: object) -> bytes:
    """A message as bytes; names of files may hold bytes that are no text, which need JSON."""
    try:
        return b"m" + msgspec.msgpack.encode(message)
    except UnicodeEncodeError:
        return b"j" + json.dumps(msgspec.to_builtins(message)).encode()


def unpack(data: bytes, kind: type[Message]) -> Message:
    """The message in some bytes.

    Raises:
        ValueError: they hold none of this type.
    """
    if data[:1] == b"m":
        return msgspec.msgpack.decode(data[1:], type=kind)
    return msgspec.convert(json.loads(data[1:]), kind)
