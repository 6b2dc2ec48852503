"""A walk over the coded pixels of a JPEG picture that reads every code and judges what it finds.

A decoder conceals damage and goes on; this stops. Pixels are made only
of blocks that look impossible.
Source: ITU-T T.81, annex F.2 (decoding), F.1.2 (what an encoder may write).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel
from rig_drivers.jpeg.header import JpegDamageError, JpegHeader

_COMPLETE: Final = 0
_NO_CODE: Final = 1
_TOO_LONG: Final = 2
_SHORT: Final = 3
_LEFT_OVER: Final = 4
_IMPOSSIBLE: Final = 5
_MARKER: Final = 6
_ZIGZAG: Final = np.array(
    sorted(
        range(64),
        key=lambda at: (
            sum(divmod(at, 8)),
            at % 8 if sum(divmod(at, 8)) % 2 == 0 else at // 8,
        ),
    ),
    np.int64,
)
"""Place in the block, row after row, of every coefficient in its coded order."""
_WAVES: Final = np.array(
    [
        [
            np.sqrt((1 if wave == 0 else 2) / 8) * np.cos((2 * at + 1) * wave * np.pi / 16)
            for at in range(8)
        ]
        for wave in range(8)
    ]
)
_BEYOND: Final = 6.0
"""How far rounding of the coefficients may carry a pixel out of 8 bits, in standard deviations."""
_REASONS: Final = {
    _NO_CODE: "bits that are no code",
    _TOO_LONG: "more than 64 coefficients in a block",
    _SHORT: "pixels are missing",
    _LEFT_OVER: "more coded bits than pixels",
    _IMPOSSIBLE: "a block brighter, darker or rougher than 8 bits allow",
    _MARKER: "a marker that does not belong there",
}


def walk_scan(content: NDArray[np.uint8], header: JpegHeader, *, is_of_camera: bool = True) -> int:
    """Walk over all coded pixels.

    Padding behind the last pixel (bytes that are all 0x00 or all 0xFF) and whatever follows the
    end mark are harmless, and so is a missing end mark.

    Args:
        content: the picture from its start mark on, (n,).
        header: of this picture.
        is_of_camera: whether no pixel can lie beyond 8 bits by more than rounding.

    Returns:
        Where the coded pixels end in `content`.

    Raises:
        JpegDamageError: it is damaged.
    """
    units = header.units_across * header.units_down
    of_block = np.repeat(
        np.arange(len(header.components)), [part.across * part.down for part in header.components]
    )
    per_restart = header.units_per_restart or units
    plain = np.empty(content.size - header.scan_at + 8, np.uint8)
    ends = np.zeros(-(-units // per_restart) + 1, np.int64)
    steps = header.quantisation
    roughest = (1024.0 + 0.5 * np.sqrt((steps.astype(np.float64) ** 2).sum(axis=1))) ** 2
    beyond = _BEYOND * np.sqrt((steps.astype(np.float64) ** 2).sum(axis=1) / 12.0) / 8.0 + 2.0
    if not is_of_camera:
        beyond = np.full_like(beyond, np.inf)
    verdict, end = _unstuff(content, header.scan_at, plain, ends)
    if verdict == _COMPLETE:
        verdict = _walk(
            plain,
            ends,
            units,
            per_restart,
            of_block,
            header.codes,
            steps,
            roughest,
            beyond,
            _WAVES,
            0 if content[end : end + 1].size else 2,  # a damaged end mark looks like two more bytes
        )
    if verdict != _COMPLETE:
        raise JpegDamageError(_REASONS[verdict])
    return end


@kernel()
def _unstuff(  # noqa: C901 - one loop over bytes
    content: NDArray[np.uint8],
    at: int,
    plain: NDArray[np.uint8],
    ends: NDArray[np.int64],
) -> tuple[int, int]:
    """Copy coded bytes without stuffing; fill in where the parts between restart markers end."""
    size, used, part = content.size, 0, 0
    last_part = ends.size - 2
    while at < size:
        byte = content[at]
        if byte != 0xFF:
            plain[used] = byte
            used += 1
            at += 1
            continue
        after = at + 1
        while after < size and content[after] == 0xFF:
            after += 1
        if after == size:
            break  # fill bytes at the end of the buffer
        marker = content[after]
        if marker == 0x00:
            if after > at + 1:
                return _MARKER, at  # fill bytes stand before markers only
            plain[used] = 0xFF
            used += 1
        elif marker == 0xD9:
            break
        elif 0xD0 <= marker <= 0xD7:
            if part == last_part or marker != 0xD0 + part % 8:
                return _MARKER, at
            part += 1
            ends[part] = used
        elif after + 1 < size:
            return _MARKER, at
        else:
            break  # what stands in place of the end mark
        at = after + 1
    if part != last_part:
        return _SHORT, at
    ends[part + 1] = used
    plain[used : used + 8] = 0
    return _COMPLETE, at


@kernel()
def _walk(  # noqa: C901 - one loop over bits, each step a few instructions
    plain: NDArray[np.uint8],
    ends: NDArray[np.int64],
    units: int,
    per_restart: int,
    of_block: NDArray[np.int64],
    codes: NDArray[np.uint16],
    steps: NDArray[np.int64],
    roughest: NDArray[np.float64],
    beyond: NDArray[np.float64],
    waves: NDArray[np.float64],
    end_mark_bytes: int,
) -> int:
    coefficients = np.zeros((8, 8))
    direct = np.zeros(3, np.int64)
    unit = 0
    for part in range(ends.size - 1):
        at, end = 8 * ends[part], 8 * ends[part + 1]
        direct[:] = 0
        for _ in range(min(per_restart, units - unit)):
            for block in range(of_block.shape[0]):
                component = of_block[block]
                place = 0
                energy, height = 0.0, 0.0
                coefficients[:] = 0.0
                while place < 64:
                    byte, shift = at >> 3, at & 7
                    window = (
                        (np.int64(plain[byte]) << 32)
                        | (np.int64(plain[byte + 1]) << 24)
                        | (np.int64(plain[byte + 2]) << 16)
                        | (np.int64(plain[byte + 3]) << 8)
                        | np.int64(plain[byte + 4])
                    ) << shift & 0xFFFFFFFFFF
                    entry = codes[component, 1 if place else 0, window >> 24]
                    length, symbol = np.int64(entry >> 8), np.int64(entry & 255)
                    if length == 0:
                        return _NO_CODE if at + 16 <= end else _SHORT
                    size, run = symbol & 15, symbol >> 4
                    if place == 0:
                        size, run = symbol, 0
                        if size > 11:
                            return _NO_CODE
                    at += length + size
                    if at > end:
                        return _SHORT
                    if size == 0 and place:
                        if run == 0:
                            break
                        if run != 15:
                            return _NO_CODE
                        place += 16
                        if place > 63:
                            return _TOO_LONG
                        continue
                    place += run
                    if place > 63:
                        return _TOO_LONG
                    value = (window >> (40 - length - size)) & ((1 << size) - 1)
                    if size and value < 1 << (size - 1):
                        value -= (1 << size) - 1
                    if place == 0:
                        direct[component] += value
                        value = direct[component]
                        if abs(2 * value * steps[component, 0]) > 2048 + steps[component, 0]:
                            return _IMPOSSIBLE
                    scaled = float(value * steps[component, place])
                    if scaled == 0.0 and value != 0:
                        return _IMPOSSIBLE  # a step of 0; where no coefficient uses it, no matter
                    energy += scaled * scaled
                    height += abs(scaled)
                    position = _ZIGZAG[place]
                    coefficients[position >> 3, position & 7] = scaled
                    place += 1
                if energy > roughest[component]:
                    return _IMPOSSIBLE
                if height > 4.0 * (128.0 + beyond[component]):
                    pixels = waves.T @ coefficients @ waves
                    if np.max(np.abs(pixels)) > 128.0 + beyond[component]:
                        return _IMPOSSIBLE
            unit += 1
        at = (at + 7) >> 3  # the rest of the last byte fills it up
        may_stay = end_mark_bytes if part == ends.size - 2 else 0
        if at + may_stay < ends[part + 1]:
            filler = plain[at]
            if filler not in (0, 255):
                return _LEFT_OVER
            for place in range(at, ends[part + 1]):
                if plain[place] != filler:
                    return _LEFT_OVER
    return _COMPLETE
