"""A page without its frame.

Entry point: `Draft`.
"""

from __future__ import annotations

from markupsafe import Markup
from msgspec import Struct


class Draft(Struct, frozen=True):
    """A page without its frame."""

    path: str
    """Its site path."""
    kind: str
    """`home`, `lesson`, `stub`, `level`, `model`, `page`, `notfound`: also a class of the style
    inputs."""
    title: str
    description: str
    body: Markup
    """What stands between the site's head and foot."""
    json_ld: Markup = Markup()
    og_type: str = "website"
    indexed: bool = True
    """Whether search engines should list it."""
