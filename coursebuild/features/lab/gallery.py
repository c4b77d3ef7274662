"""The lab of each model, for its page and the gallery: the first in a text, or one made for it.

Entry points: `gallery_labs(course)`, the labs made for models that no text shows; `model_view`,
`draw_model`, what the page of a model shows; `model_picture`.
"""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.features import Picture
from coursebuild.core.model import Course, Document, FeatureBlock, MjcfModel, find_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import BY_LAB, Library
from coursebuild.core.pages.renderer import Renderer
from coursebuild.features.lab.files import PublishedLab
from coursebuild.features.lab.model import SIMLAB, START, Lab
from coursebuild.features.lab.page import LabView, lab_picture, lab_view
from coursebuild.features.lab.schema import Overlay, SimLab

_TOGGLES: tuple[Overlay, ...] = ("frames", "com", "inertia", "joints", "axis")


def gallery_labs(course: Course) -> Iterator[tuple[MjcfModel, Lab]]:
    """Make a lab for each model that no lab of a text shows."""
    models_in_texts = {name for document in course.documents for name in _labs_by_model(document)}
    for model in course.models:
        if model.name not in models_in_texts:
            yield model, _gallery_lab(model)


def _labs_by_model(document: Document) -> dict[str, Lab]:
    """Map models to their first labs; those in questions are left out, as in summaries."""
    labs: dict[str, Lab] = {}
    blocks = [*find_blocks(document, FeatureBlock)]
    outer_spans = [block.span for block in blocks if not isinstance(block, Lab)]
    for lab in blocks:
        if isinstance(lab, Lab) and not any(span.contains(lab.span) for span in outer_spans):
            for name in lab.models():
                labs.setdefault(name, lab)
    return labs


def _gallery_lab(model: MjcfModel) -> Lab:
    """Make a lab in which a model starts from its first keyframe and is left to itself."""
    place = model.source.span(0, 0)
    fields = SimLab(model=model.name, title=model.name, toggles=_TOGGLES, setup=START)
    return Lab(place, SIMLAB, place, "", fields)


def _find_lab(library: Library, model: MjcfModel) -> tuple[Lab, PublishedLab | None]:
    documents = (use.owner.document for use in library.uses[model.name] if BY_LAB in use.ways)
    labs = (_labs_by_model(document).get(model.name) for document in documents if document)
    lab = next(filter(None, labs), None) or _gallery_lab(model)
    publication = library.trial_value(lab)
    return lab, publication if isinstance(publication, PublishedLab) else None


def model_view(library: Library, place: urls.Place, model: MjcfModel) -> LabView | None:
    """What the page of a model shows; `None` if the trial recorded nothing."""
    lab, publication = _find_lab(library, model)
    if publication is None or publication.record is None:
        return None
    view = lab_view(library.words, place, lab, publication, library.results.engine)
    return replace(view, model_href=place.href(place.path))


def draw_model(renderer: Renderer, view: LabView) -> Markup:
    """Draw the lab on the page of its model."""
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
    """Return the picture of a model's lab."""
    return lab_picture(*_find_lab(library, model))
