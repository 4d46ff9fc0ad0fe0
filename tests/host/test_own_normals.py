"""Normals that nodes give shaders, beside Cycles' bake of normals."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.bsdf import lambertian_normals
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.scene import NormalSpace
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host import scenes
from photon_bake.tests.host.cases import stage
from photon_bake.tests.host.cases.cycles import set_cycles

SIDE = 64
MAP = np.random.default_rng(4).uniform((0.3, 0.3, 0.6, 1), (0.7, 0.7, 1, 1), (8, 8, 4))
FLIPPED = np.abs(MAP - (0, 1, 1, 0))
WAVES = 0.5 + 0.2 * np.sin(2 * np.pi * (np.arange(SIDE) + 0.5) / SIDE)
HEIGHTS = np.repeat((WAVES[:, None] * WAVES)[..., None], 4, axis=2)


class Tree(stage.Nodes):
    """The nodes of a diffuse material."""

    def __init__(self):
        super().__init__(bpy.data.materials.new("Diffuse"))
        self.surface = self.add("BsdfDiffuse")
        self.done(self.surface)

    def image(self, pixels, **properties):
        node = self.add("TexImage", image=scenes.new_image(pixels, byte=False), **properties)
        node.image.colorspace_settings.name = "Non-Color"
        return node

    def map(self, strength=1.0, pixels=MAP, **properties):
        image = self.image(pixels, interpolation="Closest")
        return self.add("NormalMap", {"Color": image, "Strength": strength}, **properties)

    def bump(self, height, **inputs):
        return self.add("Bump", {"Height": height, "Distance": 0.5, **inputs})

    def noise(self):
        return self.add("TexNoise", {"Vector": self.add("TexCoord").outputs["Object"], "Scale": 1.5, "Detail": 0.0})


def by_vectors(t):
    waves = t.add("VectorMath", {0: t.add("TexCoord").outputs["Object"], 1: (3, 2, 0)}, operation="MULTIPLY")
    return t.add("VectorMath", {0: waves, 1: (0, 0, 4)}, operation="ADD")


def repeated(t, pixels):
    mapping = t.add("Mapping", {"Vector": t.add("TexCoord").outputs["UV"], "Scale": (2, 1, 1)})
    image = t.image(pixels)
    t.feed(image.inputs["Vector"], mapping)
    return image


NORMALS = {
    "tangent": lambda t: t.map(),
    "tangent, half": lambda t: t.map(0.5),
    "tangent, double": lambda t: t.map(2.0),
    "object": lambda t: t.map(space="OBJECT"),
    "object, half": lambda t: t.map(0.5, space="OBJECT"),
    "world": lambda t: t.map(1.5, space="WORLD"),
    "Blender's object": lambda t: t.map(pixels=FLIPPED, space="BLENDER_OBJECT"),
    "bump of an image": lambda t: t.bump(t.image(HEIGHTS)),
    "bump of an image, half": lambda t: t.bump(t.image(HEIGHTS), Strength=0.5),
    "bump of an image, repeated": lambda t: t.bump(repeated(t, HEIGHTS)),
    "bump of a noise": lambda t: t.bump(t.noise()),
    "bump after a map": lambda t: t.bump(t.noise(), Normal=t.map(0.5)),
    "vectors": by_vectors,
    "none": lambda t: t.map(0.0),
}


def our_normals(scene):
    """At the middles of texels of the plane's picture, (side, side, 3)."""
    middle = (np.arange(SIDE) + 0.5) / SIDE
    y, x = np.meshgrid(middle, middle, indexing="ij")
    position = np.stack([2 * x - 1, 2 * y - 1, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    found = np.zeros((SIDE * SIDE, 3), np.float32)
    for triangle in range(2):
        of = np.full(len(position), triangle, np.int32)
        u, v = scene.plane_coordinates(of, position)
        inside = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6)
        up = np.broadcast_to(np.float32([0, 0, 1]), position.shape)
        normals = lambertian_normals(scene, of, u.astype(np.float32), v.astype(np.float32), up)
        found[inside] = normals[inside]
    return found.reshape(SIDE, SIDE, 3)


def assert_as_cycles(plane):
    """Up to what the normals change within a texel or two."""
    ours = our_normals(scenes.extracted())
    bpy.context.scene.render.bake.normal_space = "OBJECT"
    theirs = 2 * scenes.cycles_picture(plane, "NORMAL", SIDE) - 1
    apart = np.linalg.norm(ours - theirs, axis=-1)
    assert np.median(apart) < 0.02 and np.quantile(apart, 0.9) < 0.06
    return theirs


@pytest.mark.parametrize("name", NORMALS)
def test_normals_are_cycles(name):
    tree = Tree()
    tree.feed(tree.surface.inputs["Normal"], NORMALS[name](tree))
    theirs = assert_as_cycles(scenes.add_plane(material=tree.block))
    assert (np.ptp(theirs, axis=(0, 1)).max() > 0.2) == (name != "none")


def test_displacement_that_only_bends_normals():
    tree = Tree()
    output = next(node for node in tree.tree.nodes if node.type == "OUTPUT_MATERIAL")
    moved = tree.add("Displacement", {"Height": tree.noise(), "Scale": 0.5})
    tree.feed(output.inputs["Displacement"], moved)
    tree.block.displacement_method = "BUMP"
    theirs = assert_as_cycles(scenes.add_plane(material=tree.block))
    assert np.ptp(theirs, axis=(0, 1)).max() > 0.2


def spaces(tree):
    scenes.add_plane(material=tree.block)
    return scenes.extracted().materials.closures.normal_space.tolist()


def test_what_needs_no_bake_is_read():
    tree = Tree()
    tree.feed(tree.surface.inputs["Normal"], tree.map())
    assert spaces(tree) == [NormalSpace.TANGENT]


def test_heights_of_an_image_are_slopes():
    tree = Tree()
    tree.feed(tree.surface.inputs["Normal"], tree.bump(tree.image(HEIGHTS)))
    assert spaces(tree) == [NormalSpace.HEIGHT]


def test_a_level_height_and_no_strength_bend_nothing():
    tree = Tree()
    tree.feed(tree.surface.inputs["Normal"], tree.bump(tree.add("Value")))
    assert spaces(tree) == [-1]
    tree.feed(tree.surface.inputs["Normal"], tree.map(0.0))
    assert set(spaces(tree)) == {-1}


def test_maps_by_the_tangents_of_two_uv_maps():
    """The second is evaluated by Cycles."""
    tree = Tree()
    other = tree.add("BsdfTranslucent", {"Normal": tree.map(uv_map="Other")})
    tree.feed(tree.surface.inputs["Normal"], tree.map(uv_map="UVMap"))
    output = next(node for node in tree.tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.feed(output.inputs["Surface"], tree.add("MixShader", {1: tree.surface, 2: other}))
    plane = scenes.add_plane(material=tree.block)
    plane.data.uv_layers.new(name="Other").uv.foreach_set("vector", [0, 0, 0, 1, 1, 1, 1, 0])
    assert scenes.extracted().materials.closures.normal_space.tolist() == [NormalSpace.TANGENT, NormalSpace.OBJECT]


def test_receivers_take_the_light_of_their_own_normals():
    """A patch whose normal leans towards the brighter half of a room, beside Cycles' own bake of it."""
    tree = Tree()
    tree.feed(tree.surface.inputs["Normal"], tree.add("CombineXYZ", {"X": 0.7, "Z": 0.7}))
    stage.room()
    patch = stage.quad("Patch", (0, 0, -0.5), (0.2, 0, 0), (0, 0.2, 0), tree.block)
    stage.lamp("AREA", (0.5, 0, 0), (2, 0, 0), size=0.5, energy=50)
    lights = {}
    for counts in (False, True):
        settings = settings_for("draft", n_gather_rays=4096, normal_maps=counts)
        job = BakeJob.prepare(bpy.context, [VertexRequest()], Progress(), [patch.name])
        (light,) = job.solve(settings, Progress()).outputs
        lights[counts] = light.irradiance.value.mean() / np.pi
    set_cycles(1024)
    cycles = scenes.cycles_bake(patch, "INDIRECT", samples=1024).mean()
    assert lights[True] == pytest.approx(cycles, rel=0.03)
    assert lights[False] != pytest.approx(cycles, rel=0.1)
