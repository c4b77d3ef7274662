"""What the site must know of its pages before any of them is written, kept for some pages at once.

Entry points: `Facts`, of all pages together; `groups`, pages that are looked up together; `Known`
and `Gathered`, what is held of one page and of a group.

A course has many pages of which an edit changes one. What a group's records say is one entry of the
store, so that the records themselves are only read of groups in which a page has changed.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator, Sequence

from coursebuild.effects.aside import Aside, Kept
from coursebuild.pipeline.groups import groups as groups
from coursebuild.render.links import has
from coursebuild.render.record import PageRecord
from coursebuild.render.search.files import Entry
from coursebuild.render.shared import PageFacts
from coursebuild.values import dataclass


class Facts:
    """What is known of pages together."""

    def __init__(self) -> None:
        self._text: set[str] = set()
        self._mathematics: set[str] = set()
        self._declarations: set[str] = set()
        self.sound = True
        """Whether every page has the anchors that it leads to itself."""
        self.leads: dict[str, str] = {}
        """Site paths that pages lead to, each by itself, so that none is held twice."""
        self.anchors: set[tuple[str, str]] = set()
        """Anchors that pages lead to on others, each after the site path of its page."""

    def add(self, record: PageRecord) -> None:
        """Note what a page shows and where it leads."""
        self._text.update(record.text)
        self._mathematics.update(record.mathematics)
        self._declarations.update(record.declarations)
        own = {"", "top", *record.ids}
        for path, anchor in record.references:
            if path == record.draft.path:
                self.sound = self.sound and has(own, anchor)
            else:
                self._lead(path, anchor)

    def update(self, said: Gathered) -> None:
        """Note what a group of pages shows and where it leads."""
        self._text.update(said.text)
        self._mathematics.update(said.mathematics)
        self._declarations.update(said.declarations)
        self.sound = self.sound and said.sound
        for path in said.leads:
            self._lead(path, "")
        for path, anchor in said.anchors:
            self._lead(path, anchor)

    def _lead(self, path: str, anchor: str) -> None:
        path = self.leads.setdefault(path, path)
        if anchor not in ("", "top"):
            self.anchors.add((path, sys.intern(anchor)))

    def together(self) -> PageFacts:
        """What the shared files must know."""
        return PageFacts(
            frozenset(self._text), frozenset(self._mathematics), frozenset(self._declarations)
        )


@dataclass(frozen=True, slots=True)
class Known:
    """What is held of a page."""

    indexed: bool
    entry: Entry | None
    """Where it is searched."""
    anchors: Kept
    """Packed."""

    @property
    def ids(self) -> frozenset[str]:
        """Its anchors."""
        found: frozenset[str] = frozenset(pickle.loads(self.anchors()))
        return found


@dataclass(frozen=True, slots=True)
class Gathered:
    """What the records of a group of pages say; all that is a set is sorted."""

    pages: tuple[tuple[bool, tuple[str, str, str, str, str] | None, int], ...]
    """Of each page whether it is indexed, where it is searched, and the bytes of its anchors."""
    anchors_of: bytes
    """Those of all pages, one behind the other."""
    text: tuple[str, ...]
    mathematics: tuple[str, ...]
    declarations: tuple[str, ...]
    sound: bool
    leads: tuple[str, ...]
    anchors: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, records: Sequence[PageRecord]) -> Gathered:
        """That of the pages with these records."""
        facts = Facts()
        pages, packed = [], []
        for record in records:
            facts.add(record)
            entry, draft = None, record.draft
            if record.search is not None:
                entry = (draft.path, draft.kind, draft.title, *record.search)
            packed.append(pickle.dumps(record.ids, pickle.HIGHEST_PROTOCOL))
            pages.append((draft.indexed, entry, len(packed[-1])))
        return cls(
            tuple(pages),
            b"".join(packed),
            tuple(sorted(facts._text)),
            tuple(sorted(facts._mathematics)),
            tuple(sorted(facts._declarations)),
            facts.sound,
            tuple(sorted(facts.leads)),
            tuple(sorted(facts.anchors)),
        )

    def known(self, aside: Aside) -> Iterator[Known]:
        """What is held of each page; the anchors are put aside."""
        kept = aside.put(self.anchors_of)
        at = 0
        for indexed, row, size in self.pages:
            entry = None
            if row is not None:
                path, kind, title, name, digest = row
                # Of what a record says as others do, no copy is held.
                entry = Entry(path, sys.intern(kind), title, name, digest)
            yield Known(indexed, entry, kept.part(at, size))
            at += size


def pack(gathered: Gathered) -> bytes:
    """It as bytes."""
    return pickle.dumps(gathered, pickle.HIGHEST_PROTOCOL)


def unpack(data: bytes | None, count: int) -> Gathered | None:
    """It, where it is of so many pages; `None` where the bytes are none of such."""
    try:
        found = None if data is None else pickle.loads(data)
    except Exception:  # whatever damaged bytes make of it
        return None
    return found if isinstance(found, Gathered) and len(found.pages) == count else None
