"""What a bake should say although it goes on; see `errors` for what a sentence can be about."""


class Warnings:
    """Collects sentences, each once, in a list that the caller may keep.

    Parameters
    ----------
    sentences : list of str, optional
        Where the sentences go; they are dropped without it.
    """

    def __init__(self, sentences: list[str] | None = None) -> None:
        self._sentences = [] if sentences is None else sentences

    def add(self, sentence: str) -> None:
        """Say `sentence` unless it was said before."""
        if sentence not in self._sentences:
            self._sentences.append(sentence)


def listed(names: list[str]) -> str:
    """The first five names."""
    return ", ".join(names[:5]) + (", …" if len(names) > 5 else "")
