"""The file beside a model, models/NAME.toml: its scenarios, and the findings of `diet` to keep.

What depends on the compiled model is checked in `core/checks/compiled`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from msgspec import Struct
from msgspec.structs import asdict

from coursebuild.core.model.scenarios import (
    BenchTable,
    Declarations,
    DeclaredScenario,
    DeclaredSweep,
    Keep,
    KeepTable,
    ScenarioTable,
    SweepTable,
    Variation,
    is_multiple,
)
from coursebuild.core.syntax.decode import Decoding, check_unique, decode
from coursebuild.core.syntax.nodes import TOML
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Parsed,
    diagnose,
    did_you_mean,
    sort_diagnostics,
)
from coursebuild.core.text.source import Source

MOST_SAMPLES = 100_000
MOST_VALUES = 100
"""The most values of a sweep, those of all parameters together."""
_TOLERANCE = 1e-9
"""A relative tolerance, as decimal fractions are not exact."""


class ModelFile(Struct, frozen=True, forbid_unknown_fields=True):
    """What is measured on a model, and which findings of the diet are wanted."""

    bench: BenchTable | None = None
    scenario: tuple[ScenarioTable, ...] = ()
    sweep: tuple[SweepTable, ...] = ()
    keep: tuple[KeepTable, ...] = ()


# ----------------------------------------------------------------------------------------- reading


def parse_declarations(source: Source) -> Parsed[Declarations | None]:
    """The declarations of the file; no value if they cannot be used. Never raises."""
    parsed_toml = parse_toml(source, rule="toml-syntax")
    root = parsed_toml.value
    if root is None:
        return Parsed(None, sort_diagnostics(parsed_toml.diagnostics))
    decoding = decode(root, ModelFile, "the file", TOML)
    diagnostics = [
        *parsed_toml.diagnostics,
        *decoding.diagnostics,
        *_check_scenarios(decoding),
        *_check_sweeps(decoding),
        *(
            diagnose("field-value", node.mark, "numbers of outputs are not bound in this file")
            for node, _ in decoding.texts
        ),
    ]
    for table, field, message in (
        (ScenarioTable, "name", "two scenarios have the name `{}`"),
        (SweepTable, "name", "two sweeps have the name `{}`"),
        (KeepTable, "finding", "the finding `{}` is kept twice"),
    ):
        structs = decoding.find_structs(table)
        names = [(getattr(struct, field), node.place(field)) for node, struct in structs]
        diagnostics += check_unique(names, "field-value", message)
    if diagnostics or decoding.value is None:
        return Parsed(None, sort_diagnostics(diagnostics))
    fields = decoding.value
    scenarios = []
    for node, scenario in zip(root.objects("scenario"), fields.scenario, strict=True):
        places = tuple((name, member.value.mark) for name, member in node.members.items())
        scenarios.append(DeclaredScenario(**asdict(scenario), span=node.mark, places=places))
    sweeps = []
    for node, sweep in zip(root.objects("sweep"), fields.sweep, strict=True):
        members, variations = node.object("vary").members, []
        for name, values in sweep.vary.items():
            relative = isinstance(values, str)
            if isinstance(values, str):
                share = float(values.strip("± %")) / 100
                values = (1 - share, 1 + share)
            span = members[name].key.mark
            variations.append(Variation(name, values, relative=relative, span=span))
        sweeps.append(DeclaredSweep(**asdict(sweep), variations=tuple(variations)))
    keeps = zip(root.objects("keep"), fields.keep, strict=True)
    declarations = Declarations(
        model=source.path.removeprefix("models/").removesuffix(".toml"),
        source=source,
        scenarios=tuple(scenarios),
        keep=tuple(
            Keep(**asdict(table), finding_span=node.place("finding")) for node, table in keeps
        ),
        bench=fields.bench or BenchTable(),
        sweeps=tuple(sweeps),
    )
    return Parsed(declarations, ())


# ---------------------------------------------------------------------------------------- checks


def _check_sweeps(decoding: Decoding[ModelFile]) -> Iterator[Diagnostic]:
    names = [table.name for _, table in decoding.find_structs(ScenarioTable)]
    for node, table in decoding.find_structs(SweepTable):
        if table.scenario is not None and table.scenario not in names:
            message = f"no scenario is called `{table.scenario}`"
            help = did_you_mean(table.scenario, names)
            yield diagnose("field-value", node.place("scenario"), message, help=help)
        count = sum(2 if isinstance(values, str) else len(values) for values in table.vary.values())
        if count > MOST_VALUES:
            message, help = f"the sweep has {count} values", f"{MOST_VALUES} are the most"
            yield diagnose("field-value", node.place("vary"), message, help=help)


def _check_scenarios(decoding: Decoding[ModelFile]) -> Iterator[Diagnostic]:
    for node, table in decoding.find_structs(ScenarioTable):
        sample, hold, duration = table.sample, table.hold, table.duration
        for name, length in (("duration", duration), ("hold", hold)):
            if sample is not None and length is not None and not is_multiple(length, sample):
                message = f"`{name}` ({length:g} s) is not a multiple of `sample` ({sample:g} s)"
                help = "the state is looked at in even steps, and a command changes at such a look"
                yield diagnose("field-value", node.place(name), message, help=help)
        most_samples = MOST_SAMPLES * (1 + _TOLERANCE)
        if sample is not None and duration is not None and duration / sample > most_samples:
            message = f"`sample` makes {duration / sample:.3g} looks at the state"
            help = f"{MOST_SAMPLES} are the most: look less often"
            yield diagnose("field-value", node.place("sample"), message, help=help)
        spans = [item.mark for item in node.items("timesteps")]
        pairs = list(zip(table.timesteps, spans, strict=True))
        # `sample` divides the others.
        times = [(hold, "hold"), (duration, "duration")] if sample is None else [(sample, "sample")]
        lengths = [(length, name) for length, name in times if length is not None]
        for (length, name), (step, span) in itertools.product(lengths, pairs):
            if not is_multiple(length, step):
                message = f"the timestep {step:g} s does not divide `{name}` ({length:g} s)"
                help = "every timestep must end at the same times, or errors cannot be compared"
                yield diagnose("field-value", span, message, help=help)
        yield from check_unique(pairs, "field-value", "the timestep {} s is named twice")
        if hold is not None and not (table.controls or table.poses):
            help = "`controls` are the commands, each held for so long"
            yield diagnose("field-missing", node.place("hold"), "`controls` is missing", help=help)
        if len(table.controls) > 1 and hold is None:
            help = "`hold`: seconds for which each command holds"
            yield diagnose("field-missing", node.mark, "`hold` is missing", help=help)
        for item, row in zip(node.items("controls"), table.controls, strict=True):
            first = len(table.controls[0])
            if len(row) != first:
                message = f"this command has {len(row)} numbers, and the first one has {first}"
                help = "give one number for every actuator"
                yield diagnose("field-value", item.mark, message, help=help)
