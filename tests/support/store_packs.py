"""Packs of a store, and what a store says."""

from __future__ import annotations

import hashlib
from pathlib import Path

from coursebuild.effects import packs
from coursebuild.effects.store import Store

ROOT = Path(__file__).parents[2]
KEY = hashlib.sha256(b"a key").hexdigest()


def key(number: int) -> str:
    return hashlib.sha256(str(number).encode()).hexdigest()


def files(folder: Path) -> list[Path]:
    """The packs, from the first to the last."""
    return sorted((folder / packs.FOLDER).iterdir())


def heard(store: Store) -> list[str]:
    lines: list[str] = []
    store.listen(lines.append)
    return lines
