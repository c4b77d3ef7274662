"""What pip says, told plainly."""

from __future__ import annotations

import pytest

from coursebuild.effects.environments import needed, other_version
from coursebuild.effects.errors import UsageError
from coursebuild.effects.installing import near, pip_error, same_version
from coursebuild.effects.versions import engine_version

LISTED = "2.3.7, 3.0.0, 3.1.0, 3.9.0, 3.10.0, 3.14.0, 4.0.0rc1, 4.0.0"
NONE = (
    "Looking in links: /wheels\n"
    "ERROR: Could not find a version that satisfies the requirement {} (from versions: {})\n"
    "ERROR: No matching distribution found for {}\n"
)
RETRIES = (
    "WARNING: Retrying (Retry(total=0, connect=None, read=None, redirect=None, status=None)) after "
    "connection broken by 'NewConnectionError(\"HTTPSConnection(host='index.example', port=443): "
    "Failed to establish a new connection: [Errno -3] Temporary failure in name resolution\")': "
    "/simple/mujoco/\n"
)


def test_a_version_that_is_not_to_be_had() -> None:
    said = NONE.format("mujoco==3.9.5", LISTED, "mujoco==3.9.5")
    error = pip_error("3.9.5", said, {})
    assert error.message.startswith("pip finds no MuJoCo 3.9.5 for Python 3.")
    assert error.help == "near it are 3.1.0, 3.9.0, 3.10.0, 3.14.0"


def test_no_version_at_all_and_no_network() -> None:
    said = NONE.format("mujoco==3.9.5", "none", "mujoco==3.9.5")
    error = pip_error("3.9.5", said, {})
    assert error.message.startswith("pip finds no MuJoCo at all for Python 3.")
    error = pip_error("3.9.5", RETRIES + said, {})
    assert error.message == "the package index cannot be reached"
    assert error.help == (
        "check the network; or let pip find the wheels in a folder, by the environment variables "
        "PIP_FIND_LINKS and PIP_NO_INDEX"
    )


def test_another_package_is_not_to_be_had() -> None:
    said = NONE.format("tool==1.2+local", "1.0, 1.1", "tool==1.2+local")
    error = pip_error("3.9.0", said, {"tool": "1.2+local"})
    assert error.message == "tool 1.2+local is installed here, and pip does not find it again"
    assert error.help == "its versions that pip finds: 1.0, 1.1"


def test_packages_that_do_not_go_together() -> None:
    said = (
        "ERROR: Cannot install mujoco==2.0 and numpy==2.4.6 because these package versions have "
        "conflicting dependencies.\n\nThe conflict is caused by:\n"
        "    The user requested numpy==2.4.6\n    mujoco 2.0 depends on numpy<2\n\n"
        "ERROR: ResolutionImpossible: for help visit https://pip.example/\n"
    )
    error = pip_error("2.0", said, {})
    assert error.message == (
        "MuJoCo 2.0 cannot be installed beside the packages of here: "
        "The user requested numpy==2.4.6; mujoco 2.0 depends on numpy<2"
    )


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (
            "Collecting\nERROR: [Errno 28] No space left on device\n",
            "[Errno 28] No space left on device",
        ),
        ("first\n  last words  \n", "first; last words"),
        (
            "ERROR: Exception:\nTraceback (most recent call last):\n  File x\nOSError: gone\n",
            "OSError: gone",
        ),
        ("", ""),
    ],
)
def test_anything_else_is_told_in_pips_words(said: str, told: str) -> None:
    assert pip_error("3.9.0", said, {}).message == f"pip cannot install MuJoCo 3.9.0: {told}"


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("3.13", "3.13.0", True),
        ("3.10", "3.1", False),
        ("3.10.0", "3.10", True),
        ("3", "3.0.0", True),
        ("3.13.0rc1", "3.13rc1", True),
        ("3.13.0rc1", "3.13.0", False),
    ],
)
def test_versions_written_in_two_ways(one: str, other: str, same: bool) -> None:
    assert same_version(one, other) is same


def test_near_versions() -> None:
    versions = LISTED.split(", ")
    assert near("9", versions) == ["3.10.0", "3.14.0", "4.0.0rc1", "4.0.0"]
    assert near("1", versions) == ["2.3.7", "3.0.0", "3.1.0", "3.9.0"]
    assert near("4.0.0", ["4.0.0rc1", "3.0"]) == ["3.0", "4.0.0rc1"]
    assert near("4.0.0", []) == []


@pytest.mark.parametrize(
    "text", ["", "abc", "3..1", "v3.1", "3.1 ", "==3.1", "3.1; x", "-e", "٣.١"]
)
def test_what_is_no_version(text: str) -> None:
    with pytest.raises(UsageError) as told:
        other_version(text)
    assert str(told.value) == f"--against: {text!r} is no version of MuJoCo, such as 3.13.0"


def test_the_version_of_here_is_no_other() -> None:
    with pytest.raises(UsageError) as told:
        other_version(engine_version())
    said = f"--against: MuJoCo {engine_version()} is the version installed here"
    assert str(told.value) == said
    assert other_version("3.99") == "3.99"


def test_which_distributions_modules_come_from() -> None:
    states = ["Some.Tool 1.2", "native 3.0rc1, other_part 4", "files 0123abcd", "", "mujoco 3.1"]
    assert needed(states) == {"some-tool": "1.2", "native": "3.0rc1", "other-part": "4"}
