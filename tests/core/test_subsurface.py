"""Subsurface scattering: its phase function, its medium, how light enters and leaves it, and walks through bodies."""

import numpy as np
import pytest
from photon_bake.addon.bsdf.phase import sampling as phase
from photon_bake.addon.bsdf.subsurface import interface, medium
from photon_bake.addon.core.sampling.warps import cosine_hemisphere
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import Channel, Closures, LightKind, Lobe, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.bodies import opaque, without_thick_bodies
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.bsdf_points import N, compiled, numbers
from photon_bake.tests.core.scenes import (
    ball,
    box,
    chi_square_of_directions,
    grid_on_walls,
    lamp,
    merge,
    of_objects,
    receivers_at,
    scene_of,
)

POWER, RHO = 24.0, 0.5
Z = np.float32([0, 0, 1])


def wax(color, path, g=0.0, ior=1.01, roughness=0.5, spread=0.0, fitted=0.0):
    """Material 0 is a matte wall of albedo `RHO`, material 1 a body of a colour and a mean free path, m."""

    def channel(wall, body):
        return Channel.constant(np.float32([np.broadcast_to(wall, 3), np.broadcast_to(body, 3)]))

    closures = Closures.of(
        np.array([0, 1, 2]),
        np.array([Lobe.DIFFUSE, Lobe.SUBSURFACE]),
        weight=channel(RHO, color),
        f0=channel(1, color),
        f90=channel(1, path),
        roughness=channel(1, roughness),
        edge=channel(1, (g, spread, fitted)),
        ior=np.float32([0, ior]),
    )
    return Materials.of(2, closures=closures)


def body_in_room(materials, body, at=(0.1, 0.2, 0.3)):
    """A room with a point lamp, and in it a body that is one object."""
    inside = merge(box(), body)
    n = len(inside[1])
    light = lamp(LightKind.POINT, POWER / (4 * np.pi), position=at)
    scene = scene_of(*inside, albedo=[RHO, RHO], material=[0] * 12 + [1] * (n - 12), lights=light)
    object.__setattr__(scene, "materials", materials)
    return of_objects(scene, np.minimum(np.arange(n), 12))


def moved(mesh, by):
    return mesh[0] + np.float32(by), mesh[1]


def light_on_walls(materials, body, **settings):
    scene = body_in_room(materials, body)
    chosen = {"n_photons": 200_000, "n_cache_elements": 5_000, "add_direct": True, "max_bounces": 400} | settings
    return bake(scene, grid_on_walls(), settings_for("draft", **chosen), EmbreeTracer(scene)).value


@compiled
def _phases(direction, g, u, out):
    for i in range(len(u)):
        put(out, i, phase.sample(row(direction, 0), g, u[i, 0], u[i, 1]))


def henyey_greenstein(cos, g):
    """P at a cosine between the directions before and after, 1/sr."""
    return (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cos) ** 1.5)


@pytest.mark.parametrize("g", [-0.7, 0.0, 0.3, 0.9])
def test_phase_function(g):
    out = np.empty((N, 3), np.float32)
    _phases(Z[None], np.float32(g), numbers(), out)
    assert chi_square_of_directions(out, lambda z: henyey_greenstein(z, g)) > 1e-4
    assert out[:, 2].mean() == pytest.approx(g, abs=0.01)


@compiled
def _interface(ior, alpha, spread, u, inside, back):
    """Where views by the cosine enter, and the weights by which light that comes by the cosine leaves."""
    one = np.float32(1)
    white = one, one, one
    of = medium.Medium(white, white, np.float32(0), white, alpha, ior, spread)
    for i in range(len(u)):
        w = cosine_hemisphere(u[i, 0], u[i, 1])
        put(inside, i, interface.enter(of, w, u[i, 2], u[i, 3], u[i, 4]).direction)
        back[i] = interface.leave(of, w, u[i, 2], u[i, 3], u[i, 4]).weight


@pytest.mark.parametrize(("ior", "roughness", "spread"), [(1.5, 0, 0), (1.5, 0.25, 0), (1.3, 0.1, 0.5), (1.01, 1, 0)])
def test_light_leaves_as_views_enter(ior, roughness, spread):
    """Of even light inside as much leaves as views go in; masking takes of both at grazing angles."""
    inside, weight = np.empty((N, 3), np.float32), np.empty(N, np.float32)
    _interface(*np.float32([ior, roughness, spread]), numbers(dimensions=5), inside, weight)
    entering = inside[:, 2] < 0
    assert weight.mean() == pytest.approx(entering.mean(), rel=0.01)
    assert entering.mean() > 0.95
    sine = np.sqrt(1 - inside[entering, 2] ** 2)
    if spread == 0 and roughness == 0:
        assert sine.max() <= 1 / ior + 1e-3


