"""Materials that differ by the side that is seen, and by the rays that see them."""

from ..registry import case
from ..stage import box, lamp, nodes, picture, probes, quad, room
from .stage import GROUP, divided, mixed, painted_floor


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
