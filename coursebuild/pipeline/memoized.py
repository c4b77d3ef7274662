"""Cut fonts and small findings, kept in the store from run to run.

Entry points: `kept_font`; `KeptBindings`.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from msgspec.structs import replace

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.prepared import prepared_cut, prepared_source
from coursebuild.core.engine.steps import step_key

if TYPE_CHECKING:
    from coursebuild.core.pages.fonts import FontJob
    from coursebuild.core.scripts.binding_memory import BindingEvidence, LazyInputs

_FONTS, _BINDINGS = "fonts", "bindings"


def kept_font(store: Memo, job: FontJob) -> bytes:
    """A cut font: cut already, or cut now."""
    make = functools.partial(cut_font, job)
    return prepared_cut(job.key) or store.get_or_create(_FONTS, job.key, make)


def cut_font(job: FontJob) -> bytes:
    """A font cut now, from a smaller font where one has all that it needs."""
    from coursebuild.core.pages.fonts import VERSION, subset_font

    source = prepared_source(job.data, job.characters, VERSION)
    return subset_font(job if source is None else replace(job, data=source))


class KeptBindings:
    """Bound numbers in which nothing is wrong, by a hash of all that this depends on.

    Those of the last run are kept, and no others.
    """

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._key = step_key("bindings")
        known = store.get_value(_BINDINGS, self._key, list[str], local=True)
        self._before = frozenset(known or ())
        self._now: set[str] = set()

    def holds(self, key: str, inputs: LazyInputs) -> bool:
        """Whether nothing was wrong in the last run."""
        if key in self._before:
            self._now.add(key)
            return True
        return False

    def add(self, key: str, inputs: LazyInputs, evidence: BindingEvidence) -> None:
        """That nothing is wrong."""
        self._now.add(key)

    def before(self, inputs: LazyInputs) -> BindingEvidence:
        """Not kept: what is said of a course does not depend on what was said of it before."""
        from coursebuild.core.scripts.binding_memory import BindingEvidence  # fonts need it not

        return BindingEvidence()

    def save(self) -> None:
        """Keep what was found."""
        if self._now != self._before:
            self._store.put_value(_BINDINGS, self._key, sorted(self._now), local=True)
