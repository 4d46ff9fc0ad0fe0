"""Materials that differ by the side that is seen, and by the rays that see them."""

import bpy

from ..registry import case
from ..stage import box, lamp, nodes, picture, probes, quad, room
from .stage import GROUP, diffuse, divided, mixed, painted_floor, principled


def backfacing(tree):
    return tree.add("NewGeometry").outputs["Backfacing"]


def leaf(reflected, transmitted):
    """A shader that reflects one colour and lets another through."""

    def both(tree):
        front = tree.add("BsdfDiffuse", {"Color": reflected})
        return tree.add("AddShader", {0: front, 1: tree.add("BsdfTranslucent", {"Color": transmitted})})

    return both


@case("Leaf of other colours on its back (Backfacing)", GROUP)
def backfacing_leaf():
    divided(mixed(backfacing, leaf((0.1, 0.4, 0.1), (0.6, 0.3, 0.1)), leaf((0.7, 0.7, 0.3), (0.1, 0.5, 0.2))))


@case("Wall that is seen from one side alone (Backfacing, Transparent)", GROUP)
def backfacing_cull():
    # Its front, which the lamp is behind, shows; its back is not there.
    def wall(tree):
        return tree.add("BsdfDiffuse", {"Color": (0.3, 0.6, 0.8)})

    screen = mixed(backfacing, wall, lambda tree: tree.add("BsdfTransparent", {"Color": (1, 0.8, 0.5)}))
    room()
    probes(n=48, where=lambda p: abs(p[0]) > 0.3)
    quad("Screen", (0, 0, 0), (0, 1.8, 0), (0, 0, 1.8), screen)
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=1, energy=200)
    lamp("POINT", (1.2, 0.8, 0.8), energy=60, shadow_soft_size=0.1)


@case("Metal on the front, a picture on the back (Backfacing)", GROUP, effort=2)
def backfacing_card():
    tree = nodes()
    pixels = [[(0.9, 0.2, 0.1), (0.1, 0.2, 0.8)], [(0.2, 0.8, 0.2), (0.8, 0.8, 0.1)]]
    print_ = tree.add("TexImage", image=picture(pixels), interpolation="Closest")
    front = tree.add("Math", {0: 1.0, 1: backfacing(tree)}, operation="SUBTRACT")
    inputs = {"Base Color": print_, "Metallic": front, "Roughness": 0.4}
    room()
    probes(n=48)
    quad("Card", (0, 0, 0), (0, 1.5, 0), (0, 0, 1.5), tree.done(tree.add("BsdfPrincipled", inputs)))
    lamp("AREA", (-1.8, 0, 1), (0, 0, 0), size=1, energy=100)
    lamp("AREA", (1.8, 0, 1), (0, 0, 0), size=1, energy=100)


@case("Emission of another colour on each side (Backfacing)", GROUP)
def backfacing_lantern():
    # Red to one side, blue and weaker to the other.
    tree = nodes()
    color = tree.add("Mix", data_type="RGBA")
    tree.feed(color.inputs[0], backfacing(tree))
    tree.feed(color.inputs[6], (1, 0.3, 0.2))
    tree.feed(color.inputs[7], (0.05, 0.1, 0.4))
    room()
    probes(n=48)
    light = tree.add("Emission", {"Color": color.outputs[2], "Strength": 8.0})
    quad("Lantern", (0.4, 0, 0), (0, 0, 0.6), (0, 0.6, 0), tree.done(light))


def light_path(output):
    return lambda tree: tree.add("LightPath").outputs[output]


def either(*outputs):
    """Whether a ray is one of some kinds."""

    def largest(tree):
        path = tree.add("LightPath")
        return tree.add("Math", {i: path.outputs[name] for i, name in enumerate(outputs)}, operation="MAXIMUM")

    return largest


def clear(color):
    return lambda tree: tree.add("BsdfTransparent", {"Color": color})


def glass(tree):
    return tree.add("BsdfGlass", {"Roughness": 0.0, "IOR": 1.45})


def paned(material):
    """A room divided by a thick pane, lit through it by a lamp of some size."""
    room()
    probes(n=48, where=lambda p: p[0] > 0.3)
    box("Pane", (0, 0, 0), (0.05, 2.1, 2.1), material)
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=1.0, energy=200)


@case("Glass that shadow rays pass (Light Path)", GROUP, effort=2)
def light_path_glass():
    # Lamplight comes both straight through and refracted.
    paned(mixed(light_path("Is Shadow Ray"), glass, clear((1, 1, 1))))


@case("Glass that shadow and diffuse rays pass, tinted (Light Path)", GROUP, effort=2)
def light_path_window():
    paned(mixed(either("Is Shadow Ray", "Is Diffuse Ray"), glass, clear((0.9, 0.6, 0.4))))


