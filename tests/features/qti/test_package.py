"""Packages of QTI, and the HTML in them."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from coursebuild.core.pages.html_xml import Element, element, markup
from coursebuild.features.qti.flow import Flow
from support.archives import (
    Package,
    entries,
    formula_mistakes,
    mistakes,
    packaging_schema,
    referenced_files,
)
from support.fixture_cases import check_lines, fixture_tables, fixture_text
from support.hostile_html import HOSTILE, REFUSED_TEXTS
from support.qti_rules import MATHML, QTI
from support.qti_rules import mistakes as item_mistakes
from support.question_zoo import ANY, SCRIPT, SVG, quiz
from support.scratch_course import GOOD, CommandResult, Folder, Make

ZIP = "quizzes-qti.zip"
SPACES = {"q": QTI, "m": MATHML}


def export(folder: Folder, *arguments: str) -> CommandResult:
    command = folder.main("export", "qti", *arguments).require_success()
    return command


def package(folder: Folder) -> dict[str, bytes]:
    export(folder)
    files = entries(folder.root / ZIP)
    check(files)
    return files


def check(files: dict[str, bytes]) -> None:
    """A package is whole: valid, every file listed, every address a file of it."""
    manifest = files["imsmanifest.xml"]
    assert mistakes(packaging_schema(), manifest) == []
    assert set(referenced_files(manifest)) == set(files) - {"imsmanifest.xml"}
    for path, data in files.items():
        if path.startswith(("items/", "tests/")):
            assert item_mistakes(data) == [], path
            root = etree.fromstring(data)
            for math in root.iter(f"{{{MATHML}}}math"):
                assert formula_mistakes(math) == [], path
            for address in root.xpath("//@href | //@src"):
                if not re.match(r"[a-z]+:", address):
                    assert unquote(address).removeprefix("../") in files


def items(files: dict[str, bytes], test: str = "") -> list[etree._Element]:
    paths = [path for path in files if path.startswith(f"tests/{test}")]
    tests = [etree.fromstring(files[path]) for path in paths]
    names = [ref.get("href") for test in tests for ref in test.iter(f"{{{QTI}}}assessmentItemRef")]
    return [etree.fromstring(files[unquote(name).removeprefix("../")]) for name in names]


@pytest.fixture(scope="session")
def zoo_items(qti: Package) -> dict[str, etree._Element]:
    return dict(zip(ANY, items(qti.files), strict=True))


def shape(node: etree._Element, path: str) -> list[str]:
    nodes = node.xpath(path, namespaces=SPACES)
    return [part if isinstance(part, str) else "".join(part.itertext()) for part in nodes]


def right(item: etree._Element) -> list[str]:
    return shape(item, "//q:correctResponse/q:value")


@pytest.mark.site
def test_package_of_every_kind_of_question_is_whole(
    qti: Package, zoo_items: dict[str, etree._Element]
) -> None:
    assert qti.result.out.count("warning[package-reduced]") == 1
    assert "its simulation is on its page alone, and left out" in qti.result.out
    assert "wrote 14 files to quizzes-qti.zip, " in qti.result.out
    check(qti.files)
    bases = "//q:responseDeclaration/@baseType"
    assert {name: shape(item, bases) for name, item in zoo_items.items()} == {
        "mcq": ["identifier"], "several": ["identifier"], "predict": ["identifier"],
        "numeric": ["float"], "zero": ["float"], "large": ["float"], "output": ["string"],
        "marks": ["string"], "open": ["string"], "order": ["identifier"],
    }  # fmt: skip
    assert qti.files["files/lessons/sketch.svg"] == SVG.encode()
    titles = [item.get("title") for item in zoo_items.values()]
    assert titles == [f"Check: Question {n}" for n in range(1, 11)]


@pytest.mark.site
def test_item_of_a_choice_holds_all_that_its_question_says(
    zoo_items: dict[str, etree._Element],
) -> None:
    choice = zoo_items["mcq"]
    assert right(choice) == ["B"]
    assert shape(choice, "//q:choiceInteraction/@maxChoices") == ["1"]
    assert shape(choice, "//q:simpleChoice") == ["1 < 2", "two", "three"]
    assert shape(choice, "//q:infoControl/@title") == ["Hint 1", "Hint 2"]
    assert shape(choice, "//q:modalFeedback/@identifier") == ["A", "C", "EXPLANATION"]
    assert shape(choice, "//q:itemBody/q:pre") == ["if x < 1:\n    y = '&'"]
    assert shape(choice, "//q:itemBody//q:img/@src") == ["../files/lessons/sketch.svg"]
    assert shape(choice, "//q:itemBody//q:td/@class") == ["align-center", "align-right"]
    assert shape(choice, "//q:itemBody/q:ul/q:li") == ["☑ done", "☐ not"]
    several = zoo_items["several"]
    assert right(several) == ["A", "C"]
    assert shape(several, "//q:responseDeclaration/@cardinality") == ["multiple"]
    assert shape(several, "//q:choiceInteraction/@maxChoices") == ["0"]
    assert "Choose all that are right." in shape(several, "//q:itemBody/q:p")


@pytest.mark.site
def test_item_of_a_number_has_its_tolerance_and_unit(zoo_items: dict[str, etree._Element]) -> None:
    for name, value, margin in (
        ("numeric", 0.08, 1e-4), ("zero", 0.0, 0.5), ("large", 6.02e23, 0.02 * 6.02e23)
    ):  # fmt: skip
        assert [float(text) for text in right(zoo_items[name])] == [value]
        [tolerance] = shape(zoo_items[name], "//q:equal/@tolerance")
        assert [float(text) for text in tolerance.split()] == pytest.approx([margin, margin])
    assert shape(zoo_items["numeric"], "//q:p[q:textEntryInteraction]") == [" kg m2"]
    assert shape(zoo_items["numeric"], "//q:sup") == ["2"]


@pytest.mark.site
def test_items_of_outputs_texts_and_orders(zoo_items: dict[str, etree._Element]) -> None:
    item = zoo_items["output"]
    assert (right(item), right(zoo_items["marks"])) == (["drift  +6.6 %"], ["<b>&amp;"])
    assert shape(item, "//q:stringMatch/@caseSensitive") == ["true"]
    assert "What does examples/fall.py print in line 1 of its output?" in shape(item, "//q:p")
    item = zoo_items["open"]
    assert right(item) == [] and shape(item, "//q:responseCondition") == []
    assert shape(item, "//q:rubricBlock/@view") == ["scorer"]
    assert shape(item, "//q:rubricBlock/q:p[1]") == ["A good answer"]
    [feedback] = shape(item, "//q:modalFeedback")
    assert feedback.startswith("A good answer") and feedback.endswith("Because.")
    item = zoo_items["order"]
    names = shape(item, "//q:simpleChoice/@identifier")
    texts = dict(zip(names, shape(item, "//q:simpleChoice"), strict=True))
    assert [texts[name] for name in right(item)] == ["first", "second", "3", "fourth"]
    assert right(item) != sorted(right(item)) and names == sorted(names), "it is not given away"
    assert shape(item, "//q:responseDeclaration/@cardinality") == ["ordered"]


# --- hard cases

WARNINGS_BY_TEXT = {
    "<video src='sketch.svg'>words</video>": "`<video>` has no place in QTI and is left out",
    "<ol start='5'><li>five</li></ol>": "a numbered list counts from 1",
    "<del>no</del>": "crossed-out text is marked by a class",
    "[there](#hello)": "the link to `#hello` is text, as the course has no `base_url`",
    "<details><summary>More</summary>x</details>": "`<details>` is open",
}
IDS = ["4.2-check", "x-" * 40, "con", "A..b", "7", "a-b", "a_b", "a.b", "ab"]
IDS += ["x" * 60 + "1", "x" * 60 + "2"]
FORMULAS = (
    r"\frac{a}{b} \boxed{E=mc^2} \color{red}x \cancel{y} \vec{v} \sqrt[3]{x} \overbrace{a}^{n}"
    r" \begin{aligned}a&=b\\c&=d\end{aligned} \text{if } \left(\frac12\right] \mathbb{R}"
    r" \raisebox{2pt}{x} \phantom{x} \binom{n}{k} \xrightarrow{abc} x'' \not= \lim_{x\to0}"
)


@pytest.mark.site
def test_package_of_hard_cases_is_whole_and_its_losses_are_reported(make_course: Make) -> None:
    """Text that a page cannot hold either is a mistake of the author's, and not tried here."""
    hostile = [
        {**ANY["mcq"], "q": text, "explain": bare, "hints": [bare], "label": bare[:40],
         "options": [bare, "b"], "answer": 0, "feedback": [bare, bare]}
        for text in HOSTILE if text not in REFUSED_TEXTS
        for bare in [text.replace(" id='y'", "")]  # a page has an id once
    ]  # fmt: skip
    formula_question = {**ANY["zero"], "q": f"Inline ${FORMULAS}$ and\n\n$${FORMULAS}$$"}
    twice = [ANY["zero"], {**ANY["zero"], "q": "Again?"}]
    folder = make_course(
        GOOD
        + SCRIPT.replace("fall.py", "fall.py requires=no_such_module")
        + quiz("unknown", ANY["output"], ANY["zero"])
        + quiz("hostile", *hostile, title='<i>"T" & co</i>')
        + quiz("warned", *({**ANY["zero"], "q": text} for text in WARNINGS_BY_TEXT))
        + quiz("formulas", formula_question)
        + "".join(quiz(id, *twice) for id in IDS)
    )
    folder.write("content/pages/about.md", "## About\n\n" + quiz("page", ANY["mcq"]))
    folder.write("content/pages/sketch.svg", SVG)
    folder.replace(
        "content/course.toml",
        "[[level]]",
        '[security]\nhtml = "trusted"\n\n'
        '[[page]]\nid = "about"\ntitle = "About"\nfile = "content/pages/about.md"\n\n[[level]]',
    )
    command = export(folder)
    files = entries(folder.root / ZIP)
    check(files)
    losses = (
        "it is left out: its script was not run, so nobody knows the key",
        *WARNINGS_BY_TEXT.values(),
    )
    message = "the QTI package cannot hold all of this question: "
    assert [loss for loss in losses if f"{message}{loss}" not in command.out] == []
    assert len(items(files, "quiz.unknown")) == 1
    assert len(items(files, "quiz.hostile")) == len(hostile) > 15
    assert etree.fromstring(files["tests/quiz.hostile.xml"]).get("title") == '<i>"T" & co</i>'
    assert "tests/quiz.page.xml" in files and "files/pages/sketch.svg" in files
    names = [item.get("identifier") for item in items(files)]
    assert len(set(names)) == len(names)
    short_name = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]{0,31}")
    all_names = [*names, *(path.rpartition("/")[2][:-4] for path in files if "s/quiz." in path)]
    assert [name for name in all_names if not short_name.fullmatch(name)] == []
    [item] = items(files, "quiz.formulas")
    formulas = item.findall(f".//{{{MATHML}}}math")
    assert len(formulas) == 2, "a formula that a page cuts in pieces is whole"
    assert not [key for math in formulas for node in math.iter() for key in node.attrib
                if key in ("class", "style") or key.startswith("data-")]  # fmt: skip
    assert "mathcolor" in {key for node in formulas[0].iter() for key in node.attrib}
    assert [n.get("notation") for n in formulas[0].iter(f"{{{MATHML}}}menclose")] == [
        "box", "updiagonalstrike"
    ]  # fmt: skip
    folder.replace(
        "content/course.toml", "[[level]]",
        '[[silence]]\nrule = "package-reduced"\nreason = "the platform has none"\n\n[[level]]',
    )  # fmt: skip
    assert "package-reduced" not in export(folder).out


