"""Model pruning: what a model holds that its scenarios do not need (`coursebuild diet`).

`xml_edits`: MJCF as text with places, and changes of it. `candidates`: what could be left out, with
`bystanders`, and `reachability`, where geoms can get. `readers`: by what code could tell.
`comparison`, `trials`: how the model does without it.
"""
