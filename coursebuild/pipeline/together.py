"""The outlines of texts that are looked up together, in one entry of the store.

Entry point: `Together`, which says what an earlier build has read of a group of texts.

An edit changes one text of many. Each outline has an entry of its own, which whoever reads a text
keeps; here the last ones of a group lie once more, one behind the other, each under the key of its
text. So of the others neither entry nor place has to be found one by one.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

from coursebuild.effects.aside import Aside, Kept
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.pipeline.outlines import Task
from coursebuild.source import key_of

_KIND = "together"
_COUNT = struct.Struct("<I")
_ROW = struct.Struct("<32sI")
"""The key of a text, and the bytes of its outline."""


class Together:
    """See the module."""

    def __init__(self, store: Store, aside: Aside) -> None:
        """`aside` is where outlines are put."""
        self._store = store
        self._aside = aside

    def get(self, tasks: Sequence[Task]) -> dict[str, Kept]:
        """The outlines of texts of this group, as far as there are any, by their keys."""
        data = None if self._store.fresh else self._store.peek(_KIND, _name(tasks))
        if data is None:
            return {}
        (count,) = _COUNT.unpack_from(data)
        at = _COUNT.size + count * _ROW.size
        kept = self._aside.put(data)
        found: dict[str, Kept] = {}
        for key, size in _ROW.iter_unpack(data[_COUNT.size : at]):
            found[key.hex()] = kept.part(at, size)
            at += size
        return found

    def keep(self, tasks: Sequence[Task], outlines: Mapping[str, Kept]) -> None:
        """Keep the outlines of the texts of a group, by their keys, as far as there are any."""
        there = [(task.key, outlines[task.key]()) for task in tasks if task.key in outlines]
        rows = (_ROW.pack(bytes.fromhex(key), len(data)) for key, data in there)
        parts = (_COUNT.pack(len(there)), *rows, *(data for _, data in there))
        self._store.keep(_KIND, _name(tasks), b"".join(parts), packed=True)


def _name(tasks: Sequence[Task]) -> str:
    """That of a group: a later entry of the same texts takes the place of the one before."""
    return key_of(tool_digest(), tasks[0].source.path)
