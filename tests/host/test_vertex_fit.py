"""Vertex light in Blender: what is stored shows the light over the faces, as far as a mesh can."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host.scenes import add_cube, add_lamp, add_mesh

N = 8


def add_room():
    """A floor of N × N quads of 0.5 m, on which a cube stands on half quads; with walls."""
    at = np.linspace(-2, 2, N + 1)
    x, y = np.meshgrid(at, at)
    first = (np.arange(N)[:, None] * (N + 1) + np.arange(N)).ravel()
    add_mesh(
        "Floor", np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1), [(i, i + 1, i + N + 2, i + N + 1) for i in first]
    )
    walls = add_cube("Walls")
    walls.scale, walls.location = (2, 2, 1.5), (0, 0, 1.49)
    walls.data.flip_normals()
    cube = add_cube("Cube")
    cube.scale, cube.location = (0.75, 0.75, 0.4), (0, 0, 0.4)
    add_lamp("POINT", location=(1.4, 1.2, 2.4), energy=200)


def light_of(fit, **changes):
    """E of the floor's vertices, (v, 3), and what was made of the light."""
    job = BakeJob.prepare(bpy.context, [VertexRequest(fit=fit)], Progress(), ["Floor", "Cube"])
    settings = settings_for("draft", n_photons=40_000, n_gather_rays=64, **changes)
    (product,) = job.solve(settings, Progress()).outputs
    target = next(one for one in product.receivers.targets if one.object_name == "Floor")
    vertex = np.empty(len(bpy.data.meshes["Floor"].loops), np.int32)
    bpy.data.meshes["Floor"].loops.foreach_get("vertex_index", vertex)
    of_vertex = np.zeros(((N + 1) ** 2, 3))
    of_element = product.irradiance.value[target.receiver_of_element]
    of_vertex[vertex if len(of_element) == len(vertex) else slice(None)] = of_element
    return of_vertex.mean(axis=1).reshape(N + 1, N + 1), product


@pytest.mark.parametrize("gather", ["final", "density"])
def test_no_dark_teeth_at_a_cubes_foot(gather):
    """Vertices that the cube covers show the light of the visible half of their faces."""
    add_room()
    (sampled, _), (fitted, product) = (light_of(fit, gather=gather) for fit in (False, True))
    assert (sampled[3:6, 3:6] < 0.02 * sampled.mean()).all(), "they are inside of the cube"
    rim, beside = fitted[3:6, 3], fitted[3:6, 2]
    assert (rim > 0.25 * beside).all() and (fitted >= 0).all()
    assert 0 <= product.face_residuals["Floor"] < 0.5


def test_error_of_what_is_stored_is_told():
    add_room()
    (_, sampled), (_, fitted) = (light_of(fit) for fit in (False, True))
    assert 0 < fitted.irradiance.relative_noise < 2 * sampled.irradiance.relative_noise
    assert fitted.counts["face_samples"] > 0 and not sampled.counts
