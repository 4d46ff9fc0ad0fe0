"""How light passes media: how far rays fly inside of each, what is left of their light, and where it is scattered.

Each medium is a volume: the inside of an object's triangles with its material, or all space. A ray is inside of a mesh
from where it enters it by a front face to where it leaves it by a back face; if it leaves first, it started inside.
That asks nothing but the ray, so that receivers, lamps and cameras may be anywhere. Volumes that overlap add up.
Where their density differs from place to place, lengths are weighted by it, and called masses.
"""
