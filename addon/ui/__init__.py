"""What people see in Blender: the settings on the scene, and the panel."""

from . import panel, properties


def register() -> None:
    """Add the settings to scenes, and the panel to the sidebar."""
    properties.register()
    panel.register()


def unregister() -> None:
    """Take them away again."""
    panel.unregister()
    properties.unregister()
