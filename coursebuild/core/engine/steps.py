"""The keys of what the tool makes.

Entry point: `step_key`. A step is a function of values. What it makes goes by the step's name, the
values' fingerprint and the tool itself: so there is no rule about what makes a thing stale. Where
anything differs there is another key, and what lies under the old one is not found.
"""

from __future__ import annotations

from coursebuild.core.engine.tool import tool_digest
from coursebuild.core.values import fingerprint


def step_key(name: str, *values: object) -> str:
    """The key of what a step of this name makes of these values."""
    return fingerprint((tool_digest(), name, values))
