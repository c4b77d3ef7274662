"""Nothing broken is published, and the old site stays: strict checks, links, empty lessons."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from support.scratch_course import FIRST, GOOD, SECOND, Folder, Make, block, without_locks

pytestmark = pytest.mark.site


def test_drift_is_not_published_and_update_puts_it_back(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    good, site = folder.read(folder.lesson()), folder.tree("public")
    folder.replace(folder.lesson(), "hello 3.14159\n", "hello 3.14158\n")
    result = folder.main("build")
    assert result.status == 1
    line = folder.text(folder.lesson()).splitlines().index("hello 3.14158") + 1
    assert f"--> {folder.lesson()}:{line}:7\n" in result.out
    assert "nothing was published; public stays as it is\n" in result.out
    assert "run `coursebuild update 1.1`" in result.out
    assert folder.tree("public") == site
    assert folder.main("update", "1.1").status == 0
    assert folder.read(folder.lesson()) == good
    assert folder.main("build").status == 0
    assert folder.tree("public") == site


MISTAKES: dict[str, bytes] = {
    "link": b"[gone](lesson:7.7)\n",
    "math": b"$\\frac{1$\n",
    "script": block("fails.py", "1/0").encode(),
    "mjcf": b"```mjcf\n<mujoco><nosuch/></mujoco>\n```\n",
    "image": b"![a](gone.png)\n",
    "json": b'```quiz\n{"id": "q"}\n```\n',
    "binding": b"`3.15`{out}\n",
    "encoding": b"\xff\n",
}


def test_site_stays_as_it_was_whatever_the_mistake(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    site = folder.tree("public")
    for kind, mistake in MISTAKES.items():
        folder.write(folder.lesson(), GOOD.encode() + mistake)
        assert folder.main("build").status == 1, kind
        assert folder.tree("public") == site, kind


def test_nothing_is_published_before_there_is_a_site(make: Make) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")
    result = folder.main("build")
    assert result.status == 1
    assert "\nnothing was published\n" in result.out
    assert folder.entries() == [
        ".coursebuild",
        "content",
        "content/course.toml",
        "content/lessons",
        "content/lessons/1.1-one.md",
        "examples",
        "examples/.extracted.json",
        "examples/hello.py",
    ]


def test_files_of_somebody_else_are_never_removed(make: Make) -> None:
    folder = make(GOOD)
    folder.write("out/notes.txt", "mine")
    result = folder.main("build", "--out", "out")  # refused before any script runs
    assert (result.status, result.out) == (2, "")
    assert not (folder.root / "examples").exists()
    assert folder.read("out/notes.txt") == b"mine"


def test_caches_that_are_gone_or_damaged_are_made_again(make: Make, stores: Path) -> None:
    folder = make(GOOD + "Őrült żółw\n")  # for which fonts are cut
    assert folder.main("build").status == 0
    site, caches = folder.tree(), folder.root / ".coursebuild"
    (caches / "fonts").unlink()
    shutil.copytree(stores / "fonts", caches / "fonts")
    for font in (caches / "fonts").iterdir():
        font.write_bytes(b"")
    assert folder.main("build").status == 0
    assert folder.tree() == site
    shutil.rmtree(caches)
    caches.mkdir()
    (caches / "fonts").symlink_to(stores / "fonts")
    assert folder.main("build").status == 0
    assert folder.tree() == site


def test_builds_at_once_wait_for_each_other_without_locks(make: Make) -> None:
    """On a file system that has none, where two would fill the same folder."""
    folder = make(GOOD)
    code = without_locks() + "import sys\nfrom coursebuild.cli import main\nsys.exit(main())\n"
    assert folder.main("build").status == 0
    site = folder.tree("public")
    for number in range(3):
        course_map = folder.text("content/course.toml")
        folder.replace("content/course.toml", "[course]", f"[course]\nsummary = 'Of {number}'")
        shutil.rmtree(folder.root / "public")
        builds = [folder.start("build", code=code, stderr=subprocess.PIPE) for _ in range(3)]
        texts = [build.communicate()[1] for build in builds]
        assert [build.returncode for build in builds] == [0, 0, 0], texts
        assert f"Of {number}" in folder.text("public/index.html")
        folder.write("content/course.toml", course_map)
    assert folder.main("build").status == 0
    assert folder.tree("public") == site
    assert ".coursebuild-lock" not in folder.entries()


QUIZ = """```quiz
{"id": "q", "questions": [{"kind": "mcq", "id": "a", "q": "See <a href=\\"gone.html\\">it</a>?",
 "options": ["yes", "no"], "answer": 0, "explain": "So."}]}
```
"""
LINKS = {
    '<a href="gone.html">it</a>': "1:10",
    '<a title="<b>it</b>" href="gone.html">it</a>': "1:28",
    "<a title='gone.html' href='gone.html?<b>&amp;c=\"d\"'>it</a>": "1:28",
    "<a href=gone.html#&lt;b&gt;>it</a>": "1:9",
    '<p>\n<b title="a>b">c</b>\n<a\nhref="gone.html">it</a></p>': "4:7",
    '> quoted\n> <a\n> href="gone.html">it</a>': "3:9",
    '- A [rotor]{term} is <a href="gone.html">it</a>.': "1:31",
    "`gone.html` and <!-- <a href='gone.html'> --> <a href='gone.html'>it</a>": "1:56",
    QUIZ: "2:74",
}


def test_broken_link_in_raw_html_is_reported_at_its_place(make: Make) -> None:
    """A title of the map that looks like such a link is text, and no link of the page."""
    folder = make(*(f"{text}\n" for text in LINKS))
    title = "title = '<a href=\"gone.html\">'"
    folder.replace("content/course.toml", 'title = "Lesson one"', title)
    result = folder.main("build")
    assert result.status == 1
    places = re.findall(r"(?:error|warning)\[.*\n *--> (.*)", result.out)
    assert places == [f"{folder.lesson(n)}:{at}" for n, at in enumerate(LINKS.values(), 1)]


def test_what_counts_as_something_to_read(make: Make) -> None:
    little = ["Prose.\n", "<!-- x -->\n\nProse.\n", "---\n", "$$x$$\n", "    code\n", "<hr>\n", "x"]
    folder = make(GOOD, *little)
    folder.main("check").require_success()
    # No other check looks at prose; the second check takes its diagnostics from the store.
    for text, status in (
        ("", 1),
        ("Other prose.\n", 0),
        ("<!-- x -->\n\n<!-- y\n\nz -->\n", 1),
        ("\u00a0\n\u2003", 1),
        ("[there]: https://example.org\n", 1),
    ):
        folder.write(folder.lesson(2), text)
        result = folder.main("check")
        assert (result.status, "error[lesson-empty]" in result.out) == (status, status == 1)
    head, second = folder.text("content/course.toml").split('"1.2"')  # a draft may be empty
    folder.write("content/course.toml", f'{head}"1.2"{second.replace("complete", "draft", 1)}')
    assert folder.main("build").status == 0
    folder.write(folder.lesson(3), "```quiz\n{\n```\n")
    result = folder.main("check")
    assert ("error[json-syntax]" in result.out, "lesson-empty" in result.out) == (True, False)


SKIP = "\n#### Deep\n"
"""A heading that gets a warning."""
TORCH = (
    "## Two\n\n"
    + block("two.py", "import no_torch", "2.99", info="requires=no_torch")
    + "It is `2.99`{out}, or `3.0`{out=examples/two.py}, of 17.5.\n"
)
NORUN = "## Three\n\n" + block("three.py", "print(3)", "7.77", info="norun")


def verify(folder: Folder, text: str) -> None:
    """Write the table `[verify]` of the map, or another one at its end."""
    name = "content/course.toml"
    map = folder.text(name).partition("\n[verify]")[0]
    folder.write(name, f"{map}\n[verify]\n{text}")


def last_line(text: str) -> str:
    return text.splitlines()[-1]


def test_strict_shows_a_warning_as_an_error_in_every_format(make: Make) -> None:
    folder = make(FIRST + SKIP)
    plain = folder.main("check")
    strict = folder.main("check", "--strict")
    assert (plain.status, strict.status) == (0, 1)
    assert plain.out.startswith("warning[heading-skip]: ")
    assert strict.out.partition("\n\n")[0] == plain.out.partition("\n\n")[0].replace(
        "warning[", "error["
    )
    assert last_line(strict.out) == "1 lesson, 0 scripts run, 1 cached: 1 error"
    parts = {
        "json": '"severity": "error"',
        "junit": '<failure type="heading-skip"',
        "sarif": '"level": "error"',
        "github": "::error file=content/lessons/1.1-one.md,line=14,",
    }
    for form, part in parts.items():
        result = folder.main("check", "--strict", "--format", form)
        assert (result.status, part in result.out) == (1, True), form
        assert part not in folder.main("check", "--format", form).out, form


@pytest.mark.parametrize("is_option", (True, False))
def test_strict_build_publishes_nothing_while_there_is_a_warning(
    make: Make, is_option: bool
) -> None:
    folder = make(FIRST + SKIP)
    option = ("--strict",) if is_option else ()
    verify(folder, "" if is_option else "strict = true\n")
    result = folder.main("build", *option)
    assert (result.status, (folder.root / "public").exists()) == (1, False)
    assert "nothing was published" in result.out
    folder.write(folder.lesson(), FIRST)
    assert folder.main("build", *option).status == 0
    assert (folder.root / "public/index.html").exists()


def test_a_run_with_nothing_to_do_keeps_the_verdict_of_strict_apart(make: Make) -> None:
    folder = make(FIRST + SKIP)
    expected = {(): 0, ("--strict",): 1}
    for _ in range(2):
        for option, status in expected.items():
            assert folder.main("check", *option).status == status
    verify(folder, "strict = true\n")
    assert folder.main("check").status == 1
    verify(folder, "strict = false\n")
    assert folder.main("check").status == 0


def test_strict_leaves_what_is_silenced_or_only_listed(make: Make) -> None:
    folder = make(FIRST + SKIP + "\nIt weighs 17.5 kg.\n")
    silence = '[[silence]]\nrule = "heading-skip"\nreason = "a list of tasks"\n'
    verify(folder, f"strict = true\n\n{silence}")
    result = folder.main("check", "--truth")
    assert result.status == 0
    assert result.out.startswith("warning[number-unproven]: `17.5` is stated")
    assert last_line(result.out) == "1 lesson, 1 script run: 1 warning (1 silenced)"


def test_results_that_nothing_gives_are_listed_of_the_lessons_that_are_named(make: Make) -> None:
    first, second = FIRST + "\nIt weighs 17.5 kg.\n", SECOND + "\nIt takes 3.25 s.\n"
    folder = make(first, second)
    folder.replace("content/course.toml", 'title = "Lesson two"', 'title = "Lesson two, in 6.5 s"')
    numbers_by_names = {(): ["17.5", "3.25", "6.5"], ("1.1",): ["17.5"], ("1.2",): ["3.25", "6.5"]}
    for names, numbers in numbers_by_names.items():
        out = folder.main("check", "--truth", *names).out
        assert sorted(re.findall(r"`([\d.]+)` is stated", out)) == numbers


def test_a_script_that_lacks_a_package_proves_nothing(make: Make) -> None:
    folder = make(FIRST, TORCH)
    result = folder.main("check")
    assert result.status == 0
    assert last_line(result.out) == (
        "2 lessons, 1 script run: holds, but for 1 script that was not run (no_torch)"
    )
    report = json.loads(folder.main("check", "--format", "json").out)
    summary, script = report["summary"], report["scripts"][1]
    assert (summary["unproven"], summary["reasons"]) == (1, ["no_torch"])
    assert (script["unproven_outputs"], script["unproven_numbers"]) == (1, 2)
    strict = folder.main("check", "--strict", "--format", "github")
    assert strict.status == 1
    assert strict.out.startswith("::error file=content/lessons/1.2-two.md,line=3,col=1,")
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.2-two.html")
    doubt = "Not verified: no_torch was not installed when the site was built."
    for number in ("2.99", "3.0"):
        assert f'<span class="bound unverified" title="{doubt}">{number}</span>' in page


def test_the_map_lets_scripts_pass_by_name(make: Make) -> None:
    folder = make(FIRST, TORCH, NORUN, TORCH.replace("two.py", "again.py"))
    passing = 'strict = true\nunproven = ["examples/three.py", "examples/again.py"'
    verify(folder, f"{passing}]\n")
    result = folder.main("check")
    assert result.status == 1
    assert "examples/three.py` was not run" not in result.out
    assert last_line(result.out).endswith(
        ": 1 error, and 3 scripts that were not run (no_torch, norun)"
    )
    verify(folder, f'{passing}, "examples/two.py"]\n')
    for command in ("check", "build"):
        result = folder.main(command)
        assert result.status == 0
        assert last_line(result.out).endswith(
            ": holds, but for 3 scripts that were not run (no_torch, norun)"
        )


def test_a_course_whose_only_scripts_are_let_pass_is_clean(make: Make) -> None:
    folder = make(TORCH)
    verify(folder, 'strict = true\nunproven = ["examples/two.py"]\n')
    assert folder.main("check").status == 0
    verify(folder, "strict = true\n")
    result = folder.main("check")
    assert result.status == 1
    assert "error[no-scripts]" in result.out
