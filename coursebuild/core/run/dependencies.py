"""What the result of a script depends on, and in which words to say that it changed.

Entry points: `group_key`, `dependencies_of`, `input_changes`, `state_changes`, `forgotten`.

1. What is known before a script runs (`Inputs`) names a group of results.
2. What it looked at while it ran (a `Trace`) names its needs; each with its state at that time is a
   `Dependency`.
3. A result holds as long as every state is as it was.
"""

from __future__ import annotations

import enum
import functools
import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator
from typing import assert_never

from msgspec import Struct

from coursebuild.core.engine.digests import ABSENT, FOLDER, SPECIAL
from coursebuild.core.model import Limits
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun

VERSION = "6"
"""To be changed with how scripts are run and watched: older results then count no more."""

_MISSING_MODULE = re.compile(r"^(?:\w+\.)*(?:ModuleNotFoundError|ImportError)\b", re.MULTILINE)
_PERTURBATION = "moved states"
"""Another name, once what is kept of such runs means something else: then they run again."""
_SHOWN = 6
"""Names of modules that are shown of a list."""
_CHANGING = ("/proc/", "/sys/", "/dev/")


class Kind(enum.Enum):
    """What sort of thing a script looked at."""

    FILE = "file"
    """Of the project, by its path there."""
    LISTING = "listing"
    """The names in a folder of the project."""
    SOUGHT = "sought"
    """Modules that were looked for in a folder of the project (`folder/{one,two}`); its state is
    which of them are there."""
    OUTSIDE = "outside"
    """A file elsewhere on this machine, by its absolute path."""
    MODULE = "module"
    """An installed one, by its name; its state is which versions of what provide it."""
    PLACE = "place"
    """Where something lies on this machine, for a script that printed it."""

    __hash__ = object.__hash__  # that of enumerations is much slower, and needs are many


class Need(Struct, frozen=True):
    """Something whose state counts."""

    kind: Kind
    name: str


class Dependency(Struct, frozen=True):
    """Something that a script looked at, and how it was then."""

    kind: Kind
    name: str
    state: str

    @property
    def need(self) -> Need:
        """Without its state."""
        return Need(self.kind, self.name)


class Inputs(Struct, frozen=True):
    """All that counts and is known before a script runs."""

    path: str
    text: str
    """Hash of the script."""
    args: tuple[str, ...]
    timeout: float
    requires: tuple[str, ...]
    around: tuple[tuple[str, str], ...]
    """What runs it, by name: the interpreter, the platform, variables of the environment."""
    version: str = VERSION


def inputs_of(job: ScriptJob, text: bytes, around: tuple[tuple[str, str], ...]) -> Inputs:
    """What is known of a job whose file holds this text."""
    digest = hashlib.sha256(text).hexdigest()
    more = [(f"environment variable {name}", value) for name, value in job.environment]
    if job.packages:
        more.append(("packages of the course", " ".join(job.packages)))
    if job.writes:
        more.append(("folders that it may write into", " ".join(job.writes)))
    if job.figures:
        more.append(("figures that it draws", " ".join(job.figures)))
    if job.memory != Limits().scripts:
        more.append(("MiB that it may take", str(job.memory)))
    if job.perturbation:
        more.append((_PERTURBATION, str(job.perturbation)))
    around = tuple(sorted((*around, *more)))
    return Inputs(job.path, digest, job.args, float(job.timeout), job.requires, around)


def is_perturbed(inputs: Inputs) -> bool:
    """Whether these are of a run whose initial states are moved."""
    return any(name == _PERTURBATION for name, _ in inputs.around)


def group_key(inputs: Inputs) -> str:
    """The name of the group of results that these inputs can have."""
    parts = [getattr(inputs, name) for name in Inputs.__struct_fields__]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def result_key(dependencies: Iterable[Dependency]) -> str:
    """The name of a result in its group."""
    parts = sorted((d.kind.value, d.name, d.state) for d in dependencies)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def dependencies_of(
    run: ScriptRun,
    requires: Iterable[str],
    places: Iterable[tuple[str, str]],
    state: Callable[[Need], str],
) -> tuple[Dependency, ...]:
    """All that the result of a run depends on, sorted; nothing where nobody watched.

    `places` are folders of this machine by name: `library` is the one that holds `mjcourse`.
    """
    trace = run.trace
    if trace is None:
        return ()
    found = {Need(Kind.FILE, path) for path in trace.files}
    found |= {Need(Kind.LISTING, path) for path in trace.folders}
    found |= {Need(Kind.SOUGHT, name) for name in trace.sought}
    found |= {Need(Kind.MODULE, name) for name in trace.modules}
    found |= {Need(Kind.MODULE, name.partition(".")[0]) for name in requires}
    known = dict(places)
    ours = f"{known['library'].rstrip('/')}/mjcourse/"
    for path in trace.outside:
        # It may lie elsewhere on another machine, and is the same.
        inside = path.startswith(ours)
        found.add(Need(Kind.MODULE, "mjcourse") if inside else Need(Kind.OUTSIDE, path))
    for name, folder in known.items():
        if len(folder) > 1 and folder in run.stdout:
            found.add(Need(Kind.PLACE, name))
    needs = sorted(found, key=lambda need: (need.kind.value, need.name))
    # What was sought in vain was not there, whatever is there by now.
    states = ("" if need.kind is Kind.SOUGHT else state(need) for need in needs)
    return tuple(
        Dependency(need.kind, need.name, now) for need, now in zip(needs, states, strict=True)
    )


