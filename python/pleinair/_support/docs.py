"""Passages of docstrings that many functions share, written once."""

from __future__ import annotations

import re
from typing import Any, TypeVar

Documented = TypeVar("Documented")

PASSAGES = {
    "progress": """progress : None, True or callable
    `progress(done, total)`; True shows a tqdm bar.""",
    "out": """out : ndarray, optional
    Where to write; shape and dtype of the result, C-contiguous.""",
    "rng": """rng : None, int, SeedSequence, BitGenerator or Generator
    Seed (SPEC 7). Same `rng`, same bits, whatever the number of threads.""",
}


def documented(thing: Documented) -> Documented:
    """Put the passages into a docstring: a line ``{name}`` becomes the passage, indented as the line is."""
    made: Any = thing
    if made.__doc__:

        def passage(line: re.Match[str]) -> str:
            return PASSAGES[line[2]].replace("\n", "\n" + line[1]).join((line[1], ""))

        made.__doc__ = re.sub(r"(?m)^( *)\{(\w+)\}$", passage, made.__doc__)
    return thing
