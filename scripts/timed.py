"""Run a command and say how much wall and CPU time it and its children took; its exit status is ours."""

import os
import subprocess
import sys
import time

start = time.perf_counter()
status = subprocess.run(sys.argv[1:], check=False).returncode
wall, spent = time.perf_counter() - start, os.times()
cpu = spent.children_user + spent.children_system
print(f"{' '.join(sys.argv[1:])}: {wall:.0f} s of wall time, {cpu:.0f} s of CPU time")
sys.exit(status)
