"""A course and what running it found, as the files of a site.

Entry point: `render_site(course, results, assets, options)`.

1. Every page is drawn without its frame.
2. Punctuation is held to formulas, styles written in single elements become classes, and the fonts
   are cut down to the characters that the pages use.
3. The style sheet gets its name from its content, and every page its frame.
4. Scripts, models, archives, files of the course, the sitemap and the rest follow.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

from markupsafe import Markup

from coursebuild.model import Course
from coursebuild.render import fonts, formulas, lesson, meta, pages, styles, urls, zips
from coursebuild.render.assets import Assets, hashed_name, page_script
from coursebuild.render.frame import Draft, Names, frame
from coursebuild.render.library import Library
from coursebuild.results import OutputFile, Results


@dataclass(frozen=True, slots=True)
class SiteOptions:
    """What is not in the course itself."""

    files: tuple[OutputFile, ...] = ()
    """Files that pages show or link to, and that models pull in, by their path relative to the
    project root."""
    around: zips.Surroundings = field(default_factory=zips.Surroundings)
    """What downloaded scripts need."""
    subset: Callable[[fonts.FontJob], bytes] = fonts.subset_font
    """How a font is cut: whoever calls may keep results, by a job's `key`."""


def render_site(
    course: Course, results: Results, assets: Assets, options: SiteOptions | None = None
) -> tuple[OutputFile, ...]:
    """The files of the site, sorted by path. The same values give the same bytes."""
    options = options or SiteOptions()
    library = Library.of(course, results, assets)
    drafts, declarations = _settled(_drafts(library))
    shared, names = _shared(library, assets, options, drafts, declarations)
    files = [OutputFile(draft.path, frame(library, draft, names).encode()) for draft in drafts]
    files += shared
    files += library.labs.files
    files += _downloads(library, options)
    files += _machine_files(course, drafts)
    return tuple(sorted(files, key=lambda file: file.path))


def _drafts(library: Library) -> Iterator[Draft]:
    """Every page without its frame."""
    course = library.course
    yield pages.home_draft(library)
    for level in course.levels:
        yield pages.level_draft(library, level)
    for entry in course.lessons:
        if entry.document is None:
            yield lesson.stub_draft(library, entry)
        else:
            yield lesson.lesson_draft(library, entry, entry.document)
    for model in course.models:
        yield pages.model_draft(library, model)
    for page in course.pages:
        if page.document is not None:
            yield pages.page_draft(library, page, page.document)
    yield pages.not_found_draft(library)


def _settled(drafts: Iterable[Draft]) -> tuple[tuple[Draft, ...], frozenset[str]]:
    """The pages without styles in their elements, and the declarations that were there."""
    kept: list[Draft] = []
    declarations: set[str] = set()
    for draft in drafts:
        body, found = styles.hoist(formulas.glue(draft.body))
        kept.append(replace(draft, body=Markup(body)))
        declarations |= found
    return tuple(kept), frozenset(declarations)


# ------------------------------------------------------------------------------ shared files


def _shared(
    library: Library,
    assets: Assets,
    options: SiteOptions,
    drafts: tuple[Draft, ...],
    declarations: frozenset[str],
) -> tuple[list[OutputFile], Names]:
    """The files that every page refers to, and their names."""
    files: list[OutputFile] = []

    def publish(path: str, data: bytes) -> str:
        name = hashed_name(f"assets/{path}", data)
        files.append(OutputFile(name, data))
        return name

    text, mathematics = _characters(library, drafts)
    faces = fonts.read_faces(assets.file("fonts/fonts.json"))
    jobs = fonts.font_jobs(
        ((face, assets.file(f"fonts/{face.file}")) for face in faces), text, mathematics
    )
    fonts_made = [(job, publish(f"fonts/{job.face.file}", options.subset(job))) for job in jobs]
    rules = fonts.face_rules((job, name.removeprefix("assets/")) for job, name in fonts_made)
    sheet = rules.encode() + assets.file("css/site.css") + styles.style_rules(declarations).encode()
    names = Names(
        style=publish("site.css", sheet),
        theme_script=publish("theme.js", page_script(assets.file("js/theme.js"))),
        script=publish("site.js", page_script(assets.file("js/site.js"))),
        icon=publish("icon.svg", assets.template("icon.svg").encode()),
        credits=publish("licences.txt", _licences(assets)),
    )
    return files, names


_FORMULA = re.compile(r"<math\b.*?</math>", re.DOTALL)
_TAGS = re.compile(r"<[^>]*>")


def _characters(library: Library, drafts: tuple[Draft, ...]) -> tuple[str, str]:
    """The characters of all pages: those of text, and those of formulas."""
    course = library.course
    text: set[str] = set()
    mathematics: set[str] = set()
    for draft in drafts:
        text.update(draft.title)
        text.update(Markup(_TAGS.sub("", _FORMULA.sub("", draft.body))).unescape())
        for formula in _FORMULA.findall(draft.body):
            mathematics.update(Markup(_TAGS.sub("", formula)).unescape())
    for _, words in library.words.entries:
        text.update(words)
    text.update(course.title, course.licence, *(page.title for page in course.pages))
    return "".join(sorted(text)), "".join(sorted(mathematics))


def _licences(assets: Assets) -> bytes:
    """The licences of fonts and libraries that the site ships."""
    parts = []
    for path, data in assets.files("licences"):
        name = path.removeprefix("licences/").removesuffix(".txt")
        parts.append(f"{name}\n{'=' * len(name)}\n\n{data.decode().strip()}\n")
    return "\n\n".join(parts).encode()


# --------------------------------------------------------------------------------- downloads


def _downloads(library: Library, options: SiteOptions) -> Iterator[OutputFile]:
    """Scripts, models, archives, and files of the course."""
    for path, (script, _) in library.scripts.items():
        yield OutputFile(path, script.code.text.encode())
    for model in library.course.models:
        yield OutputFile(urls.model_file_path(model.name), model.source.text.encode())
    if library.scripts:
        yield zips.course_zip(library, options.around)
    for entry in library.course.lessons:
        archive = zips.lesson_zip(library, options.around, entry)
        if archive is not None:
            yield archive
    for file in options.files:
        yield OutputFile(urls.file_path(file.path), file.data)


def _machine_files(course: Course, drafts: Iterable[Draft]) -> Iterator[OutputFile]:
    """What search engines look for."""
    yield OutputFile(urls.ROBOTS, meta.robots(course))
    if course.base_url:
        indexed = (draft.path for draft in drafts if draft.indexed)
        yield OutputFile(urls.SITEMAP, meta.sitemap(course, indexed))
