"""The scene diet of one model.

1. The model runs in each scenario, and from random starts nearby. From one that is lost nothing is
   claimed.
2. What is *proved* needless goes first, then far bodies. All else is tried in what is left: as much
   of each kind is taken out as changes no motion, and only the time that it saves speaks for it.
3. Scripts and labs of the course run with what is left: what changes their output is no finding.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cached_property

import mujoco
from msgspec import Struct, field
from msgspec.structs import replace

from mjbench.costs import Clock
from mjbench.machine import Machine
from mjbench.pruning.bystanders import couplings, far_bodies
from mjbench.pruning.candidates import (
    KINDS,
    Item,
    contact_of_rest,
    idle_contacts,
    message_of,
    primitive_meshes,
    unreachable_contacts,
    unread_elements,
)
from mjbench.pruning.comparison import (
    ALIKE,
    MotionComparison,
    WatchedRun,
    nearby_scenes,
    watch,
)
from mjbench.pruning.model_text import ModelText
from mjbench.pruning.reachability import PREMISES
from mjbench.pruning.readers import ModelReader, difference, unrelated_fields
from mjbench.pruning.trials import (
    PrunedGroup,
    PrunedModel,
    PruningTrials,
    largest_subset,
    views_of,
)
from mjbench.pruning.xml_edits import ModelEdit, place_of
from mjbench.reports.diet_report import (
    INTERFACE_LABEL,
    MEASURED_LABEL,
    PROVED_LABEL,
    DietReport,
    DietScenario,
    Finding,
    Keep,
    ModelPlace,
    RejectedTrial,
    StaleKeep,
)
from mjbench.scene import Scene

MIN_SPEEDUP = 1.05
"""The speedup from which on a finding that is not proved is worth a word."""
_STARTS, _QUICK_STARTS = 2, 1
"""Random starts of each scenario, beside its own."""
Rerun = Callable[[Mapping[str, bytes]], str]
"""New bytes of files → which script or lab then prints something else; empty where none does."""


class Survey(Struct, frozen=True):
    """The result of a survey."""

    report: DietReport
    text: ModelText
    edits: tuple[ModelEdit, ...] = ()
    """All that `--fix` changes."""


class StoppedSurvey(KeyboardInterrupt):
    """The user stopped a survey; `report` has what is known."""

    def __init__(self, report: DietReport) -> None:
        super().__init__("stopped")
        self.report = report


class Surveyor(Struct, kw_only=True, eq=False, dict=True):
    """Looks for everything that a model can be without."""

    model: str
    """Its name."""
    digest: str
    """The digest of everything in the course that the report depends on."""
    machine: Machine
    text: ModelText
    scenes: tuple[Scene, ...]
    readers: tuple[ModelReader, ...]
    """All code that uses the model, or may."""
    keeps: Mapping[str, Keep]
    """By the finding: `KIND`, or `KIND NAME`."""
    locked: Mapping[str, str]
    """Files that are not to be changed, and why."""
    clock: Clock | None
    """`None`: nothing is timed."""
    quick: bool
    tell: Callable[[str], None]
    """Gets a line about each stage."""
    only: Collection[str] = ()
    """The kinds of findings that are looked for; all if none is named."""
    rerun: Rerun | None = None
    """`None`: scripts and labs do not run."""
    good_runs: tuple[WatchedRun, ...] = ()
    """Of the whole model in its scenarios, those that were not lost."""
    nearby_runs: tuple[WatchedRun, ...] = ()
    """The same from starts nearby."""
    rejected: list[RejectedTrial] = field(default_factory=list)
    groups: list[PrunedGroup] = field(default_factory=list)
    """Those with a finding."""

    def survey(self) -> Survey:
        """Run the model in its scenarios, then without what it may not need.

        Raises:
            StoppedSurvey: the user does not wait for all.
        """
        runs = [watch(self.text.model, scene) for scene in self.scenes]
        self.good_runs = tuple(run for run in runs if run.judgement.ok)
        starts = _QUICK_STARTS if self.quick else _STARTS
        nearby = (s for run in self.good_runs for s in nearby_scenes(self.text.model, run, starts))
        nearby_runs = [watch(self.text.model, scene) for scene in nearby]
        self.nearby_runs = tuple(run for run in nearby_runs if run.judgement.ok)
        report = DietReport(
            model=self.model,
            digest=self.digest,
            quick=self.quick,
            machine=self.machine,
            scenarios=tuple(
                DietScenario(
                    run.scene.name,
                    run.judgement.status.value,
                    run.judgement.reasons,
                )
                for run in runs
            ),
            findings=(),
            tried=(),
            stale=(),
        )
        return self._try_all(report) if self.good_runs else Survey(report, self.text)

    @cached_property
    def trials(self) -> PruningTrials:
        """Tries the model without some things, in the scenarios in which it was not lost."""
        scenes = tuple(run.scene for run in self.good_runs)
        runs = (*self.good_runs, *self.nearby_runs)
        return PruningTrials(self.text, runs, scenes, self.clock, self.quick)

    def _try_all(self, report: DietReport) -> Survey:
        """Try every candidate, then all findings together."""
        try:
            self._find()
            fixable = [i for group in self.groups if group.finding.fixable for i in group.items]
            together = largest_subset(fixable, self._is_needless)
        except KeyboardInterrupt:
            raise StoppedSurvey(self._with_findings(report)) from None
        fixed = self.trials.prune(together) if fixable else None
        used_keys = {group.finding.kind for group in self.groups}
        used_keys |= {f"{item.kind} {item.name}" for group in self.groups for item in group.items}
        stale = {key: keep for key, keep in self.keeps.items() if key not in used_keys}
        report = replace(
            self._with_findings(report),
            stale=tuple(StaleKeep(k, at.path, at.line, at.column) for k, at in stale.items()),
        )
        return Survey(report, self.text, () if fixed is None else fixed.edits)

    def _with_findings(self, report: DietReport) -> DietReport:
        findings = (group.finding for group in self.groups)
        by_saving = sorted(findings, key=lambda finding: -(finding.saving.time or 0.0))
        return replace(report, findings=tuple(by_saving), tried=tuple(self.rejected))

    def _find(self) -> None:
        """Find the groups of things that the model can be without."""
        text, runs = self.text, self.trials.runs
        self.groups += self._settle(self._prove())
        proved = {item.element for group in self.groups for item in group.items}
        self.tell("what the scene is not about")
        names = {name for reader in self.readers for name in reader.names}
        scenarios = [run.scene.scenario for run in self.good_runs]
        far_items = far_bodies(text, names, scenarios, runs)
        self.groups += self._settle(self._try_by_running([far_items]))
        candidates = [[item for item in couplings(text) if item.element not in proved]]
        if not any(group.finding.kind == "contact-off" for group in self.groups):
            candidates += [idle_contacts(text, runs), primitive_meshes(text)]
        self.groups += self._try_by_running(candidates)
        kinds = ("far-body", "coupling-idle")
        removed_items = [i for group in self.groups for i in group.items if i.kind in kinds]
        contact_kinds = ("contact-off", "contact-idle")
        if not any(group.finding.kind in contact_kinds for group in self.groups):
            self.groups += self._try_by_running([contact_of_rest(text, removed_items)])
        self.groups = self._confirm(self.groups)

    def _settle(self, groups: Sequence[PrunedGroup]) -> list[PrunedGroup]:
        """Confirm groups, and try the rest without them, but for what is kept."""
        groups = self._confirm(groups) if groups else []
        unkept = [g for g in groups if not g.finding.kept and g.finding.label != INTERFACE_LABEL]
        self.trials.absences += tuple(item for group in unkept for item in group.items)
        return groups

    def _confirm(self, groups: Sequence[PrunedGroup]) -> list[PrunedGroup]:
        """The groups without which scripts and labs of the course print the same."""
        self.tell("scripts and labs")
        unkept = [group for group in groups if not group.finding.kept]

        def change_nothing(groups: Sequence[PrunedGroup]) -> bool:
            return self._prune(groups) is not None and not self._find_changed_output(groups)

        confirmed = largest_subset(unkept, change_nothing)
        for group in unkept:
            if group not in confirmed:
                path = self._find_changed_output([*confirmed, group])
                reason = f"{path} prints something else then" if path else "something needs it"
                self._reject(group.items, reason)
        return [group for group in groups if group.finding.kept or group in confirmed]

    def _prove(self) -> list[PrunedGroup]:
        self.tell("what nobody needs")
        items = unread_elements(self.text, [run.scene.scenario for run in self.good_runs])
        if not any(reader.touches(PREMISES) for reader in self.readers):
            items += unreachable_contacts(self.text)
        items = [item for item in items if self._is_asked(item) and self._is_unread(item)]
        unkept = [item for item in items if not self._keep_reason(item)]
        own_items = [item for item in unkept if not KINDS[item.kind].interface]
        removable = largest_subset(own_items, self._is_needless)
        # What the model offers to whoever drives it is looked at on top, and is never taken out.
        offered = largest_subset(
            [item for item in unkept if KINDS[item.kind].interface],
            lambda items: self._is_needless([*removable, *items]),
        )
        kept_items = [
            item
            for item in items
            if self._keep_reason(item) and self._is_needless([*removable, item])
        ]
        for item in unkept:
            if item not in removable and item not in offered:
                self._reject([item], "something needs it, or code may")
        elements = {item.element for item in (*removable, *offered)}
        outer = [
            item
            for item in (*removable, *offered)
            if not item.element or elements.isdisjoint(item.element.ancestors())
        ]
        groups = self._group_items([*outer, *kept_items])
        no_difference = MotionComparison(True, 0.0)
        return [
            self._make_group(
                similar,
                reason,
                INTERFACE_LABEL if KINDS[similar[0].kind].interface else PROVED_LABEL,
                no_difference,
            )
            for reason, similar in groups
        ]

    def _is_asked(self, item: Item) -> bool:
        return not self.only or item.kind in self.only

    def _is_unread(self, item: Item) -> bool:
        names = {item.name} | {node.get("class") or "" for e in item.removals for node in e.walk()}
        reader = self._find_noticing_reader(names - {""}, views_of([item]), ())
        if reader is not None:
            self._reject([item], reader.doubt)
        return reader is None

    def _find_noticing_reader(
        self, names: Collection[str], kinds: Collection[str], change: Collection[str]
    ) -> ModelReader | None:
        """The first reader that may notice that things are gone."""
        return next((r for r in self.readers if r.notices(names, kinds, change)), None)

    def _is_needless(self, items: Sequence[Item]) -> bool:
        """Whether the model without these items is otherwise the same, in any state."""
        trial = self.trials.prune(items)
        if trial is None:
            return False
        kinds = views_of(items)
        own_fields = {field for item in items for field in KINDS[item.kind].fields.split()}
        if unrelated_fields(difference(self.text.model, trial.model), kinds) - own_fields:
            return False
        try:
            change = self.trials.difference(trial, self.trials.whole)
        except ValueError:  # no state of plugins or delays can be brought over
            return False
        sleeps = int(self.text.model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)
        may_sleep = sleeps or any(reader.touches({"enableflags"}) for reader in self.readers)
        # One step from a random state tells more than scenarios that do not go there.
        state_fields = {"qpos", "qvel"} | ({"tree_sleep_policy"} if may_sleep else set())
        if change & state_fields or self._find_noticing_reader((), kinds, change) is not None:
            return False
        result = self.trials.compare(trial, self.trials.whole)
        return result is not None and result.identical

    def _try_by_running(self, candidates: Iterable[Sequence[Item]]) -> list[PrunedGroup]:
        """Take out of each list of items as many of a kind as change no motion."""
        groups: list[PrunedGroup] = []
        absences = {element for item in self.trials.absences for element in item.removals}
        edits = {edit for item in self.trials.absences for edit in item.edits}

        def is_left(item: Item) -> bool:
            if not self._is_asked(item):
                return False
            if item.element is None:
                return True
            is_whole = absences.isdisjoint((item.element, *item.element.ancestors()))
            return is_whole and not (item.edits and edits.issuperset(item.edits))

        for items in candidates:
            for reason, similar in self._group_items(filter(is_left, items)):
                self.tell(similar[0].kind)
                group = self._try_items(similar, reason)
                groups += [] if group is None else [group]
        return groups

    def _try_items(self, items: Sequence[Item], reason: str) -> PrunedGroup | None:
        """Take out as many of these items as change no motion, if that saves time.

        A shape that stands for a mesh is another scene: it may differ by less than can be seen.
        """
        unlike: list[MotionComparison] = []
        alike: list[MotionComparison] = []  # the last is of all that is removable
        tolerance = 1.0 if items[0].kind == "mesh-primitive" else ALIKE
        trials, absences = self.trials, self.trials.absences
        rest = trials.prune(absences) or trials.whole

        def moves_alike(items: Sequence[Item]) -> bool:
            trial = trials.prune([*absences, *items])
            result = None if trial is None else trials.compare(trial, rest)
            if result is None:
                return False
            is_alike = result.difference < tolerance
            (alike if is_alike else unlike).append(result)
            return is_alike

        removable = largest_subset(items, moves_alike)
        if not removable:
            least = min(unlike, key=lambda result: result.difference, default=None)
            reason_text = (
                "it cannot be removed alone" if least is None else f"without it {least.shown}"
            )
            self._reject(items, reason_text)
            return None
        group = self._make_group(removable, reason, MEASURED_LABEL, alike[-1])
        saving = group.finding.saving
        is_slow = saving.time is None or not (saving.certain and saving.time >= MIN_SPEEDUP)
        if self.clock is not None and is_slow and not reason:
            self._reject(removable, "it saves no time")
            return None
        return group

    def _keep_reason(self, item: Item) -> str:
        """Why the author keeps an item; empty where no entry names it."""
        keeps = self.keeps
        keep = keeps.get(f"{item.kind} {item.name}") or keeps.get(item.kind)
        return "" if keep is None else keep.reason

    def _group_items(self, items: Iterable[Item]) -> list[tuple[str, list[Item]]]:
        """Group items by their kind and the reason to keep them; each group with its reason."""
        groups: dict[tuple[str, str], list[Item]] = {}
        for item in items:
            groups.setdefault((item.kind, self._keep_reason(item)), []).append(item)
        return [(reason, similar) for (_, reason), similar in groups.items()]

    def _make_group(
        self, items: Sequence[Item], reason: str, label: str, comparison: MotionComparison
    ) -> PrunedGroup:
        kind, trials, edits = items[0].kind, self.trials, self.trials.edits(items)
        rest = trials.prune(trials.absences) or trials.whole
        trial = trials.prune([*trials.absences, *items])
        # One that is proved may go only with what uses it.
        change = frozenset() if trial is None else trials.difference(trial, rest)
        timed = not kind.startswith("unused-") or kind in ("unused-site", "unused-camera")
        reader = self._find_noticing_reader((), views_of(items), change)
        unfixed = self._reason_unfixed(reason, label, edits)
        places = []
        for item in items:
            if (element := item.element) is not None:
                path, position = element.document.path, element.document.position(element.start)
                places.append(ModelPlace(item.name, place_of(element), path, *position))
        finding = Finding(
            kind=kind,
            message=message_of(items),
            places=tuple(places),
            label=label,
            difference=comparison.difference,
            scenarios=tuple(run.scene.name for run in self.good_runs),
            proof=KINDS[kind].proof,
            saving=trials.measure_saving(edits, trial, rest, timed=timed),
            edits=self.text.describe(edits),
            fixable=not unfixed,
            unfixed=unfixed,
            kept=reason,
            doubt="" if reader is None else reader.doubt,
            shown=comparison.shown,
            starts=len(trials.runs),
            in_rest=bool(trials.absences),
        )
        return PrunedGroup(tuple(items), finding)

    def _reason_unfixed(self, keep_reason: str, label: str, edits: Iterable[ModelEdit]) -> str:
        """Why `--fix` does not act on a finding; empty where it does."""
        if keep_reason:
            return "it is kept"
        if label == INTERFACE_LABEL:
            return "whoever drives the model may use it"
        if label != PROVED_LABEL:
            return f"only what is {PROVED_LABEL} is changed"
        locked = (self.locked.get(edit.path, "") for edit in edits)
        return next(filter(None, locked), "")

    def _reject(self, items: Sequence[Item], reason: str) -> None:
        names = tuple(item.name for item in items)
        self.rejected.append(RejectedTrial(items[0].kind, names, reason))

    def _prune(self, groups: Sequence[PrunedGroup]) -> PrunedModel | None:
        return self.trials.prune([item for group in groups for item in group.items])

    def _find_changed_output(self, groups: Sequence[PrunedGroup]) -> str:
        """Which script or lab of the course prints something else without these groups."""
        trial = self._prune(groups)
        return self.rerun(self.text.files(trial.edits)) if trial and self.rerun else ""
