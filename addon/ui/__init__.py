"""What people see in Blender: the settings on the scene, the panel, and debug views in the viewport."""

from . import checks, debug_views, panels, properties, staleness


def register() -> None:
    """Add the settings to scenes, the debug views, and the panel to the sidebar."""
    properties.register()
    debug_views.register()
    staleness.register()
    checks.register()
    panels.register()


def unregister() -> None:
    """Take them away again."""
    panels.unregister()
    checks.unregister()
    staleness.unregister()
    debug_views.unregister()
    properties.unregister()
