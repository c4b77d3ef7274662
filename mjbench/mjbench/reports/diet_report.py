"""The report on what a model holds that its scenarios do not need."""

from __future__ import annotations

from collections.abc import Sequence

from mjbench.machine import Machine
from mjbench.reports import Record

PROVED_LABEL = "proved"
"""The label of a finding without which every bit is the same in every state, by a stated proof."""
INTERFACE_LABEL = "interface"
"""The label of what no code that was looked at reads, and whoever drives the model may."""
MEASURED_LABEL = "the same in what was run"
"""The label of a finding without which scenarios, scripts and labs gave the same, unproved."""


_NAMES = 6
"""The most names that a message lists."""


def name_list(names: Sequence[str]) -> str:
    """Names in a message, and how many more there are."""
    extra = len(names) - _NAMES
    return ", ".join(names[:_NAMES]) + (f" and {extra} more" if extra > 0 else "")


class ModelPlace(Record, frozen=True):
    """An element of the model."""

    name: str
    """Its name, or its path from the root."""
    element: str
    """Its path from the root, such as `mujoco/worldbody/body[@name="arm"]/geom[2]`."""
    path: str
    """The file, POSIX, from the course's root."""
    line: int
    """From 1."""
    column: int
    """From 1, in characters."""


class TextEdit(Record, frozen=True):
    """A part of a file replaced."""

    path: str
    line: int
    column: int
    old: str
    new: str


class Saving(Record, frozen=True):
    """What a change saves; times are those of one machine."""

    time: float | None
    """Time of the model as it is over that of the changed one; `None` where it was not measured."""
    spread: float | None
    """The standard error of the ratio, relative."""
    certain: bool
    """Whether the ratio differs from 1 by more than the measurement's uncertainty."""
    memory: int
    """Bytes of the compiled model (an MJB file)."""
    text: int
    """Bytes of the MJCF."""


class Finding(Record, frozen=True):
    """Something that a model could be without."""

    kind: str
    """The key in `[[keep]]`, such as `sensor-unread`."""
    message: str
    places: tuple[ModelPlace, ...]
    """Empty where it is about the model as a whole."""
    label: str
    """`PROVED_LABEL`, `INTERFACE_LABEL` or `MEASURED_LABEL`."""
    difference: float
    """The largest of what is seen without it, where 1 is just visible; 0 where all bits are the
    same."""
    scenarios: tuple[str, ...]
    """The scenarios in which it was tried."""
    proof: str
    """Why it holds in every state; empty where only runs speak for it."""
    saving: Saving
    edits: tuple[TextEdit, ...]
    fixable: bool
    """Whether `--fix` makes the change."""
    unfixed: str
    """Why `--fix` does not make it; empty where it does."""
    kept: str
    """The author's reason to keep it; empty without one."""
    doubt: str
    """The code that may notice, where only runs speak for it; empty where none can."""
    shown: str = ""
    """The difference in the scene's own quantities; empty where there is none."""
    starts: int = 0
    """How many runs were compared: of each scenario, and from random starts nearby; 0 where that
    was not recorded."""
    in_rest: bool = False
    """Whether it was tried, and timed, in what is left without what is proved and far bodies."""

    @property
    def is_fault(self) -> bool:
        """Whether it is a fault of the model: proved, and not kept by the author."""
        return self.label == PROVED_LABEL and not self.kept


class RejectedTrial(Record, frozen=True):
    """A candidate that is no finding: it is needed, or saves no time."""

    kind: str
    places: tuple[str, ...]
    reason: str
    """Why it was rejected."""


class DietScenario(Record, frozen=True):
    """A scenario that the model was tried in."""

    name: str
    status: str
    """`ok`, or how the run of the unchanged model was lost: then nothing is concluded from it."""
    reasons: tuple[str, ...]


class Keep(Record, frozen=True):
    """A finding that its author keeps, and where that is said."""

    finding: str
    reason: str
    path: str
    line: int
    column: int


class StaleKeep(Record, frozen=True):
    """An entry `[[keep]]` that keeps nothing any more."""

    finding: str
    path: str
    line: int
    column: int


class DietReport(Record, frozen=True):
    """All findings about a model."""

    model: str
    """Its file below `models/`, without suffix, POSIX."""
    digest: str
    """The digest of all that it depends on in the course: the model's files and its readers."""
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
