"""Formulas to MathML, friendly ones and hostile ones."""

from __future__ import annotations

import re
import threading
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from xml.etree import ElementTree

import pytest

from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.run.typesetting import MathEngine
from support.fixture_cases import fixture_tables, fixture_text
from support.run_code import program, run_code

GLOBAL = {"class", "style", "mathbackground", "mathcolor"}
ALLOWED_ATTRIBUTES = {
    name: set(attributes)
    for name, *attributes in map(
        str.split,
        fixture_text("documents/mathml_attributes.txt").splitlines(),
    )
}
"""What the HTML checker takes and browsers draw; a `span` in `mtext` is the number of an equation.
"""
FORMULAS = fixture_text("documents/formulas.tex").strip().splitlines()
MISTAKES = tomllib.loads(fixture_text("documents/formula_mistakes.toml"))["mistakes"]
DISPLAY_ONLY = fixture_tables("display_only")["formulas"]


@pytest.fixture(scope="module")
def engine() -> Iterator[MathEngine]:
    engine = MathEngine()
    yield engine
    engine.close()


def typeset_one(engine: MathEngine, tex: str, display: bool = False) -> str | MathError:
    (result,) = engine.typeset([Formula(tex, display)])
    return result


def mathml(result: str | MathError) -> ElementTree.Element:
    assert isinstance(result, str), result
    return ElementTree.fromstring(result)


class TestMarkup:
    def test_is_valid_in_html(self, engine: MathEngine) -> None:
        cases = [(tex, display) for tex in FORMULAS for display in (False, True)]
        cases += [(tex, True) for tex in DISPLAY_ONLY]
        results = engine.typeset([Formula(tex, display) for tex, display in cases])
        mistakes = {
            tex: mistake
            for (tex, display), result in zip(cases, results, strict=True)
            if (mistake := self.mistake(result, tex, display))
        }
        assert mistakes == {}

    def test_displays_alone_are_refused_in_a_line(self, engine: MathEngine) -> None:
        results = engine.typeset([Formula(tex, False) for tex in DISPLAY_ONLY])
        assert [r for r in results if isinstance(r, str)] == []

    def mistake(self, result: str | MathError, tex: str, display: bool) -> str:
        if isinstance(result, MathError):
            return result.message
        root = ElementTree.fromstring(result)
        if root.tag != "math" or (root.get("display") == "block") is not display:
            return f"<{root.tag} {root.attrib}>"
        (semantics,) = root
        if [child.get("encoding") for child in semantics][1:] != ["application/x-tex"]:
            return "no annotation"
        if semantics[1].text != tex:
            return f"the annotation {semantics[1].text}"
        strange = [
            f"<{element.tag} {element.attrib}>"
            for element in root.iter()
            if not set(element.attrib) <= ALLOWED_ATTRIBUTES.get(element.tag, set()) | GLOBAL
            or re.search("undefined|[Ff]ont-family", " ".join(element.attrib.values()))
            or element.tag not in ALLOWED_ATTRIBUTES
        ]
        return ", ".join(strange)

    def test_text_is_escaped(self, engine: MathEngine) -> None:
        tex = r"\text{</math><script>\"'\& x}"
        root = mathml(typeset_one(engine, tex))
        assert root.find(".//annotation").text == tex
        assert not root.findall(".//script")

    def test_bold_digits_are_characters_of_their_own(self, engine: MathEngine) -> None:
        for tex in (r"\boldsymbol{0}", r"\bm{0}", r"\mathbf{0}"):
            assert [mn.text for mn in mathml(typeset_one(engine, tex)).iter("mn")] == ["𝟎"], tex

    def test_cells_that_are_not_written_are_as_others(self, engine: MathEngine) -> None:
        rows = r"a & b \\ c"
        cells = mathml(typeset_one(engine, rf"\begin{{matrix}} {rows} \end{{matrix}}")).iter("mtd")
        assert len({cell.get("style") for cell in cells}) == 2  # the first and the last of a row

    def test_a_macro_is_what_its_formula_defines_or_its_arguments_say(
        self, engine: MathEngine
    ) -> None:
        for tex, text in {
            r"\braket{a|b}{c}": "⟨a|b⟩c",
            r"\braket{a} {b}": "⟨a|b⟩",
            r"\dv{f} {x}": "dfdx",
            r"\providecommand{\tr}{t}\tr": "t",
        }.items():
            root = mathml(typeset_one(engine, tex))
            assert "".join(root[0][0].itertext()) == text, tex

    def test_negated_relations_are_single_characters(self, engine: MathEngine) -> None:
        root = mathml(typeset_one(engine, r"a \not= b \not\in C"))
        assert [mo.text for mo in root.iter("mo")] == ["≠", "∉"]

    def test_a_root_over_low_letters_is_as_high_as_over_capitals(self, engine: MathEngine) -> None:
        for tex in (r"\sqrt u", r"\sqrt{1-x^2}", r"\sqrt[3]{\dot q}"):
            root = mathml(typeset_one(engine, tex))
            assert "0.7em" in [space.get("height") for space in root.iter("mspace")], tex
            assert all(len(cubic) == 2 for cubic in root.iter("mroot"))
        for tex in (r"\sqrt{x_i}", r"\sqrt{\frac12}", r"\sqrt{\sum k}"):
            root = mathml(typeset_one(engine, tex))
            assert "0.7em" not in [space.get("height") for space in root.iter("mspace")], tex

    def test_labels_become_no_ids(self, engine: MathEngine) -> None:
        result = typeset_one(engine, r"\tag{1}\label{introduction} x", True)
        assert isinstance(result, str) and " id=" not in result

    def test_same_formula_same_bytes(self) -> None:
        sources = [*FORMULAS, *MISTAKES, "{" * 600 + "x" + "}" * 600, r"\bf{" * 250 + "}" * 250]
        formulas = [Formula(tex, display) for tex in sources for display in (False, True)]
        engine = MathEngine()
        first = engine.typeset(formulas)
        assert engine.typeset(formulas) == first
        many, before = MathEngine(), threading.active_count()
        for start in range(0, len(formulas), 50):
            reverse = formulas[::-1][start : start + 50]
            assert many.typeset(reverse) == first[::-1][start : start + 50]
        assert threading.active_count() > before, "V8 has come in"
        many.close()
        assert threading.active_count() == before