# --- edits


EXERCISE = fixture_text("documents/qti_exercise.md")


@pytest.mark.site
def test_item_of_an_exercise_has_its_task_start_and_trials(make_course: Make) -> None:
    [item] = items(package(make_course(EXERCISE)))
    assert item.get("title") == "Write it yourself: Exercise"
    body = "".join(item.find(f"{{{QTI}}}itemBody").itertext())
    for words in ("Make it weigh", "as MJCF", "mass='1'/>", "it weighs 2\xa0kg: at least 2\xa0kg"):
        assert words in body
    assert "mass='2'/>" in shape(item, "//q:rubricBlock[@view='scorer']/q:pre")[0]
    assert shape(item, "//q:modalFeedback")[0].endswith("Its mass is that of its geom.")


@pytest.mark.site
def test_package_follows_edits_and_names_of_other_items_stay(make_course: Make) -> None:
    folder = make_course("## One\n\n" + quiz("a", ANY["zero"], ANY["several"]))
    before = set(package(folder))
    folder.write(
        folder.lesson(),
        quiz(
            "a",
            ANY["large"],
            {**ANY["mcq"], "id": "why"},
            ANY["several"],
            ANY["zero"],
            ANY["predict"],
        ),
    )
    folder.write("content/lessons/sketch.svg", SVG.replace("4", "5"))
    folder.replace(
        "content/course.toml",
        'title = "Scratch"\n',
        'title = "Scratch"\nbase_url = "https://example.org/c/"\n',
    )
    assert "its simulation is on its page alone, and the item links it" in export(folder).out
    files = entries(folder.root / ZIP)
    check(files)
    assert before < set(files) and "items/q.a.why.xml" in files
    assert files["files/lessons/sketch.svg"] == SVG.replace("4", "5").encode()
    [address] = shape(items(files)[-1], "//q:modalFeedback//q:a/@href")
    assert re.fullmatch(r"https://example\.org/c/lessons/1\.1-one\.html#a\.[0-9a-f]{8}", address)


