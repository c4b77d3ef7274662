"""MJCF with places, and changes of it that leave everything else as it is."""

from __future__ import annotations

import pytest

from mjbench.pruning.xml_edits import (
    Markup,
    MarkupError,
    ModelEdit,
    apply_edits,
    drop_numbers,
    parse_markup,
    remove_elements,
)


def document(text: str) -> Markup:
    return parse_markup("models/a.xml", text.encode())


def after(text: str, *edits: ModelEdit) -> str:
    return apply_edits(text.encode(), edits).decode()


def remove_by_tag(text: str, *tags: str) -> str:
    elements = [element for element in document(text).root.walk() if element.tag in tags]
    assert elements
    return after(text, *remove_elements(elements))


ODD_MODEL = (
    "\ufeff<?xml version='1.0' encoding='ISO-8859-1'?>\r\n"
    '<!-- <geom name="no"/> -->\r\n'
    "<mujoco model = 'é&amp;<'>\r\n".replace("&amp;<", "&amp;&lt;")
    + '\t<worldbody >\r\n\t\t<body name="ü > ñ"\r\n\t\t\tpos=\'1 "2" 3\'\r\n\t\t><geom size=".1"/>'
    "<geom\tname=\"🎈\" size='.1'   /></body>\r\n"
    '<?pi <geom?><![CDATA[<geom name="no"/>]]></worldbody>\r\n</mujoco>\r\n'
)


def test_places_in_an_odd_text() -> None:
    """A byte order mark, CRLF, a wrong encoding, quotes, references, comments, CDATA."""
    markup = document(ODD_MODEL)
    elements = list(markup.root.walk())
    assert [element.tag for element in elements] == ["mujoco", "worldbody", "body", "geom", "geom"]
    assert markup.root.get("model") == "é&<"
    body = elements[2]
    assert body.get("name") == "ü > ñ" and body.get("pos") == '1 "2" 3'
    assert markup.position(body.start) == (5, 3)
    assert markup.position(elements[3].start) == (7, 4)
    assert markup.position(elements[4].start) == (7, 21)
    assert markup.data[elements[4].start : elements[4].end].decode().startswith("<geom\tname=")
    assert markup.position(markup.root.start) == (3, 1)
    start, end = elements[4].attribute("name").inner
    assert markup.data[start:end].decode() == "🎈"


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("<a>\n  <b c='1' c='2'/></a>", 2, 12, "duplicate attribute"),
        ("<a>é<b></a>", 1, 10, "mismatched tag"),
        ("", 1, 1, "no element found"),
        ("<a b='x & y'/>", 1, 10, "not well-formed (invalid token)"),
        ("<!DOCTYPE a [<!ENTITY e 'x'>]>\n<a b='&e;'/>", 1, 25, "it declares the entity `e`"),
    ],
)
def test_what_is_no_xml_is_refused(text: str, line: int, column: int, words: str) -> None:
    with pytest.raises(MarkupError) as caught:
        document(text)
    assert (caught.value.line, caught.value.column) == (line, column)
    assert words in caught.value.message


@pytest.mark.parametrize(
    ("before", "left"),
    [
        ("<a>\n  <x/>\n  <y/>\n</a>", "<a>\n  <y/>\n</a>"),
        ("<a>\r\n\t<x\r\n\tb='1'/>\r\n\t<y/>\r\n</a>", "<a>\r\n\t<y/>\r\n</a>"),
        ("<a>\r  <x/>\r</a>", "<a>\r</a>"),
        ("<a><y/> <x/></a>", "<a><y/></a>"),
        ("<a>\n  <x/> <!-- why -->\n</a>", "<a>\n  <!-- why -->\n</a>"),
        ("<a>\n  <!-- why -->\n  <x> <!-- in --> <y/></x>  \n</a>", "<a>\n  <!-- why -->\n</a>"),
        ("<a><x><x/></x><y/></a>", "<a><y/></a>"),
    ],
)
def test_elements_go_with_their_lines_only(before: str, left: str) -> None:
    assert remove_by_tag(before, "x") == left


@pytest.mark.parametrize(
    ("before", "left"),
    [
        ("<m>\n  <asset>\n    <x/>\n  </asset>\n  <y/>\n</m>", "<m>\n  <y/>\n</m>"),
        ("<m>\n  <asset>\n    <x/>\n    <z/>\n  </asset>\n</m>", None),
        ("<m>\n  <asset>\n    <!-- c -->\n    <x/>\n  </asset>\n</m>", None),
        ("<m>\n  <worldbody>\n    <x/>\n  </worldbody>\n</m>", None),
        ('<m><default><default class="c"><x/></default></default></m>', None),
    ],
)
def test_only_empty_sections_go_with_the_last_of_them(before: str, left: str | None) -> None:
    rest = remove_by_tag(before, "x")
    if left is None:
        assert "<x/>" not in rest and rest != before
        assert rest.count("<") == before.count("<") - 1
    else:
        assert rest == left


@pytest.mark.parametrize(
    ("removed_numbers", "left"),
    [
        ([0], ' q="2\n 3  4"'),
        ([1, 2], ' q="1 4"'),
        ([0, 2, 3], ' q="2"'),
        ([0, 1, 2, 3], ""),
        ([3, 4, 5], ' q="1 2\n 3"'),
    ],
)
def test_numbers_go_out_of_a_list(removed_numbers: list[int], left: str) -> None:
    text = '<k q="1 2\n 3  4"/>'
    assert after(text, *drop_numbers(document(text).root, "q", removed_numbers)) == f"<k{left}/>"
    assert drop_numbers(document(text).root, "other", removed_numbers) == ()


def test_edits_that_contradict_each_other_are_refused() -> None:
    edits = (ModelEdit("a", 0, 4, b"x"), ModelEdit("a", 2, 6, b"y"))
    with pytest.raises(ValueError, match="two changes overlap at byte 2 of a"):
        apply_edits(b"0123456789", edits)
    inside = (ModelEdit("a", 2, 6, b""), ModelEdit("a", 3, 4, b"y"), ModelEdit("a", 6, 7, b""))
    assert apply_edits(b"0123456789", inside) == b"01789"
