"""Model pruning: what a model holds that its scenarios do not need (`coursebuild diet`).

Entry points: `survey.Surveyor`, for a `model_text.ModelText`; `comparison.pruning_scenes` are its
scenarios.

`xml_edits`: MJCF as text with places, and changes of it. `candidates`: what could be left out, with
`bystanders`, and `reachability`, where geoms can get. `readers`: by what code could tell.
`comparison`, `trials`: how the model does without it.
"""
