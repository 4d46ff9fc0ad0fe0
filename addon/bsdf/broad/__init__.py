"""Lobes that scatter widely but not as Lambert has it, and layers that only absorb.

A lobe is a file: `rough_diffuse`, `sheen`, `velvet`, `toon`. `absorbing` scatters nothing, it tints what it covers.
`lobes` says which file a kind of closure means.
"""
