"""Small courses made without files: a map, texts, and prepared results of running them."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.engine.store import Store
from coursebuild.core.model.lesson_record import Provenance
from coursebuild.core.model.results import (
    CompileResult,
    FileFacts,
    Formula,
    ModelFacts,
    Outcome,
    Reports,
    Results,
    ScriptRun,
    Verdict,
)
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.document_inputs import document_inputs
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.numbering import items_of
from coursebuild.core.pages.page_writer import PageWriter
from coursebuild.core.pages.renderer import known_mathml
from coursebuild.core.pages.urls import Place, lesson_path
from coursebuild.core.registry import summarize
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site
from support.fixture_cases import fixture_text
from support.made_courses import documents_of, with_documents

ROOT = Path(__file__).parents[2]

MAP = fixture_text("documents/rendered_course.toml")

BOX = '<mujoco model="box">\n  <worldbody/>\n</mujoco>\n'


def read_assets() -> Assets:
    templates, dist = ROOT / "templates", ROOT / "site" / "dist"
    assert (dist / "fonts" / "fonts.json").is_file(), "no bundle: run `python site/bundle.py`"
    return Assets(
        tuple(
            (path.relative_to(templates).as_posix(), path.read_text(encoding="utf-8"))
            for path in sorted(templates.rglob("*"))
            if path.is_file()
        ),
        {
            path.relative_to(dist).as_posix(): path.read_bytes()
            for path in sorted(dist.rglob("*"))
            if path.is_file()
        },
    )


class RenderedCourse(Struct, frozen=True):
    """A course, prepared results of running it, and the tool's own files."""

    course: model.Course
    results: Results
    assets: Assets

    def library(self, reports: Reports | None = None) -> Library:
        return make_library(self.course, self.results, self.assets, reports or Reports())

    def page(self, lesson: str = "0.1") -> PageContext:
        library = self.library()
        entry = library.lessons[lesson]
        assert entry.document is not None
        place = Place(lesson_path(entry))
        inputs = document_inputs(library, place, entry.document)
        return PageWriter(library.renderer, inputs, place, entry.document)

    def html(self, lesson: str = "0.1") -> str:
        page = self.page(lesson)
        return f"{page.blocks(page.document.blocks)}\n{page.footnotes()}"

    def site(
        self, files: Mapping[str, bytes] = MappingProxyType({}), reports: Reports | None = None
    ) -> dict[str, bytes]:
        """The whole site as a build puts it together, with these files of the course."""
        with TemporaryDirectory() as folder:
            root = Path(folder)
            models = {m.source.path: m.source.text.encode() for m in self.course.models}
            for path, data in {**models, **files}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_bytes(data)
            course = replace(self.course, files=tuple(files))
            library = replace(self, course=course).library(reports)
            options = Options(root, 1, Store(Path(CACHE.name)))
            with Reader(options) as reader:
                site = Site(library, reader, options)
                files_by_path = {file.path: file.make() for file in site.files}
        assert [file.path for file in site.files] == sorted(files_by_path)
        assert site.file_list is not None
        facts = [
            FileFacts(path, sha256(d).hexdigest(), len(d)) for path, d in files_by_path.items()
        ]
        return dict(
            sorted({**files_by_path, site.file_list.path: site.file_list.make(facts)}.items())
        )


CACHE = TemporaryDirectory()
"""The cache of subset fonts and of other results that depend on no course."""


class Make(Struct, frozen=True):
    """Makes courses from texts."""

    assets: Assets

    def __call__(
        self,
        text: str,
        *,
        course: str = MAP,
        runs: Mapping[str, ScriptRun] | None = None,
        status: str = "verified",
        **texts: str,
    ) -> RenderedCourse:
        """A course with the text of lesson 0.1; `texts` are those of other documents by id."""
        map_result = parse_course_map(Source("content/course.toml", course))
        assert map_result.value is not None and not map_result.diagnostics, map_result.diagnostics
        texts = {"0.1": text, "1.1": "Text.", "about": "About it.", **texts}
        documents = documents_of(map_result.value, texts)
        rendered = with_documents(map_result.value, documents)
        rendered = replace(
            rendered, models=(model.MjcfModel("box", Source("models/box.xml", BOX)),)
        )
        results = results_of(rendered, runs or {}, status)
        typeset = known_mathml(dict(results.formulas))
        summarized = {
            id: replace(
                document,
                summaries=summarize(document, typeset).value,
                numbered_items=items_of(document, typeset),
            )
            for id, document in documents.items()
        }
        return RenderedCourse(with_documents(rendered, summarized), results, self.assets)


PROVENANCE = Provenance("Python 3.11.7", "linux", (("mujoco", "3.14.0"),))
"""What the scripts ran with."""


def results_of(course: model.Course, runs: Mapping[str, ScriptRun], status: str) -> Results:
    """Scripts that are not in `runs` printed `one`, `two`; a formula is rendered as its TeX."""
    script_runs: list[ScriptRun] = []
    verdicts: list[Verdict] = []
    formulas: dict[Formula, str] = {}
    for document in course.documents:
        for block in model.document_blocks(document):
            if isinstance(block, model.Script):
                default_run = ScriptRun(
                    block.path, Outcome.OK, 0, "one\ntwo\n", "", 0.1, provenance=PROVENANCE
                )
                script_runs.append(runs.get(block.path, default_run))
            elif isinstance(block, model.Recording):
                verdicts.append(Verdict(block, course.comparison_of(block), status))
            elif isinstance(block, model.MathBlock):
                formulas[Formula(block.tex.text, True)] = mathml(block.tex.text, "display")
        for inline in model.document_inlines(document):
            if isinstance(inline, model.Math):
                formulas[Formula(inline.tex.text, inline.display)] = mathml(
                    inline.tex.text, "inline"
                )
    facts = ModelFacts(1, 2, 1, 7, 6, 0, 0.002, "RK4", 1.5, ("start", ""), (), ("box",))
    return Results(
        tuple(script_runs),
        tuple(verdicts),
        tuple(formulas.items()),
        (("box", CompileResult("", None, facts)),),
        "3.14.0",
    )


def mathml(tex: str, kind: str) -> str:
    return f'<math class="{kind}"><mi>{tex.strip()}</mi></math>'
