"""Photon Bake: indirect light baked by photon mapping."""


def register() -> None:
    """Make the panel, the operators and the command known to Blender; fails where the zip is another Blender's."""
    from . import operators
    from .addon import ui
    from .addon.core.zips import check_zip

    check_zip()
    ui.register()
    operators.register()


def unregister() -> None:
    """Take back what `register` did; a bake that runs is cancelled."""
    from . import operators
    from .addon import ui

    operators.unregister()
    ui.unregister()
