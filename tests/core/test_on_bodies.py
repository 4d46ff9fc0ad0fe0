"""Receivers on bodies: what comes to them through the body, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.path_numbers import path_key
from photon_bake.addon.gather.on_bodies import OnBodies, arrivals
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import Channel, Closures, Lobe, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import EmbreeTracer, TransparencyTracer
from photon_bake.tests.core.scenes import ball, box, of_objects, receivers_at, scene_of

SKY = 2.0


def half_wax(color, path, share):
    """A body of which a share is wax and the rest is diffuse, of one colour."""
    channel = Channel.constant
    closures = Closures.of(
        np.array([0, 2]),
        np.array([Lobe.SUBSURFACE, Lobe.DIFFUSE]),
        weight=channel(np.float32([np.multiply(share, color), np.multiply(1 - share, color)])),
        f0=channel(np.float32([color, color])),
        f90=channel(np.full((2, 3), path, np.float32)),
        roughness=channel(np.full((2, 3), 0.5, np.float32)),
        edge=channel(np.zeros((2, 3), np.float32)),
        ior=np.float32([1.3, 0]),
    )
    return Materials.of(1, closures=closures)


def under_sky(materials, mesh):
    return of_objects(replace(scene_of(*mesh, world=SKY), materials=materials), np.zeros(len(mesh[1]), int))


def around(mesh, lift=1e-3):
    """A receiver over the middle of each triangle."""
    corners = mesh[0][mesh[1]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return receivers_at(corners.mean(axis=1) + lift * normal, normal)


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_white_body_under_an_even_sky(share):
    """Nothing is lost on the way: E = πL."""
    mesh = box(0.3, inwards=False)
    scene = under_sky(half_wax((1, 1, 1), 0.2, share), mesh)
    settings = settings_for("draft", add_direct=True, n_photons=1000)
    value = bake(scene, around(mesh), settings, EmbreeTracer(scene)).value
    assert value.mean() == pytest.approx(np.pi * SKY, rel=2e-3)


def test_views_along_the_normal_see_about_the_colour():
    """They go deeper into a thick body than those by the cosine, which have the colour, and lose more if it is dark."""
    mesh = ball(1.0, n=12)
    scene = under_sky(half_wax((0.9, 0.5, 0.2), 0.01, 1.0), mesh)
    tracer, at = EmbreeTracer(scene), around(mesh)
    on = OnBodies.of(scene, tracer, at)
    assert on.there.all()
    none = np.zeros((0, 3), np.float32)
    light = TransparencyTracer(scene, tracer)
    weight = arrivals(light, on, at.position, at.normal, none, 64, path_key(1, 1), 0).weight.mean(axis=0)
    assert 1 > weight[0] > weight[1] > weight[2] > 0.8 and weight[0] > 0.95


def test_receivers_on_other_things_are_on_no_body():
    mesh = box(0.3, inwards=False)
    scene = under_sky(half_wax((0.8, 0.8, 0.8), 0.1, 1.0), mesh)
    far = receivers_at([[0, 0, 2]], [0, 0, 1])
    assert OnBodies.of(scene, EmbreeTracer(scene), far) is None


def test_slopes_are_those_of_surfaces():
    """Normals of a map turn at both ends of walks: of light that is the same from everywhere above, B = E n/2."""
    mesh = box(0.3, inwards=False)
    scene = under_sky(half_wax((1, 1, 1), 0.2, 1.0), mesh)
    at = replace(around(mesh), directional=True)
    light = bake(scene, at, settings_for("draft", add_direct=True, n_photons=1000), EmbreeTracer(scene))
    along = np.einsum("nac,na->nc", light.slope, at.normal)
    assert along.mean() == pytest.approx(np.pi * SKY / 2, rel=0.05)


def test_threads_change_nothing():
    mesh = ball(1.0, n=6)
    scene = under_sky(half_wax((0.8, 0.5, 0.3), 0.3, 0.7), mesh)
    at, tracer = around(mesh), EmbreeTracer(scene)
    few, many = (
        bake(scene, at, settings_for("draft", add_direct=True, n_photons=1000, n_threads=n), tracer) for n in (1, 3)
    )
    np.testing.assert_array_equal(few.value, many.value)
