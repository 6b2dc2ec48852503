"""Many lines that a controller might say when the cable is bad."""

import random
from collections.abc import Iterator, Sequence

LINES_PER_SEED = 1000


def salad(seed: int, words: Sequence[str], lines: Sequence[str]) -> Iterator[str]:
    """Yield `LINES_PER_SEED` mixtures of words, and good lines with a few bytes changed.

    Args:
        seed: the same seed gives the same lines.
        words: parts of the protocol.
        lines: whole lines of it.
    """
    rng = random.Random(seed)  # noqa: S311
    for _ in range(LINES_PER_SEED):
        if rng.random() < 0.5:
            yield "".join(rng.choices(words, k=rng.randrange(14)))
        else:
            text = list(rng.choice(lines))
            for _ in range(rng.randrange(1, 4)):
                at = rng.randrange(len(text) + 1)
                text[at : at + rng.randrange(2)] = chr(rng.choice((rng.randrange(128), 0xFFFD)))
            yield "".join(text)
