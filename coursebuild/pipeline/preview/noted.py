"""What a build has noted of a page that shows just this: then it need not be drawn to know it.

Entry point: `Noted`.
"""

from __future__ import annotations

from coursebuild.core.engine.memo import Memo
from coursebuild.core.values import encode
from coursebuild.pipeline.pages import text_page_key
from coursebuild.pipeline.tasks import PAGES, KeptPage, Task
from coursebuild.render.library import Library
from coursebuild.render.page_list import PageEntry
from coursebuild.render.shared import PageFacts


class Noted:
    """The records of pages that builds have left in a store."""

    def __init__(self, store: Memo) -> None:
        self._store = store

    def __call__(self, page: PageEntry, library: Library, task: Task | None) -> PageFacts | None:
        """What the shared files must know of a page, if that was noted.

        `task`: the text of its document, if it has one.
        """
        key = text_page_key(library.course, task, encode(page.inputs(library)))
        kept = KeptPage.read(self._store.get(PAGES, key, local=True))
        record = None if kept is None else kept.record
        return None if record is None else record.facts
