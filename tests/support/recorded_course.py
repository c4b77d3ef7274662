"""A course with a model that was measured, and with reports of that."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from coursebuild.core.run.versions import engine_version
from coursebuild.numerics.reports.bench import SceneReport
from coursebuild.numerics.reports.records import BENCH, DIET, STABILITY
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scenes import scene_digest
from support.model_reports import box, case, diet, finding
from support.scratch_course import Folder

BOX = '<mujoco><include file="arm/part.xml"/></mujoco>\n'
PART = '<mujoco><worldbody><geom name="g" size="1"/></worldbody></mujoco>\n'
PAGE, NUMERICS = "models/box.html", "numerics/index.html"


class Course:
    """A course with a model that was measured."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        folder.write("models/box.xml", BOX)
        folder.write("models/arm/part.xml", PART)
        folder.write("models/cup.xml", PART)

    def digest(self) -> str:
        """Of the model as it is."""
        course = load(self.folder.root).course
        assert course is not None
        model = next(one for one in course.models if one.name == "box")
        declared = next((one for one in course.declarations if one.model == "box"), None)
        return scene_digest(self.folder.root, model, declared)

    def bench(self, **other: Any) -> SceneReport:
        here = replace(box().machine, engine=engine_version())
        return replace(box(), **{"digest": self.digest(), "machine": here, **other})

    def record(self) -> None:
        """Put reports into the course."""
        self.folder.write(BENCH.path("box"), BENCH.encode(self.bench()))
        self.write_diet("nobody reads it")
        self.write_cases("it swings")

    def write_diet(self, message: str) -> None:
        report = diet(finding(message=message))
        here = replace(report.machine, engine=engine_version())
        report = replace(report, digest=self.digest(), machine=here)
        self.folder.write(DIET.path("box"), DIET.encode(report))

    def write_cases(self, note: str) -> None:
        here = replace(box().machine, engine=engine_version())
        cases = (case("spring", 5, machine=here, note=note),)
        self.folder.write(STABILITY.path(), STABILITY.encode(cases))

    def build(self, *arguments: str) -> str:
        """What is wrong, which has to be nothing that keeps the site from being published."""
        done = self.folder.main("build", "-q", *arguments)
        assert done.status == 0, done.out
        return done.out

    def page(self, path: str = PAGE) -> str:
        return self.folder.text(f"public/{path}")

    def drawn(self) -> set[str]:
        """The pages that a build draws now."""
        options = Options(self.folder.root, jobs=1, quiet=True)
        with prepare(options, Progress(quiet=True)) as (report, site):
            assert site is not None, report.diagnostics
            for file in site.files:
                if file.path.endswith(".html"):
                    file.make()
            return set(site.drawn)
