"""An io card as a value."""

from __future__ import annotations

from coursebuild.core.model import FeatureBlock, Inline


class Io(FeatureBlock, frozen=True):
    """What a script takes, does and gives."""

    input: tuple[Inline, ...]
    process: tuple[Inline, ...]
    output: tuple[Inline, ...]

    def parts(self) -> tuple[tuple[str, tuple[Inline, ...]], ...]:
        """The three parts with the names of their interface texts, in order."""
        return ("io.input", self.input), ("io.process", self.process), ("io.output", self.output)

    def child_inlines(self) -> tuple[Inline, ...]:
        """The lines of all parts."""
        return (*self.input, *self.process, *self.output)
