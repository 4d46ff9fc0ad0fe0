"""The settings of a bake as Blender shows and saves them, made from `BakeSettings` and those of its targets."""

from dataclasses import Field, fields
from typing import Any, TypeVar, get_args, get_type_hints

import bpy

from ...core.parameters import meaning_of
from ...settings.bake import CHOICES, BakeSettings, Quality, settings_for
from ...settings.camera import PASS_CHOICES, PASS_FOLDER, CameraSettings
from ...settings.lightmap import LIGHTMAP_CHOICES, LIGHTMAP_FOLDER, LightmapSettings
from ...settings.live import LiveSettings
from ...settings.probes import PROBE_CHOICES, PROBE_FOLDER, ProbeSettings
from . import mixer as mixer_properties
from . import show as show_properties
from .frames import PhotonBakeFramesProperties
from .mixer import LIGHT_GROUPS, PhotonBakeLightLayer
from .show import PhotonBakeShownProperties
from .zero_values import SUBTYPES, zero_properties

_Settings = TypeVar("_Settings", BakeSettings, LightmapSettings, CameraSettings, ProbeSettings, LiveSettings)

QUALITIES: tuple[Quality, ...] = get_args(Quality)
KNOBS = fields(BakeSettings)
LIGHTMAP_KNOBS = fields(LightmapSettings)
CAMERA_KNOBS = fields(CameraSettings)
PROBE_KNOBS = fields(ProbeSettings)
PRESET_KNOBS = [knob.name for knob in KNOBS if len({getattr(settings_for(q), knob.name) for q in QUALITIES}) > 1]
"""The knobs that the quality presets differ in."""

_CHOICES = {**CHOICES, **LIGHTMAP_CHOICES, **PASS_CHOICES, **PROBE_CHOICES}
CHOICE_MEANINGS = {
    "gather": "How photons become light",
    "tracer": "What finds where photons meet the scene",
    "atlas": "Which objects share an image",
    "file_format": "What the light is stored in",
    "denoiser": "What takes the noise out",
    "pass_denoiser": "What takes the noise out",
    "precision": "Bits of a channel; depth always has 32",
    "compression": "How the file is compressed",
    "harmonics": "Spherical harmonics that files of probes hold",
    "axes": "Axes that files of probes are in",
}
"""What the knobs of `_CHOICES` mean."""

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
    "atlas auto": ("Automatic", "Shared where more than four objects have a material in common, else per object"),
    "per_object": ("Per Object", "Every object has an image of its own"),
    "shared": ("Shared", "All objects lie in one image, or in as few as hold them"),
    "exr_half": ("OpenEXR Half", "16 bits a channel: enough for light"),
    "exr_float": ("OpenEXR Float", "32 bits a channel"),
    "hdr": ("Radiance HDR", "8 bits a channel and a common exponent"),
    "rgbm": ("PNG RGBM", "8 bits a channel, times a factor in alpha: for engines and texture compression"),
    "rgbd": ("PNG RGBD", "8 bits a channel, over a divisor in alpha"),
    "auto": ("Automatic", "OpenImageDenoise where the extension has it; for interpolated lightmaps nothing"),
    "oidn": ("OpenImageDenoise", "Intel's filter; lightmaps chart by chart, so that nothing bleeds across"),
    "own": ("Own Filter", "Averages neighbors with the same light, place and direction"),
    "none": ("None", "Nothing: the noise stays, or the file's size"),
    "half": ("Half", "16 bits a channel: enough for light"),
    "float": ("Float", "32 bits a channel"),
    "rle": ("RLE", "Run lengths: fast, lossless"),
    "zips": ("ZIP by Line", "Lossless, a line at a time"),
    "zip": ("ZIP", "Lossless, 16 lines at a time"),
    "piz": ("PIZ", "Lossless, wavelets: good for noise"),
    "dwaa": ("DWAA", "Loses a little, 32 lines at a time"),
    "dwab": ("DWAB", "Loses a little, 256 lines at a time"),
    "l1": ("L1", "Two bands, four numbers a color: what most engines take"),
    "l2": ("L2", "Three bands, nine numbers a color: sharper"),
    "blender": ("Blender", "Z up"),
    "gltf": ("glTF", "Y up, as in exported files: three.js, Godot"),
}
CHOICE_NUMBERS = {
    "gather": {"final": 0, "density": 1, "light_volume": 2, "photon_volumes": 3},
    "tracer": {"embree": 0, "multi_image": 1},
    "atlas": {"per_object": 0, "shared": 1, "auto": 2},
    "file_format": {"exr_half": 0, "exr_float": 1, "hdr": 2, "rgbm": 3, "rgbd": 4},
    "denoiser": {"auto": 0, "oidn": 1, "own": 2, "none": 3},
    "pass_denoiser": {"auto": 0, "oidn": 1, "none": 2},
    "precision": {"half": 0, "float": 1},
    "compression": {"none": 0, "rle": 1, "zips": 2, "zip": 3, "piz": 4, "dwaa": 5, "dwab": 6},
    "harmonics": {"l1": 0, "l2": 1},
    "axes": {"blender": 0, "gltf": 1},
}
"""What .blend files keep of the knobs' choices: never to be given to another choice, or files would open with that."""

