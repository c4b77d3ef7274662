"""Labs of models, for their pages and the gallery: the first that shows a model, or one of its own.

Entry points: `own_labs(course)`, those that no text has; `model_view`, `draw_model`, what the page
of a model shows; `model_picture`.
"""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.features import Picture
from coursebuild.core.model import Course, Document, FeatureBlock, MjcfModel, document_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import BY_LAB, Library
from coursebuild.core.pages.renderer import Renderer
from coursebuild.features.lab.files import ShownLab
from coursebuild.features.lab.model import SIMLAB, START, Lab
from coursebuild.features.lab.page import LabView, lab_picture, lab_view
from coursebuild.features.lab.schema import Overlay, SimLab

_TOGGLES: tuple[Overlay, ...] = ("frames", "com", "inertia", "joints", "axis")


def own_labs(course: Course) -> Iterator[tuple[MjcfModel, Lab]]:
    """A lab for each model that no lab of a text shows."""
    shown = {name for document in course.documents for name in _labs_by_model(document)}
    for model in course.models:
        if model.name not in shown:
            yield model, _own_lab(model)


def _labs_by_model(document: Document) -> dict[str, Lab]:
    """The first lab of each model; those in questions are left out, as summaries leave them out."""
    found: dict[str, Lab] = {}
    blocks = [block for block in document_blocks(document) if isinstance(block, FeatureBlock)]
    others = [block.span for block in blocks if not isinstance(block, Lab)]
    for lab in blocks:
        if isinstance(lab, Lab) and not any(span.contains(lab.span) for span in others):
            for name in lab.models():
                found.setdefault(name, lab)
    return found


def _own_lab(model: MjcfModel) -> Lab:
    """A model that starts from its first keyframe and is left to itself."""
    place = model.source.span(0, 0)
    fields = SimLab(model=model.name, title=model.name, toggles=_TOGGLES, setup=START)
    return Lab(place, SIMLAB, place, "", fields)


def _find(library: Library, model: MjcfModel) -> tuple[Lab, ShownLab | None]:
    documents = (use.owner.document for use in library.uses[model.name] if BY_LAB in use.ways)
    labs = (_labs_by_model(one).get(model.name) for one in documents if one is not None)
    lab = next(filter(None, labs), None) or _own_lab(model)
    shown = library.trial_values.get((lab.span.path, lab.span.start))
    return lab, shown if isinstance(shown, ShownLab) else None


def model_view(library: Library, place: urls.Place, model: MjcfModel) -> LabView | None:
    """What the page of a model shows; `None` where nothing came of its trial."""
    lab, shown = _find(library, model)
    if shown is None or shown.record is None:
        return None
    view = lab_view(library.words, place, lab, shown, library.results.engine)
    return replace(view, model_href=place.href(place.path))


def draw_model(renderer: Renderer, view: LabView) -> Markup:
    """The lab on the page of its model."""
    return renderer.render(
        "lab/lab.html",
        lab=view,
        docked=False,
        opens_page=True,
        address="",
        source="",
        note="",
        goal="",
    )


def model_picture(library: Library, model: MjcfModel) -> Picture | None:
    """The picture of a model's lab."""
    return lab_picture(*_find(library, model))
