"""Compiling MJCF with the real MuJoCo: facts, messages, and what would take a process down."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.run import mjcf, mjcf_worker
from coursebuild.core.run.mjcf import (
    TEXT_PATH,
    TIMEOUT,
    compile_all,
    error_line,
    model_files,
    readable_error,
)
from support.model_files import TETRAHEDRON, png

pytestmark = pytest.mark.site

ARM = """<mujoco model="arm">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="ünder"><freejoint/><geom size="0.1" mass="2"/><site name="tip"/><site/>
      <body><joint type="ball"/><joint type="hinge"/><geom size="0.1" mass="0.5"/></body>
    </body>
  </worldbody>
  <actuator><motor name="m" joint="h"/></actuator>
  <keyframe><key name="home"/><key/></keyframe>
</mujoco>
""".replace('type="hinge"', 'name="h" type="hinge" pos="1 0 0"').replace('<joint type="ball"/>', "")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    (root / "models/parts").mkdir(parents=True)
    (root / "models/parts/mesh.obj").write_text(TETRAHEDRON)
    (root / "models/parts/skin.png").write_bytes(png())
    (root / "models/parts/asset.xml").write_text(
        '<mujoco><asset><mesh name="m" file="mesh.obj"/>'
        '<texture name="t" type="2d" file="skin.png"/></asset></mujoco>'
    )
    (root / "models/child.xml").write_text(
        '<mujoco><worldbody><body name="b"><geom size="1"/></body></worldbody></mujoco>'
    )
    return root


def model(root: Path, name: str, text: str) -> CompileResult:
    path = root / "models" / f"{name}.xml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    (result,) = compile_all(root, [(f"models/{name}.xml", text)])
    return result


def text(root: Path, xml: str) -> CompileResult:
    (result,) = texts(root, [xml])
    return result


def texts(root: Path, xmls: Sequence[str], timeout: float = TIMEOUT) -> tuple[CompileResult, ...]:
    return compile_all(root, [(TEXT_PATH, xml) for xml in xmls], timeout=timeout)


MAIN = """<mujoco>
  <compiler meshdir="parts" texturedir="parts"/>
  <include file="parts/asset.xml"/>
  <asset><model name="child" file="child.xml"/></asset>
  <worldbody><geom type="mesh" mesh="m"/><attach model="child" body="b" prefix="c_"/></worldbody>
