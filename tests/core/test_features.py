"""The interface of features, as `help` shows it."""

from __future__ import annotations

import pydoc

from coursebuild.core import features


def test_help_shows_each_part_of_the_interface() -> None:
    for name, part in vars(features).items():
        if isinstance(part, type) and part.__module__ == features.__name__:
            assert name in pydoc.render_doc(part)
    assert "core.pages.context.PageContext" in pydoc.plain(pydoc.render_doc(features.FenceKind))
