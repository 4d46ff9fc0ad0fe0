"""Live light drawn in 3D views: over what Solid shading drew, and under outlines, overlays and gizmos.

Blender draws these into an image of their own, which it puts over that of the surfaces. Before a view is drawn the
image of the surfaces is bound, afterwards that of the overlays: the first handler takes note of the one that the second
draws into. It is linear, and Blender encodes it for the display without any view transform.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import bpy
import gpu
import numpy as np

from ...scene import World
from .looks import Looks
from .shaders import Compiled, Shader
from .surfaces import DrawnSurfaces
from .tables import image
from .view_transform import ViewTransform

if TYPE_CHECKING:
    from ...pipeline.live import LiveLight

MODES = ("colored", "indirect", "light")
"""What is drawn: light and colour, indirect light alone, light alone. In the order of the shaders' numbers."""

_NEARER = 2e-3
"""How much nearer surfaces are drawn than they are, as a share of their distance."""

_TRANSFORM = {"transform": "FLOAT_3D"}
_LOOKS = {"materials": "FLOAT_2D", "images": "FLOAT_2D", "pixels": "FLOAT_2D"}
_SURFACES = {"lights": "FLOAT_2D", "objects": "FLOAT_2D", **_LOOKS, **_TRANSFORM}
_CONSTANTS = {"view_projection": "MAT4", "eye": "VEC4", "shaper": "VEC4", "nearer": "VEC2", "mode": "INT"}
_BETWEEN = {"direct_at": "VEC3", "indirect_at": "VEC3", "uv_at": "VEC2", "toward_at": "VEC3", "material_at": "INT"}
_INPUTS = {"position": "VEC3", "uv": "VEC2", "whole": "VEC3"}

SURFACES = Shader(
    ("tables", "surfaces"),
    ("view_transform", "tables", "material", "surfaces"),
    _INPUTS,
    _BETWEEN,
    _CONSTANTS,
    _SURFACES,
)
SKY = Shader(
    ("sky",),
    ("view_transform", "sky_color", "sky"),
    {"corner": "VEC2", "toward": "VEC3"},
    {"toward_at": "VEC3"},
    {"shaper": "VEC4", "mode": "INT"},
    {**_TRANSFORM, "sky": "FLOAT_2D"},
)


@dataclass(frozen=True)
class Scenery:
    """What there is to draw.

    Attributes
    ----------
    scene : int
        Session id of Blender's scene, in whose views it is drawn.
    layer : str
        The view layer, the same.
    light : LiveLight
    looks : Looks
        Of the materials that the light's surfaces have.
    transforms : (o, 4, 4) float32
        From where the surfaces have each object to where it is.
    world : World
    shown_as : ViewTransform
    mode : str
        One of `MODES`.
    shown_in : callable
        Which objects a 3D view shows, (o,) bool.
    complete : bool
        Whether surfaces are of all that light meets now. If so, and light passes some of them, the sky goes over all
        that Solid shading drew; else over its background alone, and what else there is stays as it drew it.
    """

    scene: int
    layer: str
    light: "LiveLight"
    looks: Looks
    transforms: np.ndarray
    world: World
    shown_as: ViewTransform
    mode: str
    shown_in: Callable[[Any], np.ndarray]
    complete: bool = True


