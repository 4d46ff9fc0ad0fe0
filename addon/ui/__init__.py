"""What people see in Blender: the settings on the scene, the panel, and debug views in the viewport."""

from . import checks, live, panels, staleness
from .panels import objects as object_panel
from .properties import objects as object_properties
from .properties import scene as properties
from .views import debug_views, texel_view


def register() -> None:
    """Add the settings to scenes, the debug views, and the panel to the sidebar."""
    properties.register()
    object_properties.register()
    debug_views.register()
    staleness.register()
    checks.register()
    texel_view.register()
    live.register()
    panels.register()
    object_panel.register()


def unregister() -> None:
    """Take them away again."""
    object_panel.unregister()
    panels.unregister()
    live.unregister()
    texel_view.unregister()
    checks.unregister()
    staleness.unregister()
    debug_views.unregister()
    object_properties.unregister()
    properties.unregister()
