"""Quizzes as a package of IMS QTI 2.1: every kind of question, whatever stands in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from urllib.parse import unquote

import pytest
from lxml import etree

from coursebuild.core.pages.packages.xml import identifier
from support.archives import (
    Package,
    entries,
    formula_mistakes,
    mistakes,
    packaging_schema,
    referred,
)
from support.hostile_html import HOSTILE, REFUSED
from support.qti_rules import MATHML, QTI
from support.qti_rules import mistakes as item_mistakes
from support.question_zoo import ANY, SCRIPT, SVG, quiz
from support.scratch_course import GOOD, Done, Folder

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
ZIP = "quizzes-qti.zip"
SPACES = {"q": QTI, "m": MATHML}


def export(folder: Folder, *arguments: str) -> Done:
    return folder.main("export", "qti", *arguments)


def package(folder: Folder) -> dict[str, bytes]:
    """The package, in which everything is as it must be."""
    done = export(folder)
    assert done.status == 0, done.out + done.err
    files = entries(folder.root / ZIP)
    check(files)
    return files


def check(files: dict[str, bytes]) -> None:
    """A package is whole: valid, every file listed, every address a file of it."""
    manifest = files["imsmanifest.xml"]
    assert mistakes(packaging_schema(), manifest) == []
    assert set(referred(manifest)) == set(files) - {"imsmanifest.xml"}
    for path, data in files.items():
        if path.startswith(("items/", "tests/")):
            assert item_mistakes(data) == [], path
            root = etree.fromstring(data)
            for math in root.iter(f"{{{MATHML}}}math"):
                assert formula_mistakes(math) == [], path
            for address in root.xpath("//@href | //@src"):
                if not re.match(r"[a-z]+:", address):
                    assert unquote(address).removeprefix("../") in files


def items(files: dict[str, bytes]) -> list[etree._Element]:
    """The items in the order of their tests."""
    tests = [etree.fromstring(files[path]) for path in files if path.startswith("tests/")]
    names = [ref.get("href") for test in tests for ref in test.iter(f"{{{QTI}}}assessmentItemRef")]
    return [etree.fromstring(files[unquote(name).removeprefix("../")]) for name in names]


@pytest.fixture(scope="session")
def zoo_items(qti: Package) -> dict[str, etree._Element]:
    """The items by the names of their questions."""
    return dict(zip(ANY, items(qti.files), strict=True))


def shape(node: etree._Element, path: str) -> list[str]:
    """Texts or attributes."""
    found = node.xpath(path, namespaces=SPACES)
    return [part if isinstance(part, str) else "".join(part.itertext()) for part in found]


def test_package_of_every_kind_of_question_is_whole(
    qti: Package, zoo_items: dict[str, etree._Element]
) -> None:
    assert qti.done.out.count("warning[package-reduced]") == 1, "the simulation"
    assert "wrote 14 files to quizzes-qti.zip, 0.0 MB" in qti.done.out
    check(qti.files)
    bases = "//q:responseDeclaration/@baseType"
    assert {name: shape(one, bases) for name, one in zoo_items.items()} == {
        "mcq": ["identifier"], "several": ["identifier"], "predict": ["identifier"],
        "numeric": ["float"], "zero": ["float"], "large": ["float"], "output": ["string"],
        "marks": ["string"], "open": ["string"], "order": ["identifier"],
    }  # fmt: skip
    assert qti.files["files/lessons/sketch.svg"] == SVG.encode()
    titles = [one.get("title") for one in zoo_items.values()]
    assert titles == [f"Check: Question {n}" for n in range(1, 11)]


def right(one: etree._Element) -> list[str]:
    return shape(one, "//q:correctResponse/q:value")


def test_item_of_a_choice_holds_all_that_its_question_says(
    zoo_items: dict[str, etree._Element],
) -> None:
    one = zoo_items["mcq"]
    assert right(one) == ["B"]
    assert shape(one, "//q:choiceInteraction/@maxChoices") == ["1"]
    assert shape(one, "//q:simpleChoice") == ["1 < 2", "two", "three"]
    assert shape(one, "//q:infoControl/@title") == ["Hint 1", "Hint 2"]
    assert shape(one, "//q:modalFeedback/@identifier") == ["A", "C", "EXPLANATION"]
    assert shape(one, "//q:itemBody/q:pre") == ["if x < 1:\n    y = '&'"]
    assert shape(one, "//q:itemBody//q:img/@src") == ["../files/lessons/sketch.svg"]
    assert shape(one, "//q:itemBody//q:td/@class") == ["align-center", "align-right"]
    assert shape(one, "//q:itemBody/q:ul/q:li") == ["☑ done", "☐ not"]


def test_item_with_several_right_options_asks_for_all(
    zoo_items: dict[str, etree._Element],
) -> None:
    one = zoo_items["several"]
    assert right(one) == ["A", "C"]
    assert shape(one, "//q:responseDeclaration/@cardinality") == ["multiple"]
    assert shape(one, "//q:choiceInteraction/@maxChoices") == ["0"]
    assert "Choose all that are right." in shape(one, "//q:itemBody/q:p")


@pytest.mark.parametrize(
    ("name", "value", "within"),
    [("numeric", 0.08, 1e-4), ("zero", 0.0, 0.5), ("large", 6.02e23, 0.02 * 6.02e23)],
)
def test_item_of_a_number_has_its_tolerance(
    zoo_items: dict[str, etree._Element], name: str, value: float, within: float
) -> None:
    one = zoo_items[name]
    assert [float(text) for text in right(one)] == [value]
    [tolerance] = shape(one, "//q:equal/@tolerance")
    assert [float(text) for text in tolerance.split()] == pytest.approx([within, within])


def test_unit_of_a_number_is_text(zoo_items: dict[str, etree._Element]) -> None:
    one = zoo_items["numeric"]
    assert shape(one, "//q:p[q:textEntryInteraction]") == [" kg m2"]
    assert shape(one, "//q:sup") == ["2"]


def test_item_of_an_output_asks_for_the_printed_line(
    zoo_items: dict[str, etree._Element],
) -> None:
    one = zoo_items["output"]
    assert (right(one), right(zoo_items["marks"])) == (["drift  +6.6 %"], ["<b>&amp;"])
    assert shape(one, "//q:stringMatch/@caseSensitive") == ["true"]
    assert "What does examples/fall.py print in line 1 of its output?" in shape(one, "//q:p")


def test_a_question_whose_script_was_not_run_is_left_out_and_said(make: Make) -> None:
    script = SCRIPT.replace("fall.py", "fall.py requires=no_such_module")
    folder = make(GOOD + script + quiz("a", ANY["output"], ANY["zero"]))
    done = export(folder)
    assert done.status == 0, done.out + done.err
    assert "it is left out: its script was not run, so nobody knows the key" in done.out
    assert len(items(entries(folder.root / ZIP))) == 1


def test_open_question_is_for_people_to_score(
    zoo_items: dict[str, etree._Element],
) -> None:
    one = zoo_items["open"]
    assert right(one) == []
    assert shape(one, "//q:rubricBlock/@view") == ["scorer"]
    assert shape(one, "//q:rubricBlock/q:p[1]") == ["A good answer"]
    assert shape(one, "//q:responseCondition") == []
    [said] = shape(one, "//q:modalFeedback")
    assert said.startswith("A good answer") and said.endswith("Because.")


def test_item_of_an_order_does_not_give_it_away(
    zoo_items: dict[str, etree._Element],
) -> None:
    one = zoo_items["order"]
    texts = dict(zip(shape(one, "//q:simpleChoice/@identifier"), shape(one, "//q:simpleChoice"),
                     strict=True))  # fmt: skip
    assert [texts[name] for name in right(one)] == ["first", "second", "3", "fourth"]
    assert right(one) != sorted(right(one)) and list(texts) == sorted(texts)
    assert shape(one, "//q:responseDeclaration/@cardinality") == ["ordered"]


def test_a_simulation_is_linked_where_the_course_has_an_address(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["predict"]))
    assert "its simulation is on its page alone, and left out" in export(folder).out
    folder.replace(
        "content/course.toml",
        'title = "Scratch"\n',
        'title = "Scratch"\nbase_url = "https://example.org/c/"\n',
    )
    assert "and the item links it" in export(folder).out
    [one] = items(package(folder))
    [address] = shape(one, "//q:modalFeedback//q:a/@href")
    assert re.fullmatch(r"https://example\.org/c/lessons/1\.1-one\.html#a\.[0-9a-f]{8}", address)


# --- names


def test_names_depend_on_the_question_and_not_on_its_place(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["zero"], ANY["several"]))
    before = set(package(folder))
    folder.write(folder.lesson(), GOOD + quiz("a", ANY["large"], ANY["several"], ANY["zero"]))
    after = set(package(folder))
    assert before < after and len(after - before) == 1
    named = {**ANY["open"], "id": "why"}
    folder.write(folder.lesson(), GOOD + quiz("a", named))
    assert "items/q.a.why.xml" in package(folder)


def test_names_are_short_and_of_xml_and_stay_apart(make: Make) -> None:
    ids = ["4.2-check", "x-" * 40, "con", "A..b", "7"]
    ids += ["a-b", "a_b", "a.b", "ab", "x" * 60 + "1", "x" * 60 + "2"]
    questions = [ANY["zero"], {**ANY["zero"], "q": "Again?"}]
    files = package(make(GOOD + "".join(quiz(id, *questions) for id in ids)))
    names = [one.get("identifier") for one in items(files)]
    assert len(set(names)) == 2 * len(ids)
    paths = [path for path in files if "/" in path]
    assert len([path for path in paths if path.startswith("tests/")]) == len(ids)
    assert len([path for path in paths if path.startswith("items/")]) == 2 * len(ids)
    wanted = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]{0,31}")
    every = [*names, *(path.rpartition("/")[2][:-4] for path in paths)]
    assert [name for name in every if not wanted.fullmatch(name)] == []


@pytest.mark.parametrize("most", [0, 32])
def test_identifiers_of_any_texts_are_valid_and_differ(most: int) -> None:
    texts = [
        "",
        "ä",
        "ä ",
        "_e4_",
        "Проверка",
        "問題",
        "a/b",
        "..",
        "a\0b",
        "é" * 60,
        "é" * 61,
        "a b",
    ]
    names = [identifier("q.", text, most=most) for text in texts]
    assert len(set(names)) == len(texts)
    for name in names:
        assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", name) and len(name) <= (most or 1000)


# --- hostile texts


def test_package_of_hostile_texts_is_valid(make: Make) -> None:
    """What a page cannot hold either is a mistake of the author's, and not tried here."""
    questions = [
        {**ANY["mcq"], "q": text, "explain": text, "hints": [text], "label": text[:40],
         "options": [text, "b"], "answer": 0, "feedback": [text, text]}
        for text in HOSTILE if text not in REFUSED
    ]  # fmt: skip
    folder = make(GOOD + quiz("a", *questions, title="<i>&"))
    files = package(folder)
    assert len(items(files)) == len(questions) > 15


