"""Microfacets: how each distribution spreads, masks and samples their normals, and what a facet reflects.

`ggx`, `beckmann` and `ashikhmin_shirley` are distributions; `microfacets`, a rank above, says which of them a closure
means. `metal` has the curves of metals, `thin_film` the interference in a film on a facet of anything.
"""