_WANTED = [
    ("vertex", "Vertices", "A color attribute on each mesh", "VERTEXSEL", 1),
    ("lightmap", "Lightmaps", "Images, on UV maps of their own", "TEXTURE", 2),
    ("camera", "Camera", "A pass of the scene's camera, which compositing adds to direct light", "CAMERA_DATA", 4),
    ("probes", "Probes", "Light at points in the air, as files for what moves in an engine", "LIGHTPROBE_VOLUME", 8),
]
_QUALITY_ITEMS = [
    ("draft", "Draft", "Seconds: to see where the light goes", 0),
    ("medium", "Medium", "Good for most scenes", 1),
    ("high", "High", "Little noise left; takes several times as long as Medium", 2),
    ("custom", "Custom", "Your own values, from the Sampling panel", 3),
]


_LABELS = {
    "uv_map": "UV Map",
    "value_range": "Range",
    "denoiser": "Denoise",
    "pass_denoiser": "Denoise",
    "density": "Texels/m",
    "memory": "Memory (MB)",
    "n_nearest": "Near Photons",
    "n_probe_rays": "Rays",
}


def label(knob: str) -> str:
    """The name that a knob has in the panel: ``n_gather_rays`` is Gather Rays."""
    return _LABELS.get(knob) or knob.removeprefix("n_").replace("_", " ").title()


def _property(settings: type, knob: Field) -> Any:
    """Blender's property for a knob of a settings class, from the knob's own default, range and meaning."""
    kind = get_type_hints(settings)[knob.name]
    meta: dict[str, Any] = {"name": label(knob.name), "default": knob.default}
    choices = _CHOICES.get(knob.name)
    if choices:
        numbers = CHOICE_NUMBERS[knob.name]
        words = {choice: _CHOICE_WORDS.get(f"{knob.name} {choice}") or _CHOICE_WORDS[choice] for choice in choices}
        items = [(choice, *words[choice], numbers[choice]) for choice in choices]
        return bpy.props.EnumProperty(items=items, description=CHOICE_MEANINGS[knob.name], **meta)
    meta["description"] = meaning_of(knob)
    if kind is str:
        return bpy.props.StringProperty(**meta)
    if kind is bool:
        return bpy.props.BoolProperty(**meta)
    meta.update(min=knob.metadata["low"], max=knob.metadata["high"], **SUBTYPES.get(knob.metadata["unit"], {}))
    if kind is int:
        return bpy.props.IntProperty(**meta)
    return bpy.props.FloatProperty(**meta, precision=3, step=1)


def _properties(settings: type) -> dict[str, Any]:
    """Blender's properties for the knobs of a settings class, and what the panel shows of those whose 0 means more."""
    kinds, found = get_type_hints(settings), {}
    for knob in fields(settings):
        found[knob.name] = _property(settings, knob)
        if knob.metadata.get("zero"):
            found |= zero_properties(knob, kinds[knob.name], label(knob.name))
    return found


