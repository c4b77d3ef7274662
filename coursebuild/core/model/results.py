"""The results of running a course: values made by runners, read by comparisons, reports, pages."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from msgspec import Meta, Struct, field

from coursebuild.core.model import Comparison, Limits, Recording
from coursebuild.core.model.lesson_record import Address, Provenance
from coursebuild.core.model.script_download import ScriptDownload
from coursebuild.core.text.source import Span


class Outcome(enum.Enum):
    """How the run of a script ended."""

    OK = "ok"
    FAILED = "failed"
    """It exited with a status other than 0."""
    TIMEOUT = "timeout"
    KILLED = "killed"
    """A signal ended it."""
    OUTPUT_LIMIT = "output-limit"
    ENCODING = "encoding"
    """It printed bytes that are not UTF-8."""
    SKIPPED = "skipped"
    """A module that it requires is missing."""
    NORUN = "norun"
    """Its author said not to run it, or nothing is named that runs its language."""
    UNRECORDED = "unrecorded"
    """Nothing is recorded of it yet, so it was not run: there was nothing to compare with."""


class ScriptJob(Struct, frozen=True):
    """A script to run, with everything that the runner needs to know."""

    path: str
    """POSIX path relative to the project root, e.g. `examples/l4_2.py`."""
    args: tuple[str, ...]
    timeout: float  # seconds
    requires: tuple[str, ...]
    perturbation: int = 0
    """From 1 on, the direction in which initial states are moved; below 0, steps change."""
    packages: tuple[str, ...] = ()
    environment: tuple[tuple[str, str], ...] = ()
    writes: tuple[str, ...] = ()
    """Folders of the project that it may write into."""
    figures: tuple[str, ...] = ()
    memory: int = Limits().scripts
    """MiB that it may take, where the system can enforce that."""
    part_lines: tuple[int, ...] = ()
    """The lines of its file, from 1, at which its parts but the first begin."""
    keeps_going: bool = False  # after a part that fails
    commands: tuple[tuple[str, ...], ...] = ()  # that run it in place of Python


class Sign(enum.Enum):
    """The sign that a simulation has diverged."""

    POSITIONS = "positions"
    """MuJoCo warned of bad ones; likewise in the next two."""
    VELOCITIES = "velocities"
    ACCELERATIONS = "accelerations"
    STATE = "state"
    """The state was not finite when it was checked."""
    CONTACT = "contact"
    """Bodies penetrated each other deeply when they were checked; MuJoCo does not warn of that."""


class Divergence(Struct, frozen=True):
    """A simulation of a script that diverged."""

    sign: Sign
    time: str
    """Simulated time, s, as MuJoCo wrote it."""
    model: str
    """The model's name; empty where it has none or is not known."""
    path: str
    """The file that was being executed, relative to the project; empty where none was."""
    line: int
    """Its line, from 1; 0 where it is not known."""
    depth: str = ""
    """Of a contact: how deep it was, m."""
    geoms: tuple[str, ...] = ()
    """Of a contact: the names of its geoms, or words for those without a name."""


_NUMBER = r"(-?0x[01](\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}|-?inf|nan)"
EndState: TypeAlias = Annotated[
    str, Meta(pattern=rf"^[0-9]{{1,9}} [0-9]{{1,9}}( {_NUMBER}){{2,}}$")
]


class EffectKind(enum.Enum):
    """The kind of an effect of a script on its surroundings."""

    WRITE = "w"
    """It writes outside its temporary folder, where it may not."""
    CONNECTION = "c"


class Effect(Struct, frozen=True, rename={"target": "what"}):
    """Something that a line of a script does beyond the script."""

    kind: EffectKind
    target: str
    """The path that it writes, relative to the project for a file of it; or the address."""
    path: str
    """The file of the project with the line; empty where it is not known."""
    line: int


class Trace(Struct, frozen=True, rename={"is_perturbed": "moved"}):
    """What a script read while it ran: all that its result depends on, besides its text.

    Project paths are POSIX and relative to the root. Each tuple is sorted, without repeats.
    """

    files: tuple[str, ...]
    """Files of the project that it read or tried to read, without its own and those that it had
    written itself; the source in place of a compiled module."""
    folders: tuple[str, ...]
    outside: tuple[str, ...]
    """Absolute paths of files read, of neither the project nor a package nor Python."""
    modules: tuple[str, ...]
    """Top-level names of installed packages' modules that it imported; none of Python's own."""
    opaque: str
    """Why the trace may be incomplete, as the end of a sentence ("it starts other programs"); empty
    where it is complete."""
    divergences: tuple[Divergence, ...] = ()
    """The simulations that diverged, in the order in which that was noticed, without repeats."""
    is_perturbed: bool = False
    """Of a run with a `ScriptJob.perturbation`: whether a state or a step was changed."""
    states: tuple[EndState, ...] = ()
    """Of such a run, for each `MjData`, separated by blanks: its number in the order of first use,
    the length of `qpos`, the sizes that |qpos| and |qvel| are compared by (at least the largest
    since its simulation began), and the final `qpos` and `qvel`, as hexadecimal numbers."""
    effects: tuple[Effect, ...] = ()
    """What it wrote outside its temporary folder and what it connected to, once for each line."""
    sought: tuple[str, ...] = ()
    """Modules that it looked for in a folder of the project in vain: `folder/{one,two}`."""
    existence: tuple[tuple[str, str], ...] = ()
    """Paths of the project where it looked whether something is there, each with the answer."""
    statuses: tuple[tuple[str, str], ...] = ()
    """Paths of the project whose sizes or times it asked for, each with the answer."""


