"""What mjbench finds that models could be without: what of its reports is shown."""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.model.results import Machine

PROVED_LABEL = "proved"
"""The label of a finding without which every bit is the same in every state."""


class ModelPlace(Struct, frozen=True):
    """An element of a model."""

    name: str
    element: str
    path: str
    line: int
    column: int


class TextEdit(Struct, frozen=True):
    """A part of a file replaced."""

    path: str
    line: int
    column: int
    old: str
    new: str


class Saving(Struct, frozen=True):
    """What a change saves; times are those of one machine."""

    time: float | None
    spread: float | None
    certain: bool
    memory: int
    text: int


class Finding(Struct, frozen=True):
    """Something that a model could be without."""

    kind: str
    message: str
    places: tuple[ModelPlace, ...]
    label: str
    difference: float
    scenarios: tuple[str, ...]
    proof: str
    saving: Saving
    edits: tuple[TextEdit, ...]
    fixable: bool
    kept: str
    doubt: str
    shown: str = ""
    starts: int = 0
    in_rest: bool = False

    @property
    def is_fault(self) -> bool:
        """Whether it is a fault of the model: proved, and not kept by the author."""
        return self.label == PROVED_LABEL and not self.kept


class RejectedTrial(Struct, frozen=True):
    """What is no finding: it is needed, or saves no time."""

    kind: str
    places: tuple[str, ...]
    reason: str


class DietScenario(Struct, frozen=True):
    """A scenario that the model was tried in."""

    name: str
    status: str
    reasons: tuple[str, ...]


class StaleKeep(Struct, frozen=True):
    """An entry `[[keep]]` that keeps nothing any more."""

    finding: str
    path: str
    line: int
    column: int


class DietReport(Struct, frozen=True):
    """All findings about a model."""

    model: str
    digest: str
    quick: bool
    machine: Machine
    scenarios: tuple[DietScenario, ...]
    findings: tuple[Finding, ...]
    tried: tuple[RejectedTrial, ...]
    stale: tuple[StaleKeep, ...]

    @property
    def ok(self) -> bool:
        """Whether there is nothing to do."""
        lost = any(scenario.status != "ok" for scenario in self.scenarios)
        return not (lost or self.stale or any(finding.is_fault for finding in self.findings))
