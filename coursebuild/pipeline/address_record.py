"""The addresses of the values that a lesson shows, kept in a file of text beside it.

A line for each value, in the order of the lesson, so that branches merge. It is written when the
lesson was checked without an error, and by `update`; a line that cannot be read counts for nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import Document
from coursebuild.core.model.lesson_record import Address
from coursebuild.core.scripts.bound_places import document_values
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.provenance import Addresses, ShownValue


class _Line(Struct, frozen=True, omit_defaults=True):
    text: str
    script: str
    before: str
    at: tuple[Address, ...]
    nth: int = 0
    count: int = 1


def addresses_path(document: str) -> str:
    """The file with the addresses of a lesson or page."""
    return f"{document.removesuffix('.md')}.addresses.jsonl"


def read_addresses(root: Path, documents: Iterable[Document]) -> Addresses:
    """What is remembered of these documents."""
    addresses: Addresses = {}
    for path in (document.source.path for document in documents):
        for data in _read(root, path).splitlines():
            try:
                line = msgspec.json.decode(data, type=_Line)
            except msgspec.DecodeError:
                continue
            value = ShownValue(path, line.script, line.before, line.text, line.nth, line.count)
            addresses[value] = line.at
    return addresses


def write_addresses(
    root: Path,
    documents: Iterable[Document],
    outputs: PrintedOutputs,
    addresses: Addresses,
    broken: Collection[str] = (),
) -> None:
    """Remember where the values of documents were printed, but for those that have mistakes."""
    for document in documents:
        path = document.source.path
        if path in broken:
            continue
        lines = [
            _Line(value.text, value.script, value.before, addresses[value], value.nth, value.count)
            for value in document_values(document, outputs)
            if value in addresses
        ]
        data = b"".join(msgspec.json.encode(line) + b"\n" for line in lines)
        before = _read(root, path)
        if data != before:
            write_atomic(root, addresses_path(path), data, expected=before or None)


def _read(root: Path, document: str) -> bytes:
    try:
        return read_regular(root / addresses_path(document))
    except OSError:
        return b""
