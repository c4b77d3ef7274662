"""The scene diet of one model: candidates, tried one after the other.

Entry point: `survey`.

1. The model runs once in each scenario. From one that is lost nothing is claimed.
2. Each kind of thing that may be in vain is taken out, all of them at once; where that is not the
   same, one by one. The changed text is compiled and run beside the original.
3. What is left out of the finding because the author keeps it is tried apart.
4. In the end everything that `--fix` would change is taken out together, and tried again; and so is
   everything found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.numerics.pruning.compare import Seen, watch
from coursebuild.numerics.pruning.dynamics import collisions, idle, settings
from coursebuild.numerics.pruning.edits import ModelEdit, merge_edits
from coursebuild.numerics.pruning.markup import place_of
from coursebuild.numerics.pruning.model_text import ModelText
from coursebuild.numerics.pruning.readers import Readers
from coursebuild.numerics.pruning.scenery import scenery
from coursebuild.numerics.pruning.trials import (
    Candidate,
    Item,
    NotTriedError,
    PruningContext,
    PruningTrial,
    PruningTrials,
)
from coursebuild.numerics.pruning.unused import meshes, unused
from coursebuild.numerics.reports.diet import (
    CHANGES,
    EQUAL,
    IDENTICAL,
    UNTOUCHED,
    Finding,
    ModelPlace,
    Saving,
    TextEdit,
    Tried,
)
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.timing import Clock, Timing

NAMES = 6
"""Names that a message lists."""
LEAST = 1.05
"""A setting must save so much time to be worth a word."""


class Order(Struct, frozen=True, eq=False):
    """What is to be surveyed, and how."""

    text: ModelText
    scenes: tuple[Scene, ...]
    readers: Readers
    keeps: Mapping[str, str]
    """Reasons, by the finding: `KIND`, or `KIND NAME`."""
    locked: Mapping[str, str]
    """Files that are not to be changed, and why."""
    numbered: frozenset[str]
    clock: Clock | None
    """`None`: nothing is timed."""
    quick: bool
    tell: Callable[[str], None]
    """Is told what is tried next."""


class Survey(Struct, frozen=True):
    """What was found."""

    seen: tuple[Seen, ...]
    findings: tuple[Finding, ...] = ()
    tried: tuple[Tried, ...] = ()
    fixed: Saving | None = None
    slim: Saving | None = None
    slim_difference: float | None = None
    stale: tuple[str, ...] = ()
    edits: tuple[ModelEdit, ...] = ()
    """All that `--fix` changes."""


def survey(order: Order) -> Survey:
    """Try everything on a model."""
    seen = tuple(watch(order.text.model, scene) for scene in order.scenes)
    good = tuple(one for one in seen if one.judgement.ok)
    return _Surveyor(order, seen, good).all() if good else Survey(seen)


class _Surveyor:
    def __init__(self, order: Order, seen: tuple[Seen, ...], good: tuple[Seen, ...]) -> None:
        self.order = order
        self.seen, self.good = seen, good
        scenes = [one.scene for one in good]
        self.trials = PruningTrials(order.text, scenes, order.clock, quick=order.quick)
        self.findings: list[Finding] = []
        self.tried: list[Tried] = []
        self.used: set[str] = set()
        self.fixes: list[Item] = []
        self.faults: list[Item] = []

    def all(self) -> Survey:
        """Every candidate, then all of what was found."""
        for candidate in self._candidates():
            self.order.tell(candidate.kind)
            self._judge(candidate)
        fixed, edits = self._fixed()
        slim, difference = self._slim(fixed)
        return Survey(
            self.seen,
            tuple(self.findings),
            tuple(self.tried),
            fixed,
            slim,
            difference,
            tuple(one for one in self.order.keeps if one not in self.used),
            edits,
        )

    def _candidates(self) -> Iterator[Candidate]:
        order = self.order
        declared = any(scene.declared is not None for scene in order.scenes)
        begun = frozenset(scene.scenario.keyframe for scene in order.scenes)
        keyframes = begun if declared else frozenset(range(order.text.model.nkey))
        look = PruningContext(order.text, order.readers, self.good, keyframes, order.numbered)
        yield from unused(look, lambda kind, name: self._reason(kind, name) is not None)
        yield from meshes(look)
        yield from idle(look)
        yield from collisions(look)
        yield from scenery(look)
        yield from settings(look)

    def _reason(self, kind: str, name: str) -> str | None:
        """Why the author keeps it; `None` where nothing says so."""
        keeps = self.order.keeps
        return keeps.get(f"{kind} {name}", keeps.get(kind))

    def _judge(self, candidate: Candidate) -> None:
        by_reason: dict[str | None, list[Item]] = {}
        for item in candidate.items:
            by_reason.setdefault(self._reason(candidate.kind, item.name), []).append(item)
        for reason, items in by_reason.items():
            if candidate.is_setting:
                parts = self._setting(candidate, items, reason or "")
            else:
                parts = [
                    part
                    for part, trial in self._parts(candidate, items)
                    if self._report(candidate, part, trial, self._timed(candidate, trial), reason)
                ]
            for part in parts:
                self.used |= {candidate.kind, *(f"{candidate.kind} {item.name}" for item in part)}

    def _setting(
        self, candidate: Candidate, items: list[Item], reason: str
    ) -> Sequence[Sequence[Item]]:
        """Try a setting that saves time; for what a reason to keep it stands."""
        try:
            trial = self.trials.changed(items)
            timing = self.trials.timing(trial)
            if timing is None or not (timing.certain and timing.ratio.value >= LEAST):
                self._note(candidate, items, None, "it saves no time")
                return [items]
            trial = self.trials.compared(trial)
        except NotTriedError as error:
            self._note(candidate, items, None, str(error))
            return []
        return [items] if self._report(candidate, items, trial, timing, reason) or reason else []

    def _parts(
        self, candidate: Candidate, items: list[Item]
    ) -> Iterator[tuple[list[Item], PruningTrial]]:
        """Items that go together, and how it went without them; what cannot be tried is noted."""
        whole = self._try(items)
        if whole is not None and (len(items) == 1 or _label(candidate, whole) != CHANGES):
            yield items, whole
            return
        alike: dict[str, list[tuple[Item, PruningTrial]]] = {}
        for item in items:
            try:
                trial = self.trials.run([item])
            except NotTriedError as error:
                self._note(candidate, [item], None, str(error))
            else:
                alike.setdefault(_label(candidate, trial), []).append((item, trial))
        for label, found in alike.items():
            together = [item for item, _ in found]
            joined = self._try(together) if label != CHANGES and len(found) > 1 else None
            if joined is not None and _label(candidate, joined) == label:
                yield together, joined
            else:
                yield from (([item], trial) for item, trial in found)

    def _try(self, items: Sequence[Item]) -> PruningTrial | None:
        try:
            return self.trials.run(items)
        except NotTriedError:
            return None

    def _timed(self, candidate: Candidate, trial: PruningTrial) -> Timing | None:
        useful = candidate.timed and _label(candidate, trial) != CHANGES
        return self.trials.timing(trial) if useful else None

    def _report(
        self,
        candidate: Candidate,
        items: Sequence[Item],
        trial: PruningTrial,
        timing: Timing | None,
        reason: str | None,
    ) -> bool:
        """Note what was found; whether there was anything."""
        assert trial.result is not None
        label = _label(candidate, trial)
        if label == CHANGES:
            self._note(candidate, items, trial.result.difference, "")
            return False
        unfixed = self._unfixed(candidate, trial, label, reason or "")
        finding = Finding(
            kind=candidate.kind,
            message=_message(candidate, [item.name for item in items]),
            places=tuple(_place(item) for item in items if item.element is not None),
            label=label,
            difference=trial.result.difference,
            scenarios=tuple(one.scene.name for one in self.good),
            proof=candidate.proof,
            setting=candidate.is_setting,
            saving=self.trials.saving(trial, timing),
            edits=self._texts(trial.edits),
            fixable=not unfixed,
            unfixed=unfixed,
            kept=reason or "",
            doubt=candidate.doubt,
        )
        self.findings.append(finding)
        if not unfixed:
            self.fixes += items
        if finding.counts:
            self.faults += items
        return True

    def _unfixed(self, candidate: Candidate, trial: PruningTrial, label: str, reason: str) -> str:
        """Why `--fix` does not change it; empty where it does."""
        if reason:
            return "it is kept"
        if candidate.is_setting:
            return "how to compute is the author's choice"
        if label != IDENTICAL:
            return f"only what is {IDENTICAL} is changed"
        for edit in trial.edits:
            if edit.path in self.order.locked:
                return self.order.locked[edit.path]
        if candidate.by_runs and self.order.quick:
            return "short runs say too little of it: leave out --quick"
        return candidate.doubt or candidate.blocked

    def _note(
        self, candidate: Candidate, items: Sequence[Item], difference: float | None, why: str
    ) -> None:
        finite = difference if difference is not None and math.isfinite(difference) else None
        names = tuple(item.name for item in items)
        self.tried.append(Tried(candidate.kind, _message(candidate, names), names, finite, why))

    def _texts(self, edits: Sequence[ModelEdit]) -> tuple[TextEdit, ...]:
        by_path = {document.path: document for document in self.order.text.documents}
        found = []
        for edit in merge_edits(edits):
            document = by_path[edit.path]
            old = document.data[edit.start : edit.end].decode("utf-8", "replace")
            line, column = document.position(edit.start)
            new = edit.new.decode("utf-8", "replace")
            found.append(TextEdit(edit.path, line, column, edit.start, edit.end, old, new))
        return tuple(found)

    def _fixed(self) -> tuple[Saving | None, tuple[ModelEdit, ...]]:
        """All that is to be fixed at once; less, where that is no longer the same."""
        while self.fixes:
            trial = self._try(self.fixes)
            if trial is not None and trial.result is not None and trial.result.identical:
                return self.trials.saving(trial, self.trials.timing(trial)), trial.edits
            self.fixes.pop()
        return None, ()

    def _slim(self, fixed: Saving | None) -> tuple[Saving | None, float | None]:
        """What everything found saves; `fixed` is what all that is to be fixed does."""
        if not self.faults:
            return None, None
        if fixed is not None and set(self.faults) == set(self.fixes):
            return fixed, 0.0
        trial = self._try(self.faults)
        if trial is None or trial.result is None:
            return None, None
        difference = trial.result.difference
        saving = self.trials.saving(trial, self.trials.timing(trial))
        return saving, difference if math.isfinite(difference) else None


def _place(item: Item) -> ModelPlace:
    element = item.element
    assert element is not None
    line, column = element.document.position(element.start)
    return ModelPlace(item.name, place_of(element), element.document.path, line, column)


def _message(candidate: Candidate, names: Sequence[str]) -> str:
    """Its message, with the first of the names."""
    shown = ", ".join(names[:NAMES])
    if len(names) > NAMES:
        shown += f" and {len(names) - NAMES} more"
    return candidate.message.replace("{}", shown)


def _label(candidate: Candidate, trial: PruningTrial) -> str:
    assert trial.result is not None
    if trial.result.identical:
        certain = candidate.proof or candidate.is_setting
        return IDENTICAL if certain else UNTOUCHED
    return EQUAL if trial.result.equal else CHANGES