@case("Tinted shadows of a screen (Light Path)", GROUP)
def light_path_tinted_shadow():
    # What other rays see is white paper.
    room()
    probes(n=48)
    screen = mixed(light_path("Is Shadow Ray"), lambda t: t.add("BsdfDiffuse"), clear((0.8, 0.3, 0.1)))
    quad("Screen", (0, 0, 0), (0, 1.2, 0), (0, 0, 1.2), screen)
    lamp("POINT", (-1.2, 0.3, 0.2), energy=150, shadow_soft_size=0.1)


@case("Surface that only the camera sees as it is (Light Path)", GROUP)
def light_path_camera():
    # The camera would see black cloth; all light sees a blue wall.
    def black(tree):
        return tree.add("BsdfDiffuse", {"Color": (0, 0, 0)})

    def blue(tree):
        return tree.add("BsdfDiffuse", {"Color": (0.2, 0.3, 0.8)})

    painted_floor(mixed(light_path("Is Camera Ray"), blue, black))


@case("Panel that shines for the camera alone (Light Path)", GROUP)
def light_path_camera_panel():
    tree = nodes()
    strength = tree.add("Math", {0: light_path("Is Camera Ray")(tree), 1: 20.0}, operation="MULTIPLY")
    painted_floor(tree.done(tree.add("Emission", {"Strength": strength})))


@case("Wall that mirrors show in another colour (Light Path)", GROUP, effort=4)
def light_path_glossy():
    # White to diffuse rays and red in the mirror floor.
    def white(tree):
        return tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8)})

    def red(tree):
        return tree.add("BsdfDiffuse", {"Color": (0.9, 0.05, 0.05)})

    mirror = principled(Base_Color=(0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.3)
    room(paint={"Floor": mirror, "Left": mixed(light_path("Is Glossy Ray"), white, red)}, dim=0.5)
    probes("Right Front Back Ceiling", 48)
    lamp("AREA", (0.5, 0, 1.0), (-2, 0, 0), size=0.5, energy=150)


UNWEIGHED = "as with Emission Sampling None; else Cycles gives weight to shadow rays, which see none of its light"
NO_PHOTONS = "no photons of it, which bring what more than two surfaces reflect"


@case("Lamp of a mesh that only mirrors show (Light Path)", GROUP, differs=UNWEIGHED, effort=4)
def light_path_glossy_panel():
    # Its light comes by the mirror floor alone. Cycles' shadow rays see none of it, but what its sampled rays see
    # is weighed as if they did.
    tree = nodes()
    strength = tree.add("Math", {0: light_path("Is Glossy Ray")(tree), 1: 8.0}, operation="MULTIPLY")
    mirror = principled(Base_Color=(0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.3)
    room(paint={"Floor": mirror}, dim=0.7)
    probes("Right Front Back Ceiling", 48)
    quad("Panel", (-1.95, 0, 0), (0, 0.8, 0), (0, 0, 0.8), tree.done(tree.add("Emission", {"Strength": strength})))
    lamp("POINT", (0.5, 0, 1.0), energy=10, shadow_soft_size=0.1)


@case("Lamp of a mesh that only mirrors show, Emission Sampling None (Light Path)", GROUP, differs=NO_PHOTONS, effort=4)
def light_path_unsampled_panel():
    light_path_glossy_panel()
    bpy.data.objects["Panel"].data.materials[0].cycles.emission_sampling = "NONE"


def by_depth(output, bound):
    """Whether a ray's depth is above a bound."""
    return lambda tree: tree.add("Math", {0: light_path(output)(tree), 1: bound}, operation="GREATER_THAN")


@case("Floor of another colour from the second bounce on (Ray Depth)", GROUP)
def light_path_ray_depth():
    painted_floor(mixed(by_depth("Ray Depth", 1.5), diffuse((0.2, 0.3, 0.8)), diffuse((0.9, 0.6, 0.1))))


@case("Floor that is black from the second bounce on (Diffuse Depth)", GROUP)
def light_path_diffuse_depth():
    painted_floor(mixed(by_depth("Diffuse Depth", 1.5), diffuse((0.8, 0.8, 0.8)), diffuse((0, 0, 0))))


@case("Metal floor, matte from the second bounce on (Ray Depth)", GROUP, effort=4)
def light_path_depth_metal():
    def metal(tree):
        return tree.add("BsdfAnisotropic", {"Color": (0.9, 0.6, 0.2), "Roughness": 0.4})

    painted_floor(mixed(by_depth("Ray Depth", 1.5), metal, diffuse((0.3, 0.3, 0.3))))


LONG_RAYS, DEEP_RAYS = "rays of 1 m", "from the third bounce on what the second sees"


@case("Floor whose colour rays' lengths mix (Ray Length)", GROUP, differs=LONG_RAYS)
def light_path_length():
    painted_floor(mixed(by_depth("Ray Length", 1.6), diffuse((0.2, 0.3, 0.8)), diffuse((0.9, 0.6, 0.1))))


@case("Floor of another colour from the third bounce on (Ray Depth)", GROUP, differs=DEEP_RAYS)
def light_path_third_depth():
    painted_floor(mixed(by_depth("Ray Depth", 2.5), diffuse((0.2, 0.3, 0.8)), diffuse((0.9, 0.6, 0.1))))
