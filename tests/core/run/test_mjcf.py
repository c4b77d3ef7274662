"""Compiling MJCF with MuJoCo: facts, messages, memory, and what would take a process down."""

from __future__ import annotations

import itertools
import os
import resource
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest
from PIL import Image

from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError, LackError
from coursebuild.core.model import Limits
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.run import mjcf
from coursebuild.core.run.child import LIMITS
from coursebuild.core.run.mjcf import TEXT_PATH, compile_all, model_files, readable_error
from support.fixture_cases import fixture_tables, fixture_text
from support.growth import processor_time_growth
from support.model_files import TETRAHEDRON, png
from support.run_code import program
from support.runners import SOURCE_TREE

pytestmark = pytest.mark.site

MODELS = tomllib.loads(fixture_text("documents/models.toml"))
PART_NAMES = "child.xml parts/asset.xml parts/mesh.obj parts/skin.png".split()
PARTS = tuple(f"models/{name}" for name in PART_NAMES)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    (root / "models/parts").mkdir(parents=True)
    (root / "models/parts/mesh.obj").write_text(TETRAHEDRON)
    for name, text in MODELS["parts"].items():
        (root / "models" / name).write_text(text)
    (root / "models/parts/skin.png").write_bytes(png())
    return root


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def texts(root: Path, xmls: Sequence[str], limits: Limits = LIMITS) -> tuple[CompileResult, ...]:
    return compile_all(root, [(TEXT_PATH, xml) for xml in xmls], limits=limits)


def includes(root: Path, xmls: Sequence[str]) -> list[tuple[str, ...] | None]:
    return [result.facts and result.facts.includes for result in texts(root, xmls)]


# --- facts


def test_facts_of_the_text_that_was_read(root: Path) -> None:
    (root / "models/arm.xml").write_text("<broken")
    assert compile_all(root, [("models/arm.xml", MODELS["arm"])]) == (
        CompileResult(
            "",
            None,
            ModelFacts(
                bodies=2,
                geoms=2,
                joints=2,
                nq=8,
                nv=7,
                nu=1,
                timestep=0.001,
                integrator="implicitfast",
                total_mass=2.5,
                keyframes=("home", ""),
                sites=("tip", ""),
                body_names=("ünder", ""),
                includes=(),
                sizes={"rad": 1.0, "m": 2.0},
            ),
        ),
    )


def test_integrators_by_their_names(root: Path) -> None:
    names = ["Euler", "RK4", "implicit", "implicitfast", "discrete"]
    xmls = [f'\ufeff<mujoco><option integrator="{name}"/></mujoco>' for name in names]
    assert [result.facts and result.facts.integrator for result in texts(root, xmls)] == names


def test_everything_that_a_model_or_a_text_pulls_in(root: Path) -> None:
    for path in ("models/main.xml", TEXT_PATH):
        (result,) = compile_all(root, [(path, MODELS["main"])])
        assert result.facts is not None, result.error
        assert (result.facts.includes, result.facts.body_names) == (PARTS, ("c_b",))
    assert (names(root), names(root / "models")) == (["models"], ["child.xml", "parts"])


