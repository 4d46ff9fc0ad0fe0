"""The tab as it draws itself: nothing fails, no label is cut in a sidebar of the default width."""

from types import SimpleNamespace

import blf
import bpy
import pytest
from photon_bake.addon.core.errors import Missing
from photon_bake.addon.ui import panels
from photon_bake.addon.ui.checks import checks
from photon_bake.addon.ui.outcomes import Outcome
from photon_bake.addon.ui.panels.entries import PHOTON_BAKE_PT_render, _draw_in_menu
from photon_bake.addon.ui.panels.outcome import draw_outcome
from photon_bake.addon.ui.panels.presets import VALUES
from photon_bake.addon.ui.remedies import REMEDIES
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.jobs import folders
from photon_bake.operators.jobs.solving import over_view

from .scenes import add_cube, add_lamp

WIDTH = 227
"""Of a panel in a sidebar of the default 280, measured in Blender 5.2; in units of a 1x interface."""

LABEL, VALUE = 0.4 * WIDTH, 0.6 * WIDTH
"""Of it, for labels and for values, where they are split."""

ARROW, ICON, MARGIN = 22, 20, 10


class Layout:
    """Draws nothing and keeps what it was asked for, with the layouts in it."""

    def __init__(self, drawn=None, split=False, share=1.0, row=False):
        self.__dict__.update(drawn=[] if drawn is None else drawn, use_property_split=split, share=share)
        self.__dict__.update(is_row=row, beside=[])

    def _inner(self, share=1.0, row=False):
        inner = Layout(self.drawn, self.use_property_split, self.share * share, row)
        self.beside.append(inner)
        return inner

    def column(self, align=False, heading=""):
        self._take("heading", heading)
        return self._inner()

    def row(self, align=False, heading=""):
        self._take("heading", heading)
        return self._inner(row=True)

    def grid_flow(self, columns, **_):
        return self._inner(1 / columns)

    def panel(self, idname, default_closed=False):
        return self._inner(), self._inner()

    def _take(self, what, text, icon=False):
        if what != "heading":
            self.beside.append(text)
        if text:
            self.drawn.append((what, text, icon, self))

    def label(self, text="", icon="NONE"):
        self._take("label", text, icon != "NONE")

    def prop(self, owner, name, text=None, icon="NONE", toggle=False, slider=False, expand=False):
        prop = owner.bl_rna.properties[name]  # else it is misspelt
        if expand:
            for item in prop.enum_items:
                self._take("button", item.name, True)
            return
        shown = prop.name if text is None else text
        boolean = prop.type == "BOOLEAN"
        self._take("button" if toggle else "check" if boolean else "split", shown)
        if prop.type == "ENUM":
            for item in prop.enum_items:
                self._take("choice", item.name)

    def prop_search(self, owner, name, *_):
        self.prop(owner, name)

    def operator(self, idname, text=None, icon="NONE", emboss=True, depress=False):
        group, name = idname.split(".")
        rna = getattr(getattr(bpy.ops, group), name).get_rna_type()
        self._take("operator", rna.name if text is None else text, icon != "NONE")
        return type("Properties", (), {})()

    def progress(self, factor, text):
        self._take("label", text)

    def popover(self, panel, text="", icon="NONE"):
        assert hasattr(bpy.types, panel)

    def separator(self, **_):
        pass


class Context:
    """The scene's context, with a sidebar of the default width."""

    def __getattr__(self, name):
        return getattr(bpy.context, name)

    region = type("Region", (), {"width": 280})()
    preferences = type("Preferences", (), {"system": type("System", (), {"ui_scale": 1.0})()})()


def drawn(*classes):
    """What panels draw, those whose poll says so."""
    layout = Layout()
    for cls in classes or panels.CLASSES:
        if hasattr(cls, "draw") and cls.__name__ != "PHOTON_BAKE_PT_presets":
            context = Context()
            if getattr(cls, "poll", lambda _: True)(context):
                cls.draw(type("Panel", (), {"layout": layout})(), context)
    return layout.drawn


def width(text):
    blf.size(0, 11)
    return blf.dimensions(0, text)[0]


def room(what, icon, layout):
    if what in {"heading", "split"} and layout.use_property_split:
        return LABEL - 4
    if what in {"choice"}:
        return VALUE - ARROW - 4
    if what == "check":
        return (VALUE if layout.use_property_split else WIDTH) - ICON
    n_bare = sum(one == "" for one in layout.beside) if layout.is_row else 0
    n_words = max(len(layout.beside) - n_bare, 1) if layout.is_row else 1
    return (WIDTH * layout.share - n_bare * ICON) / n_words - MARGIN - (ICON if icon else 0)


