"""Every routine says of every argument what shape and what numbers it wants."""

import inspect
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mjcourse import spatial
from support.fixture_cases import check_lines
from support.run_code import run_code

SHAPES: dict[tuple[int, ...], str] = {
    (): "angle dt half_length mass radius t",
    (3,): "angles angvel axis com half_sizes moments offset pos pos1 pos2 rotvec semi_axes vector",
    (4,): "a b quat",
    (6,): "force motion velocity",
    (3, 3): "inertia mat rot rot1 rot2",
    (6, 6): "spatial",
}
SHAPE_OF = {name: shape for shape, names in SHAPES.items() for name in names.split()}
SIGNATURES = {
    name: {
        argument: SHAPE_OF[argument]
        for argument in inspect.signature(getattr(spatial, name)).parameters
        if argument not in ("seq", "rtol")
    }
    for name in spatial.__all__
    if name != "compose_inertia"  # whose leading axes are not all alike; it has tests of its own
}
ARGUMENTS = [
    (name, argument, core)
    for name, shapes_by_name in SIGNATURES.items()
    for argument, core in shapes_by_name.items()
]


def routine(name: str) -> Callable[..., object]:
    function = getattr(spatial, name)
    assert callable(function)
    return function


def valid(shape: tuple[int, ...], lead: tuple[int, ...] = ()) -> np.ndarray:
    entry = np.eye(shape[0]) if len(shape) == 2 else np.ones(shape)
    return np.broadcast_to(entry, (*lead, *shape))


def shape_text(shape: tuple[int, ...]) -> str:
    return f"({', '.join(('...', *map(str, shape)))})"


def answer(name: str, **replacements: object) -> str:
    """What a routine says to arguments that are valid but for those that are given."""
    arguments = {key: valid(shape) for key, shape in SIGNATURES[name].items()}
    try:
        routine(name)(**{**arguments, **replacements})
    except (TypeError, ValueError) as error:
        return f"{type(error).__name__}: {error}"
    return "nothing"


def test_values_that_a_routine_cannot_take_are_named(rewriting: bool) -> None:
    scope = {**vars(np), **vars(spatial)}

    def convert(call: str) -> list[str]:
        with pytest.raises(ValueError) as caught:
            eval(call, scope)
        return [str(caught.value)]

    check_lines(Path(__file__).with_name("errors.md"), convert, rewriting=rewriting)


def test_a_bad_shape_says_what_was_expected_and_what_came() -> None:
    mismatches = []
    for name, argument, core in ARGUMENTS:
        if not core:
            continue
        for shape in ((), (5,), (2, *core[:-1], core[-1] + 1), core[1:], (0,)):
            message = answer(name, **{argument: np.ones(shape)})
            if message != f"ValueError: {argument} must have shape {shape_text(core)}, got {shape}":
                mismatches.append((name, argument, shape, message))
    assert mismatches == []


def test_what_is_no_number_is_an_error() -> None:
    mismatches = []
    for name, argument, core in ARGUMENTS:
        for value, dtype in ((1j, "complex128"), (None, "object"), ("1", "<U1")):
            message = answer(name, **{argument: np.full(core, value)})
            if message != f"TypeError: {argument} must hold real numbers, got dtype {dtype}":
                mismatches.append((name, argument, value, message))
    assert mismatches == []


def test_a_ragged_sequence_is_an_error() -> None:
    mismatches = []
    for name, argument, core in ARGUMENTS:
        message = answer(name, **{argument: [[1.0, 2.0], [3.0]]})
        expected = f"{argument} must have shape {shape_text(core)}, got a ragged sequence"
        if message != f"ValueError: {expected}":
            mismatches.append((name, argument, message))
    assert mismatches == []


def test_leading_shapes_that_do_not_broadcast_are_named() -> None:
    mismatches = []
    for name, shapes_by_name in SIGNATURES.items():
        if len(shapes_by_name) == 1:
            continue
        leads = [(2,), (3,), (1,), (1,)][: len(shapes_by_name)]
        parts = zip(shapes_by_name.items(), leads, strict=True)
        message = answer(name, **{key: valid(shape, lead) for (key, shape), lead in parts})
        shapes = ", ".join(f"{key} {lead}" for key, lead in zip(shapes_by_name, leads, strict=True))
        if name == "transform_spatial_inertia":
            shapes = "spatial (2,), pose (3,)"  # rot and pos were taken together before
        if message != f"ValueError: leading shapes do not broadcast: {shapes}":
            mismatches.append((name, message))
    assert mismatches == []


def parts(result: object) -> tuple[object, ...]:
    return result if isinstance(result, tuple) else (result,)


def test_an_empty_batch_gives_an_empty_one() -> None:
    for name, shapes_by_name in SIGNATURES.items():
        first, *_ = parts(routine(name)(*(valid(shape, (0,)) for shape in shapes_by_name.values())))
        assert isinstance(first, np.ndarray), name
        assert first.shape[0] == 0, name


def test_lists_and_other_dtypes_are_taken_as_doubles() -> None:
    mismatches = []
    for name, shapes_by_name in SIGNATURES.items():
        arguments = [valid(shape) for shape in shapes_by_name.values()]
        double = parts(routine(name)(*arguments))
        for kind, converted in (
            ("lists", [argument.tolist() for argument in arguments]),
            ("float32", [argument.astype(np.float32) for argument in arguments]),
            ("int8", [argument.astype(np.int8) for argument in arguments]),
        ):
            for a, b in zip(double, parts(routine(name)(*converted)), strict=True):
                alike = np.array_equal(np.asarray(a), np.asarray(b))
                if not alike or np.asarray(a).dtype != np.asarray(b).dtype:
                    mismatches.append((name, kind, a, b))
    assert mismatches == []


def test_arguments_are_neither_changed_nor_returned() -> None:
    for name, shapes_by_name in SIGNATURES.items():
        arguments = [np.array(valid(shape)) for shape in shapes_by_name.values()]
        for argument in arguments:
            argument.setflags(write=False)
        for part in parts(routine(name)(*arguments)):
            assert not any(np.shares_memory(part, argument) for argument in arguments), name
            if isinstance(part, np.ndarray):
                assert part.flags.writeable, name
                assert part.ndim > 0, name


@pytest.mark.site
def test_importing_mjcourse_loads_numpy_and_nothing_else_that_is_installed() -> None:
    code = (
        "import sys; before = set(sys.modules)\n"
        "import mjcourse, mjcourse.spatial\n"
        "names = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(names - sys.stdlib_module_names))"
    )
    process = run_code(code, PYTHONWARNINGS="error")
    assert process.returncode == 0, process.stderr
    # NumPy registers some of its compiled modules under top-level names of its own.
    modules = [name for name in process.stdout.split() if not name.startswith("_")]
    assert modules == ["mjcourse", "numpy"]
