"""The models of labs, compiled natively and saved as browsers load them.

Entry points: `model_of_lab`, `model_of_course`, `saved_model`.
"""

from __future__ import annotations

from coursebuild.core.features import TrialContext
from coursebuild.core.run.model_memory import model_key
from coursebuild.core.text.source import Source
from coursebuild.features.lab.engines.native import NativeEngine
from coursebuild.features.lab.model import Lab


def model_of_lab(context: TrialContext, lab: Lab) -> Source | None:
    """A lab's model; `None` for one that does not compile, as is told already."""
    if lab.xml is not None:
        return Source("models/.lab.xml", lab.xml.text)
    compiled = context.models.get(name := lab.fields.model or "")
    return model_of_course(context, name) if compiled and compiled.facts else None


def model_of_course(context: TrialContext, name: str) -> Source | None:
    """A model of the course; `None` where there is none of this name."""
    return next((m.source for m in context.course.models if m.name == name), None)


def saved_model(context: TrialContext, native: NativeEngine, model: Source) -> bytes:
    """A model as an MJB file, from the store where nothing that it is made of has changed."""
    store, key = context.memory.store, model_key(context.root, model.path, model.text)
    saved = store.get("mjb", key, bytes)
    if saved is None:
        saved = native.save(model.path, model.text)
        if model_key(context.root, model.path, model.text) == key:  # it was not edited meanwhile
            store.put("mjb", key, saved)
    return saved