@pytest.fixture
def properties(empty_scene):
    add_cube("Cube")
    add_lamp("POINT")
    return empty_scene.photon_bake


SETTINGS = [
    {"targets": {"vertex", "lightmap", "camera", "probes"}},
    {"targets": {"camera"}, "gather": "density"},
    {"targets": {"lightmap"}, "gather": "light_volume", "tracer": "multi_image", "noise": 0.1, "time": 5.0},
    {"targets": {"vertex"}, "gather": "photon_volumes", "n_threads": 3, "max_radius": 1.0},
    {"targets": set()},
]


@pytest.mark.parametrize("settings", SETTINGS)
def test_no_label_is_cut(properties, settings):
    for name, value in settings.items():
        setattr(properties, name, value)
    properties.lightmap.size = 512 if "camera" in properties.targets else 0
    properties.lightmap.file_format = "rgbm"
    for what, text, icon, layout in [*drawn(), *drawn(PHOTON_BAKE_PT_render)]:
        if "Sidebar" not in text:  # which is in the wider Properties editor
            assert width(text) <= room(what, icon, layout), f"{what} {text!r} is {width(text)} wide"


def test_a_short_screen_of_settings(properties):
    """What is there for one target is not there for another."""

    def labels(target):
        properties.targets = {target}
        return {text for _, text, *_ in drawn()}

    assert "Attribute" in labels("vertex") and "Attribute" not in labels("camera")
    assert "Texels/m" in labels("lightmap") and "Texels/m" not in labels("vertex")
    assert "Pixel Samples" in labels("camera") and "Pixel Samples" not in labels("lightmap")


def test_nothing_is_spelt_british():
    """As Blender spells."""
    british = ("colour", "neighbour", "metre", "grey", "centre")
    owners = [bpy.types.Scene.bl_rna.properties["photon_bake"].fixed_type]
    owners += [owner.properties[name].fixed_type for owner in list(owners) for name in ("lightmap", "camera")]
    for owner in owners:
        for prop in owner.properties:
            texts = [prop.name, prop.description]
            texts += [item.description for item in prop.enum_items] if prop.type == "ENUM" else []
            assert not any(word in text.lower() for word in british for text in texts), prop.identifier


def test_off_and_auto(properties):
    """0 is a checkbox, which brings back what there was; scripts and files keep the number."""
    assert not properties.use_noise and properties.noise == 0
    properties.use_noise = True
    assert properties.noise == pytest.approx(0.05) and properties.noise_shown == pytest.approx(5)
    properties.noise_shown = 2
    assert properties.noise == pytest.approx(0.02)
    properties.use_noise = False
    assert properties.noise == 0
    properties.use_noise = True
    assert properties.noise == pytest.approx(0.02)
    lightmap = properties.lightmap
    assert lightmap.auto_size and lightmap.size == 0
    lightmap.auto_size = False
    assert lightmap.size == 1024 == lightmap.size_shown
    lightmap.size = 300  # by a script
    assert not lightmap.auto_size and lightmap.size_shown == 300
    lightmap.auto_size = True
    assert lightmap.size == 0


def test_units(properties):
    units = {name: prop.unit for name, prop in properties.bl_rna.properties.items() if hasattr(prop, "unit")}
    assert units["max_radius"] == "LENGTH" and units["time_shown"] == "TIME_ABSOLUTE"
    assert properties.lightmap.bl_rna.properties["max_size"].subtype == "PIXEL"
    assert properties.bl_rna.properties["noise_shown"].subtype == "PERCENTAGE"


def test_the_tooltip_fits_the_target(properties):
    describe = bpy.types.PHOTON_BAKE_OT_bake_indirect.description
    properties.targets = {"vertex", "camera"}
    told = describe(bpy.context, None)
    assert told == "Bake indirect light into a color attribute of each mesh and a picture for compositing"
    properties.targets = set()
    assert "Choose first" in describe(bpy.context, None)


def test_what_a_check_found_is_drawn(properties):
    bpy.ops.photon_bake.check()
    texts = [text for _, text, *_ in drawn()]
    assert "1 object will get light" in texts and any(text.startswith("About ") for text in texts)
    assert "Cube: no material" in texts and REMEDIES["add_material"][0] in texts


