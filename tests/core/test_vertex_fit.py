"""Vertices fitted to the light over their faces."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.gather import Irradiance
from photon_bake.addon.output.vertex_light import VertexSamples, finish_vertices
from photon_bake.addon.receivers import Receivers, ShownFaces, face_samples, vertex_receivers
from photon_bake.addon.receivers.face_samples import MOST_OF_FACE, OF_COVERED, samples_of_faces
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, scene_of
from photon_bake.tests.core.test_receivers import grid, mesh_of


def shown(vertices, faces):
    """A mesh whose faces are cut into triangles that renders show."""
    mesh = mesh_of(vertices, faces)
    first = np.flatnonzero(np.diff(mesh.corner_face, prepend=-1))
    size = np.bincount(mesh.corner_face)
    fans = [[start, start + i, start + i + 1] for start, n in zip(first, size, strict=True) for i in range(1, n - 1)]
    return replace(mesh, triangles=np.array(fans, np.int32))


def sampled(meshes, extent=4.0, things=None):
    """Receivers at vertices, and what they are fitted to, in a scene of things that hide faces."""
    tracer = EmbreeTracer(scene_of(*merge(*(things or [solid(1e-3, (50, 50, 50))]))))
    vertices = vertex_receivers(meshes)
    faces = ShownFaces.of(meshes, vertices.targets)
    samples, hidden = face_samples(faces, vertices, extent, tracer, Workers())
    receivers = Receivers.join([vertices, samples.receivers(faces, vertices.targets)])
    names = [target.object_name for target in vertices.targets]
    return vertices, VertexSamples(faces, samples, hidden, names, receivers, extent)


def fitted(light, vertices, at, stderr=0.0, progress=None):
    """What comes of light that is a function of the place: the same for the three colors."""
    place = np.concatenate([vertices.position, at.samples.position])
    value = np.repeat(light(place)[:, None], 3, axis=1).astype(np.float32)
    irradiance = Irradiance(value, np.full(len(value), stderr, np.float32), {"indirect": value}, {})
    return finish_vertices(irradiance, at, Workers(progress=progress or Progress()))


def test_linear_light_is_kept():
    vertices, at = sampled([shown(*grid(6))])
    light = fitted(lambda p: 1 + p[:, 0] - 0.5 * p[:, 1], vertices, at)
    corner = vertices.footprint[0] * 0.02  # receivers at the rim are pulled in
    expected = 1 + vertices.position[:, 0] - 0.5 * vertices.position[:, 1]
    assert np.allclose(light.irradiance.value[:, 0], expected, atol=2 * corner)
    assert light.residuals["Object"] < 2 * corner


def test_a_parabola_is_met_in_the_mean():
    """Linear pieces through x² lie above it by t(h − t), h²/6 on the average: by so much the values are lower."""
    n = 12
    vertices, at = sampled([shown(*grid(n))])
    light = fitted(lambda p: 1 + p[:, 0] ** 2, vertices, at)
    x = vertices.position[:, 0]
    inner = (np.abs(vertices.position[:, :2] - 0.5) < 0.3).all(axis=1)
    lower = (1 + x**2 - light.irradiance.value[:, 0])[inner] * 6 * n**2
    assert lower == pytest.approx(np.ones(inner.sum()), abs=0.4) and lower.mean() == pytest.approx(1, abs=0.05)
    # What is left of t(h − t) has the variance h⁴/30 − h⁴/36
    assert light.residuals["Object"] == pytest.approx((1 / 180) ** 0.5 / n**2 / (4 / 3), rel=0.15)


def test_errors_where_there_is_hardly_light_are_compared_to_that_of_all_objects():
    vertices, faces = grid(6)
    far = np.add(vertices, (2, 0, 0))
    pair = [replace(shown(*at), object_name=name) for name, at in (("Lit", (vertices, faces)), ("Dim", (far, faces)))]
    waves = lambda p: (2 + np.sin(40 * p[:, 0])) * np.where(p[:, 0] < 1.5, 1, 0.01)  # noqa: E731
    light = fitted(waves, *sampled(pair))
    assert light.residuals["Lit"] > 0.2
    assert light.residuals["Dim"] == pytest.approx(light.residuals["Lit"] * 0.01 / (0.25 * 0.505), rel=0.05)
    alone = fitted(lambda p: 0.01 * waves(p), *sampled(pair[:1]))
    assert alone.residuals["Lit"] == pytest.approx(light.residuals["Lit"], rel=0.05)


def test_flat_faces_of_a_box_have_light_of_their_own():
    vertices, at = sampled([shown(*box(inwards=False))])
    of_axis = np.array([1.0, 2.0, 4.0])
    normal = np.concatenate([vertices.normal, at.samples.normal])
    value = np.repeat((np.abs(normal) @ of_axis)[:, None], 3, axis=1).astype(np.float32)
    light = finish_vertices(Irradiance(value, value[:, 0] * 0, {"indirect": value}, {}), at, Workers())
    assert np.allclose(light.irradiance.value, value[: len(vertices)], rtol=1e-4)


def test_vertices_of_faces_without_samples_keep_their_light():
    vertices, at = sampled([shown(*grid(6))])
    at = replace(at, samples=at.samples.where(slice(0, 0)), receivers=vertices)
    light = fitted(lambda p: 1 + p[:, 0], vertices, at)
    assert light.irradiance.value[:, 0] == pytest.approx(1 + vertices.position[:, 0], abs=0.01)


def test_a_step_makes_no_light_below_none_and_little_above_all():
    vertices, at = sampled([shown(*grid(9))])
    value = fitted(lambda p: (p[:, 0] > 0.5).astype(float), vertices, at).irradiance.value
    assert value.min() >= 0 and 1 < value.max() <= 1.25
    assert value.mean() == pytest.approx(0.5, abs=0.02)


def test_what_a_box_covers_has_no_say():
    """The light of a floor is 1 beside a box that stands on it, and none is inside."""
    things = [grid_of_triangles(10), solid(0.117, (0.5, 0.5, 0.117))]
    vertices, at = sampled([shown(*grid(10))], things=things)
    covered = (np.abs(vertices.position[:, :2] - 0.5) < 0.117).all(axis=1)
    assert np.array_equal(at.hidden, covered) and covered.sum() == 9

    def light(place):
        return 1.0 - (np.abs(place[:, :2] - 0.5) < 0.117).all(axis=1)

    assert np.allclose(fitted(light, vertices, at).irradiance.value[~covered], 1, atol=1e-3)
    outer = covered & (np.abs(vertices.position[:, :2] - 0.5) > 0.05).any(axis=1)
    assert np.allclose(fitted(light, vertices, at).irradiance.value[outer], 1, atol=1e-2), "teeth at the box's foot"


def test_hidden_points_that_have_light_count():
    """In a room whose surfaces face outwards all seems to be inside of something."""
    things = [grid_of_triangles(4), solid(3.0)]
    vertices, at = sampled([shown(*grid(4))], things=things)
    assert at.hidden.all() and at.samples.hidden.all()
    light = fitted(lambda p: 1 + p[:, 0], vertices, at).irradiance.value[:, 0]
    assert np.allclose(light, 1 + vertices.position[:, 0], atol=0.02)


def test_errors_are_those_of_what_is_fitted_to():
    vertices, at = sampled([shown(*grid(4))])
    light = fitted(lambda p: 1 + p[:, 0], vertices, at, stderr=0.25)
    assert np.allclose(light.irradiance.stderr, 0.25, rtol=1e-5)
    assert light.residuals["Object"] == 0, "noise is no residual"


def test_fitting_can_be_cancelled():
    vertices, at = sampled([shown(*grid(8))])
    progress = Progress(lambda stage, fraction: progress.cancel())
    with pytest.raises(Cancelled):
        fitted(lambda p: p[:, 0], vertices, at, progress=progress)


def test_samples_are_even_and_bounded():
    assert np.array_equal(samples_of_faces(np.full(4, 0.25), 0.5, 100), [1, 1, 1, 1])
    assert samples_of_faces(np.array([1e9]), 0.1, 100_000)[0] == MOST_OF_FACE
    assert samples_of_faces(np.full(1000, 1e-6), 1e-3, 100).sum() == 100
    narrow = samples_of_faces(np.full(1000, 0.1), 1.0, 10_000)
    assert narrow.sum() == 100 and narrow.max() == 1 and np.ptp(np.diff(np.flatnonzero(narrow))) <= 2


def test_faces_that_are_covered_in_part_get_more_samples():
    things = [grid_of_triangles(10), solid(0.117, (0.5, 0.5, 0.117))]
    _, at = sampled([shown(*grid(10))], extent=12.0, things=things)
    number = np.bincount(at.samples.face, minlength=len(at.faces))
    middle = at.faces.position.mean(axis=1)
    distance = np.abs(np.abs(middle[:, :2] - 0.5).max(axis=1) - 0.117)
    assert number[distance < 0.02].max() == OF_COVERED and number[distance > 0.2].max() <= 2


def test_light_on_a_sheets_side_is_that_sides():
    """Faces between which only vertices are known are not fitted; those of two sheets in one place have no part in
    each other."""
    up, down = grid(4)[0], grid(4)[0]
    faces = grid(4)[1]
    meshes = [shown(up, faces), shown(down, [face[::-1] for face in faces])]
    vertices, at = sampled(meshes)
    normal = np.concatenate([vertices.normal, at.samples.normal])
    value = np.repeat(np.where(normal[:, 2] > 0, 3.0, 1.0)[:, None], 3, axis=1).astype(np.float32)
    light = finish_vertices(Irradiance(value, value[:, 0] * 0, {"indirect": value}, {}), at, Workers())
    assert np.allclose(light.irradiance.value, value[: len(vertices)], rtol=1e-4)


def solid(half, middle=(0, 0, 0)):
    vertices, triangles = box(half, inwards=False)
    return vertices + np.array(middle, np.float32), triangles


def grid_of_triangles(n):
    vertices, faces = grid(n)
    return vertices, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