def sought(name: str) -> tuple[str, tuple[str, ...]]:
    """The folder and the modules of a need of the kind `SOUGHT`."""
    folder, _, modules = name.rpartition("/{")
    return folder, tuple(modules.removesuffix("}").split(","))


@functools.lru_cache(maxsize=64)
def sought_files(name: str) -> tuple[str, ...]:
    """The files that were looked for, of a need of the kind `SOUGHT`."""
    folder, modules = sought(name)
    before = f"{folder}/" if folder else ""  # the project's own folder has no name
    return tuple(f"{before}{module}{end}" for module in modules for end in (".py", "/__init__.py"))


def forgotten(run: ScriptRun) -> str:
    """Why the result of a run is not remembered, as the end of a sentence; empty if it is."""
    match run.outcome:
        case Outcome.TIMEOUT:
            return "it was stopped after its time limit"
        case Outcome.KILLED:
            return "a signal ended it"
        case Outcome.SKIPPED:
            return f"it needs {', '.join(run.missing)}"
        case Outcome.NORUN:
            return "its lesson says `norun`"
        case Outcome.FAILED if _MISSING_MODULE.search(run.stderr):
            return "it did not find a module"
        case Outcome.OK | Outcome.FAILED | Outcome.OUTPUT_LIMIT | Outcome.ENCODING:
            pass
        case _:
            assert_never(run.outcome)
    if run.trace is None:
        return "nobody could watch what it looks at"
    changing = next((p for p in run.trace.outside if p.startswith(_CHANGING)), None)
    if changing is not None and changing != "/dev/null":
        return f"it reads {changing}"
    return run.trace.opaque


# --- what changed


def input_changes(old: Inputs, new: Inputs) -> list[str]:
    """What is different, each as a clause."""
    found = ["its text changed"] if old.text != new.text else []
    before, now = dict(old.around), dict(new.around)
    names = sorted({*before, *now})
    for what, one, two in (
        ("its arguments changed", _list(old.args), _list(new.args)),
        ("its option `timeout` changed", f"{old.timeout:g}", f"{new.timeout:g}"),
        ("its option `requires` changed", _list(old.requires), _list(new.requires)),
        *((name, before.get(name, "unset"), now.get(name, "unset")) for name in names),
    ):
        if one != two:
            found.append(f"{what}: {one} → {two}")
    if old.version != new.version:
        found.append("this version of coursebuild runs scripts in another way")
    return found


def state_changes(
    dependencies: Iterable[Dependency], state: Callable[[Need], str]
) -> Iterator[str]:
    """What is no longer as it was, each as a clause, in order; nothing where a result holds."""
    for dependency in dependencies:
        now = state(dependency.need)
        # What a device gives is never known to be the same.
        if now != dependency.state or now == SPECIAL:
            yield _change(dependency, now)


def _change(old: Dependency, now: str) -> str:
    match old.kind:
        case Kind.FILE | Kind.OUTSIDE:
            return f"{old.name} {_became(old.state, now)}"
        case Kind.LISTING:
            if ABSENT in (old.state, now):
                return f"the folder {old.name} {_became(old.state, now)}"
            return f"the list of files in {old.name} changed"
        case Kind.SOUGHT:
            folder = sought(old.name)[0]
            return f"{folder} has a file now with the name of a module: {now}"
        case Kind.MODULE:
            if not now:
                return f"{old.name} is no longer installed (it was {old.state})"
            if not old.state:
                return f"{old.name} is installed now: {now}"
            if now.startswith("files "):
                return f"the files of the module {old.name} changed"
            return f"{old.state} → {now}"
        case Kind.PLACE:
            return f"it printed a path of this machine: {old.state} → {now}"
        case _:
            assert_never(old.kind)


def _became(old: str, now: str) -> str:
    if now == ABSENT:
        return "is gone"
    if old == ABSENT:
        return "appeared"
    if now == FOLDER:
        return "is a folder now"
    if now.startswith("unreadable"):
        return f"is {now}"
    return "may have changed" if now == SPECIAL else "changed"


def _list(items: tuple[str, ...]) -> str:
    return " ".join(items) or "none"


def describe(dependency: Dependency) -> str:
    """A dependency as a line of a list."""
    match dependency.kind:
        case Kind.FILE | Kind.OUTSIDE:
            return dependency.name + (" (not there)" if dependency.state == ABSENT else "")
        case Kind.LISTING:
            return f"the list of files in {dependency.name or '.'}"
        case Kind.SOUGHT:
            folder, modules = sought(dependency.name)
            shown = ", ".join(modules[:_SHOWN])
            more = f" and {len(modules) - _SHOWN} more" if len(modules) > _SHOWN else ""
            return f"no file of {folder or 'the course'} has the name of a module ({shown}{more})"
        case Kind.MODULE:
            if not dependency.state:
                return f"the module {dependency.name} (not installed)"
            if dependency.state.startswith("files "):
                return f"the files of the module {dependency.name}"
            return dependency.state
        case Kind.PLACE:
            return f"that {dependency.state} is where it is: it printed that"
        case _:
            assert_never(dependency.kind)
