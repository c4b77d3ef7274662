"""The pages about the reader's progress, filled by the page's script from the browser's storage."""

from __future__ import annotations

from msgspec import Struct

from coursebuild.api import Feature, Lesson, Library, PageKind, PagePart, urls
from coursebuild.core.pages.document_inputs import level_view

_PROGRESS, _REVIEW = "progress/index.html", "review/index.html"
STORAGE_PREFIX = "coursebuild.progress."
"""The beginning of the name under which a browser stores progress; the course's key follows. As in
site/js/progress/store.js."""


class QuestionPage(Struct, frozen=True):
    """A lesson or page with questions."""

    id: str
    """The id of a lesson; empty for other pages."""
    title: str
    href: str
    quiz_index: str
    """See `Library.quiz_index`."""
    questions: int


def progress_values(library: Library) -> dict[str, object]:
    """Return the values for the page of the reader's progress: all lessons, by level."""
    place = urls.Place(_PROGRESS)
    return {
        "levels": tuple(
            level_view(library, place, level, whole=True) for level in library.course.levels
        ),
        "pages": tuple(page for page in _question_pages(library, place) if not page.id),
        "review": place.href(_REVIEW) if library.quiz_index else "",
        "name": STORAGE_PREFIX + library.course.key,
    }


def review_values(library: Library) -> dict[str, object]:
    """Return the values for the page of the review: the lessons and pages with questions."""
    place = urls.Place(_REVIEW)
    return {"pages": _question_pages(library, place), "progress": place.href(_PROGRESS)}


def _question_pages(library: Library, place: urls.Place) -> tuple[QuestionPage, ...]:
    pages = []
    for owner in library.course.owners:
        text = library.quiz_index.get(owner.path, "")
        if text:
            id = owner.id if isinstance(owner, Lesson) else ""
            href = place.href(urls.owner_path(owner))
            count = sum(len(part.partition(":")[2].split(",")) for part in text.split(" "))
            pages.append(QuestionPage(id, owner.title, href, text, count))
    return tuple(pages)


_TROUBLE = "progress.trouble."
_MAP_TEXTS = ("progress.map.", "site.comma")
FEATURE = Feature(
    name="progress",
    pages=(
        PageKind(
            name="progress",
            values=progress_values,
            exists=lambda library: not library.course.is_manual or bool(library.quiz_index),
            order=50,
            indexed=False,
        ),
        PageKind(
            name="review",
            values=review_values,
            exists=lambda library: bool(library.quiz_index),
            order=60,
            indexed=False,
        ),
    ),
    parts=(
        PagePart(mark="data-mark", kinds=("home", "level"), bundled="map.js", texts=_MAP_TEXTS),
        PagePart(
            mark='data-progress="lesson"', texts=("progress.lesson.", "progress.map.read", _TROUBLE)
        ),
        PagePart(
            mark='data-progress="overall"',
            bundled="progress.js",
            texts=("progress.live.", *_MAP_TEXTS, _TROUBLE),
        ),
        PagePart(
            mark='data-progress="review"',
            bundled="review.js",
            texts=("review.live.", "quiz.live.", _TROUBLE),
        ),
    ),
)
