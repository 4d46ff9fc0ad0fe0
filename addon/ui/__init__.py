"""What people see in Blender: the settings on the scene, the panel, and debug views in the viewport."""

from . import checks, debug_views, object_panel, object_properties, panels, properties, staleness, texel_view


def register() -> None:
    """Add the settings to scenes, the debug views, and the panel to the sidebar."""
    properties.register()
    object_properties.register()
    debug_views.register()
    staleness.register()
    checks.register()
    texel_view.register()
    panels.register()
    object_panel.register()


def unregister() -> None:
    """Take them away again."""
    object_panel.unregister()
    panels.unregister()
    texel_view.unregister()
    checks.unregister()
    staleness.unregister()
    debug_views.unregister()
    object_properties.unregister()
    properties.unregister()
