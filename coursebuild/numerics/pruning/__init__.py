"""Model pruning: what a model holds that its scenarios do not need (`coursebuild diet`).

Entry points: `ablation.survey(order)`, of a `model_text.ModelText`; `compare.pruning_scenes` are
its scenarios.

`markup`, `edits`: MJCF as text with places, and changes of it. `unused`, `dynamics`, `scenery`:
what could be left out, with `readers`, who looks at it, and `reachability`, where geoms can get.
`index_map`, `compare`, `trials`: how the model does without it.
"""
