"""The bindings that were found to hold, and by which lines.

Entry points: `BindingMemory`, which a check asks; `BindingHistory`, one that follows a course from
check to check. When an output is another, it knows where the number of a binding was printed
before.
"""

from __future__ import annotations

from typing import Protocol

from msgspec import Struct


class BindingInputs(Struct, frozen=True):
    """What a binding shows, and on which outputs it leans, whatever they are now."""

    text: str
    script: str
    document: str
    """Empty where the binding names the script."""
    nth: int
    """Of the recorded outputs of the script in the document."""
    count: int
    """Of these outputs: with another one, it is not known any more which is which."""


class BindingEvidence(Struct, frozen=True):
    """The lines by which a binding held."""

    lines: tuple[str, ...] = ()
    ran: bool = False
    """They were those of a run, and not recorded."""


class BindingMemory(Protocol):
    """Remembers bindings in which nothing is wrong."""

    def holds(self, key: str, inputs: BindingInputs) -> bool:
        """Whether nothing is wrong with a binding, by a hash of all that this depends on."""

    def add(self, key: str, inputs: BindingInputs, evidence: BindingEvidence) -> None:
        """That nothing is wrong; there are no lines where nothing could be looked at."""

    def before(self, inputs: BindingInputs) -> BindingEvidence:
        """By what a binding held when it was last looked at and held, if that is known."""


class BindingHistory:
    """Follows a course from check to check: by what each binding held when it last did."""

    def __init__(self) -> None:
        self._by: dict[str, BindingEvidence] = {}
        self._last: dict[BindingInputs, BindingEvidence] = {}

    def __len__(self) -> int:
        """How many bindings are remembered, those of outputs that are no more too."""
        return len(self._by)

    def clear(self) -> None:
        """Forget all of them."""
        self._by.clear()
        self._last.clear()

    def holds(self, key: str, inputs: BindingInputs) -> bool:
        """See `BindingMemory`."""
        evidence = self._by.get(key)
        if evidence is not None:
            self.add(key, inputs, evidence)
        return evidence is not None

    def add(self, key: str, inputs: BindingInputs, evidence: BindingEvidence) -> None:
        """See `BindingMemory`."""
        self._by[key] = evidence
        if evidence.lines:
            self._last[inputs] = evidence

    def before(self, inputs: BindingInputs) -> BindingEvidence:
        """See `BindingMemory`."""
        return self._last.get(inputs, BindingEvidence())
