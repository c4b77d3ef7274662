"""The versions that `check --against` accepts."""

from __future__ import annotations

import pytest

from coursebuild.core.files.errors import UsageError
from coursebuild.core.run.packages import check_other_version
from coursebuild.core.run.script_environment import engine_version


@pytest.mark.parametrize(
    "text", ["", "abc", "3..1", "v3.1", "3.1 ", "==3.1", "3.1; x", "-e", "٣.١"]
)
def test_texts_that_are_no_version(text: str) -> None:
    with pytest.raises(UsageError) as error:
        check_other_version(text)
    assert str(error.value) == f"--against: {text!r} is not a version of MuJoCo, such as 3.13.0"


def test_the_installed_version_is_refused_however_it_is_written() -> None:
    installed = engine_version()
    for text in (installed, f"{installed}.0"):
        with pytest.raises(UsageError) as error:
            check_other_version(text)
        assert str(error.value) == f"--against: MuJoCo {installed} is the version installed here"
    assert check_other_version("3.99") == "3.99"
