"""Motion blur: light averaged over a shutter that is open for the time of a frame around the scene's frame 2."""

import bpy
import numpy as np

from .registry import case
from .stage import box, glow, lamp, matte, mesh, probes, quad, room

GROUP = "Shapes and objects"


def moving(obj, path, before, after):
    """Have a property go evenly from one value, half a frame before frame 2, to another half a frame after it."""
    middle, ends = np.array(before) / 2 + np.array(after) / 2, np.array(after) - np.array(before)
    for frame, value in ((1, middle - ends), (3, middle + ends)):
        setattr(obj, path, value if np.ndim(value) else float(value))
        obj.keyframe_insert(path, frame=frame)
    for layer in obj.id_data.animation_data.action.layers:
        for bag in layer.strips[0].channelbags:
            for curve in bag.fcurves:
                for point in curve.keyframe_points:
                    point.interpolation = "LINEAR"


def open_shutter():
    """The room with its probes, at frame 2, whose shutter is open for one frame's time."""
    room()
    probes()
    scene = bpy.context.scene
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 1.0, "CENTER"


@case("A lamp that moves (in Cycles it stands still)", GROUP, motion_blur=16)
def motion_lamp():
    open_shutter()
    moving(lamp("POINT", energy=100, shadow_soft_size=0.1), "location", (-1.7, 0, 0.4), (1.7, 0.4, -0.4))
    bpy.context.scene.frame_set(2)


@case("An object that moves between a lamp and the floor", GROUP, motion_blur=16)
def motion_blocker():
    open_shutter()
    lamp("AREA", (0, 0, 1.8), size=0.6, energy=100)
    moving(box("Box", (0, 0, 0), (0.7, 0.7, 0.1), matte((0.1, 0.1, 0.8))), "location", (-1.2, 0, 0.6), (0.6, 0, 0.6))
    bpy.context.scene.frame_set(2)


@case("A panel that emits and turns", GROUP, motion_blur=16)
def motion_panel():
    # It shines at the red wall first, at the green one last.
    open_shutter()
    panel = quad("Panel", (0, 0, 0), (0, 0.6, 0), (0, 0, 0.6), glow((1, 1, 1), 20))
    quad("Back", (-0.01, 0, 0), (0, 0.6, 0), (0, 0, -0.6), matte((0.2, 0.2, 0.2))).parent = panel
    moving(panel, "rotation_euler", (0, 0, -2.0), (0, 0, 0.5))
    bpy.context.scene.frame_set(2)


@case("A mesh that its shape key bends", GROUP, motion_blur=16)
def motion_shape_key():
    # A flat sheet under the lamp is pulled up in its middle and to the side.
    open_shutter()
    lamp("POINT", (0, 0, 1.5), energy=100, shadow_soft_size=0.1)
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    flat = np.stack([x.ravel(), y.ravel(), np.full(81, -1.0)], axis=1)
    faces = [(i, i + 1, i + 10, i + 9) for i in range(71) if i % 9 < 8]
    sheet = mesh("Sheet", flat, faces, matte((0.1, 0.6, 0.7)))
    sheet.shape_key_add(name="Basis")
    key = sheet.shape_key_add(name="Up")
    up = flat + np.stack([0.6 + 0 * x.ravel(), 0 * x.ravel(), 1.9 * np.exp(-3 * (x**2 + y**2)).ravel()], axis=1)
    key.data.foreach_set("co", up.astype(np.float32).ravel())
    key.slider_min, key.slider_max = -1, 2
    moving(key, "value", 0.0, 1.0)
    bpy.context.scene.frame_set(2)


@case("Motion blur where nothing moves", GROUP, motion_blur=8)
def motion_still():
    open_shutter()
    lamp("AREA", (0.5, 0, 1.8), size=0.6, energy=100)
    box("Box", (0, 0, 0), (0.5, 0.5, 0.1), matte((0.1, 0.1, 0.8)))
    bpy.context.scene.frame_set(2)
