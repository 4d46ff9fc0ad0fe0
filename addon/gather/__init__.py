"""Photons to irradiance: a density estimate, or a final gather into a radiance cache."""

from .irradiance import Irradiance

__all__ = ["Irradiance"]
