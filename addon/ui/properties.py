"""The settings of a bake as Blender shows and saves them, made from `BakeSettings`."""

from dataclasses import Field, fields
from typing import Any, get_args, get_type_hints

import bpy

from ..camera_settings import PASS_CHOICES, PASS_FOLDER, CameraSettings
from ..lightmap_settings import LIGHTMAP_CHOICES, LIGHTMAP_FOLDER, LightmapSettings
from ..settings import CHOICES, BakeSettings, Quality, settings_for

QUALITIES: tuple[Quality, ...] = get_args(Quality)
KNOBS = fields(BakeSettings)
LIGHTMAP_KNOBS = fields(LightmapSettings)
CAMERA_KNOBS = fields(CameraSettings)
PRESET_KNOBS = [knob.name for knob in KNOBS if len({getattr(settings_for(q), knob.name) for q in QUALITIES}) > 1]
"""The knobs that the quality presets differ in."""

CHOICE_MEANINGS = {
    "gather": "How photons become light",
    "tracer": "What finds where photons meet the scene",
    "atlas": "Which objects share an image",
    "file_format": "What the light is stored in",
    "denoiser": "What takes the noise out",
    "pass_denoiser": "What takes the noise out",
    "precision": "Bits of a channel; depth always has 32",
    "compression": "How the file is compressed",
}
"""What the knobs of `CHOICES`, `LIGHTMAP_CHOICES` and `PASS_CHOICES` mean."""

_CHOICE_WORDS = {
    "final": ("Final Gather", "Every vertex looks around with rays: smooth, and exact with enough of them"),
    "density": ("Density Estimate", "Every vertex counts the photons around it: fast, but blurred by its radius"),
    "light_volume": (
        "Light Volume",
        "A few rays, or photons, fill a coarse grid, which every vertex reads: a draft in seconds",
    ),
    "photon_volumes": (
        "Photon Volumes",
        "Every photon lights the pixels around it: the fastest for a camera's pass, and for nothing else",
    ),
    "embree": ("Embree", "Meets the meshes themselves: exact, and the fastest"),
    "multi_image": ("Multi-Image", "Meets pictures of the scene in cube maps: inexact, and slow on a CPU"),
    "per_object": ("Per Object", "Every object has an image of its own"),
    "shared": ("Shared", "All objects lie in one image, or in as few as hold them"),
    "exr_half": ("OpenEXR Half", "16 bits a channel: enough for light"),
    "exr_float": ("OpenEXR Float", "32 bits a channel"),
    "hdr": ("Radiance HDR", "8 bits a channel and a common exponent"),
    "rgbm": ("PNG RGBM", "8 bits a channel, times a factor in alpha: for engines and texture compression"),
    "rgbd": ("PNG RGBD", "8 bits a channel, over a divisor in alpha"),
    "auto": ("Automatic", "OpenImageDenoise where the extension has it; for interpolated lightmaps nothing"),
    "oidn": ("OpenImageDenoise", "Intel's filter; lightmaps chart by chart, so that nothing bleeds across"),
    "own": ("Own Filter", "Averages neighbours with the same light, place and direction"),
    "none": ("None", "Nothing: the noise stays, or the file's size"),
    "half": ("Half", "16 bits a channel: enough for light"),
    "float": ("Float", "32 bits a channel"),
    "rle": ("RLE", "Run lengths: fast, lossless"),
    "zips": ("ZIP by Line", "Lossless, a line at a time"),
    "zip": ("ZIP", "Lossless, 16 lines at a time"),
    "piz": ("PIZ", "Lossless, wavelets: good for noise"),
    "dwaa": ("DWAA", "Loses a little, 32 lines at a time"),
    "dwab": ("DWAB", "Loses a little, 256 lines at a time"),
}
CHOICE_NUMBERS = {
    "gather": {"final": 0, "density": 1, "light_volume": 2, "photon_volumes": 3},
    "tracer": {"embree": 0, "multi_image": 1},
    "atlas": {"per_object": 0, "shared": 1},
    "file_format": {"exr_half": 0, "exr_float": 1, "hdr": 2, "rgbm": 3, "rgbd": 4},
    "denoiser": {"auto": 0, "oidn": 1, "own": 2, "none": 3},
    "pass_denoiser": {"auto": 0, "oidn": 1, "none": 2},
    "precision": {"half": 0, "float": 1},
    "compression": {"none": 0, "rle": 1, "zips": 2, "zip": 3, "piz": 4, "dwaa": 5, "dwab": 6},
}
"""What .blend files keep of the knobs' choices: never to be given to another choice, or files would open with that."""

