"""What people see in Blender: the settings on the scene, the panel, and debug views in the viewport."""

from . import debug_views, object_panel, object_properties, panel, properties, texel_view


def register() -> None:
    """Add the settings to scenes, the debug views, and the panel to the sidebar."""
    properties.register()
    object_properties.register()
    debug_views.register()
    texel_view.register()
    panel.register()
    object_panel.register()


def unregister() -> None:
    """Take them away again."""
    object_panel.unregister()
    panel.unregister()
    texel_view.unregister()
    debug_views.unregister()
    object_properties.unregister()
    properties.unregister()
