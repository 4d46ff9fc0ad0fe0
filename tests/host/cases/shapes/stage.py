"""What several of the cases here have in common."""

from ..stage import lamp, matte, probes, quad, room

GROUP = "Shapes and objects"


def shaded_room(energy=100, at=(0, 0, 0.5)):
    """A dim room with a lamp above where the shapes are."""
    room(dim=0.6)
    probes()
    lamp("POINT", at, energy=energy, shadow_soft_size=0)


def red():
    """What the shapes are made of."""
    return matte((0.7, 0.1, 0.05), "Red")


def plate(half=0.5, at=(0, 0, 0)):
    """A red square under the lamp."""
    return quad("Shape", at, (half, 0, 0), (0, half, 0), red())


def modified(obj, kind, **settings):
    """An object with a modifier."""
    modifier = obj.modifiers.new(kind, kind)
    for key, value in settings.items():
        setattr(modifier, key, value)
    return modifier