class Drawing:
    """Draws in all 3D views in Solid shading until it is ended.

    Parameters
    ----------
    scenery : callable
        What there is to draw now; None for nothing.
    fails : callable
        Told of what went wrong, after which nothing is drawn any more.
    """

    def __init__(self, scenery: Callable[[], Scenery | None], fails: Callable[[Exception], None]) -> None:
        self._scenery, self._fails = scenery, fails
        self._failed = False
        self._under_overlays: Any = None
        self._surfaces: DrawnSurfaces | None = None
        self._textures: dict[str, tuple[Any, Any]] = {}
        self._handlers: list[Any] = []
        if not bpy.app.background:
            for draw, when in ((self._before, "PRE_VIEW"), (self._after, "POST_VIEW")):
                self._handlers.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", when))

    def end(self) -> None:
        """Draw no more; what is on the graphics card goes."""
        for handler in self._handlers:
            bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
        self._handlers.clear()
        self._surfaces = self._under_overlays = None
        self._scenery, self._fails = _nothing, _nobody  # who gave them goes now, and not when Python looks for cycles
        self._textures.clear()
        self.__dict__.pop("_shaders", None)

    def _before(self) -> None:
        self._under_overlays = gpu.state.active_framebuffer_get()

    def _after(self) -> None:
        target, self._under_overlays = self._under_overlays, None
        context = bpy.context
        space, region = context.space_data, context.region_data
        if self._failed or space.shading.type != "SOLID" or region is None:
            return
        try:
            scenery = self._scenery()
            if scenery is None or (scenery.scene, scenery.layer) != (
                context.scene.session_uid,
                context.view_layer.name,
            ):
                return
            with (target or gpu.state.active_framebuffer_get()).bind():
                view = View(np.array(region.view_matrix), np.array(region.window_matrix), region.is_perspective)
                culled = space.shading.show_backface_culling
                self.draw(scenery, view, scenery.shown_in(space), culled)
        except Exception as error:  # Blender would print it at each redraw
            self._failed = True
            self._fails(error)

    def draw(self, scenery: Scenery, view: "View", shown: np.ndarray, culled: bool = False) -> None:
        """Draw into the framebuffer that is bound.

        Parameters
        ----------
        scenery : Scenery
        view : View
        shown : (o,) bool
            Which objects are shown.
        culled : bool
            Whether backs are not drawn.
        """
        if self._surfaces is None or self._surfaces.surfaces is not scenery.light.surfaces:
            self._surfaces = DrawnSurfaces(scenery.light.surfaces)
        surfaces = self._surfaces
        surfaces.light(scenery.light)
        surfaces.looks(scenery.looks)
        constants = {
            "view_projection": view.view_projection.T.ravel().tolist(),
            "eye": view.eye,
            "nearer": view.nearer,
            "shaper": scenery.shown_as.shaper,
            "mode": MODES.index(scenery.mode),
        }
        textures = {
            **surfaces.textures(scenery.transforms, shown),
            "transform": self._kept("transform", scenery.shown_as.table, _volume),
            "sky": self._kept("sky", scenery.world, _panorama),
        }
        gpu.state.blend_set("NONE")
        gpu.state.depth_mask_set(True)
        gpu.state.depth_test_set("ALWAYS" if scenery.looks.see_through and scenery.complete else "LESS_EQUAL")
        try:
            view.sky_batch().draw(self._shaders["sky"].bind(constants, textures))
            gpu.state.depth_test_set("LESS_EQUAL")
            gpu.state.face_culling_set("BACK" if culled else "NONE")
            surfaces.draw(self._shaders["surfaces"].bind(constants, textures))
        finally:
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")

    @cached_property
    def _shaders(self) -> dict[str, Compiled]:
        return {"sky": SKY.compiled(), "surfaces": SURFACES.compiled()}

    def _kept(self, name: str, of: Any, make: Callable[[Any], Any]) -> Any:
        """A texture of something, made anew where that is another one."""
        if name not in self._textures or self._textures[name][0] is not of:
            self._textures[name] = of, make(of)
        return self._textures[name][1]


def _nothing() -> Scenery | None:
    return None


def _nobody(error: Exception) -> None:
    pass


@dataclass(frozen=True)
class View:
    """How a view looks at the scene.

    Attributes
    ----------
    view, window : (4, 4) float64
        From the world to the eye's space, and from that to clip space.
    perspective : bool
    """

    view: np.ndarray
    window: np.ndarray
    perspective: bool

    @property
    def view_projection(self) -> np.ndarray:
        return np.asarray(self.window @ self.view)

    @property
    def eye(self) -> tuple[float, ...]:
        """Where the eye is, and 1; or in which direction it looks, and 0."""
        back = np.linalg.inv(self.view)
        return (*back[:3, 3].tolist(), 1.0) if self.perspective else (*(-back[:3, 2]).tolist(), 0.0)

    @property
    def nearer(self) -> tuple[float, float]:
        """What brings all a little nearer, but leaves the picture: a factor of clip space, and a shift of its z."""
        return (1 - _NEARER, float(_NEARER * self.window[2, 3])) if self.perspective else (1.0, -_NEARER / 10)

    def sky_batch(self) -> Any:
        """A triangle that covers the view, with the directions in the world at its corners."""
        corners = np.array([(-1, -1), (3, -1), (-1, 3)], float)
        back = np.linalg.inv(self.view_projection)
        near, far = (
            _through(back, np.concatenate([corners, np.full((3, 1), z), np.ones((3, 1))], axis=1)) for z in (-1.0, 0.5)
        )
        toward = far - near
        form = gpu.types.GPUVertFormat()
        form.attr_add(id="corner", comp_type="F32", len=2, fetch_mode="FLOAT")
        form.attr_add(id="toward", comp_type="F32", len=3, fetch_mode="FLOAT")
        vertices = gpu.types.GPUVertBuf(form, 3)
        vertices.attr_fill("corner", corners.astype(np.float32))
        vertices.attr_fill("toward", toward.astype(np.float32))
        return gpu.types.GPUBatch(type="TRIS", buf=vertices)


def _through(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Homogeneous points (n, 4) taken through a matrix to places (n, 3)."""
    moved = points @ matrix.T
    return np.asarray(moved[:, :3] / moved[:, 3:])


def _volume(values: np.ndarray | None) -> Any:
    """A 3D texture of a table; of nothing, one texel."""
    values = np.zeros((1, 1, 1, 3), np.float32) if values is None else values
    return image(np.concatenate([values, np.ones((*values.shape[:3], 1), np.float32)], axis=3), half=True)


def _panorama(world: World) -> Any:
    """A texture of a world's radiance; of one colour, one texel."""
    values = world.color * (np.ones((1, 1, 3), np.float32) if world.image is None else world.image)
    return image(np.concatenate([values, np.ones((*values.shape[:2], 1), np.float32)], axis=2), half=True)
