"""What exporters are given.

Entry point: `ExportContext`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct

from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.library import Library


class ExportContext(Struct, frozen=True):
    """A course in which nothing is wrong, and what can be made of it."""

    library: Library
    """The course with its results, words and templates. Its documents are summaries."""
    assets: Assets
    site: Callable[[], Mapping[str, SiteFile]]
    """The files of its site by path; they are put together when this is called first."""
    page: Callable[[Document], PageContext]
    """A document with all its text, on its page, ready to be drawn."""
    read: Callable[[str], bytes]
    """A file of the course, by its path."""

    @property
    def course(self) -> Course:
        """The course."""
        return self.library.course
