"""Irradiance by the density of photons around receivers."""
