"""Videos as people see them: played by Chromium, drawn to a canvas, compared with the frames they were made of."""

import base64
import sys
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from chromium import Browser, executable

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(executable() is None, reason="no Chromium: scripts/install-chromium.sh installs it"),
]

sys.path.insert(0, str(Path(__file__).parents[1] / "house"))
from test_film import PATCHES, bars

FRAMES = [bars(4 * k) for k in range(10)]
PLAY = """
window.shown = null;
const video = document.createElement("video");
video.muted = true;
video.src = "data:%s;base64,%s";
video.onerror = () => { window.shown = {error: video.error.message}; };
video.onseeked = () => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [video.videoWidth, video.videoHeight];
    const context = canvas.getContext("2d");
    context.drawImage(video, 0, 0);
    const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
    let text = "";
    for (const v of data) text += String.fromCharCode(v);
    window.shown = {size: [canvas.width, canvas.height], seconds: video.duration, levels: btoa(text)};
};
video.onloadeddata = () => { video.currentTime = 0.55; };
0
"""


@pytest.mark.parametrize(("name", "kind"), [("a.mp4", "video/mp4"), ("a.webm", "video/webm")])
def test_chromium_shows_the_frames(tmp_path, name, kind):
    path = pa.io.write_video(tmp_path / name, FRAMES, fps=10)
    browser = Browser()
    try:
        browser.open("about:blank")
        browser.run(PLAY % (kind, base64.b64encode(path.read_bytes()).decode()))
        browser.until("window.shown !== null")
        shown = browser.run("window.shown")
    finally:
        browser.close()
    assert "error" not in shown, shown
    assert shown["size"] == [320, 180]
    assert shown["seconds"] == pytest.approx(1, abs=0.01)
    levels = np.frombuffer(base64.b64decode(shown["levels"]), np.uint8).reshape(180, 320, 4)[..., :3]
    off = np.abs(levels.astype(int) - FRAMES[5])
    assert off.mean() <= 2.5
    for top, left in PATCHES.values():
        assert off[top + 8 : top + 16, left + 8 : left + 16].mean() <= 4, "Rec. 601 is 15 off"
