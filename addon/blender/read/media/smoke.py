"""Smoke domains of fluid simulations: the grids of the frame that is shown."""

import bpy
import numpy as np

_GRIDS = {"density": "density_grid", "flame": "flame_grid", "temperature": "temperature_grid"}


def is_smoke(obj: "bpy.types.Object") -> bool:
    """Whether an object is the domain of a gas simulation."""
    return _domain(obj) is not None


def smoke_grids(obj: "bpy.types.Object") -> dict[str, np.ndarray]:
    """The grids over the bounds of an evaluated domain's mesh, (x, y, z) float32 each, by name; those that it has."""
    settings = _domain(obj)
    found: dict[str, np.ndarray] = {}
    if settings is None:
        return found
    for name, member in _GRIDS.items():
        values = np.array(getattr(settings, member), np.float32)
        shape = np.array(settings.domain_resolution[:])
        if values.size and shape.all():
            finer = round((values.size / shape.prod()) ** (1 / 3))  # cells of Noise
            if values.size == (finer * shape).prod():
                found[name] = np.nan_to_num(values.reshape((finer * shape)[::-1]).transpose(), posinf=0.0, neginf=0.0)
    return found


def _domain(obj: "bpy.types.Object") -> "bpy.types.FluidDomainSettings | None":
    for modifier in obj.modifiers:
        is_domain = modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN"
        if is_domain and modifier.domain_settings.domain_type == "GAS":
            return modifier.domain_settings
    return None
