"""Tables that Pandoc reads are tables here as well; what only looks like one is left alone."""

from __future__ import annotations

import pytest

from coursebuild.features.importer.pandoc_tables import rewrite_tables


def rewrite(text: str) -> str:
    """The new text without the empty lines that keep the places of what follows."""

    def leave(line: int) -> None:
        raise AssertionError(f"line {line} is left")

    new, _ = rewrite_tables(text, leave)
    assert new.count("\n") == text.count("\n")
    return "\n".join(line for line in new.split("\n") if line.strip("> "))


GRID = """\
+--------+------------+
| Fruit  | Advantages |
+:======:+===========:+
| Banana | - wrapped  |
|        | - bright   |
+--------+------------+
| Lemon, | a \\| b     |
| yellow |            |
|        | second     |
+--------+------------+
"""
LONG = """\
-------------------------------------------
 Centered   Default           Right Left
  Header    Aligned         Aligned Aligned
----------- ------- --------------- -------
   First    row                12.0 Example
                                    of two

  Second    row                 5.0 Here
-------------------------------------------

Table: Lines of rows.
"""


def test_a_grid_has_its_sides_items_and_paragraphs() -> None:
    assert rewrite(GRID) == (
        "| Fruit | Advantages |\n"
        "| :---: | ---: |\n"
        "| Banana | • wrapped<br>• bright |\n"
        "| Lemon, yellow | a \\| b<br>second |"
    )


def test_rows_of_several_lines_are_rows() -> None:
    assert rewrite(LONG) == (
        "Table: Lines of rows.\n"
        "| Centered Header | Default Aligned | Right Aligned | Left Aligned |\n"
        "| :---: | --- | ---: | :--- |\n"
        "| First | row | 12.0 | Example of two |\n"
        "| Second | row | 5.0 | Here |"
    )


def test_a_wide_character_takes_two_columns() -> None:
    grid = "+------+------+\n| 日本 | 語 a |\n+======+======+\n| 甲   | b    |\n+------+------+"
    assert rewrite(grid) == "| 日本 | 語 a |\n| --- | --- |\n| 甲 | b |"


def test_a_cell_over_columns_and_rows_keeps_its_words() -> None:
    grid = (
        "+---+---+---+\n| a     | b |\n+---+---+---+\n| c | d | e |\n"
        "+   +---+---+\n|   | f | g |\n+---+---+---+"
    )
    assert rewrite(grid).endswith("| a |  | b |\n| c | d<br>f | e<br>g |")


def test_a_table_without_a_heading_and_one_in_a_quotation() -> None:
    simple = "> a\n>\n> --- ---\n> b   c\n> d   e\n> --- ---\n>\n> : Its caption {#tbl-q}\n"
    assert rewrite(simple) == (
        "> a\n> Table: Its caption {#tab:q}\n> |  |  |\n> | :--- | :--- |\n> | b | c |\n> | d | e |"
    )


@pytest.mark.parametrize(
    "text",
    [
        "--- ---\n\ntext\n\n--- ---\n",
        "Title\n-----\n\ntext\n",
        "| a | b\n| - | -\n| c | d\n",
        "```\n\n+---+\n| a |\n+---+\n```\n",
        "- item\n\n  ```\n\n  a   b\n  --- ---\n  ```\n",
        "    +---+\n    | a |\n    +---+\n",
        "a long sentence stands here\n---- ----\n\n",
        "words of a sentence go on\n--- --- ---\nwords of a sentence go on\n",
        "| a single line\n",
    ],
)
def test_what_is_no_table_stays(text: str) -> None:
    assert rewrite_tables(text, lambda line: None) == (text, 0)