def test_everything_left_out_is_warned_of(make: Make) -> None:
    texts = {
        "<video src='a.mp4'>words</video>": "`<video>` has no place in QTI and is left out",
        "<ol start='5'><li>five</li></ol>": "a numbered list counts from 1",
        "<del>no</del>": "crossed-out text is marked by a class",
        "[there](#hello)": "the link to `#hello` is text, as the course has no `base_url`",
        "<details><summary>More</summary>x</details>": "`<details>` is open",
    }
    questions = [{**ANY["zero"], "q": text} for text in texts]
    folder = make(GOOD + quiz("a", *questions))
    done = export(folder)
    assert done.status == 0, done.out + done.err
    for number, said in enumerate(texts.values(), 1):
        assert f"this question is not whole in the QTI package: {said}" in done.out, number
    assert "5 warnings" in done.out
    check(entries(folder.root / ZIP))
    folder.replace(
        "content/course.toml", "[[level]]",
        '[[silence]]\nrule = "package-reduced"\nreason = "the platform has none"\n\n[[level]]',
    )  # fmt: skip
    assert "package-reduced" not in export(folder).out


def test_mathml_is_of_version_2(make: Make) -> None:
    formulas = (
        r"\frac{a}{b} \boxed{E=mc^2} \color{red}x \cancel{y} \vec{v} \sqrt[3]{x} \overbrace{a}^{n}"
        r" \begin{aligned}a&=b\\c&=d\end{aligned} \text{if } \left(\frac12\right] \mathbb{R}"
        r" \raisebox{2pt}{x} \phantom{x} \binom{n}{k} \xrightarrow{abc} x'' \not= \lim_{x\to0}"
    )
    question = {**ANY["zero"], "q": f"Inline ${formulas}$ and\n\n$${formulas}$$"}
    [one] = items(package(make(GOOD + quiz("a", question))))
    found = one.findall(f".//{{{MATHML}}}math")
    assert len(found) == 2, "a formula that a page cuts in pieces is whole"
    assert not [key for math in found for node in math.iter() for key in node.attrib
                if key in ("class", "style") or key.startswith("data-")]  # fmt: skip
    assert "mathcolor" in {key for node in found[0].iter() for key in node.attrib}
    assert [n.get("notation") for n in found[0].iter(f"{{{MATHML}}}menclose")] == [
        "box", "updiagonalstrike"
    ]  # fmt: skip


