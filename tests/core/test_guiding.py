"""Photons that go where they are important carry what all would."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.photons import GuidedSource, guide_sources, trace_photons
from photon_bake.addon.photons.guiding import EVEN
from photon_bake.addon.scene import LightKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, receivers_in_box, scene_of

N = 1 << 16


def unit_points(n=N):
    return fixed_points(n, 5)


def guided_by(importance, lights=None, **scene):
    room = scene_of(*box(), lights=lights or lamp(LightKind.POINT, 2.0, (0, 0, 0)), **scene)
    (source,) = light_sources(room, region_of(receivers_in_box(10).position))
    u = unit_points()
    return source, GuidedSource(source, u, importance(u))


@pytest.mark.parametrize("importance", [lambda u: u[:, 0] < 0.1, lambda u: np.zeros(len(u)), lambda u: u[:, 1] ** 4])
def test_flux_has_the_mean_that_it_had(importance):
    source, guided = guided_by(importance)
    flux = guided.emit(unit_points()).flux
    assert flux.mean(axis=0) == pytest.approx(source.power, rel=1e-3)
    assert flux.max() <= source.emit(unit_points()).flux.max() / EVEN * 1.001


def test_photons_go_where_they_are_most_important():
    _, guided = guided_by(lambda u: (u[:, 0] < 0.125).astype(float))
    towards = guided.emit(unit_points()).directions[:, 2]
    assert (towards > 0.75).mean() > 0.7  # the first eighth of a point lamp's first dimension is an eighth of 2 in z


def test_power_leaves_evenly_though_photons_do_not():
    """An even lamp's photons, more of them in some directions, carry the same power in all."""
    _, guided = guided_by(lambda u: 0.1 + np.sin(np.pi * u[:, 0]) ** 8)
    rays = guided.emit(np.random.default_rng(0).random((N, 5), dtype=np.float32))
    z, flux = rays.directions[:, 2], rays.flux[:, 0].astype(float)
    power, edges = np.histogram(z, 32, (-1, 1), weights=flux)
    square, _ = np.histogram(z, edges, weights=flux**2)
    counts, _ = np.histogram(z, edges)
    assert counts.max() > 3 * counts.min()
    assert (np.abs(power - flux.sum() / 32) < 5 * np.sqrt(square)).all()


def test_a_room_behind_a_hole_gets_more_photons():
    """Sun through a hole in a roof: the photons' importance inside keeps its mean and is told by more of them."""
    walls = box()
    roof_hole = merge(plane(20.0, 1.5), (walls[0], walls[1][2:]))
    scene = scene_of(*roof_hole, lights=lamp(LightKind.SUN, 3.0, direction=(0.2, 0.1, -1)), world=0.3)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    sources = light_sources(scene, region_of(receivers_in_box(100).position))

    def importance(photons):
        inside = (np.abs(photons.position) < 0.99).any(axis=1) & (np.abs(photons.position) < 1.01).all(axis=1)
        return photons.power.sum(axis=1) * inside

    plain = trace_photons(scene, tracer, sources, N, 32, Workers())
    better = trace_photons(
        scene, tracer, guide_sources(scene, tracer, sources, N, 32, importance, Workers()), N, 32, Workers()
    )
    assert importance(better).sum() == pytest.approx(importance(plain).sum(), rel=0.1)
    assert (importance(better) > 0).sum() > 1.5 * (importance(plain) > 0).sum()
