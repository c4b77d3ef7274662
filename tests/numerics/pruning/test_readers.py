"""Who reads a model, and what of it."""

from __future__ import annotations

import pytest

from coursebuild.numerics.pruning.readers import Reader, Readers, readers_of


def of(*texts: str) -> Readers:
    return Readers(tuple(Reader(f"{i}.md", text) for i, text in enumerate(texts)))


@pytest.mark.parametrize(
    "text",
    [
        'model_path("arm")',
        "A lesson on the arm.",
        '{"model": "robots/arm", "title": "…"}',
        'for name in ("a", "b"): model_path(f"models/{name}.xml")',
        "for path in Path('models').glob('*.xml'): pass",
        "model_path('models/' + kind + '.xml')",
    ],
)
def test_a_text_that_names_a_model_or_builds_its_path_may_use_it(text: str) -> None:
    assert readers_of("robots/arm", [Reader("a.md", text)]).files


@pytest.mark.parametrize("text", ["model_path('army')", "alarm", "f'{name}.xml'", "charm arms"])
def test_a_text_with_other_words_only_does_not_use_the_model(text: str) -> None:
    assert not readers_of("robots/arm", [Reader("a.md", text)]).files


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("sensor", "data.sensordata"),
        ("sensor", "data.sensor(name)"),
        ("sensor", "data.sensor( i )"),
        ("actuator", "data.ctrl[:]"),
        ("actuator", "model.actuator(0)"),
        ("keyframe", 'lab {"key": 1}'),
        ("keyframe-number", "mj_resetDataKeyframe(model, data, 2)"),
        ("site", "data.site_xpos"),
        ("energy", "lib.energy().kinetic"),
        ("shape", "model.geom_size[0] = 2"),
        ("material", "model.mat(i)"),
        ("tendon", "data.ten_length"),
        ("number", "data.qpos[3:]"),
        ("number", "qpos = initial"),
        ("body-number", "data.xpos[2]"),
    ],
)
def test_what_counts_things_or_takes_them_all_reads_the_whole_kind(what: str, text: str) -> None:
    assert of("nothing", text).whole(what) == "1.md"


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("sensor", 'data.sensor("gyro")'),
        ("sensor", "a sensor, somewhere"),
        ("actuator", "menu, manual"),
        ("keyframe", 'lab {"key": "up"}'),
        ("keyframe-number", 'mj_resetDataKeyframe(model, data, model.key("up").id)'),
        ("site", 'data.site("tip")'),
        ("site", "opposite(x)"),
        ("material", "format(i)"),
        ("number", 'data.joint("pivot").qpos[0] + data.body("arm").xpos'),
    ],
)
def test_what_asks_for_one_thing_by_name_does_not_read_the_whole_kind(what: str, text: str) -> None:
    assert of(text).whole(what) == ""


def test_names_are_found_as_whole_words() -> None:
    readers = of('data.sensor("gyro-2")', "the Kügelchen; a.b")
    assert readers.named("gyro-2") == "0.md" and readers.named("Kügelchen") == "1.md"
    assert readers.named("a.b") and not readers.named("a+b") and not readers.named("")
    assert not readers.named("gyr") and not readers.named("Kügel")
    assert readers.reads("sensor", "gyro-2") and not readers.reads("sensor", "touch")