class ScriptRun(Struct, frozen=True):
    """The run of a script."""

    path: str
    outcome: Outcome
    status: int
    """Exit status; the signal's number where one ended it."""
    stdout: str
    """LF line ends."""
    stderr: str
    """The last 64 KiB, with extracted paths as the interpreter wrote them."""
    seconds: float
    missing: tuple[str, ...] = ()
    """Modules that it requires and that are not installed."""
    cached: bool = False
    trace: Trace | None = None
    """What it read; `None` where that was not traced."""
    recorded: str = ""
    """When and where a run that the course keeps was made."""
    figures: tuple[tuple[str, bytes], ...] = ()
    """The files among `ScriptJob.figures` that it drew, by name."""
    unrepeated: bool = False
    """Whether something else was recorded when it ran, or nothing: what is recorded from it since
    then, no other run bears out."""
    provenance: Provenance | None = None
    """What it ran with; `None` where it did not run, and while it is stored."""
    part_starts: tuple[int, ...] = ()
    """Where in `stdout` the output of each of its parts but the first begins."""

    def output_of(self, part: int) -> str:
        """What a part printed, counted from 0: of a script that is not in parts, all of it."""
        edges = (0, *self.part_starts, len(self.stdout))
        return self.stdout[edges[part] : edges[part + 1]] if part + 1 < len(edges) else ""

    @property
    def did_run(self) -> bool:
        """Whether it was run at all, so that it can bear out what is recorded."""
        return self.outcome not in (Outcome.SKIPPED, Outcome.NORUN, Outcome.UNRECORDED)


class DriftKind(enum.Enum):
    """The kind of a difference between the recorded output and that of a run."""

    ROUNDING = "rounding"
    """Numbers differ in their last recorded digit only."""
    NUMERIC = "numeric"
    TEXT = "text"
    MISSING = "missing lines"
    EXTRA = "extra lines"


class Change(Struct, frozen=True):
    """One difference between a recorded output and a run; for a number, how far apart they are."""

    kind: DriftKind
    span: Span
    """In the lesson: the number, the text, the missing line, or the place where extra lines would
    stand."""
    recorded: str
    printed: str
    relative_error: float | None = None
    digits: int | None = None
    """Leading significant digits that agree."""


class Verdict(Struct, frozen=True):
    """The comparison of one recorded output with a run."""

    recording: Recording
    comparison: Comparison
    """The comparison used: the fence's own or the course's default."""
    status: Literal["verified", "drift", "volatile", "unchecked"]
    """`unchecked`: the script did not run to its end."""
    changes: tuple[Change, ...] = ()
    row_addresses: tuple[tuple[Address, ...], ...] = ()
    """Of a table: where the numbers of each row were printed."""
    rivals: tuple[str, ...] = ()
    """Of a table: printed lines of which its rows may mean any."""
    rows: tuple[int, int] = (0, 0)
    """Of a table: how many rows it shows, and of how many that were printed."""


class Formula(Struct, frozen=True):
    """A formula to typeset."""

    tex: str
    display: bool


class MathError(Struct, frozen=True):
    """Why a formula cannot be typeset; the position is in code points of its TeX, if known."""

    message: str
    position: int | None


Mathml: TypeAlias = Callable[[str, bool], str]
"""Typesets a formula, given whether on a line of its own; empty for one with an error."""


class CompileResult(Struct, frozen=True):
    """The result of compiling a piece of MJCF; `error` is empty if it compiled."""

    error: str
    line: int | None = None
    """Line of the error in the text that was compiled, from 1."""
    facts: ModelFacts | None = None
    timeout: bool = False
    """Whether there was no time to compile it, which `error` says as the end of a sentence."""
    includes: tuple[str, ...] = ()
    """Files that a text with an error includes, as `ModelFacts` has those of a right one."""


class ModelFacts(Struct, frozen=True):
    """Facts about a compiled model, for its page and for checking the names that labs use."""

    bodies: int
    """Without the world."""
    geoms: int
    joints: int
    nq: int
    nv: int
    nu: int
    timestep: float
    """s."""
    integrator: str
    total_mass: float
    """kg."""
    keyframes: tuple[str, ...]
    """Names; an unnamed one is empty."""
    sites: tuple[str, ...]
    body_names: tuple[str, ...]
    includes: tuple[str, ...] = ()
    """Files that the model includes, relative to the project root; absolute if outside."""
    sensors: tuple[str, ...] = ()
    sizes: Mapping[str, float] = {}
    """The size of a large difference, by the units of its coordinates: 1 rad for hinges and
    attitudes, the model's extent for slides and places, m."""


