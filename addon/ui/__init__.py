"""What people see in Blender: the settings on the scene, the panel, and debug views in the viewport."""

from . import debug_views, panels, properties


def register() -> None:
    """Add the settings to scenes, the debug views, and the panel to the sidebar."""
    properties.register()
    debug_views.register()
    panels.register()


def unregister() -> None:
    """Take them away again."""
    panels.unregister()
    debug_views.unregister()
    properties.unregister()
