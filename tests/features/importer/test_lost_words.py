"""Words of a source that neither the new course nor its account has are named."""

from __future__ import annotations

import json
from pathlib import Path

from support.converted_folder import account_of, convert_files


def test_a_word_that_is_nowhere_in_the_new_course_is_named_with_its_place(tmp_path: Path) -> None:
    cell = {
        "cell_type": "code",
        "source": "1",
        "outputs": [{"output_type": "display_data", "data": {"text/html": "<b id='x'>zebra</b>"}}],
    }
    files = {
        "_category_.yml": "label: Nobody reads this\n",
        "one.md": "# One\n\n```{figure} p.png\n:figclass: margin-caption\nA ball.\n```\n",
        "p.png": "\x89PNG",
        "two.ipynb": json.dumps({"cells": [cell], "metadata": {}, "nbformat": 4}),
    }
    lost = account_of(convert_files(tmp_path, files)).partition("## Words that are nowhere")[2]
    assert "- one.md, line 4: figclass margin caption\n" in lost
    assert "- two.ipynb, cell 1: zebra\n" in lost


def test_nothing_is_said_of_words_where_the_new_course_has_all(tmp_path: Path) -> None:
    course = convert_files(tmp_path, {"one.md": "# One\n\nA *ball* falls, [see](https://e.org).\n"})
    assert "## Words" not in account_of(course)
