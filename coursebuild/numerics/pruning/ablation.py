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

from coursebuild.numerics.pruning.compare import Case, MotionComparison, Seen, watch
from coursebuild.numerics.pruning.dynamics import collisions, idle, settings
from coursebuild.numerics.pruning.edits import ModelEdit, merge_edits
from coursebuild.numerics.pruning.markup import place_of
from coursebuild.numerics.pruning.meshes import meshes
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
    Ratio,
)
from coursebuild.numerics.pruning.unused import unused
from coursebuild.numerics.reports.diet import (
    CHANGES,
    EQUAL,
    IDENTICAL,
    UNTOUCHED,
    ModelPlace,
    Saving,
    TextEdit,
)
from coursebuild.numerics.reports.diet import Finding as Finding
from coursebuild.numerics.reports.diet import Tried as Tried
from coursebuild.numerics.timing import Clock

NAMES = 6
"""Names that a message lists."""
LEAST = 1.05
"""A setting must save so much time to be worth a word."""


class Order(Struct, frozen=True, eq=False):
    """What is to be surveyed, and how."""

    scene: ModelText
    cases: tuple[Case, ...]
    readers: Readers
    keeps: Mapping[str, str]
    """Reasons, by the finding: `KIND`, or `KIND NAME`."""
    locked: Mapping[str, str]
    """Files that are not to be changed, and why."""
    numbered: frozenset[str]
    clock: Clock
    quick: bool
    tell: Callable[[str], None]
    """Is told what is tried next."""


class Survey(Struct, frozen=True):
    """What was found."""

    seen: tuple[Seen, ...]
    findings: tuple[Finding, ...]
    tried: tuple[Tried, ...]
    fixed: Saving | None
    slim: Saving | None
    slim_difference: float | None
    stale: tuple[str, ...]
    edits: tuple[ModelEdit, ...]
    """All that `--fix` changes."""


def survey(order: Order) -> Survey:
    """Try everything on a model."""
    return _Surveyor(order).all()


