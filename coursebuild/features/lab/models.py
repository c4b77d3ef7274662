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
    """Return a lab's model; `None` if it does not compile, which is reported already."""
    if lab.xml is not None:
        return Source("models/.lab.xml", lab.xml.text)
    compilation = context.models.get(name := lab.fields.model or "")
    return model_of_course(context, name) if compilation and compilation.facts else None


def model_of_course(context: TrialContext, name: str) -> Source | None:
    """Return the model of the course with this name, or `None`."""
    return next((m.source for m in context.course.models if m.name == name), None)


def saved_model(context: TrialContext, native: NativeEngine, model: Source) -> bytes:
    """Return a model as an MJB file; from the store if nothing in it has changed."""
    store, key = context.memory.store, model_key(context.root, model.path, model.text)
    mjb = store.get("mjb", key, bytes)
    if mjb is None:
        mjb = native.save(model.path, model.text)
        if model_key(context.root, model.path, model.text) == key:  # it was not edited meanwhile
            store.put("mjb", key, mjb)
    return mjb
