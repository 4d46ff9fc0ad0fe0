"""Volume caustics: light that media scatter to a camera after lamps sent it over mirrors and through glass.

No ray from the camera finds such a lamp, so photons bring it (Jensen and Christensen 1998). Between two surfaces each
leaves points where media scatter it, be it there or not that it is scattered on its way. The camera sees these points
one by one, blurred over pixels as their density says, so that with more photons the picture converges.
"""
