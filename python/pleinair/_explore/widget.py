"""The explorer's messages through anywidget. Imported by `explore` only: the package itself needs numpy alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import anywidget
import traitlets

__all__ = ["Shell"]

STATIC = Path(__file__).parent / "static"


class Shell(anywidget.AnyWidget):
    """The page, and the way to it and back. Pictures travel as buffers of custom messages.

    Parameters
    ----------
    spec : dict
        What the page builds itself from.
    poster : bytes
        JPEG shown until the first answer, and for ever where no kernel runs.
    handle : callable
        Takes a message, returns a header and bytes.
    """

    _esm = STATIC / "explore.js"
    _css = STATIC / "explore.css"
    spec = traitlets.Dict().tag(sync=True)
    poster = traitlets.Bytes().tag(sync=True)
    # What the page shows when it is still, so that a second view or a reload begins there.
    state = traitlets.Dict().tag(sync=True)

    def __init__(
        self, spec: dict[str, Any], poster: bytes, handle: Callable[[Mapping[str, Any]], tuple[dict[str, Any], bytes]]
    ) -> None:
        super().__init__(spec=spec, poster=poster)
        self._handle = handle
        self.on_msg(self._answer)

    def _answer(self, _widget: Any, message: Mapping[str, Any], _buffers: Any) -> None:
        header, data = self._handle(message)
        self.send(header, buffers=[data] if data else None)