def outcome_drawn(**said):
    scene = bpy.context.scene
    bake_state.start("final", scene=scene.session_uid)
    bake_state.stop(Outcome(**said))
    layout = Layout()
    draw_outcome(layout, scene, 30)
    return [text for _, text, *_ in layout.drawn]


def test_an_outcome_says_where_and_how_good(properties, tmp_path):
    files = [tmp_path / "maps" / name for name in ("a.exr", "b.exr")]
    texts = outcome_drawn(result="10 points in 3 s", noise=0.52, places=["Indirect on 2 objects"], files=files)
    assert "Indirect on 2 objects" in texts and "2 files in maps" in texts
    assert {"Noise 52%; for less:", "Raise Quality", "Noise 5 %"} <= set(texts)
    assert "The scene has changed since" not in texts


def test_black_light_is_said(properties):
    texts = " ".join(outcome_drawn(result="10 points in 3 s", black=True, places=["Indirect on 2 objects"]))
    assert "nothing to bounce off" in texts
    texts = " ".join(
        outcome_drawn(result="1", black=True, places=["x"], warnings=["Nothing in the scene gives light, so …"])
    )
    assert "bounce off" not in texts and "Nothing gives light" in texts


def test_many_warnings_are_few_lines(properties):
    warnings = [f"Material 'M{i}': its coat is not baked." for i in range(300)]
    warnings += [Missing(f"Image 'I{i}' is missing: it is magenta.") for i in range(40)]
    texts = outcome_drawn(result="1", warnings=warnings)
    assert "300 materials: coat is not baked" in texts and "40 images: is missing" in texts
    assert len(texts) < 60


def test_another_scene_has_its_own_outcome(properties):
    outcome_drawn(result="10 points in 3 s")
    layout = Layout()
    other = bpy.data.scenes.new("Other")
    draw_outcome(layout, other, 30)
    assert not layout.drawn
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    draw_outcome(layout, bpy.context.scene, 30)
    assert not layout.drawn and checks.of(bpy.context.scene) is None


def test_an_unsaved_file_wants_a_folder_where_one_is_needed(properties, tmp_path):
    properties.targets = {"vertex"}
    assert not folders.without_folder(properties)
    properties.targets = {"lightmap", "camera"}
    assert folders.without_folder(properties) == [properties.lightmap, properties.camera]
    properties.camera.folder = str(tmp_path)
    assert folders.without_folder(properties) == [properties.lightmap]


def test_presets_come_back(properties, tmp_path, monkeypatch):
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, path="", create=False, **__: str(tmp_path))
    properties.targets, properties.noise, properties.lightmap.size = {"lightmap"}, 0.1, 256
    assert bpy.ops.photon_bake.add_preset(name="Mine") == {"FINISHED"}
    (preset,) = tmp_path.glob("**/Mine.py")
    properties.targets, properties.noise, properties.lightmap.size = {"vertex"}, 0.0, 0
    exec(preset.read_text())
    assert (properties.targets, properties.lightmap.size) == ({"lightmap"}, 256)
    assert properties.noise == pytest.approx(0.1)
    assert {f"bake.{name}" for name in ("noise", "lightmap.atlas", "camera.precision")} <= set(VALUES)


@pytest.mark.parametrize(("x", "y", "over"), [(120, 30, True), (99, 30, False), (150, 30, False), (250, 30, False)])
def test_esc_cancels_over_a_view_alone(x, y, over):
    view = SimpleNamespace(type="VIEW_3D", x=100, y=0, width=50, height=50)
    text = SimpleNamespace(type="TEXT_EDITOR", x=200, y=0, width=100, height=50)
    context = SimpleNamespace(screen=SimpleNamespace(areas=[text, view]))
    assert over_view(context, SimpleNamespace(mouse_x=x, mouse_y=y)) == over


def test_a_bake_is_cancelled_from_menus_too(properties):
    """F3 searches menus."""

    def menu():
        layout = Layout()
        _draw_in_menu(SimpleNamespace(layout=layout), bpy.context)
        return [text for _, text, *_ in layout.drawn]

    assert menu() == ["Bake Indirect"]
    bake_state.start("final")
    try:
        assert menu() == ["Cancel Bake"] and bpy.ops.photon_bake.cancel.poll()
    finally:
        bake_state.stop()
    assert "INTERNAL" not in getattr(bpy.types.PHOTON_BAKE_OT_cancel, "bl_options", ())