def _folder(files: str, default: str) -> Any:
    """Blender's property for a folder of files, which need not be there."""
    return bpy.props.StringProperty(
        name="Folder",
        description=f"Where {files} go; // is the folder of the .blend file",
        default=f"//{default}",
        subtype="DIR_PATH",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )


def _taken(group: Any, settings: type[_Settings]) -> _Settings:
    """The knobs of a property group as the engine takes them."""
    return settings(**{knob.name: getattr(group, knob.name) for knob in fields(settings)})


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
        "folder": _folder("the images' files", LIGHTMAP_FOLDER),
        **_properties(LightmapSettings),
    }

    def settings(self) -> LightmapSettings:
        """The knobs as the engine takes them."""
        return _taken(self, LightmapSettings)


class PhotonBakeCameraProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake.camera`` holds: every knob of `CameraSettings` under its own name, and a folder."""

    __annotations__ = {
        "folder": _folder("the pass's files", PASS_FOLDER),
        **_properties(CameraSettings),
    }

    def settings(self) -> CameraSettings:
        """The knobs as the engine takes them."""
        return _taken(self, CameraSettings)


class PhotonBakeProbeProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake.probes`` holds: every knob of `ProbeSettings` under its own name, and a folder."""

    __annotations__ = {
        "folder": _folder("the probes' files", PROBE_FOLDER),
        **_properties(ProbeSettings),
    }

    def settings(self) -> ProbeSettings:
        """The knobs as the engine takes them."""
        return _taken(self, ProbeSettings)


class PhotonBakeLiveProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake.live`` holds: every knob of `LiveSettings` under its own name."""

    __annotations__ = _properties(LiveSettings)

    def settings(self) -> LiveSettings:
        """The knobs as the engine takes them."""
        return _taken(self, LiveSettings)


_GROUPS = (
    PhotonBakeLightmapProperties,
    PhotonBakeCameraProperties,
    PhotonBakeProbeProperties,
    PhotonBakeLiveProperties,
    PhotonBakeFramesProperties,
)


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
        "probes": bpy.props.PointerProperty(type=PhotonBakeProbeProperties, name="Probes"),
        "live": bpy.props.PointerProperty(type=PhotonBakeLiveProperties, name="Live Light"),
        "frames": bpy.props.PointerProperty(type=PhotonBakeFramesProperties, name="Frames"),
        "attribute": bpy.props.StringProperty(
            name="Attribute",
            description="Color attribute that the light is written to, made if it is not there",
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
        **_properties(BakeSettings),
        "light_groups": bpy.props.EnumProperty(
            name="Light Groups",
            description="Which light of the view layer's light groups is baked",
            items=LIGHT_GROUPS,
            get=mixer_properties.get_light_groups,
            set=mixer_properties.set_light_groups,
        ),
        "light_groups_chosen": bpy.props.IntProperty(min=0, max=2, options={"HIDDEN"}),
        "mixer": bpy.props.CollectionProperty(type=PhotonBakeLightLayer, name="Light Mixer"),
        "shown": bpy.props.PointerProperty(type=PhotonBakeShownProperties, name="Baked Light"),
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
        return _taken(self, BakeSettings)


def register() -> None:
    """Give every scene its settings, ``scene.photon_bake``."""
    for cls in _GROUPS:
        bpy.utils.register_class(cls)
    mixer_properties.register()
    show_properties.register()
    bpy.utils.register_class(PhotonBakeProperties)
    bpy.types.Scene.photon_bake = bpy.props.PointerProperty(type=PhotonBakeProperties, name="Photon Bake")


def unregister() -> None:
    """Take them away again."""
    del bpy.types.Scene.photon_bake
    bpy.utils.unregister_class(PhotonBakeProperties)
    show_properties.unregister()
    mixer_properties.unregister()
    for cls in reversed(_GROUPS):
        bpy.utils.unregister_class(cls)
