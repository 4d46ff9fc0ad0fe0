"""Lambertian lobes: the same radiance in every direction, of the side that light came to or of the other."""