GOOD_ITEM = fixture_text("documents/good_item.xml")
BAD = fixture_tables("bad_items")["replacements"]


def test_rules_find_every_mistake_in_an_item() -> None:
    assert item_mistakes(GOOD_ITEM.encode()) == []
    missed = [new for old, new in BAD if not item_mistakes(GOOD_ITEM.replace(old, new).encode())]
    assert missed == []


TAGS = (
    "a abbr b blockquote br button caption code dd del details div dl dt em figure form h3 hr img"
    " input li math mi mo mrow mtable mtd mtr ol p pre ruby rt script span sub sup summary svg"
    " table tbody td tfoot th thead tr u ul video"
).split()
ATTRIBUTES = ("", " class='anchor'", " start=3", " colspan=2 rowspan='x'", " href='x'", " lang=de",
              " src='a.png' alt='&lt;'", " type=checkbox checked", " title='t'", " display=block",
              " style='color:#f00;border:1px'")  # fmt: skip
PIECES = st.one_of(
    st.builds("<{}{}>".format, st.sampled_from(TAGS), st.sampled_from(ATTRIBUTES)),
    st.builds("</{}>".format, st.sampled_from(TAGS)),
    st.builds("<{}/>".format, st.sampled_from(TAGS)),
    st.sampled_from(
        ["<table><tr>", "<table><thead><tr><th>", "<ul><li>", "<dl><dt>", "<pre><code>"]
    ),
    st.sampled_from(["words", " ", "\n", "&amp;", "&lt;b&gt;", "&#0;", "\x0b", "\ufffe", "<", "é"]),
)


