"""Labs for tests: makes a `Lab` from JSON, its request, and the engine's reply."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from coursebuild.core.features import TrialContext, TrialOutcome
from coursebuild.core.model import Course, find_blocks
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run.run_store import RunStore
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.features.lab.compile import compile_lab
from coursebuild.features.lab.model import Lab, lab_trials
from coursebuild.features.lab.trial import Engines, LabTrials
from coursebuild.pipeline.options import Options

BALL = (
    "<mujoco><worldbody><body name='ball'><freejoint/><geom name='g' size='.1'/>"
    "<site name='tip' pos='.1 0 0'/></body></worldbody></mujoco>"
)


def make_lab(text: str | None = None, /, **fields: Any) -> Lab:
    """The lab of a fence with this JSON, which starts on the third line of a lesson."""
    body = text if text is not None else json.dumps({"xml": BALL, **fields}, ensure_ascii=False)
    return lab_of(f"Text.\n\n```lab simlab\n{body}\n```\n")


def lab_of(text: str) -> Lab:
    source = Source("content/lessons/4.2-x.md", text)
    result = parse_document(source, frozenset(), lesson=True)
    assert result.diagnostics == (), [d.message for d in result.diagnostics]
    (lab,) = find_blocks(result.value, Lab)
    return lab


def request(lab: Lab) -> dict[str, Any]:
    module = compile_lab(lab, "4.2-lab-1")
    return {"config": module.config, "code": module.literal, "seconds": lab.verify.seconds}


def try_labs(
    course: Course,
    options: Options,
    engines: Engines,
    models: Mapping[str, CompileResult] | None = None,
    diagnostics: Sequence[Diagnostic] = (),
    documents: frozenset[str] | None = None,
    seconds: float | None = None,
) -> TrialOutcome:
    """Run the trials of a course's labs, or of those in some documents, without static forms."""
    run_store = RunStore(options.root, options.store)
    context = TrialContext(options.root, course, models or {}, run_store, diagnostics)
    trials = [t for t in lab_trials(course) if documents is None or t.block.span.path in documents]
    return LabTrials(context, engines, seconds).run(trials)


class Bench(Engines):
    """Both engines, with methods that send the requests for a lab."""

    def trial(self, lab: Lab, seconds: float = 30.0) -> dict[str, Any]:
        return self.browser.trial(request(lab), self.save_model(lab), seconds)

    def parity(self, lab: Lab) -> dict[str, Any]:
        """Compare the main run of a lab in both engines."""
        reply, mjb = self.trial(lab), self.save_model(lab)
        assert not reply["failures"], reply["failures"]
        run = reply["main"]["parity"]
        horizon = max(1, round(1.0 / reply["main"]["timestep"]))
        return {**self.native.parity(mjb, run, horizon), "run": run, "mjb": mjb}

    def save_model(self, lab: Lab) -> bytes:
        assert lab.xml is not None
        return self.native.save("models/x.xml", lab.xml.text)


class OpenEngines(Engines):
    """Both engines of labs, which stay open for the next course."""

    def __exit__(self, *_: object) -> None:
        """Keep the engines open."""

    def close(self) -> None:
        super().__exit__()