</mujoco>
"""


class TestFacts:
    def test_facts(self, root: Path) -> None:
        result = model(root, "robots/arm", ARM)
        assert result == CompileResult(
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
            ),
        )

    def test_integrators_by_their_names(self, root: Path) -> None:
        names = ["Euler", "RK4", "implicit", "implicitfast", "discrete"]
        found = texts(root, [f'<mujoco><option integrator="{name}"/></mujoco>' for name in names])
        assert [one.facts and one.facts.integrator for one in found] == names

    def test_everything_that_is_pulled_in(self, root: Path) -> None:
        result = model(root, "main", MAIN)
        assert result.facts is not None, result.error
        assert result.facts.includes == (
            "models/child.xml",
            "models/parts/asset.xml",
            "models/parts/mesh.obj",
            "models/parts/skin.png",
        )
        assert result.facts.body_names == ("c_b",)

    def test_a_text_finds_what_is_in_models(self, root: Path) -> None:
        result = text(root, MAIN)
        assert result.facts is not None, result.error
        assert result.facts.geoms == 2
        assert result.facts.includes == (
            "models/child.xml",
            "models/parts/asset.xml",
            "models/parts/mesh.obj",
            "models/parts/skin.png",
        )
        assert names(root) == ["models"]
        assert names(root / "models") == ["child.xml", "parts"]

    def test_what_a_text_pulls_in_from_elsewhere(self, root: Path, tmp_path: Path) -> None:
        """From beside `models/`, by an absolute path, and from outside of the course."""
        part = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
        (root / "beside").mkdir()
        (root / "beside/part.xml").write_text(part)
        far = tmp_path / "far.xml"
        far.write_text(part)
        (root.parent / "above.xml").write_text(part)
        for written, told in (
            ("../beside/part.xml", "beside/part.xml"),
            (str(far), str(far)),
            ("../../above.xml", str(root.parent / "above.xml")),
        ):
            found = text(root, f'<mujoco><include file="{written}"/></mujoco>').facts
            assert found is not None and found.includes == (told,)

    def test_what_is_looked_for_and_not_there(self, root: Path) -> None:
        asset = '<asset><hfield name="h" file="h.png"/></asset>'
        xml = f'<mujoco><include file="none.xml"/>{asset}</mujoco>'
        assert text(root, xml).error
        assert model_files(root, "models/a.xml", xml) == ("models/h.png", "models/none.xml")

    def test_a_link_is_a_part_by_its_own_name(self, root: Path) -> None:
        """It may lead elsewhere the next time."""
        (root / "models/link.xml").symlink_to("child.xml")
        result = model(root, "m", MAIN.replace("child.xml", "link.xml"))
        assert result.facts is not None, result.error
        assert "models/link.xml" in result.facts.includes

    def test_a_model_is_compiled_as_it_was_read(self, root: Path) -> None:
        (root / "models/m.xml").write_text("<broken")
        (result,) = compile_all(root, [("models/m.xml", "<mujoco/>")])
        assert result.error == ""

    def test_byte_order_mark(self, root: Path) -> None:
        assert text(root, "\ufeff<mujoco/>").error == ""


class TestMessages:
    MISTAKES = (
        (
            '<mujoco>\n<worldbody>\n<geom foo="1"/></worldbody></mujoco>',
            "3: schema violation: unrecognized attribute: 'foo' in <geom>",
        ),
        (
            '<mujoco>\n<worldbody>\n\n<geom size="a"/></worldbody></mujoco>',
            "4: bad format in attribute 'size' in <geom>",
        ),
        (
            '<mujoco>\n<worldbody><body name="q"><joint/></body></worldbody></mujoco>',
            "2: mass and inertia of moving bodies must be larger than mjMINVAL (element `q`)",
        ),
        (
            "<mujoco>\n<worldbody>\n</mujoco>",
            "2: not well-formed XML (mismatched element <worldbody>)",
        ),
        ("", "None: empty file this text"),
        ("hello", "1: not well-formed XML (text)"),
        ("<a/>", "None: unrecognized XML model type: 'a'"),
        (
            '<mujoco>\n<include file="none.xml"/></mujoco>',
            "2: error opening file 'none.xml' in <include>",
        ),
        (
            '<mujoco><asset><mesh file="none.stl"/></asset></mujoco>',
            "None: error opening file 'none.stl'",
        ),
        (
            '<mujoco>\n<worldbody><body name="a"/>\n<body name="a"/></worldbody></mujoco>',
            "3: repeated name 'a' in body in <body>",
        ),
        (
            '<mujoco><keyframe><key qpos="1 2"/></keyframe></mujoco>',
            "None: keyframe '': invalid qpos size, expected 0, got 2",
        ),
    )

    def test_mistakes(self, root: Path) -> None:
        results = texts(root, [xml for xml, _ in self.MISTAKES])
        told = [f"{each.line}: {readable_error(each.error)}" for each in results]
        assert told == [said for _, said in self.MISTAKES]
        assert not any(each.facts or str(root) in each.error for each in results)

    @pytest.mark.parametrize(
        "inner",
        [
            '<mujoco>\n<worldbody><geom size="0" name="q"/></worldbody></mujoco>',
            '<mujoco>\n<worldbody><geom size="a" name="q"/></worldbody></mujoco>',
        ],
    )
    def test_mistakes_in_included_files_have_no_line_here(self, root: Path, inner: str) -> None:
        (root / "models/inner.xml").write_text(inner)
        result = text(root, '<mujoco>\n<include file="inner.xml"/>\n</mujoco>')
        assert result.error and result.line is None

    def test_broken_included_file_is_reported_where_it_is_included(self, root: Path) -> None:
        (root / "models/inner.xml").write_text("<mujoco>\n\n\n<worldbody></mujoco>")
        assert text(root, '<mujoco>\n<include file="inner.xml"/>\n</mujoco>').line == 2

    def test_mistakes_in_attached_models(self, root: Path) -> None:
        (root / "models/inner.xml").write_text(
            '<mujoco>\n<worldbody><body name="b"><joint/></body></worldbody></mujoco>'
        )
        xml = (
            '<mujoco>\n<asset><model name="i" file="inner.xml"/></asset>\n<worldbody>\n'
            '<attach model="i" body="{}" prefix="p_"/></worldbody></mujoco>'
        )
        assert text(root, xml.format("b")).line is None
        assert text(root, xml.format("none")).line == 4

    def test_a_file_that_includes_itself(self, root: Path) -> None:
        result = model(root, "m", '<mujoco><include file="m.xml"/></mujoco>')
        assert "already included" in result.error

    @pytest.mark.parametrize(
        ("message", "line"),
        [
            ("no number", None),
            ("Element 'geom', line 0", None),
            ("Element 'geom', line 3", None),
            ("Element 'geom', line 2", 2),
            ("quoted: Element 'geom', line 9\n\nElement 'model', line 1\n", 1),
        ],
    )
    def test_lines(self, message: str, line: int | None) -> None:
        assert error_line(message, "<mujoco>\n</mujoco>") == line


class TestNothingStaysBehind:
    def test_warnings_do_not_litter_the_course(
        self, root: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.chdir(root)
        result = text(root, '<mujoco><option timestep="nan"/></mujoco>')
        assert result.error == ""
        assert names(root) == ["models"]
        assert capfd.readouterr() == ("", "")

    def test_a_model_without_end(self, root: Path) -> None:
        endless = (
            '<mujoco><worldbody><replicate count="300000000"><geom size="1"/></replicate>'
            "</worldbody></mujoco>"
        )
        for limit in (0.5, 8.0, 120.0):  # what comes to an end may take its time
            first, second = texts(root, [endless, "<mujoco/>"], timeout=limit)
            assert first.facts is None
            assert first.error == f"MuJoCo's compiler took longer than {limit:g} s"
            if second.error == "":
                break
        assert second.error == ""

    def test_a_model_of_any_size(self, root: Path) -> None:
        first, second = texts(root, ['<mujoco><size memory="90000G"/></mujoco>', "<mujoco/>"])
        assert first.error == "MuJoCo's compiler takes more than 1024 MiB of memory for it"
        assert second.error == ""

    @pytest.fixture
    def bad_worker(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        """A compiler that has a bug: the real one around a wrapper that crashes on cue."""
        path = tmp_path / "worker.py"
        path.write_text(
            f"import sys\nsys.path.insert(0, {str(Path(mjcf.__file__).parents[3])!r})\n"
            "import ctypes, os, time\n"
            "from coursebuild.core.run import mjcf_worker\n"
            "really = mjcf_worker._compile\n"
            "def compile(mujoco, request):\n"
            "    if 'crash' in request['text']: ctypes.string_at(0)\n"
            "    if 'exit' in request['text']: os._exit(7)\n"
            "    if 'noise' in request['text']: print('noise'); os.write(1, b'noise')\n"
            "    return really(mujoco, request)\n"
            "mjcf_worker._compile = compile\n"
            "mjcf_worker.main()\n"
        )
        monkeypatch.setattr(mjcf_worker, "__file__", str(path))
        return path

    @pytest.mark.usefixtures("bad_worker")
    def test_a_compiler_that_crashes(self, root: Path) -> None:
        xmls = [
            "<mujoco/>",
            "<!-- crash -->",
            "<mujoco/>",
            "<!-- exit -->",
            "<mujoco model='noise'/>",
        ]
        results = texts(root, xmls)
        assert [r.error for r in results] == [
            "",
            "MuJoCo's compiler crashed (SIGSEGV)",
            "",
            "MuJoCo's compiler ended with status 7",
            "",
        ]

    def test_no_engine(self, root: Path, bad_worker: Path) -> None:
        bad_worker.write_text("raise ImportError('no MuJoCo here')")
        with pytest.raises(EffectError) as caught:
            text(root, "<mujoco/>")
        assert caught.value.message == "MuJoCo cannot be loaded: ImportError: no MuJoCo here"