class TrialLine(Struct, frozen=True):
    """The result of a trial as a report lists it."""

    name: str  # unique in the course: `4.2-lab-1`
    title: str
    lesson: str  # id of its lesson or page
    status: str  # `ok`, `failed` or `untried`
    seconds: float = 0.0  # wall time
    steps_per_second: int | None = None
    """Of a simulation that ran to its end; else `None`."""
    tried: int = 0
    parity: str = ""
    """A comparison with native MuJoCo in words; empty where there was none."""
    cached: bool = False
    unexported: str = ""
    """Why its page offers no Python script, in words."""
    fill: float | None = None
    """The share of its picture that its motion fills; `None` where nothing could move."""
    play: str = ""
    """What Play alone moves, in words."""
    fallen: tuple[str, ...] = ()
    """What has fallen out of the scene, and to where."""
    clipped: tuple[str, ...] = ()
    """Which curves leave the part of a plot that its author has fixed, and how far."""
    untried: str = ""  # why it was not tried; empty if it was


class TrialResult(Struct, frozen=True):
    """The result of a trial, and what its page needs of it."""

    span: Span
    """The block that was tried, by which its page finds the result."""
    line: TrialLine
    output: Struct


class OutputFile(Struct, frozen=True):
    """A file of the site: its path there (POSIX, relative) and its bytes."""

    path: str
    data: bytes

    def make(self) -> bytes:
        """The bytes, as from `CachedFile`."""
        return self.data


class CachedFile(Struct, frozen=True):
    """A file of the site that is not made again if it was published under the same key."""

    path: str
    """In the site, POSIX."""
    key: str
    """A hash of all that its bytes depend on."""
    make: Callable[[], bytes]
    """Make its bytes; called at most once, and not at all if the published file is whole."""


SiteFile: TypeAlias = OutputFile | CachedFile
"""A file, made now or when it is asked for."""


class PublishedTrials(Struct, frozen=True):
    """The results of trials as a site needs them."""

    values: Mapping[str, Struct] = {}
    """The value that the page of a block shows, by the trial's name."""
    files: tuple[OutputFile, ...] = ()


class FileFacts(Struct, frozen=True):
    """An entry in a list of a site's files."""

    path: str
    """Its path in the site."""
    digest: str
    """SHA-256 of its bytes, in hexadecimal digits."""
    size: int
    """Bytes."""


class FileList(Struct, frozen=True):
    """A file of the site that is made from the facts about all others."""

    path: str
    key: str
    """A hash of all that its bytes depend on besides the other files."""
    make: Callable[[Iterable[FileFacts]], bytes]
    """Make its bytes; the other files come sorted by path."""


class Results(Struct, frozen=True):
    """All results of running a course."""

    runs: tuple[ScriptRun, ...]
    verdicts: tuple[Verdict, ...]
    formulas: tuple[tuple[Formula, str | MathError], ...]
    """Each distinct formula of the course, with its MathML or its error."""
    models: tuple[tuple[str, CompileResult], ...]
    engine: str
    """Version of MuJoCo that ran the scripts."""
    trials: tuple[TrialResult, ...] = ()
    downloads: tuple[ScriptDownload, ...] = ()


class Reports(Struct, frozen=True):
    """The recorded reports that fit the present state of a course, for the features that show them.

    What a report holds is between these features and the code that measures.
    """

    scenes: Mapping[str, Any] = field(default_factory=dict)
    """By the model's name, as `diets` and `engines`."""
    diets: Mapping[str, Any] = field(default_factory=dict)
    cases: tuple[Any, ...] = ()
    """Of hard cases, which belong to no model."""
    engines: Mapping[str, Any] = field(default_factory=dict)


class Machine(Struct, frozen=True, forbid_unknown_fields=True):
    """The machine of a measurement; times mean nothing without it."""

    engine: str
    """Version of MuJoCo."""
    python: str
    numpy: str
    system: str
    """Operating system and kind of processor, such as `Linux x86_64`."""
    cpu: str
    """The processor's own name; empty where it has none."""
    governor: str = ""
    """The rule by which the system sets the processor's clock; empty where not known."""
    processors: int = 0
    """The number of usable processors; 0 where that was not recorded."""
    pinned: bool = False
    """Whether times were taken on a single one of them."""

    @property
    def hardware(self) -> str:
        parts = [self.system, self.cpu]
        if self.processors:
            many = f"{self.processors} processor{'s' if self.processors > 1 else ''}"
            parts.append(f"pinned to one of {many}" if self.pinned else many)
            parts.append(f"clock governor {self.governor or 'unknown'}")
        return ", ".join(filter(None, parts))
