"""Photon Bake: indirect light baked by photon mapping."""


def register() -> None:
    """Make the panel, the operators and the command known to Blender."""
    from . import operators
    from .addon import ui

    ui.register()
    operators.register()


def unregister() -> None:
    """Take back what `register` did; a bake that runs is cancelled."""
    from . import operators
    from .addon import ui

    operators.unregister()
    ui.unregister()
