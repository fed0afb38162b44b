"""Run the notebooks and store what they show: `python scripts/run_notebooks.py [NAME ...]`.

Needs `pip install nbclient ipykernel`. Pictures are kept as JPEG of at most 640 pixels across, so that a notebook is below
400 kB; nothing volatile is stored: no times, no versions, no machine. Of the sources that were run a checksum is kept, so that
tests/house/test_notebooks.py can tell pictures that are older than their code.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import sys
from pathlib import Path

import nbclient
import nbformat
from PIL import Image

FOLDER = Path(__file__).parents[1] / "notebooks"
WIDEST, LARGEST = 640, 400_000


def checksum(cells: list) -> str:
    """Of the code of a notebook."""
    sources = ["".join(c["source"]) for c in cells if c["cell_type"] == "code"]
    return hashlib.sha256("\0".join(sources).encode()).hexdigest()


def jpeg(png: str, quality: int, widest: int) -> str:
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    picture.thumbnail((widest, 4 * widest), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=quality, optimize=True)
    return base64.b64encode(stream.getvalue()).decode()


def kept(output: dict, quality: int, widest: int) -> dict | None:
    """What is stored of an output."""
    if output["output_type"] == "stream":
        return None if output["name"] == "stderr" else {**output}
    data = output.get("data", {})
    if "image/png" in data:
        data = {"image/jpeg": jpeg(data["image/png"], quality, widest)}
    elif "text/plain" in data:
        data = {k: v for k, v in data.items() if k in ("text/plain", "text/html")}
    return {"output_type": "display_data", "data": data, "metadata": {}}


def run(path: Path) -> None:
    plain = json.loads(path.read_text())
    book = nbformat.reads(path.read_text(), as_version=4)
    client = nbclient.NotebookClient(
        book, timeout=900, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}
    )
    client.execute()
    for quality, widest in ((85, WIDEST), (75, WIDEST), (65, 560), (55, 480), (45, 420)):
        for cell, done in zip(plain["cells"], book["cells"], strict=True):
            if cell["cell_type"] == "code":
                cell["outputs"] = [o for o in (kept(o, quality, widest) for o in done["outputs"]) if o is not None]
                cell["execution_count"] = None
        plain["metadata"]["pleinair"] = {"checksum": checksum(plain["cells"])}
        text = json.dumps(plain, indent=1, ensure_ascii=False) + "\n"
        if len(text.encode()) <= LARGEST:
            break
    else:
        sys.exit(f"{path.name}: {len(text.encode())} bytes, more than {LARGEST}")
    temporary = path.with_suffix(".part")
    temporary.write_text(text)
    temporary.replace(path)
    print(f"{path.name}: {len(text.encode()) // 1000} kB")


if __name__ == "__main__":
    names = sys.argv[1:]
    for notebook in sorted(FOLDER.glob("*.ipynb")):
        if not names or any(name in notebook.name for name in names):
            run(notebook)