class _Surveyor:
    def __init__(self, order: Order) -> None:
        self.order = order
        self.scene = order.scene
        self.seen = tuple(watch(order.scene.model, case) for case in order.cases)
        self.cases = [one.case for one in self.seen if one.judgement.ok]
        self.trials = PruningTrials(order.scene, self.cases, order.clock, quick=order.quick)
        self.findings: list[Finding] = []
        self.tried: list[Tried] = []
        self.used: set[str] = set()
        self.fixes: list[Item] = []
        self.faults: list[Item] = []
        self.fixed_items: list[Item] = []

    def all(self) -> Survey:
        """Every candidate, then all of what was found."""
        if not self.cases:
            return Survey(self.seen, (), (), None, None, None, (), ())
        for candidate in self._candidates():
            self.order.tell(candidate.kind)
            self._judge(candidate)
        fixed, edits = self._together(self.fixes)
        slim, difference = self._slim(fixed)
        stale = [one for one in self.order.keeps if one not in self.used]
        found, tried = tuple(self.findings), tuple(self.tried)
        return Survey(self.seen, found, tried, fixed, slim, difference, tuple(stale), edits)

    def _candidates(self) -> Iterator[Candidate]:
        good = tuple(one for one in self.seen if one.judgement.ok)
        declared = any(one.case.declared for one in self.seen)
        model = self.scene.model
        keyframes = frozenset({one.case.scenario.keyframe for one in self.seen} - {-1})
        look = PruningContext(
            self.scene,
            self.order.readers,
            good,
            keyframes if declared else frozenset(range(model.nkey)),
            declared,
            self.order.numbered,
        )
        yield from unused(look, lambda kind, name: self._reason(kind, name) is not None)
        yield from meshes(look)
        yield from idle(look)
        yield from collisions(look)
        yield from scenery(look)
        yield from settings(look)

    def _reason(self, kind: str, name: str) -> str | None:
        """Why the author keeps it; `None` where nothing says so."""
        for key in (f"{kind} {name}", kind):
            if key in self.order.keeps:
                return self.order.keeps[key]
        return None

    def _judge(self, candidate: Candidate) -> None:
        by_reason: dict[str | None, list[Item]] = {}
        for item in candidate.items:
            by_reason.setdefault(self._reason(candidate.kind, item.name), []).append(item)
        for reason, items in by_reason.items():
            if candidate.is_setting:
                told = self._setting(candidate, items, reason or "")
                parts = [items] if told else []
            else:
                parts = [
                    part
                    for part, trial in self._parts(candidate, items)
                    if self._report(candidate, part, trial, self._timed(candidate, trial), reason)
                ]
            for part in parts:
                self.used |= {candidate.kind, *(f"{candidate.kind} {item.name}" for item in part)}

    def _setting(self, candidate: Candidate, items: Sequence[Item], reason: str) -> bool:
        """Try a setting that saves time; whether it could be tried."""
        try:
            edits, model, left = self.trials.changed(items)
            ratio = self.trials.ratio(model, left)
            if ratio is None or not (ratio.certain and ratio.value >= LEAST):
                self._note(candidate, items, None, "it saves no time")
                return True
            trial = PruningTrial(edits, model, left, self.trials.compared(model, left))
        except NotTriedError as error:
            self._note(candidate, items, None, str(error))
            return False
        return self._report(candidate, items, trial, ratio, reason) or bool(reason)

    def _parts(
        self, candidate: Candidate, items: Sequence[Item]
    ) -> Iterator[tuple[list[Item], PruningTrial]]:
        """Items that go together, and how it went without them; what cannot be tried is noted."""
        waiting = [list(items)]
        same: list[tuple[list[Item], PruningTrial]] = []
        near: list[tuple[list[Item], PruningTrial]] = []
        while waiting:
            part = waiting.pop()
            try:
                trial = self.trials.run(part)
            except NotTriedError as error:
                if len(part) == 1:
                    self._note(candidate, part, None, str(error))
                    continue
            else:
                if trial.result.identical:
                    same.append((part, trial))
                    continue
                if trial.result.equal and (len(part) == 1 or not candidate.split):
                    near.append((part, trial))
                    continue
                if len(part) == 1:
                    yield part, trial
                    continue
            half = len(part) // 2
            waiting += [part[half:], part[:half]]
        yield from self._joined(same, identical=True)
        yield from self._joined(near, identical=False)

    def _joined(
        self, parts: Sequence[tuple[list[Item], PruningTrial]], *, identical: bool
    ) -> Iterator[tuple[list[Item], PruningTrial]]:
        """Parts that are alike, as one where that is like them."""
        if len(parts) > 1:
            items = [item for part, _ in parts for item in part]
            try:
                trial = self.trials.run(items)
            except NotTriedError:
                yield from parts
                return
            if trial.result.identical if identical else trial.result.equal:
                yield items, trial
                return
        yield from parts

    def _timed(self, candidate: Candidate, trial: PruningTrial) -> Ratio | None:
        if not candidate.timed or not (trial.result.identical or trial.result.equal):
            return None
        return self.trials.ratio(trial.model, trial.left)

    def _report(
        self,
        candidate: Candidate,
        items: Sequence[Item],
        trial: PruningTrial,
        ratio: Ratio | None,
        reason: str | None,
    ) -> bool:
        """Note what was found; whether there was anything."""
        label = _label(candidate, trial.result)
        if label == CHANGES:
            self._note(candidate, items, trial.result.difference, "")
            return False
        unfixed = self._unfixed(candidate, trial, label, reason or "")
        finding = Finding(
            kind=candidate.kind,
            message=_said(candidate, [item.name for item in items]),
            places=tuple(self._place(item) for item in items if item.element is not None),
            label=label,
            difference=trial.result.difference,
            scenarios=tuple(case.name for case in self.cases),
            proof=candidate.proof,
            setting=candidate.is_setting,
            saving=self.trials.saving(trial, ratio),
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
        self,
        candidate: Candidate,
        items: Sequence[Item],
        difference: float | None,
        why: str,
    ) -> None:
        finite = difference if difference is not None and math.isfinite(difference) else None
        names = tuple(item.name for item in items)
        message = _said(candidate, names)
        self.tried.append(Tried(candidate.kind, message, names, finite, why))

    def _place(self, item: Item) -> ModelPlace:
        element = item.element
        assert element is not None
        line, column = element.document.position(element.start)
        return ModelPlace(item.name, place_of(element), element.document.path, line, column)

    def _texts(self, edits: Sequence[ModelEdit]) -> tuple[TextEdit, ...]:
        by_path = {document.path: document for document in self.scene.documents}
        found = []
        for edit in merge_edits(edits):
            document = by_path[edit.path]
            old = document.data[edit.start : edit.end].decode("utf-8", "replace")
            line, column = document.position(edit.start)
            new = edit.new.decode("utf-8", "replace")
            found.append(TextEdit(edit.path, line, column, edit.start, edit.end, old, new))
        return tuple(found)

    def _together(self, items: Sequence[Item]) -> tuple[Saving | None, tuple[ModelEdit, ...]]:
        """All that is to be fixed at once; less, where that is no longer the same."""
        left = list(items)
        while left:
            try:
                trial = self.trials.run(left)
            except NotTriedError:
                trial = None
            if trial is not None and trial.result.identical:
                self.fixed_items = left
                return self.trials.saving(
                    trial, self.trials.ratio(trial.model, trial.left)
                ), trial.edits
            left.pop()
        return None, ()

    def _slim(self, fixed: Saving | None) -> tuple[Saving | None, float | None]:
        """What everything found saves; `fixed` is what all that is to be fixed does."""
        if not self.faults:
            return None, None
        if fixed is not None and set(self.faults) == set(self.fixed_items):
            return fixed, 0.0
        try:
            trial = self.trials.run(self.faults)
        except NotTriedError:
            return None, None
        difference = trial.result.difference
        finite = difference if math.isfinite(difference) else None
        return self.trials.saving(trial, self.trials.ratio(trial.model, trial.left)), finite


def _said(candidate: Candidate, names: Sequence[str]) -> str:
    """Its message, with the first of the names."""
    shown = ", ".join(names[:NAMES])
    if len(names) > NAMES:
        shown += f" and {len(names) - NAMES} more"
    return candidate.message.replace("{}", shown)


def _label(candidate: Candidate, result: MotionComparison) -> str:
    if result.identical:
        certain = candidate.proof or candidate.is_setting
        return IDENTICAL if certain else UNTOUCHED
    return EQUAL if result.equal else CHANGES
