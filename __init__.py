"""Radiosity Baker: fast, noise-free global illumination baked to vertex colours.

Blender imports this package as an extension; tests and scripts may import `radiosity_baker.core` without Blender, so
the add-on is only loaded when Blender asks for it.
"""


def register() -> None:
    from . import addon

    addon.register()


def unregister() -> None:
    from . import addon

    addon.unregister()
