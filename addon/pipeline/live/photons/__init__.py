"""Light of lamps over smooth gloss and through glass: photons whose paths are kept, and traced anew where they change.

After Larsen and Christensen, "Simulating Photon Mapping for Real-time Applications" (2004), section 2.
"""
