"""The pages that are about the reader: what is read and answered, and what to go over again.

Nothing of a reader is known here. The pages list the lessons with their questions, say what is kept
and where, and hold places that the page's script fills from the reader's own browser.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.features import Feature, PageKind, PagePart
from coursebuild.core.model import Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.lesson import level_view
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.quiz_index import count

_PROGRESS, _REVIEW = "progress/index.html", "review/index.html"
KEPT_AS = "coursebuild.progress."
"""What the name under which a browser keeps progress begins with; the course's key follows. As in
site/js/progress/store.js."""


class Asking(Struct, frozen=True):
    """A lesson or page with questions."""

    id: str
    """Of a lesson; empty for another page."""
    title: str
    href: str
    quiz_index: str
    """See `quiz_index`."""
    questions: int


def progress_values(library: Library) -> dict[str, object]:
    """What the page of the reader's progress shows: all lessons, by level."""
    place = urls.Place(_PROGRESS)
    return {
        "levels": tuple(
            level_view(library, place, level, whole=True) for level in library.course.levels
        ),
        "pages": tuple(one for one in _asking(library, place) if not one.id),
        "review": place.href(_REVIEW) if library.quiz_index else "",
        "name": KEPT_AS + library.course.key,
    }


def review_values(library: Library) -> dict[str, object]:
    """What the page of the review shows: where questions are, and when missed ones come back."""
    place = urls.Place(_REVIEW)
    return {"pages": _asking(library, place), "progress": place.href(_PROGRESS)}


def _asking(library: Library, place: urls.Place) -> tuple[Asking, ...]:
    """Everything with questions, in the order of the course."""
    found = []
    for owner in library.course.owners:
        text = library.quiz_index.get(owner.path, "")
        if text:
            id = owner.id if isinstance(owner, Lesson) else ""
            href = place.href(urls.owner_path(owner))
            found.append(Asking(id, owner.title, href, text, count(text)))
    return tuple(found)


_TROUBLE = "progress.trouble."
FEATURE = Feature(
    name="progress",
    pages=(
        PageKind(name="progress", values=progress_values, order=50, indexed=False),
        PageKind(
            name="review",
            values=review_values,
            exists=lambda library: bool(library.quiz_index),
            order=60,
            indexed=False,
        ),
    ),
    parts=(
        PagePart(
            mark="data-mark", kinds=("home", "level"), bundled="map.js", texts=("progress.map.",)
        ),
        PagePart(mark='data-progress="lesson"', texts=("progress.lesson.", _TROUBLE)),
        PagePart(
            mark='data-progress="overall"',
            bundled="reader.js",
            texts=("progress.live.", "progress.map.", _TROUBLE),
        ),
        PagePart(
            mark='data-progress="review"',
            bundled="reader.js",
            texts=("review.live.", "quiz.live.", _TROUBLE),
        ),
    ),
)
