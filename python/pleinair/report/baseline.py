"""An earlier build of pleinair in a process of its own, beside this one in the rounds of a race.

`benches/baseline.sh` builds it into ``target/baseline``; ``PLEINAIR_BASELINE`` names another interpreter.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

__all__ = ["Baseline"]

# Reads pickled requests, each answered by a pickle: the setup once, then calls, timed here by CPU time.
_CHILD = """
import pickle, sys, time
import pleinair as pa
pa.set_num_threads(1)
out, sys.stdout = sys.stdout.buffer, sys.stderr
space = {"pa": pa}
while True:
    try:
        kind, what = pickle.load(sys.stdin.buffer)
    except EOFError:
        break
    if kind == "run":
        exec(what, space)
        answer = None
    elif kind == "value":
        answer = eval(what, space)
    else:
        code, n = what
        code = compile(code, "call", "eval")
        start = time.process_time()
        for _ in range(n):
            eval(code, space)
        answer = time.process_time() - start
    pickle.dump(answer, out)
    out.flush()
"""


class _Call:
    """An expression in the other process, which times it itself."""

    def __init__(self, ask: Callable[[str, Any], Any], expression: str) -> None:
        self._ask, self._expression = ask, expression

    def __call__(self) -> Any:
        return self._ask("value", self._expression)

    def seconds(self, n: int) -> float:
        return float(self._ask("time", (self._expression, n)))


class Baseline:
    """An earlier build, ready to be raced.

    Parameters
    ----------
    setup : str
        Python statements that both builds run first; ``pa`` is pleinair.

    Attributes
    ----------
    there : bool
        Whether there is an earlier build.
    name : str
        What rows call it.

    Examples
    --------
    >>> old = Baseline("x = [3.0, 4.0]")
    >>> list(old.both("sum(x)"))[0]
    'pleinair'
    """

    name = "pleinair 5196074"

    def __init__(self, setup: str) -> None:
        self.space: dict[str, Any] = {}
        exec("import pleinair as pa", self.space)  # noqa: S102 (the statements of a bench)
        exec(setup, self.space)  # noqa: S102
        python = self.interpreter()
        self.there = python is not None
        self._process: subprocess.Popen[bytes] | None = None
        if python is not None:
            threads = {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
            pipe = subprocess.PIPE
            self._process = subprocess.Popen(
                [python, "-P", "-c", _CHILD], stdin=pipe, stdout=pipe, cwd="/", env=self.environment(python) | threads
            )
            try:
                self._ask("run", setup)
            except (EOFError, BrokenPipeError):
                print(f"{self.name} cannot run this bench: left out", file=sys.stderr)
                self.there = False
                self.close()

    @staticmethod
    def interpreter() -> str | None:
        """Return the Python of the earlier build, if there is one.

        Returns
        -------
        str or None
            Its absolute path.

        Examples
        --------
        >>> Baseline.interpreter() in (None, Baseline.interpreter())
        True
        """
        python = Path(os.environ.get("PLEINAIR_BASELINE", "target/baseline/venv/bin/python"))
        return str(python.absolute()) if python.exists() else None

    @staticmethod
    def environment(python: str) -> dict[str, str]:
        """Return the environment of an interpreter: PYTHONPATH would bring this build to another one.

        Parameters
        ----------
        python : str
            Its path.

        Returns
        -------
        dict of str to str
            This process', without PYTHONPATH for an interpreter that is not its own.

        Examples
        --------
        >>> Baseline.environment("/elsewhere/python")["PYTHONPATH"]
        ''
        """
        return dict(os.environ) if python == sys.executable else {**os.environ, "PYTHONPATH": ""}

    def _ask(self, kind: str, what: Any) -> Any:
        process = self._process
        if process is None or process.stdin is None or process.stdout is None:
            msg = "there is no earlier build"
            raise RuntimeError(msg)
        pickle.dump((kind, what), process.stdin)
        process.stdin.flush()
        return pickle.load(process.stdout)

    def both(self, expression: str) -> dict[str, Callable[[], Any]]:
        """Return contenders for `race`: an expression in this build and, where there is one, in the earlier one.

        Parameters
        ----------
        expression : str
            A Python expression in the names of the setup.

        Returns
        -------
        dict of str to callable
            ``"pleinair"`` and `name`.

        Examples
        --------
        >>> with Baseline("x = [3.0, 4.0]") as old:
        ...     old.both("sum(x)")["pleinair"]()
        7.0
        """
        code = compile(expression, "call", "eval")
        found: dict[str, Callable[[], Any]] = {"pleinair": lambda: eval(code, self.space)}
        if self.there:
            found[self.name] = _Call(self._ask, expression)
        return found

    def close(self) -> None:
        """End the other process.

        Examples
        --------
        >>> Baseline("x = 1").close()
        """
        process, self._process = self._process, None
        if process is not None:
            process.communicate()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()
