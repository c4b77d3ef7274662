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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from coursebuild.measured.diet import CHANGES, EQUAL, IDENTICAL, UNTOUCHED, Place, Saving, TextEdit
from coursebuild.measured.diet import Finding as Finding
from coursebuild.measured.diet import Tried as Tried
from coursebuild.physics.diet.candidates import Candidate, Item, Look, change
from coursebuild.physics.diet.cases import Case
from coursebuild.physics.diet.collisions import collisions
from coursebuild.physics.diet.compare import Comparison, Seen, compare, watch
from coursebuild.physics.diet.edits import Edit
from coursebuild.physics.diet.mapping import Mapping as Left
from coursebuild.physics.diet.mapping import fits, mapping_without
from coursebuild.physics.diet.markup import place_of
from coursebuild.physics.diet.meshes import meshes
from coursebuild.physics.diet.model_text import ModelText, saved
from coursebuild.physics.diet.motion import idle
from coursebuild.physics.diet.readers import Readers
from coursebuild.physics.diet.scenery import scenery
from coursebuild.physics.diet.settings import settings
from coursebuild.physics.diet.timing import Clock, Ratio, time_ratio
from coursebuild.physics.diet.unused import unused
from coursebuild.values import dataclass

NAMES = 6
"""Names that a message lists."""
LEAST = 1.05
"""A setting must save so much time to be worth a word."""


@dataclass(frozen=True, slots=True, eq=False)
class Order:
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


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found."""

    seen: tuple[Seen, ...]
    findings: tuple[Finding, ...]
    tried: tuple[Tried, ...]
    fixed: Saving | None
    slim: Saving | None
    slim_difference: float | None
    stale: tuple[str, ...]
    edits: tuple[Edit, ...]
    """All that `--fix` changes."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A changed model, and how it did."""

    edits: tuple[Edit, ...]
    model: Any
    left: Left
    result: Comparison


class _NotTriedError(Exception):
    """A change that makes no model, or one that cannot be compared."""


def survey(order: Order) -> Survey:
    """Try everything on a model."""
    return _Surveyor(order).all()


