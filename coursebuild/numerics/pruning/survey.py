"""The scene diet of one model.

Entry point: `survey`.

1. The model runs once in each scenario. From one that is lost nothing is claimed.
2. *Proved*: of all that no motion is computed of, as much is taken out at once as the compiler lets
   go, as changes nothing else in the compiled model, and as no code can notice; every scenario must
   give the same bits.
3. *The same in what was run*: of the rest as much of each kind as changes no motion in the
   scenarios; only the time that it saves speaks for it.
4. Scripts and labs of the course run with what is left: what changes their output is no finding.
   Other settings, with which they compute other digits, are tried in the scenarios alone.
5. In the end all that `--fix` would change is taken out together; and so is everything found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import mujoco
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import Machine
from coursebuild.core.model.scenarios import Keep
from coursebuild.numerics.pruning.candidates import (
    Item,
    contacts,
    far_bodies,
    idle_contacts,
    message_of,
    proof_of,
    settings,
    unread,
)
from coursebuild.numerics.pruning.compare import TOLERANCE, MotionComparison, WatchedRun, watch
from coursebuild.numerics.pruning.differences import beyond, difference
from coursebuild.numerics.pruning.edits import ModelEdit, merge_edits
from coursebuild.numerics.pruning.markup import place_of
from coursebuild.numerics.pruning.model_text import ModelText
from coursebuild.numerics.pruning.reachability import PREMISES
from coursebuild.numerics.pruning.readers import Reader
from coursebuild.numerics.pruning.trials import PrunedModel, PruningTrials, largest_subset
from coursebuild.numerics.reports.diet import (
    PROVED,
    SAME,
    DietReport,
    DietScenario,
    Finding,
    ModelPlace,
    Saving,
    StaleKeep,
    TextEdit,
    Tried,
    name_list,
)
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.timing import Clock

LEAST = 1.05
"""What only runs speak for must save so much time to be worth a word."""
_OWN_FIELDS = {
    kind: frozenset(fields.split(" "))
    for kind, fields in {
        "energy-flag": "enableflags",
        "fwdinv-flag": "enableflags",
        "contact-off": "disableflags",
        "actuator-idle": "key_ctrl nu nout nJmom tree_sleep_policy",
        "tendon-idle": "wrap_type wrap_prm nwrap nJten ten_J_rownnz ten_J_rowadr ten_J_colind",
        "unused-mesh": "npolygonmax",
        "collision-unreachable": (
            "geom_contype geom_conaffinity body_contype body_conaffinity body_bvhnum body_bvhadr"
        ),
    }.items()
}
"""What else of the compiled model is of these kinds alone."""

Rerun = Callable[[Mapping[str, bytes]], str]
"""With files changed so: who then says something else; empty where nobody does."""


class Order(Struct, frozen=True, eq=False):
    """What is to be surveyed, and how."""

    model: str
    """Its name."""
    digest: str
    """Of all in the course that the report depends on."""
    machine: Machine
    text: ModelText
    scenes: tuple[Scene, ...]
    readers: tuple[Reader, ...]
    """All code that uses the model, or may."""
    keeps: Mapping[str, Keep]
    """By the finding: `KIND`, or `KIND NAME`."""
    locked: Mapping[str, str]
    """Files that are not to be changed, and why."""
    has_commands: bool
    """Whether scenarios give commands, by the number of their actuator."""
    clock: Clock | None
    """`None`: nothing is timed."""
    quick: bool
    tell: Callable[[str], None]
    """Is told what is tried next."""
    rerun: Rerun | None = None
    """`None`: scripts and labs do not run."""


class Survey(Struct, frozen=True):
    """What was found."""

    report: DietReport
    text: ModelText
    edits: tuple[ModelEdit, ...] = ()
    """All that `--fix` changes."""


def survey(order: Order) -> Survey:
    """Try everything on a model."""
    seen = [watch(order.text.model, scene) for scene in order.scenes]
    report = DietReport(
        model=order.model,
        digest=order.digest,
        quick=order.quick,
        machine=order.machine,
        readers=tuple(dict.fromkeys(one.path.partition(":")[0] for one in order.readers)),
        scenarios=tuple(
            DietScenario(
                one.scene.name,
                round(one.scene.scenario.duration / one.scene.timestep),
                one.judgement.status.value,
                one.judgement.reasons,
            )
            for one in seen
        ),
        findings=(),
        tried=(),
        fixed=None,
        slim=None,
        slim_difference=None,
        stale=(),
    )
    good = tuple(one for one in seen if one.judgement.ok)
    return _Surveyor(order, good).all(report) if good else Survey(report, order.text)


class _Found(Struct, frozen=True, eq=False):
    """Things that go together."""

    items: tuple[Item, ...]
    finding: Finding


class _Surveyor:
    def __init__(self, order: Order, good: tuple[WatchedRun, ...]) -> None:
        self.order = order
        self.good = good
        self.trials = PruningTrials(
            order.text, [one.scene for one in good], order.clock, quick=order.quick
        )
        self.tried: list[Tried] = []

    def all(self, report: DietReport) -> Survey:
        """Every candidate, then all of what was found."""
        proved = self._proved()
        found = self._believed([*proved, *self._run(proved)])
        found += self._settings()
        self.order.tell("all together")
        fixable = [item for one in found if one.finding.fixable for item in one.items]
        whole = self.trials.without(largest_subset(fixable, self._holds)) if fixable else None
        slim, apart = self._slim([one for one in found if not one.finding.kept])
        used = {one.finding.kind for one in found}
        used |= {f"{item.kind} {item.name}" for one in found for item in one.items}
        stale = {key: one.finding_span for key, one in self.order.keeps.items() if key not in used}
        report = replace(
            report,
            findings=tuple(one.finding for one in found),
            tried=tuple(self.tried),
            fixed=None if whole is None else self.trials.saving(whole),
            slim=slim,
            slim_difference=apart,
            stale=tuple(StaleKeep(k, at.path, at.line, at.column) for k, at in stale.items()),
        )
        return Survey(report, self.order.text, () if whole is None else whole.edits)

    def _believed(self, found: Sequence[_Found]) -> list[_Found]:
        """Those without which scripts and labs of the course say the same."""
        self.order.tell("scripts and labs")
        unkept = [one for one in found if not one.finding.kept]
        believed = largest_subset(unkept, lambda some: not self._says_otherwise(some))
        for one in unkept:
            if one not in believed:
                who = self._says_otherwise([one])
                self._note(one.items, one.finding.difference, f"{who} says something else then")
        return [one for one in found if one.finding.kept or one in believed]

    def _proved(self) -> list[_Found]:
        order = self.order
        order.tell("what nobody needs")
        items = unread(order.text, [one.scene.scenario for one in self.good])
        if not any(one.touches(PREMISES) for one in order.readers):
            items += contacts(order.text)
        items = [one for one in items if self._unread(one)]
        wanted = [one for one in items if not self._reason(one)]
        gone = largest_subset(wanted, self._holds)
        kept = [one for one in items if self._reason(one) and self._holds([*gone, one])]
        for one in wanted:
            if one not in gone:
                self._note([one], None, "something needs it, or code may")
        elements = {one.element for one in gone}
        outer = [one for one in gone if not one.element or elements.isdisjoint(one.element.above())]
        groups = self._grouped([*outer, *kept])
        return [self._found(some, reason, PROVED, 0.0) for reason, some in groups]

    def _unread(self, item: Item) -> bool:
        names = {item.name} | {one.get("class") or "" for e in item.gone for one in e.walk()}
        return self._noticing(names - {""}, {item.view} - {""}, ()) is None

    def _noticing(
        self, names: Collection[str], kinds: Collection[str], change: Collection[str]
    ) -> Reader | None:
        """The first who may notice that things are gone."""
        return next((o for o in self.order.readers if o.notices(names, kinds, change)), None)

    def _holds(self, items: Sequence[Item]) -> bool:
        """Whether nothing but these would be missing, in any state."""
        trial = self.trials.without(items)
        if trial is None:
            return False
        kinds = frozenset(one.view for one in items if one.view)
        change = difference(self.order.text.model, trial.model)
        own = {field for one in items for field in _OWN_FIELDS.get(one.kind, ())}
        if beyond(change, kinds) - own:
            return False
        if "tree_sleep_policy" in change and self._may_sleep():
            return False
        change |= self.trials.state_difference(trial)
        if self._noticing((), kinds, change) is not None:
            return False
        result = self.trials.compare(trial)
        return result is not None and result.identical

    def _may_sleep(self) -> bool:
        asleep = int(self.order.text.model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)
        return bool(asleep or any(one.touches({"enableflags"}) for one in self.order.readers))

    def _run(self, proved: Sequence[_Found]) -> list[_Found]:
        text = self.order.text
        said = {name for one in self.order.readers for name in one.names}
        groups = [far_bodies(text, said, self.good)]
        if not any(one.items[0].kind == "contact-off" for one in proved):
            groups.append(idle_contacts(text, self.good))
        return self._each(groups)

    def _settings(self) -> list[_Found]:
        return self._each([[one] for one in settings(self.order.text, self.good)])

    def _each(self, groups: Iterable[Sequence[Item]]) -> list[_Found]:
        found: list[_Found] = []
        for items in groups:
            for reason, some in self._grouped(items):
                self.order.tell(some[0].kind)
                one = self._same(some, reason)
                found += [] if one is None else [one]
        return found

    def _same(self, items: Sequence[Item], reason: str) -> _Found | None:
        """As many of these as change no motion, if that saves time."""
        results: list[MotionComparison] = []

        def same(some: Sequence[Item]) -> bool:
            trial = self.trials.without(some)
            result = None if trial is None else self.trials.compare(trial)
            if result is not None:
                results.append(result)
            return result is not None and result.difference <= allowed

        # Bodies fall asleep below a speed, which is then the difference.
        sleeps = items[0].kind == "sleep"
        allowed = float(self.order.text.model.opt.sleep_tolerance) if sleeps else TOLERANCE
        gone = largest_subset(items, same)
        if not gone:
            worst = max((one.difference for one in results), default=math.inf)
            self._note(items, worst, "it changes the motion")
            return None
        if not same(gone):
            return None
        one = self._found(gone, reason, SAME, results[-1].difference)
        saving = one.finding.saving
        slow = saving.time is None or not (saving.certain and saving.time >= LEAST)
        if self.order.clock is not None and slow and not reason:
            self._note(gone, results[-1].difference, "it saves no time")
            return None
        return one

    def _reason(self, item: Item) -> str:
        """Why the author keeps it; empty where nothing says so."""
        keeps = self.order.keeps
        keep = keeps.get(f"{item.kind} {item.name}") or keeps.get(item.kind)
        return "" if keep is None else keep.reason

    def _grouped(self, items: Iterable[Item]) -> list[tuple[str, list[Item]]]:
        """Items of one kind that are kept for one reason, or for none."""
        groups: dict[tuple[str, str], list[Item]] = {}
        for item in items:
            groups.setdefault((item.kind, self._reason(item)), []).append(item)
        return [(reason, some) for (_, reason), some in groups.items()]

    def _found(self, items: Sequence[Item], reason: str, label: str, apart: float) -> _Found:
        kind, trial = items[0].kind, self.trials.without(items)
        change: frozenset[str] = frozenset()
        edits = self.trials.edits(items)
        saving = Saving(None, None, False, 0, self.trials.bytes_of(edits))
        if trial is not None:  # not where it goes only with what uses it
            timed = not kind.startswith("unused-") or kind == "unused-site"
            saving = self.trials.saving(trial, timed=timed)
            change = difference(self.order.text.model, trial.model)
            change |= self.trials.state_difference(trial)
        reader = self._noticing((), {items[0].view} - {""}, change)
        finding = Finding(
            kind=kind,
            message=message_of(kind, name_list([item.name for item in items]), len(items)),
            places=tuple(_place(item) for item in items if item.element is not None),
            label=label,
            difference=apart,
            scenarios=tuple(one.scene.name for one in self.good),
            proof=proof_of(kind) if label == PROVED else "",
            saving=saving,
            edits=self._texts(edits),
            fixable=False,
            unfixed="",
            kept=reason,
            doubt=f"{reader.path} may notice" if reader is not None else "",
        )
        unfixed = self._unfixed(finding)
        return _Found(tuple(items), replace(finding, fixable=not unfixed, unfixed=unfixed))

    def _unfixed(self, finding: Finding) -> str:
        """Why `--fix` does not change it; empty where it does."""
        if finding.kept:
            return "it is kept"
        if finding.label != PROVED:
            return f"only what is {PROVED} is changed"
        if finding.kind == "actuator-idle" and self.order.has_commands:
            return "scenarios give commands by number: their rows would have to be shortened"
        locked = (self.order.locked.get(edit.path, "") for edit in finding.edits)
        return next(filter(None, locked), "")

    def _note(self, items: Sequence[Item], apart: float | None, why: str) -> None:
        finite = apart if apart is not None and math.isfinite(apart) else None
        kind, names = items[0].kind, tuple(item.name for item in items)
        message = message_of(kind, name_list([item.name for item in items]), len(items))
        self.tried.append(Tried(kind, message, names, finite, why))

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

    def _without(self, found: Sequence[_Found]) -> PrunedModel | None:
        return self.trials.without([item for one in found for item in one.items])

    def _says_otherwise(self, found: Sequence[_Found]) -> str:
        """Who of the course's scripts and labs says something else without all these."""
        trial, rerun = self._without(found), self.order.rerun
        if trial is None or rerun is None:
            return ""
        return rerun(self.order.text.files(trial.edits))

    def _slim(self, found: Sequence[_Found]) -> tuple[Saving | None, float | None]:
        """What everything found saves: the most that goes together, or the best alone."""

        def equal(some: Sequence[_Found]) -> bool:
            trial = self._without(some)
            result = None if trial is None else self.trials.compare(trial)
            allowed = max([TOLERANCE, *(one.finding.difference for one in some)])
            return result is not None and result.difference <= allowed

        by_time = sorted(found, key=lambda one: -(one.finding.saving.time or 0.0))
        trial = self._without(largest_subset(by_time, equal)) if found else None
        result = None if trial is None else self.trials.compare(trial)
        if trial is None or result is None:
            return None, None
        slim = self.trials.saving(trial)
        best = by_time[0].finding
        if (best.saving.time or 0.0) > (slim.time or 0.0):
            return best.saving, best.difference
        return slim, result.difference


def _place(item: Item) -> ModelPlace:
    element = item.element
    assert element is not None
    line, column = element.document.position(element.start)
    return ModelPlace(item.name, place_of(element), element.document.path, line, column)
