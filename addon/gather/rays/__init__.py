"""Rays that gather radiance at receivers, in gloss that a camera sees, and at probes."""