class TestMistakes:
    def test_each_mistake_has_its_message_and_place(self, engine: MathEngine) -> None:
        errors = engine.typeset([Formula(tex, False) for tex in MISTAKES])
        for error, (tex, (message, *position)) in zip(errors, MISTAKES.items(), strict=True):
            assert error == MathError(message, *(position or [None])), tex

    def test_one_bad_formula_spoils_no_other(self, engine: MathEngine) -> None:
        formulas = [Formula(tex, False) for tex in ("a", r"\foo", "b", "{", "c")]
        kinds = [isinstance(r, str) for r in engine.typeset(formulas)]
        assert kinds == [True, False, True, False, True]

    def test_macros_do_not_leak(self, engine: MathEngine) -> None:
        for define in (r"\def", r"\gdef", r"\global\def", r"\xdef"):
            formulas = [Formula(tex, False) for tex in (rf"{define}\zz{{x}} \zz", r"\zz")]
            good, bad = engine.typeset(formulas)
            assert isinstance(good, str)
            assert bad == MathError(r"unknown command \zz", 0)

    def test_built_in_commands_cannot_be_changed_for_others(self, engine: MathEngine) -> None:
        before = typeset_one(engine, r"\sin x")
        engine.typeset([Formula(r"\gdef\sin{\cos} \sin", False)])
        engine.typeset([Formula(r"\gdef\__proto__{y} \__proto__", False)])
        assert typeset_one(engine, r"\sin x") == before

    def test_position_in_a_macro_of_temml_is_not_taken_for_ours(self, engine: MathEngine) -> None:
        for tex in (r"\ket{\ket{", r"\implies^a^b", r"\TeX^a^b", r"\dots\foo"):
            result = typeset_one(engine, tex)
            assert isinstance(result, MathError)
            assert result.position is None or 0 <= result.position <= len(tex)


NINE = r"\def\a#1{#1#1#1#1#1#1#1#1#1}"
HOSTILE = {
    "endless macro": r"\def\a{\a\a}\a",
    "endless edef": r"\def\a{xx}" + r"\edef\a{\a\a}" * 40 + r"\a",
    "tokens without end": NINE + r"\a{\a{\a{" + "x" * 19_000 + "}}}",
    "memory": NINE + r"\a{\a{\a{\a{" + "x" * 10_000 + "}}}}",
    "markup without end": NINE + r"\a{\a{" + "x" * 1_500 + "}}",
    "too long": "x" * 100_000,
    "deep groups": "{" * 9_000 + "x" + "}" * 9_000,
    "deep fractions": r"\frac{1}{" * 1_000 + "x" + "}" * 1_000,
    "deep enough for a browser to give up": r"\sqrt{" * 300 + "x" + "}" * 300,
    "deep delimiters": r"\left(" * 1_200 + r"\right)" * 1_200,
    "deep scripts": "x^{" * 3_000 + "x" + "}" * 3_000,
    "columns": r"\begin{matrix}" + "&" * 19_000 + r"\end{matrix}",
    "combining": "x" + "\u0301" * 19_000,
    "code point": r'\char"110000',
    "unfinished": r"\begin{" + "a" * 19_000,
    "command": "\\" + "a" * 19_000,
}


class TestHostile:
    @pytest.mark.parametrize("name", HOSTILE)
    def test_ends_in_an_error_and_harms_nobody(self, engine: MathEngine, name: str) -> None:
        before, bad, after = engine.typeset(
            [Formula("a", False), Formula(HOSTILE[name], True), Formula("b", False)]
        )
        assert isinstance(before, str) and isinstance(after, str)
        assert isinstance(bad, MathError)
        assert len(bad.message) <= 160


def test_copies_of_a_process_that_typesets_do_so_too() -> None:
    process = run_code(program("typeset_in_copies"))
    assert process.stderr == ""
    assert process.stdout == "True False\nTrue True\n"


def test_a_process_that_typesets_can_still_be_copied() -> None:
    """Else a build would be drawn by one process, however many it may use."""
    process = run_code(
        "from coursebuild.core.engine.page_pool import can_fork\n"
        "from coursebuild.core.model.results import Formula\n"
        "from coursebuild.core.run.typesetting import MathEngine\n"
        "(html,) = MathEngine().typeset([Formula('x', False)])\n"
        "print(html[:5], can_fork())\n"
    )
    assert (process.stdout, process.stderr) == ("<math True\n", "")


def test_threads_share_an_engine_whatever_is_nested_in_their_formulas() -> None:
    engine = MathEngine()

    def typeset(number: int) -> list[type]:
        roots = [r"\sqrt{" * depth + str(number) + "}" * depth for depth in (70, 9_000)]
        return [type(result) for result in engine.typeset([Formula(root, True) for root in roots])]

    with ThreadPoolExecutor(3) as threads:
        assert list(threads.map(typeset, range(6))) == [[str, MathError]] * 6
