"""What a model holds that its scenarios do not need.

Entry point: `DietReport`.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.model.results import Machine
from coursebuild.numerics.reports import Record

PROVED = "proved"
"""Without it every bit is the same in every state, for a reason that is stated."""
SAME = "the same in what was run"
"""Without it scenarios, scripts and labs gave the same; nothing says that it must be so."""


_NAMES = 6
"""That a message lists."""


def name_list(names: Sequence[str]) -> str:
    """Names in a message, and how many more there are."""
    more = len(names) - _NAMES
    return ", ".join(names[:_NAMES]) + (f" and {more} more" if more > 0 else "")


class ModelPlace(Record, frozen=True):
    """An element of the model."""

    name: str
    """What it is called, or its way from the root."""
    element: str
    """The way to it from the root, such as `mujoco/worldbody/body[@name="arm"]/geom[2]`."""
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
    start: int
    """Bytes from the beginning of the file."""
    end: int
    old: str
    new: str


class Saving(Record, frozen=True):
    """What a change saves; times are those of one machine."""

    time: float | None
    """Time of the model as it is over that of the changed one; `None` where it was not measured."""
    spread: float | None
    """The standard error of the ratio, relative."""
    certain: bool
    """Whether the ratio is another than 1 beyond what can be told."""
    memory: int
    """Bytes of the compiled model (an MJB file)."""
    text: int
    """Bytes of the MJCF."""


class Finding(Record, frozen=True):
    """What a model could be without."""

    kind: str
    """By which it is kept, such as `sensor-unread`."""
    message: str
    places: tuple[ModelPlace, ...]
    """Empty where it is about the model as a whole."""
    label: str
    """`PROVED` or `SAME`."""
    difference: float
    """The largest within 50 ms, relative to a number's size where that is over 1; 0 where all bits
    are the same."""
    scenarios: tuple[str, ...]
    """In which it was tried."""
    proof: str
    """Why it holds whatever happens; empty where only runs speak for it."""
    saving: Saving
    edits: tuple[TextEdit, ...]
    fixable: bool
    """Whether `--fix` makes the change."""
    unfixed: str
    """Why it does not; empty where it does."""
    kept: str
    """The reason for which it stays; empty where there is none."""
    doubt: str
    """Which code may notice, of what only runs speak for; empty where none can."""

    @property
    def counts(self) -> bool:
        """Whether it is a fault of the model: it is proved, and nothing explains it."""
        return self.label == PROVED and not self.kept


class RejectedTrial(Record, frozen=True):
    """What could be left out and is no finding: it is needed, or saves no time."""

    kind: str
    message: str
    places: tuple[str, ...]
    difference: float | None
    """As of a finding; `None` where the changed run was lost, or there was none."""
    reason: str
    """Why it was not run; empty where it was, and changed the result."""


class DietScenario(Record, frozen=True):
    """A scenario that the model was tried in."""

    name: str
    steps: int
    status: str
    """`ok`, or how the run of the model as it is was lost: then nothing is claimed from it."""
    reasons: tuple[str, ...]


class StaleKeep(Record, frozen=True):
    """An entry `[[keep]]` that keeps nothing any more."""

    finding: str
    path: str
    line: int
    column: int


class DietReport(Record, frozen=True):
    """Everything that was found in a model."""

    model: str
    """Its file below `models/`, without suffix, POSIX."""
    digest: str
    """Of all in the course that it depends on: the model with its files, and who reads it."""
    quick: bool
    machine: Machine
    readers: tuple[str, ...]
    """The files of the course that use the model."""
    scenarios: tuple[DietScenario, ...]
    findings: tuple[Finding, ...]
    tried: tuple[RejectedTrial, ...]
    fixed: Saving | None
    """What all that `--fix` changes saves together; `None` where it changes nothing."""
    slim: Saving | None
    """What all findings save together that are no settings and are not kept."""
    slim_difference: float | None
    """How far the model without all of them is from the model as it is."""
    stale: tuple[StaleKeep, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is to be done."""
        lost = any(one.status != "ok" for one in self.scenarios)
        return not (lost or self.stale or any(one.counts for one in self.findings))
