"""What a bake can end with besides light."""


class BakeError(Exception):
    """Input that cannot be baked. The message is one sentence naming the object and the remedy."""


class Cancelled(Exception):  # noqa: N818 (a wish, not an error)
    """The user asked the bake to stop; raised by `Progress.update`."""