@pytest.mark.parametrize("fitted", [False, True])
@pytest.mark.parametrize("g", [0.0, 0.6])
@pytest.mark.parametrize("color", [0.1, 0.5, 0.8])
def test_half_space_has_the_colour(color, g, fitted):
    """The inversions against walks: views that enter by the cosine see the colour that was asked for."""
    scene = body_in_room(wax(color, 0.01, g, spread=1, fitted=fitted), box(0.3, inwards=False))
    ratio = opaque._albedo_ratio(scene, 1, np.full(64, 12, np.int32), 1)
    bound = 0.03 if fitted else 0.015  # that of the fits themselves, where little is scattered
    assert ratio.mean() == pytest.approx(1, abs=bound)


@pytest.mark.parametrize("ior", [1.01, 1.5])
@pytest.mark.parametrize("gather", ["final", "density"])
def test_white_body_loses_nothing(ior, gather):
    """What the lamp emits ends in the walls: by gather rays that look through the body, and by photons in it."""
    body = moved(box(0.3, inwards=False), (-0.4, -0.4, -0.4))
    value = light_on_walls(wax(1.0, 0.2, ior=ior), body, gather=gather)
    assert value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02 if gather == "final" else 0.05)


def far_wall(n=12):
    """Receivers on the wall of the room behind a slab."""
    at = grid_on_walls(n)
    of = at.normal[:, 0] < -0.5
    return receivers_at(at.position[of], at.normal[of])


def light_behind_slab(n_threads=1, **settings):
    """Irradiance on a wall that light gets to only through a slab of wax."""
    slab = box(1.0, inwards=False)
    slab = slab[0] * np.float32([0.1, 1.1, 1.1]), slab[1]
    scene = body_in_room(wax((0.9, 0.7, 0.5), (0.2, 0.1, 0.1), g=0.3, ior=1.4), slab, at=(-0.5, 0.1, 0.2))
    chosen = {"n_photons": 400_000, "n_cache_elements": 4_000, "max_radius": 0.5, "n_threads": n_threads} | settings
    return bake(scene, far_wall(), settings_for("draft", **chosen), EmbreeTracer(scene)).value


def test_photons_and_gather_rays_see_the_same_body():
    """Reciprocity: walks from the lit side and walks from the dark side bring the same light through."""
    by_rays, by_photons = (light_behind_slab(gather=gather).mean(axis=0) for gather in ("final", "density"))
    assert by_rays == pytest.approx(by_photons, rel=0.03)
    assert by_rays[0] > 1.3 * by_rays[2] > 0


def test_same_light_for_any_number_of_threads():
    few = {"n_photons": 100_000, "n_cache_elements": 500}
    assert np.array_equal(light_behind_slab(1, **few), light_behind_slab(3, **few))


def test_share_of_a_ball():
    """The mean of e^(−s/ℓ) over chords s = 2r cos θ by the cosine."""
    mesh, path = ball(0.5), 0.05
    scene = body_in_room(wax(0.5, path), mesh)
    walled = opaque._triangles_of(scene, 1)
    share = opaque._share_elsewhere(scene, EmbreeTracer(scene), 1, walled, 1)
    a = 1 / (path / np.sqrt(3 * (1 - 0.9117)))
    assert share == pytest.approx(2 / a**2 * (1 - (1 + a) * np.exp(-a)), rel=0.1)


def test_thick_bodies_are_lambertian():
    scene = body_in_room(wax(0.6, 0.001), box(0.3, inwards=False))
    closures = without_thick_bodies(scene, EmbreeTracer(scene), 1).materials.closures
    assert closures.kind.tolist() == [Lobe.DIFFUSE, Lobe.DIFFUSE]
    assert closures.weight.value[1] == pytest.approx(0.6, rel=0.02)
    thin = body_in_room(wax(0.6, 0.1), box(0.3, inwards=False))
    assert without_thick_bodies(thin, EmbreeTracer(thin), 1) is thin
