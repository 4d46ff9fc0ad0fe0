"""From the light at texels to finished lightmaps: images, their borders and seams, noise, and files."""

from .finish import FinishOptions, finish_lightmaps

__all__ = ["FinishOptions", "finish_lightmaps"]
