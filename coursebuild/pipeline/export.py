"""`coursebuild export`: the course, or its quizzes, as one file for other programs and for paper.

Entry point: `export(options, kind, out)`.

The course is verified as for a build, and nothing is written where something is wrong.

- `scorm`: the files of the site, a page that opens each lesson, and a manifest.
- `qti`: the items of the quizzes of each document, kept under the key of its page, and a manifest.
- `epub`, `page`: the lessons as an e-book and on one page, made from the pages of the site.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal, TypeAlias, assert_never

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.archives import (
    begins_with,
    check_target,
    holds,
    write_archive,
    write_single,
)
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.model import Block, Course, document_blocks
from coursebuild.core.model.results import CachedFile, OutputFile, Results, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.exports import book, epub
from coursebuild.core.pages.exports.whole_course import WholeCourse
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.packages import qti, scorm
from coursebuild.core.pages.packages.items import Loss, MadeQuiz
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source
from coursebuild.core.values import decode, encode
from coursebuild.features.quiz.model import Quiz
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.pages import page_key
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.site import Site, site_files
from coursebuild.pipeline.tasks import ITEMS, Ask, Draw, Later
from coursebuild.report import Report

Kind: TypeAlias = Literal["epub", "page", "qti", "scorm"]
NAMES: dict[Kind, str] = {
    "epub": "course.epub",
    "page": "course.html",
    "qti": "quizzes-qti.zip",
    "scorm": "course-scorm.zip",
}
"""What a file is called where nothing is said."""
_IS_OURS: dict[Kind, Callable[[Path], bool]] = {
    "epub": functools.partial(holds, name=epub.PACKAGE),
    "page": functools.partial(begins_with, mark=book.MARK),
    "qti": functools.partial(holds, name=qti.MANIFEST),
    "scorm": functools.partial(holds, name=scorm.MANIFEST),
}
"""Whether a file is one that an earlier export may have written."""
_AT_ONCE = 256
"""Documents whose items are waited for before more are made."""


def export(options: Options, kind: Kind, out: Path) -> Report:
    """Write the file to `out` (relative to the course's folder), or nothing."""
    progress = Progress(quiet=options.quiet)
    place = options.root / out
    check_target(options.root, place, _IS_OURS[kind])
    make = functools.partial(_exported, kind)
    with project_lock(options.root, progress.say), prepare(options, progress, make) as prepared:
        if not prepared.report.ok:
            return replace(prepared.report, remarks=("nothing was written",))
        if not prepared.files:
            raise EffectError("the course has no quiz with a question, so there is no QTI package")
        with progress.stage("packing"):
            write = write_single if kind == "page" else write_archive
            size = write(place, prepared.files)
    count = len(prepared.files)
    said = f"wrote {f'{count} files to ' if count > 1 else ''}{out}, {size / 1e6:.1f} MB"
    return replace(prepared.report, remarks=(said,), depends=None)


def _exported(
    kind: Kind,
    course: Course,
    results: Results,
    documents: Documents,
    options: Options,
    reports: Reports,
) -> Site:
    """The files of an export, as the files of a site."""
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    library = Library.of(course, results, assets, reports)
    if kind == "qti":
        items = _Items(library, documents, options)
        return Site(tuple(items.files()), None, tuple(items.diagnostics), ())
    site = site_files(course, results, documents, options, reports)
    files: tuple[SiteFile, ...]
    match kind:
        case "scorm":
            files = tuple(_scorm(library, assets, site))
        case "epub":
            style = assets.template("exports/epub.css")
            files = epub.epub_files(_whole(library, site), style, _style_inputs(site))
        case "page":
            page = book.book(_whole(library, site), _style_inputs(site))
            files = (OutputFile(NAMES[kind], page),)
        case _:
            assert_never(kind)
    return replace(site, files=files, listed=None)


def _whole(library: Library, site: Site) -> WholeCourse:
    return WholeCourse(library, {file.path: functools.partial(_data, file) for file in site.files})


def _data(file: SiteFile) -> bytes:
    return file.data if isinstance(file, OutputFile) else file.make()


def _style_inputs(site: Site) -> str:
    """The site path of the style sheet of all pages."""
    return next(
        f.path for f in site.files if f.path.startswith("assets/site.") and f.path.endswith(".css")
    )


def _scorm(library: Library, assets: Assets, site: Site) -> Iterator[SiteFile]:
    course = library.course
    packed = [file for file in site.files if scorm.is_packed(file.path)]
    shared = tuple(scorm.shared_files(assets))
    yield from packed
    yield from shared
    for entry in scorm.written(course):
        make = functools.partial(scorm.launch_page, course, entry, library.tools)
        yield CachedFile(scorm.launch_path(entry), "", make)
    yield scorm.manifest(course, sorted(file.path for file in (*packed, *shared)))


# ------------------------------------------------------------------------------------------ QTI


class _Asked(Struct, frozen=True):
    """A document with quizzes."""

    source: Source
    key: str
    page: PageEntry


class _Items:
    """The items of all quizzes: made bytes of each document."""

    def __init__(self, library: Library, documents: Documents, options: Options) -> None:
        self._library = library
        self._documents = documents
        self._options = options
        self._last: tuple[bytes, tuple[MadeQuiz, ...]] | None = None
        self.diagnostics: list[Diagnostic] = []

    def files(self) -> Iterator[SiteFile]:
        """The files of the package; none where there is no item."""
        listed: list[MadeQuiz] = []
        pictures: set[str] = set()
        documents = list(self._asked())
        made = self._made(documents)
        for asked in documents:
            kept = made[asked.key]
            for quiz in self._unpacked(kept, asked.source):
                self.diagnostics += (_reduced(loss) for loss in quiz.losses)
                if quiz.items:
                    yield from (self._later(asked, kept, path) for path in qti.quiz_paths(quiz))
                    pictures.update(path for item in quiz.items for path in item.pictures)
                    listed.append(qti.without_bytes(quiz))
        if listed:
            yield from self._pictures(pictures)
            yield qti.style_file()
            yield qti.manifest(self._library.course, listed)

    def _later(self, asked: _Asked, kept: bytes, path: str) -> CachedFile:
        return CachedFile(path, asked.key, functools.partial(self._file, asked.source, kept, path))

    def _file(self, source: Source, kept: bytes, path: str) -> bytes:
        if self._last is None or self._last[0] is not kept:
            self._last = kept, self._unpacked(kept, source)
        return qti.quiz_file(self._last[1], path)

    def _pictures(self, found: set[str]) -> Iterator[SiteFile]:
        for path in self._library.course.files:
            place = urls.file_path(path)
            if place in found:
                yield OutputFile(place, read_bytes(self._options.root, path))

    def _unpacked(self, data: bytes, source: Source) -> tuple[MadeQuiz, ...]:
        found = decode(data, tuple, source)
        assert found is not None
        return found

    def _asked(self) -> Iterator[_Asked]:
        """The documents that have quizzes."""
        library = self._library
        for page in page_list(library):
            document = page.document(library)
            if document is not None and any(map(_is_quiz, document_blocks(document))):
                inputs = encode(page.inputs(library))
                key = page_key(library.course, self._documents.task(document.source.path), inputs)
                yield _Asked(document.source, key, page)

    def _made(self, asked: list[_Asked]) -> dict[str, bytes]:
        """The items of documents, kept or made now, by the keys of these."""
        store, made, new = self._options.store, dict[str, bytes](), list[_Asked]()
        for one in asked:
            data = store.get(ITEMS, one.key, local=True)
            if data is None or decode(data, tuple, one.source) is None:
                new.append(one)
            else:
                made[one.key] = data
        for start in range(0, len(new), _AT_ONCE):
            some = new[start : start + _AT_ONCE]
            later = [Later(a.source.path, functools.partial(self._request, a)) for a in some]
            for one, data in zip(some, self._documents.draw(later), strict=True):
                made[one.key] = data
        return made

    def _request(self, asked: _Asked) -> Ask:
        course = self._library.course
        task = self._documents.task(asked.source.path)
        inputs = encode(asked.page.inputs(self._library))
        return Ask(Draw(inputs, task, course.language, course.base_url, asked.key))


def _is_quiz(block: Block) -> bool:
    return isinstance(block, Quiz)


def _reduced(loss: Loss) -> Diagnostic:
    message = f"this question is not whole in the QTI package: {loss.what}"
    return diagnose("package-reduced", loss.span, message)
