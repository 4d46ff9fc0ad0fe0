"""The light-gathering volume (Fei and Wang, section 4): photons to irradiance over coarse grids."""

from .cascade import Cascade
from .grid import Grid
from .volume import LightVolume

__all__ = ["Cascade", "Grid", "LightVolume"]