class _Surveyor:
    def __init__(self, order: Order) -> None:
        self.order = order
        self.scene = order.scene
        self.seen = tuple(watch(order.scene.model, case) for case in order.cases)
        self.cases = [one.case for one in self.seen if one.judgement.ok]
        self.findings: list[Finding] = []
        self.tried: list[Tried] = []
        self.used: set[str] = set()
        self.fixes: list[Item] = []
        self.faults: list[Item] = []

    def all(self) -> Survey:
        """Every candidate, then all of what was found."""
        if not self.cases:
            return Survey(self.seen, (), (), None, None, None, (), ())
        for candidate in self._candidates():
            self.order.tell(candidate.kind)
            self._judge(candidate)
        fixed, edits = self._together(self.fixes)
        slim, difference = self._slim()
        stale = [one for one in self.order.keeps if one not in self.used]
        found, tried = tuple(self.findings), tuple(self.tried)
        return Survey(self.seen, found, tried, fixed, slim, difference, tuple(stale), edits)

    def _candidates(self) -> Iterator[Candidate]:
        good = tuple(one for one in self.seen if one.judgement.ok)
        declared = any(one.case.declared for one in self.seen)
        model = self.scene.model
        used = {one.case.keyframe for one in self.seen} - {None}
        keyframes = frozenset(k for k in used if k is not None)
        look = Look(
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
            for part, trial in self._parts(candidate, items):
                if self._report(candidate, part, trial, reason or ""):
                    self.used |= {f"{candidate.kind} {item.name}" for item in part}
                    self.used.add(candidate.kind)

    def _parts(
        self, candidate: Candidate, items: Sequence[Item]
    ) -> Iterator[tuple[list[Item], _Trial]]:
        """Items that go together, and how it went without them; what cannot be tried is noted."""
        waiting = [list(items)]
        same: list[Item] = []
        apart: list[tuple[list[Item], _Trial]] = []
        while waiting:
            part = waiting.pop()
            try:
                trial = self._try(part)
            except _NotTriedError as error:
                if len(part) == 1:
                    self._note(candidate, part, None, str(error))
                    continue
            else:
                if trial.result.identical:
                    same += part
                    continue
                if len(part) == 1 or candidate.is_setting:
                    apart.append((part, trial))
                    continue
                if trial.result.equal and not candidate.proof:
                    apart.append((part, trial))
                    continue
            half = len(part) // 2
            waiting += [part[half:], part[:half]]
        if same:
            try:
                whole = self._try(same)
            except _NotTriedError:
                for item in same:
                    yield [item], self._try([item])
            else:
                yield same, whole
        yield from _grouped(apart, self._try)

    def _try(self, items: Iterable[Item]) -> _Trial:
        """The model without these, in all scenarios."""
        scene = self.scene
        edits, gone = change(scene, items)
        left = mapping_without(scene.model, gone)
        try:
            model = scene.compiled(edits)
            if not fits(left, model):
                raise _NotTriedError("what is left cannot be told from what is gone")
            result = compare(scene.model, model, left, self.cases)
        except ValueError as error:
            raise _NotTriedError(" ".join(str(error).split())) from None
        return _Trial(edits, model, left, result)

    def _report(
        self, candidate: Candidate, items: Sequence[Item], trial: _Trial, reason: str
    ) -> bool:
        """Note what was found; whether there was anything."""
        label = _label(candidate, trial.result)
        if label == CHANGES:
            self._note(candidate, items, trial.result.difference, "")
            return False
        ratio = self._time(trial) if candidate.timed else None
        if candidate.is_setting and not (
            ratio is not None and ratio.certain and ratio.value >= LEAST
        ):
            self._note(candidate, items, trial.result.difference, "", label)
            return bool(reason)
        unfixed = self._unfixed(candidate, trial, label, reason)
        finding = Finding(
            kind=candidate.kind,
            message=_said(candidate, [item.name for item in items]),
            places=tuple(self._place(item) for item in items if item.element is not None),
            label=label,
            difference=trial.result.difference,
            scenarios=tuple(case.name for case in self.cases),
            proof=candidate.proof,
            setting=candidate.is_setting,
            saving=self._saving(trial, ratio),
            edits=self._texts(trial.edits),
            fixable=not unfixed,
            unfixed=unfixed,
            kept=reason,
        )
        self.findings.append(finding)
        if not unfixed:
            self.fixes += items
        if finding.counts:
            self.faults += items
        return True

    def _unfixed(self, candidate: Candidate, trial: _Trial, label: str, reason: str) -> str:
        if reason:
            return "it is kept"
        if candidate.is_setting:
            return "how to compute is the author's choice"
        if label != IDENTICAL:
            return f"only what is {IDENTICAL} is changed"
        for edit in trial.edits:
            if edit.path in self.order.locked:
                return self.order.locked[edit.path]
        return candidate.blocked

    def _note(
        self,
        candidate: Candidate,
        items: Sequence[Item],
        difference: float | None,
        why: str,
        label: str = CHANGES,
    ) -> None:
        finite = difference if difference is not None and math.isfinite(difference) else None
        names = tuple(item.name for item in items)
        message = _said(candidate, names)
        self.tried.append(Tried(candidate.kind, message, names, label, finite, why))

    def _time(self, trial: _Trial) -> Ratio | None:
        order = self.order
        model = self.scene.model
        return time_ratio(
            model, trial.model, trial.left, self.cases, order.clock, quick=order.quick
        )

    def _saving(self, trial: _Trial, ratio: Ratio | None) -> Saving:
        files = self.scene.files(trial.edits)
        before = {one.path: len(one.data) for one in self.scene.documents}
        text = sum(before[path] - len(data) for path, data in files.items())
        memory = len(saved(self.scene.model)) - len(saved(trial.model))
        if ratio is None:
            return Saving(None, None, False, memory, text)
        return Saving(ratio.value, ratio.spread, ratio.certain, memory, text)

    def _place(self, item: Item) -> Place:
        element = item.element
        assert element is not None
        line, column = element.document.position(element.start)
        return Place(item.name, place_of(element), element.document.path, line, column)

    def _texts(self, edits: Sequence[Edit]) -> tuple[TextEdit, ...]:
        by_path = {document.path: document for document in self.scene.documents}
        found = []
        for edit in sorted(edits):
            document = by_path[edit.path]
            old = document.data[edit.start : edit.end].decode("utf-8", "replace")
            line, column = document.position(edit.start)
            new = edit.new.decode("utf-8", "replace")
            found.append(TextEdit(edit.path, line, column, edit.start, edit.end, old, new))
        return tuple(found)

    def _together(self, items: Sequence[Item]) -> tuple[Saving | None, tuple[Edit, ...]]:
        """All that is to be fixed at once; less, where that is no longer the same."""
        left = list(items)
        while left:
            try:
                trial = self._try(left)
            except _NotTriedError:
                trial = None
            if trial is not None and trial.result.identical:
                return self._saving(trial, self._time(trial)), trial.edits
            left.pop()
        return None, ()

    def _slim(self) -> tuple[Saving | None, float | None]:
        """What everything found saves."""
        if not self.faults:
            return None, None
        try:
            trial = self._try(self.faults)
        except _NotTriedError:
            return None, None
        difference = trial.result.difference
        finite = difference if math.isfinite(difference) else None
        return self._saving(trial, self._time(trial)), finite


def _said(candidate: Candidate, names: Sequence[str]) -> str:
    """Its message, with the first of the names."""
    shown = ", ".join(names[:NAMES])
    if len(names) > NAMES:
        shown += f" and {len(names) - NAMES} more"
    return candidate.message.replace("{}", shown)


def _label(candidate: Candidate, result: Comparison) -> str:
    if result.identical:
        certain = candidate.proof or candidate.is_setting
        return IDENTICAL if certain else UNTOUCHED
    return EQUAL if result.equal else CHANGES


def _grouped(
    apart: Sequence[tuple[list[Item], _Trial]], retry: Callable[[Iterable[Item]], _Trial]
) -> Iterator[tuple[list[Item], _Trial]]:
    """Parts that were equal within tolerance in one, if they are so together."""
    equal = [part for part in apart if part[1].result.equal]
    yield from (part for part in apart if not part[1].result.equal)
    if len(equal) > 1:
        items = [item for part, _ in equal for item in part]
        try:
            trial = retry(items)
        except _NotTriedError:
            trial = None
        if trial is not None and trial.result.equal:
            yield items, trial
            return
    yield from equal
