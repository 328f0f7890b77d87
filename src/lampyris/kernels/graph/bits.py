"""Bits in lines, 64 in a word, the lowest first: what one is, and how far the next one set is."""

from __future__ import annotations

from lampyris.kernels._jit import highest, kernel, lowest, u64


@kernel()
def ahead(words, at):
    """Distance from a bit to the next one set."""
    place = at + 1
    k = u64(place) >> u64(6)
    word = words[k] >> (u64(place) & u64(63))
    if word != u64(0):
        return lowest(word) + 1
    reach = 65 - (place & 63)
    k += u64(1)
    word = words[k]
    while word == u64(0):
        reach += 64
        k += u64(1)
        word = words[k]
    return reach + lowest(word)


@kernel()
def back(words, at):
    """Distance from a bit to the one set before it."""
    place = at - 1
    k = u64(place) >> u64(6)
    word = (words[k] << u64(63 - (place & 63))) & u64(0xFFFF_FFFF_FFFF_FFFF)
    if word != u64(0):
        return 64 - highest(word)
    reach = 65 + (place & 63)
    k -= u64(1)
    word = words[k]
    while word == u64(0):
        reach += 64
        k -= u64(1)
        word = words[k]
    return reach - highest(word)


@kernel()
def bit(words, at):
    """1 where a bit is set, else 0."""
    return 1 if (words[u64(at) >> u64(6)] >> (u64(at) & u64(63))) & u64(1) != u64(0) else 0
