"""Files with damage: whatever stands in them, a reader gives what they hold, or one sentence."""


def damaged(rng, source, pieces):
    """Return bytes with one to four damages, half of them near the start: headers are short.

    A byte is another; a stretch, a line or the rest is lost; a stretch stands there twice; one of the pieces stands
    between others or in their place.
    """
    data = bytearray(source)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(len(data)))
        if rng.random() < 0.5:
            at = min(at, int(rng.integers(3000)))
        kind, piece = rng.integers(7), pieces[rng.integers(len(pieces))]
        if kind == 0:
            data[at] = rng.integers(256)
        elif kind == 1:
            del data[at : at + rng.integers(1, 40)]
        elif kind == 2:
            del data[data.rfind(b"\n", 0, at) + 1 : data.find(b"\n", at) + 1]
        elif kind == 3:
            del data[at + 1 :]
        elif kind == 4:
            data[at:at] = data[at : at + rng.integers(1, 300)]
        else:
            data[at : at + (kind == 6) * rng.integers(1, 9)] = piece
        data = data or bytearray(b"x")
    return bytes(data)
