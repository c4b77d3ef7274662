"""The sandbox of this machine, or how it is refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.sandbox import Sandbox, find_sandbox


def require_sandbox(root: Path) -> Sandbox:
    """The sandbox for a course; where there can be none, that is told to users, and here."""
    try:
        return find_sandbox(root)
    except EffectError as error:
        assert "`--sandbox`" in error.message and error.help
        warnings.warn(f"nothing ran, and that is told: {error.message}", stacklevel=2)
        pytest.skip("this machine can have no sandbox, which is told")