def test_what_is_pulled_in_from_elsewhere_or_by_a_link(root: Path) -> None:
    """From next to `models/`, by an absolute path; a link has its own name."""
    (root / "beside").mkdir()
    (root / "beside/part.xml").write_text(
        "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    )
    (root / "models/link.xml").symlink_to("child.xml")
    paths_by_name = {
        "../beside/part.xml": "beside/part.xml",
        str(root / "beside/part.xml"): "beside/part.xml",
        "link.xml": "models/link.xml",
    }
    xmls = [f'<mujoco><include file="{name}"/></mujoco>' for name in paths_by_name]
    assert includes(root, xmls) == [(path,) for path in paths_by_name.values()]


def test_what_is_looked_for_and_not_there(root: Path) -> None:
    asset = '<asset><hfield name="h" file="h.png"/></asset>'
    xml = f'<mujoco><include file="none.xml"/>{asset}</mujoco>'
    assert model_files(root, "models/a.xml", xml) == ("models/h.png", "models/none.xml")


# --- messages

MISTAKES = tomllib.loads(fixture_text("documents/model_mistakes.toml"))
INCLUDE = '<mujoco>\n<include file="{}.xml"/>\n</mujoco>'


def test_messages_have_one_line_and_the_line_of_the_text(root: Path) -> None:
    for name, text in MISTAKES["files"].items():
        (root / f"models/{name}.xml").write_text(text)
    messages = MISTAKES["messages"]
    for (xml, line), result in zip(messages.items(), texts(root, [*messages]), strict=True):
        assert f"{result.line}: {readable_error(result.error)}".startswith(line), xml
        assert result.error and not result.facts and str(root) not in result.error


# --- what would take a process down


def test_warnings_do_not_litter_the_course(
    root: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(root)
    (result,) = texts(root, ['<mujoco><option timestep="nan"/></mujoco>'])
    assert result.error == ""
    assert names(root) == ["models"]
    assert capfd.readouterr() == ("", "")


ENDLESS = (
    '<mujoco><worldbody><replicate count="300000000"><geom size="1"/></replicate>'
    "</worldbody></mujoco>"
)


def test_a_model_without_end_or_of_any_size_is_ended(root: Path) -> None:
    """One model may take half of the time, so that the others of the course are still judged."""
    field = '<hfield name="h" nrow="40000" ncol="30000" size="1 1 1 1"/>'
    large = f"<mujoco><asset>{field}</asset></mujoco>"
    for seconds in (1.0, 16.0, 240.0):  # slow machines need a longer limit
        results = texts(root, [ENDLESS, large, "<mujoco/>"], Limits(models=seconds))
        assert results[0].error == f"takes more than {seconds / 2:g} s to compile"
        if results[2].error == "":
            break
    message = "MuJoCo's compiler takes more than 896 MiB of memory for it"
    assert [result.error for result in results[1:]] == [message, ""]


def test_what_other_models_have_taken_is_not_what_a_model_takes(root: Path) -> None:
    """MuJoCo keeps pictures and meshes for the next model."""
    xmls = []
    for level in range(5):
        Image.new("RGB", (3000, 3000), (level, 0, 0)).save(root / f"models/{level}.png")
        texture = f'<texture name="t" type="2d" file="{level}.png"/>'
        xmls.append(f"<mujoco><asset>{texture}</asset></mujoco>")
    assert [r.error for r in texts(root, xmls, Limits(memory=256))] == [""] * 5


def test_what_a_model_reserves_is_not_what_its_compiler_takes(root: Path) -> None:
    scene = '<worldbody><body name="b"><freejoint/><geom size="1"/></body></worldbody>'
    (root / "models/reserve.xml").write_text('<mujoco><size memory="1G"/></mujoco>')
    xmls = [
        f'<mujoco><size memory="2G"/>{scene}</mujoco>',
        f'<mujoco><include file="reserve.xml"/>{scene}</mujoco>',
    ]
    for result in texts(root, xmls):
        assert result.facts is not None, result.error
        assert result.facts.body_names == ("b",)
    (refused,) = texts(root, [xmls[0].replace('"1"', '"-1"')])
    assert "size 0 must be positive in geom" in refused.error


def test_models_that_take_all_the_time_of_a_course_leave_none_for_others(root: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    xmls = [ENDLESS.replace("3", str(i)) for i in range(1, 10)]
    results = texts(root, [*xmls, "<mujoco/>"], Limits(models=1.0))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    exhausted = "was not compiled: others took the 1 s that all may take"
    assert [result.error for result in results[2:]] == 8 * [exhausted]
    assert all(result.timeout for result in results)
    assert after.ru_utime - before.ru_utime < 4, "as long as two models, with starting MuJoCo"


def test_what_is_no_regular_file_is_not_read(root: Path) -> None:
    """To open a pipe may take for ever, and so may reading from a device."""
    os.mkfifo(root / "models/pipe.xml")
    (root / "models/zero.xml").symlink_to("/dev/zero")
    mesh = '<mujoco><asset><mesh file="pipe.xml"/></asset></mujoco>'
    xmls = [INCLUDE.format("pipe"), INCLUDE.format("zero"), mesh, "<mujoco/>"]
    assert [result.error for result in texts(root, xmls)] == [
        "'models/pipe.xml' is a device or a pipe",
        "'models/zero.xml' leads out of the course",
        "'models/pipe.xml' is a device or a pipe",
        "",
    ]


@pytest.mark.parametrize(("element", "file"), fixture_tables("outside_files")["elements"])
def test_no_file_outside_the_course_is_read(root: Path, element: str, file: str) -> None:
    """By its path, or by a link to it or to a folder above it."""
    (root.parent / "outside").mkdir()
    for secret in (root.parent / "secret.xml", root.parent / "outside/secret.xml"):
        secret.write_text("<mujocoinclude/>")
    (root / "models/link.xml").symlink_to("../../secret.xml")
    (root / "models/folder").symlink_to("../../outside")
    (result,) = texts(root, [f"<mujoco>\n{element.format(root.parent)}</mujoco>"])
    message = f"'{file.format(root.parent)}' leads out of the course"
    assert (result.error, result.line) == (message, 2)


@pytest.mark.parametrize(
    "text",
    [
        "<" + "a" * 60_000,
        "<!--" * 20_000,
        f"<mesh {'a' * 60_000}>",
        "<a '\"" * 20_000,
    ],
)
def test_files_are_looked_for_in_time_that_grows_with_the_text(root: Path, text: str) -> None:
    numbers = itertools.count()  # the same text is not read again

    def look(size: int) -> None:
        model_files(root, TEXT_PATH, f"{text[: 500 * size]}{next(numbers)}")

    assert processor_time_growth(look, 10) < 30


def test_files_that_include_each_other_in_many_ways_are_read_once(root: Path) -> None:
    """Each includes the next one twice: 2^30 ways."""
    for i in range(30):
        file = root / f"models/f{i}.xml"
        file.write_text("<mujoco>" + 2 * f'<include file="f{i + 1}.xml"/>' + "</mujoco>")
    files = {f"models/f{i}.xml" for i in range(1, 31)}
    assert {*model_files(root, "models/f0.xml", (root / "models/f0.xml").read_text())} == files


def test_a_compiler_that_crashes_or_cannot_be_loaded(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text(program("bad_compiler").replace("SOURCE", str(SOURCE_TREE)))
    monkeypatch.setattr(mjcf, "PROGRAM", str(worker))
    good = "<mujoco model='noise'/>"
    results = texts(root, [good, "<!-- crash -->", good, "<!-- exit -->", good])
    assert [result.error for result in results] == [
        "",
        "MuJoCo's compiler crashed (SIGSEGV)",
        "",
        "MuJoCo's compiler ended with status 7",
        "",
    ]
    worker.write_text("raise ImportError('no MuJoCo here')")
    with pytest.raises(EffectError) as caught:
        texts(root, [good])
    assert caught.value.message == "MuJoCo cannot be loaded: ImportError: no MuJoCo here"
    worker.write_text("import errno, os\nraise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))")
    with pytest.raises(LackError, match="resource temporarily unavailable"):
        texts(root, [good])


TEXT = '<mujoco><include file="part.xml"/></mujoco>'
BROKEN = "<mujoco><nonsense/></mujoco>"


class Course:
    """A course of two models, and commands that compile them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.compiled_names: list[str] = []
        """What MuJoCo was asked to compile since the last `take_compiled`."""

    def compile(self, *extra_texts: str, fresh: bool = False) -> dict[str, CompileResult]:
        """The results, by the name of the model or by the text."""
        models = {path.stem: path.read_text() for path in sorted(self.root.glob("models/*.xml"))}
        texts = [(f"models/{name}.xml", text) for name, text in models.items()]
        texts += [(mjcf.TEXT_PATH, text) for text in extra_texts]
        results = mjcf.compile_or_recall(self.root, Store(self.root, fresh=fresh), texts)
        return dict(zip([*models, *extra_texts], results, strict=True))

    def take_compiled(self) -> list[str]:
        names, self.compiled_names = self.compiled_names, []
        return sorted(names)


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    course = Course(tmp_path / "course")
    (course.root / "models/assets").mkdir(parents=True)
    (course.root / "models/assets/m.obj").write_text(TETRAHEDRON)
    for name, text in MODELS["course"].items():
        (course.root / "models" / name).write_text(text)
    real = mjcf.compile_all

    def compile(root: Path, texts: Sequence[tuple[str, str]], **limits: int) -> object:
        course.compiled_names += [
            t if path == mjcf.TEXT_PATH else Path(path).stem for path, t in texts
        ]
        return real(root, texts, **limits)

    monkeypatch.setattr(mjcf, "compile_all", compile)
    return course


def test_nothing_is_compiled_twice(course: Course) -> None:
    first = course.compile(TEXT, BROKEN, TEXT)
    assert course.take_compiled() == sorted(["main", "part", TEXT, BROKEN])
    assert first["main"].facts is not None and first["main"].facts.includes == (
        "models/assets/m.obj",
        "models/part.xml",
    )
    assert first[BROKEN].error
    for path in course.root.rglob("*"):
        os.utime(path)
    course.root = course.root.rename(course.root.with_name("moved"))
    assert course.compile(BROKEN, TEXT) == first
    assert course.take_compiled() == []


def test_models_are_compiled_again_when_a_file_of_theirs_changes(course: Course) -> None:
    course.compile()
    for file, again in (
        ("models/assets/m.obj", ["main"]),
        ("models/part.xml", ["main", "part"]),
        ("models/main.xml", ["main"]),
        ("models/other.txt", []),
    ):
        course.take_compiled()
        with (course.root / file).open("a") as stream:
            stream.write("\n")
        course.compile()
        assert course.take_compiled() == again, file
    course.compile(fresh=True)
    assert course.take_compiled() == ["main", "part"]


def test_an_error_is_remembered_until_the_missing_file_is_there(course: Course) -> None:
    mesh = course.root / "models/assets/m.obj"
    mesh.unlink()
    first = course.compile()
    assert "m.obj" in first["main"].error
    course.take_compiled()
    assert course.compile() == first
    assert course.take_compiled() == []
    mesh.write_text(TETRAHEDRON)
    assert course.compile()["main"].error == ""
    assert course.take_compiled() == ["main"]