# --- the command


@pytest.mark.slow
def test_same_course_gives_the_same_bytes(qti: Package) -> None:
    once = qti.folder.read(ZIP)
    export(qti.folder)
    assert qti.folder.read(ZIP) == once, "from what is kept"
    export(qti.folder, "--no-cache", "--jobs", "1", "--out", "sub/other.zip")
    assert qti.folder.read("sub/other.zip") == once


def test_a_course_without_quizzes_has_no_package(make: Make) -> None:
    folder = make(GOOD)
    done = export(folder)
    assert (done.status, done.err.splitlines()[-1]) == (
        1,
        "coursebuild: the course has no quiz with a question, so there is no QTI package",
    )
    assert not (folder.root / ZIP).exists()


def test_nothing_is_written_where_something_is_wrong(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["zero"]))
    package(folder)
    once = folder.read(ZIP)
    folder.replace(folder.lesson(), "hello 3.14159\n", "hello 3.14158\n")
    done = export(folder)
    assert done.status == 1 and "nothing was written" in done.out
    assert folder.read(ZIP) == once


def test_package_is_written_nowhere_where_it_would_be_in_the_way(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["zero"]))
    folder.write("notes.txt", "mine")
    assert folder.main("build").status == 0
    for out, said in (
        ("models/q.zip", "lies in models/ of the project, where no export goes"),
        ("notes.txt", "is there, and is no such export"),
        (".", "is a folder"),
        ("public/q.zip", "lies in a published site, which the next build replaces"),
    ):
        done = export(folder, "--out", out)
        assert done.status == 2 and said in done.err, out
    assert folder.text("notes.txt") == "mine"


def test_a_picture_that_is_replaced_is_replaced_in_the_package(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["mcq"]))
    package(folder)
    folder.write("content/lessons/sketch.svg", SVG.replace("4", "5"))
    assert package(folder)["files/lessons/sketch.svg"] == SVG.replace("4", "5").encode()


def test_pages_have_quizzes_too(make: Make) -> None:
    folder = make(GOOD)
    folder.write("content/pages/about.md", "## About\n\n" + quiz("b", ANY["mcq"]))
    folder.write("content/pages/sketch.svg", SVG)
    folder.replace(
        "content/course.toml",
        "[[level]]",
        '[[page]]\nid = "about"\ntitle = "About"\nfile = "content/pages/about.md"\n\n[[level]]',
    )
    files = package(folder)
    assert "tests/quiz.b.xml" in files and "files/pages/sketch.svg" in files


def test_the_title_of_a_quiz_is_text(make: Make) -> None:
    folder = make(GOOD + quiz("a", ANY["zero"], title='<i>"T" & co</i>'))
    [test] = [data for path, data in package(folder).items() if path.startswith("tests/")]
    assert etree.fromstring(test).get("title") == '<i>"T" & co</i>'