def flow() -> Flow:
    return Flow(
        lambda address: address if address.startswith("https:") else None,
        lambda address: f"../{address}" if address.endswith(".png") else None,
    )


def item(flow: Flow, html: str) -> bytes:
    """An item in which a text stands wherever one may stand."""
    blocks = [markup(flow.blocks(html)) for _ in range(4)]
    choice = markup([element("simpleChoice", {"identifier": "A"}, *flow.line(html))])
    return f"""\
<assessmentItem xmlns="{QTI}" xmlns:m="{MATHML}" identifier="a" title="t" adaptive="false"
 timeDependent="false">
<responseDeclaration identifier="RESPONSE" cardinality="single" baseType="identifier"/>
<outcomeDeclaration identifier="F" cardinality="single" baseType="identifier"/>
<itemBody>{blocks[0]}<infoControl title="Hint">{blocks[1]}</infoControl>
<rubricBlock view="scorer">{blocks[2]}</rubricBlock>
<choiceInteraction responseIdentifier="RESPONSE" shuffle="false" maxChoices="1">{choice}
</choiceInteraction></itemBody>
<modalFeedback outcomeIdentifier="F" identifier="A" showHide="show">{blocks[3]}</modalFeedback>
</assessmentItem>""".encode()


def check_flow(html: str) -> Flow:
    converter = flow()
    data = item(converter, html)
    assert item_mistakes(data) == [], html
    return converter


def test_hostile_html_becomes_a_valid_item() -> None:
    for html in HOSTILE:
        check_flow(html)


@given(st.lists(PIECES, max_size=14).map("".join) | st.text())
def test_any_text_becomes_a_valid_item(html: str) -> None:
    check_flow(html)


def blocks(html: str) -> str:
    return "".join(
        re.sub(r' xmlns:m="[^"]*"', "", etree.tostring(node, encoding="unicode"))
        for node in (etree.fromstring(bare(block)) for block in flow().blocks(html))
    )


def bare(node: Element) -> bytes:
    data = markup([node]).encode()
    declaration = rb'\1 xmlns:m="http://www.w3.org/1998/Math/MathML"'
    return re.sub(rb"(<[a-z:0-9]+)", declaration, data, count=1)


def test_html_becomes_the_nearest_that_qti_allows_and_losses_are_listed(rewriting: bool) -> None:
    def convert(html: str) -> list[str]:
        return [blocks(html), *(f"loss: {loss}" for loss in check_flow(html).losses)]

    check_lines(Path(__file__).with_name("html.md"), convert, rewriting=rewriting)


@given(st.lists(PIECES, max_size=14).map("".join))
def test_any_formula_is_of_mathml(html: str) -> None:
    """Nesting as Temml gives it; what an author nests is the author's."""
    parts = flow().line("<math><mrow><mi>x</mi></mrow></math>" + html.replace("<m", "<x"))
    formulas = [part for part in parts if not isinstance(part, str) and part.tag == "m:math"]
    assert formulas
    for formula in formulas:
        assert formula_mistakes(etree.fromstring(bare(formula))) == []