_WANTED = [
    ("vertex", "Vertices", "A colour attribute on each mesh", "VERTEXSEL", 1),
    ("lightmap", "Lightmaps", "Images, on UV maps of their own", "TEXTURE", 2),
    ("camera", "Camera", "A pass of the scene's camera, which compositing adds to direct light", "CAMERA_DATA", 4),
]
_QUALITY_ITEMS = [
    ("draft", "Draft", "Seconds: to see where the light goes", 0),
    ("medium", "Medium", "Good for most scenes", 1),
    ("high", "High", "Little noise left; takes several times as long as Medium", 2),
    ("custom", "Custom", "Your own values, from the Sampling panel", 3),
]


_LABELS = {"uv_map": "UV Map", "value_range": "Range", "denoiser": "Denoise", "pass_denoiser": "Denoise"}


def label(knob: str) -> str:
    """The name that a knob has in the panel: ``n_gather_rays`` is Gather Rays."""
    return knob.removeprefix("n_").replace("_", " ").title()


def _property(settings: type, knob: Field) -> Any:
    """Blender's property for a knob of a settings class, from the knob's own default, range and meaning."""
    kind = get_type_hints(settings)[knob.name]
    meta: dict[str, Any] = {"name": _LABELS.get(knob.name) or label(knob.name), "default": knob.default}
    choices = {**CHOICES, **LIGHTMAP_CHOICES, **PASS_CHOICES}.get(knob.name)
    if choices:
        numbers = CHOICE_NUMBERS[knob.name]
        items = [(choice, *_CHOICE_WORDS[choice], numbers[choice]) for choice in choices]
        return bpy.props.EnumProperty(items=items, description=CHOICE_MEANINGS[knob.name], **meta)
    meta["description"] = knob.metadata["meaning"]
    if kind is str:
        return bpy.props.StringProperty(**meta)
    if kind is bool:
        return bpy.props.BoolProperty(**meta)
    meta.update(min=knob.metadata["low"], max=knob.metadata["high"])
    if kind is int:
        return bpy.props.IntProperty(**meta)
    return bpy.props.FloatProperty(**meta, precision=3, step=1)


def _get_quality(properties: "PhotonBakeProperties") -> int:
    """The preset whose values the knobs have, or Custom: nothing of its own is stored, so the two cannot disagree."""
    for i, quality in enumerate(QUALITIES):
        preset = settings_for(quality)
        if all(getattr(properties, name) == getattr(preset, name) for name in PRESET_KNOBS):
            return i
    return len(QUALITIES)


def _set_quality(properties: "PhotonBakeProperties", index: int) -> None:
    if index < len(QUALITIES):
        preset = settings_for(QUALITIES[index])
        for name in PRESET_KNOBS:
            setattr(properties, name, getattr(preset, name))


class PhotonBakeLightmapProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake.lightmap`` holds: every knob of `LightmapSettings` under its own name, and a folder."""

    __annotations__ = {
        "folder": bpy.props.StringProperty(
            name="Folder",
            description="Where the images' files go; // is the folder of the .blend file",
            default=f"//{LIGHTMAP_FOLDER}",
            subtype="DIR_PATH",
        ),
        **{knob.name: _property(LightmapSettings, knob) for knob in LIGHTMAP_KNOBS},
    }

    def settings(self) -> LightmapSettings:
        """The knobs as the engine takes them."""
        return LightmapSettings(**{knob.name: getattr(self, knob.name) for knob in LIGHTMAP_KNOBS})


class PhotonBakeCameraProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake.camera`` holds: every knob of `CameraSettings` under its own name, and a folder."""

    __annotations__ = {
        "folder": bpy.props.StringProperty(
            name="Folder",
            description="Where the pass's files go; // is the folder of the .blend file",
            default=f"//{PASS_FOLDER}",
            subtype="DIR_PATH",
        ),
        **{knob.name: _property(CameraSettings, knob) for knob in CAMERA_KNOBS},
    }

    def settings(self) -> CameraSettings:
        """The knobs as the engine takes them."""
        return CameraSettings(**{knob.name: getattr(self, knob.name) for knob in CAMERA_KNOBS})


class PhotonBakeProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake`` holds: every knob of `BakeSettings` under its own name, and these."""

    __annotations__ = {
        "quality": bpy.props.EnumProperty(
            name="Quality",
            description="Sets the values under Sampling",
            items=_QUALITY_ITEMS,
            get=_get_quality,
            set=_set_quality,
        ),
        "targets": bpy.props.EnumProperty(
            name="Bake To", description="Where the light goes", items=_WANTED, options={"ENUM_FLAG"}, default={"vertex"}
        ),
        "lightmap": bpy.props.PointerProperty(type=PhotonBakeLightmapProperties, name="Lightmaps"),
        "camera": bpy.props.PointerProperty(type=PhotonBakeCameraProperties, name="Camera"),
        "attribute": bpy.props.StringProperty(
            name="Attribute",
            description="Colour attribute that the light is written to, made if it is not there",
            default="Indirect",
        ),
        "light_group": bpy.props.StringProperty(
            name="Light Group",
            description="Bake the light of this light group of the view layer alone; empty for all light",
            default="",
        ),
        "selected_only": bpy.props.BoolProperty(
            name="Selected Only",
            description="Write light to the selected objects only; all objects still scatter and block it. "
            "A camera's pass shows all of them",
            default=False,
        ),
        "strict": bpy.props.BoolProperty(
            name="Strict",
            description="Write nothing where light would differ from Cycles', or where a file is missing",
            default=False,
        ),
        "bake_copies": bpy.props.BoolProperty(
            name="Bake Copies",
            description="Objects whose mesh cannot hold their light (texts, curves, instances, shared meshes, geometry "
            "that modifiers make anew) get copies with meshes of their own, and are hidden in renders",
            default=False,
        ),
        **{knob.name: _property(BakeSettings, knob) for knob in KNOBS},
        "fit": bpy.props.BoolProperty(
            name="Fit to Faces",
            description="Give vertices the values that show the light over their faces best, rather than the light at "
            "the vertices themselves",
            default=True,
        ),
        "denoise": bpy.props.BoolProperty(
            name="Denoise",
            description="Take noise out of the light of vertices, as far as the estimated error allows",
            default=True,
        ),
    }

    def settings(self) -> BakeSettings:
        """The knobs as the engine takes them."""
        return BakeSettings(**{knob.name: getattr(self, knob.name) for knob in KNOBS})


def register() -> None:
    """Give every scene its settings, ``scene.photon_bake``."""
    bpy.utils.register_class(PhotonBakeLightmapProperties)
    bpy.utils.register_class(PhotonBakeCameraProperties)
    bpy.utils.register_class(PhotonBakeProperties)
    bpy.types.Scene.photon_bake = bpy.props.PointerProperty(type=PhotonBakeProperties, name="Photon Bake")


def unregister() -> None:
    """Take them away again."""
    del bpy.types.Scene.photon_bake
    bpy.utils.unregister_class(PhotonBakeProperties)
    bpy.utils.unregister_class(PhotonBakeCameraProperties)
    bpy.utils.unregister_class(PhotonBakeLightmapProperties)
