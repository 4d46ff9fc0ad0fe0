"""Subsurface scattering: light that enters a body, walks through it at random, and leaves it elsewhere.

Cycles' model. Where a view from ωo meets the surface at x, light goes on into the body in a direction ω₀ of the density
p(ω₀ | ωo) (`interface`), is scattered and absorbed in it as in a medium (`medium`, `bsdf.phase`), and leaves it where
it meets the surface again, at y. There the light is taken as a white Lambertian surface would: with the weight W of
the walk,

    L(x, ωo) = E[W E(y)] / π.

**Light's way.** For photons the same is read backwards. The transport T inside of a medium is reciprocal,
T(x, ω₀ → y, ω₁) = T(y, −ω₁ → x, −ω₀), where a walk's density is T by the projected solid angles at both ends. A photon
that meets the surface at y is one of E(y): it enters by the cosine, which is the view's white Lambertian exit, walks,
and leaves at x from −ω₀ with the density p(ω₀ | ωo) cos θo / cos θ₀ by solid angle, whatever that integrates to
(`interface.leave`). What is stored of it is stored at y, where it entered, as on any surface: there its power is part
of E(y). What leaves at x is light on its way to other surfaces. So nothing counts twice.

**Gather rays** that end on a body walk from there, and take E(y)/π of the side of the surface element that the walk
comes out of: its direct light by lamps, and the rest by photons or by what it gathered (`RadianceCache.arriving`).

**Receivers** on a body are viewed along their normal, and what they receive is E[W E(y)] over the colour A: each of
their gather rays starts where a walk from below the receiver leaves the body (`gather.on_bodies`).

**Normals** of a closure's own bend the way of views in, and with a diffuse closure's cosine and shadowing the light at
y, as Cycles has it: turned as those of gloss are, there by the direction ω₁ in which the walk comes out. Photons take
both backwards: what comes to y counts by the normal there, and at x p(ω₀ | ωo) is around the normal of x, with the
cosines to the geometric one. What a cache keeps of E(y) is the mean over four ω₁.
"""
