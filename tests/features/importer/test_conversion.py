"""What of a course is converted in ways that need more than one place to be seen."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path

import mujoco
import pytest

from support.converted_folder import account_of, convert_files, first_lesson
from support.fixture_cases import FIXTURES, Case, check_cases
from support.rule_cases import parts

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
BASE = '<mujoco><asset><mesh name="m" file="m.obj"/></asset></mujoco>'
ROBOT = """<mujoco>
  <compiler meshdir="../meshes"/>
  <include file="parts/base.xml"/>
  <worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body></worldbody>
</mujoco>"""


PICTURE = {"p.png": "\x89PNG"}
FOLDERS = {
    "plain": PICTURE,
    "sphinx": {"conf.py": "numfig = True\n"},
    "mkdocs": {
        **PICTURE,
        "mkdocs.yml": "site_name: A\nmarkdown_extensions: [pymdownx.emoji]",
        "hidden/.b.md": "C\nD\n",
        "hidden/c.py": "d = 1\n",
        ".obsidian/app.json": "{}",
    },
}
"""What the folders of `tests/fixtures/imports` hold beside the files of a case."""


@pytest.mark.parametrize("kind", FOLDERS)
def test_the_first_text_of_a_folder_keeps_all_that_readers_see(
    tmp_path: Path, kind: str, rewriting: bool
) -> None:
    def render(case: Case) -> str:
        files = {path: text for _, path, text in parts(case.input)}
        course = convert_files(tmp_path / str(case.line), FOLDERS[kind] | files)
        return first_lesson(course)

    check_cases(FIXTURES / f"imports/{kind}.md", render, rewriting=rewriting)


def test_a_tab_loses_the_icon_in_its_title(tmp_path: Path) -> None:
    text = '# One\n\n=== ":simple-linux: Linux"\n\n    Text.\n'
    assert first_lesson(convert_files(tmp_path, {"one.md": text})) == "**Linux**\n\nText.\n"


def test_a_drawing_loses_only_what_none_may_hold(tmp_path: Path) -> None:
    start = '<svg xmlns="http://www.w3.org/2000/svg"'
    text = '<switch><foreignObject><p xmlns="">B</p></foreignObject><text>B</text></switch></svg>'
    sheet = "<style>@font-face {src: url(f)} .r {fill: red}</style>"
    files = {"a.md": "# One\n\n![B](b.svg)\n", "b.svg": f'{start} host="C">{sheet}{text}'}
    course = convert_files(tmp_path, files)
    drawing = course.files["content/files/b.svg"].decode()
    assert (
        drawing == f"{start}><style> .r {{fill: red}}</style><switch><text>B</text></switch></svg>"
    )
    left = "`host` of `<svg>`, a `url()` that leads elsewhere of a style sheet, `<foreignObject>`"
    assert f"  - b.svg: {left}\n" in account_of(course)


@pytest.mark.parametrize("folder", ["robots/arm", "content/models"])
def test_a_model_brings_the_files_that_it_is_made_of(tmp_path: Path, folder: str) -> None:
    above = folder.rpartition("/")[0]
    course = convert_files(
        tmp_path,
        {
            "one.md": "# One\n\nText.\n",
            f"{folder}/arm.xml": ROBOT,
            f"{folder}/parts/base.xml": BASE,
            f"{above}/meshes/m.obj": MESH,
            "other/arm.xml": "<mujoco model='other'/>",
            "loose/part.xml": "<mujocoinclude><asset/></mujocoinclude>",
            "made/task.xml": "<mujoco><include file='made.xml'/><include file='a.xml'/></mujoco>",
            "made/a.xml": "<mujoco><worldbody><geom material='m' size='1'/></worldbody></mujoco>",
            "made/mesh.xml": "<mujoco><asset><mesh file='no.obj'/></asset><worldbody/></mujoco>",
            "test/models/people.json": "{}",
            "loose/keys.xml": "<mujoco><keyframe><key qpos='1 2'/></keyframe></mujoco>",
        },
    )
    for path, data in course.files.items():
        (tmp_path / "new" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "new" / path).write_bytes(data)
    arms = [path for path in course.files if path.endswith("arm.xml")]
    models = [mujoco.MjModel.from_xml_path(str(tmp_path / "new" / path)) for path in arms]
    assert sorted(model.nmesh for model in models) == [0, 1]
    account = account_of(course)
    assert "- fragment of a model: beside the models that include it (1 time)" in account
    fragments = "a fragment of a model, which no whole one includes: it is compiled with none\n"
    assert f"{fragments}  - loose/keys.xml\n  - loose/part.xml\n  - made/a.xml\n" in account
    assert "a model that needs `made.xml`, which the folder does not hold" in account
    assert "a model that needs `no.obj`, which the folder does not hold" in account
    assert not any(word in path for path in course.files for word in ("loose", "keys", "made"))
    assert "used by no text\n  - test/models/people.json" in account


def test_a_long_text_is_within_the_limit_of_its_new_course(tmp_path: Path) -> None:
    texts = {
        "long.md": "# Long\n\n" + "A force is a push.\n" * 16_000,
        "short.md": "# Short\n\nText.\n",
    }
    course = convert_files(tmp_path, texts)
    limits = tomllib.loads(course.files["content/course.toml"].decode())["limits"]
    assert max(map(len, course.files.values())) < limits["text"] <= 500_000


def test_a_lab_of_another_tool_is_a_card_and_a_module_to_be_written(tmp_path: Path) -> None:
    first = '{"title": "A walker", "note": "It falls.", "poster": "w.png", "speed": [1, 2]}'
    second = '{"title": "Again", "camera": {"azimuth": 10}, "odd \\n key": 3}'
    course = convert_files(
        tmp_path,
        {
            "course.json": json.dumps({"levels": [{"lessons": [{"id": "1.1", "file": "a.md"}]}]}),
            "texts/a.md": f"# A\n\n```lab walker\n{first}\n```\n\n```lab walker\n{second}\n```\n\n"
            "```lab Bad/Name\n{}\n```\n",
            "w.png": "",
        },
    )
    text = next(data for path, data in course.files.items() if path.startswith("content/lessons"))
    assert b"> [!note] This lab is not here yet: walker\n>\n> A walker\n>\n> It falls.\n" in text
    assert b"> ![A walker](../files/w.png)" in text
    assert b'"azimuth": -170' in text
    modules = {path: data for path, data in course.files.items() if path.endswith(".js")}
    assert [*modules] == ["content/labs/walker.js"]
    module = tmp_path / "walker.mjs"
    module.write_bytes(modules["content/labs/walker.js"])
    fields = [line for line in module.read_text().splitlines() if line.startswith("//   ")]
    assert len(fields) == 6
    assert "//   speed: [1, 2]" in fields
    script = f"import({json.dumps(module.as_uri())}).then(m => console.log(typeof m.mount))"
    run = subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True)
    assert run.stdout == "function\n"


def test_a_text_of_headings_alone_is_a_draft(tmp_path: Path) -> None:
    course = convert_files(tmp_path, {"one.md": "# One\n\nText.\n", "two.md": "# Two\n\n## Aims\n"})
    lessons = tomllib.loads(course.files["content/course.toml"].decode())["level"][0]["lesson"]
    assert [lesson["status"] for lesson in lessons] == ["complete", "draft"]
