"""Speed against error: race contenders in one process on one input, and write pages that show it.

The benches of a checkout (`benches/bench_*.py`) each offer ``rows() -> Iterable[Row]``; ``pleinair report`` runs them, holds
them to ``benches/TARGETS.toml`` and rewrites ``docs/report/``. A contender's answer is checked before it is timed; times are CPU
seconds of one thread unless a row says otherwise, medians over interleaved rounds; a ratio is the rival's time over ours in the
same rounds.
"""

from .baseline import Baseline
from .benches import check, run
from .pages import write
from .rounds import Row, machine, race

__all__ = ["Baseline", "Row", "check", "machine", "race", "run", "write"]
