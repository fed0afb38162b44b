"""Strokes beside llvmpipe (the same masks as a fragment shader) and Skia (masks baked into an atlas).

1280×720, square sprites spread evenly, sizes ±30 %. Truth: the reference compositor, on 320×180 with the same density.
CPU time of the process on one thread, but llvmpipe's threads count too, so its is the CPU time of all of them.
Skia blends bytes and cannot be compared in value; llvmpipe blends back to front in 16-bit floats.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
import pleinair as pa
from pleinair import paint
from pleinair.report import Row, race

ROOM = "corot"
WIDTH, HEIGHT = 1280, 720
# Sprites, pixels.
CASES = ((20_000, 24.0), (200_000, 12.0), (1_000_000, 8.0))


def cloud(n: int, size: float, width: int, height: int, twist: bool = False) -> paint.Sprites:
    rng = np.random.default_rng(0)
    return paint.Sprites(
        rng.random((n, 2)) * [width, height],
        size * rng.uniform(0.7, 1.3, (n, 1)) * np.ones(2),
        rng.uniform(1, 10, n),
        rng.random((n, 3)),
        rotation=rng.uniform(-180, 180, n) if twist else 0.0,
    )


def area(sprites: paint.Sprites) -> float:
    """Sprite area [Mpx]."""
    return float(sprites.size.prod(axis=1, dtype=float).sum()) / 1e6


def error(n: int, size: float, twist: bool, **kw: object) -> float:
    small = cloud(n // 64, size, 160, 90, twist)
    fast, slow = (paint.composite(small, 160, 90, method=m, **kw) for m in ("fast", "reference"))
    return float(np.abs(fast.rgb - slow.rgb).max())


SHADER = """
#version 330
flat in vec3 color; flat in uint key; in vec2 st; out vec4 frag;
vec2 gradient(ivec2 c) {
    uint h = (uint(c.x) * 0x8DA6B343u ^ key ^ (uint(c.y) * 0xD8163841u)) * 0x7FEB352Du;
    h = (h ^ (h >> 15)) * 0x846CA68Bu;
    return vec2(float(int(h)), float(int(h << 16))) / 2147483648.0;
}
void main() {
    vec2 u = (st - 0.5) * 4.0 + 0.37, c = floor(u), x = u - c;
    ivec2 i = ivec2(c);
    vec2 f = x * x * x * (x * (x * 6.0 - 15.0) + 10.0);
    float n = mix(mix(dot(gradient(i), x), dot(gradient(i + ivec2(1, 0)), x - vec2(1, 0)), f.x),
                  mix(dot(gradient(i + ivec2(0, 1)), x - vec2(0, 1)), dot(gradient(i + 1), x - 1.0), f.x), f.y);
    float edge = pow(max(sin(3.14159265 * st.x) * cos(3.14159265 * (st.y - 0.5)), 0.0), 0.32192809);
    frag = vec4(color, 0.9 * smoothstep(0.4, 0.6, min(0.5 + n, 1.0) * edge));
}
"""
VERTEX = """
#version 330
in vec2 corner; in vec2 center; in vec2 size; in vec3 rgb; in uint label;
flat out vec3 color; flat out uint key; out vec2 st;
void main() {
    st = corner; color = rgb; key = label * 2654435761u;
    vec2 at = (center + (corner - 0.5) * size) / vec2(1280.0, 720.0);
    gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
}
"""


def llvmpipe(sprites: paint.Sprites) -> tuple[str, Callable[[], object]] | None:
    """The same work as an OpenGL program on the CPU."""
    try:
        import moderngl

        context = moderngl.create_standalone_context(backend="egl")
    except Exception:  # noqa: BLE001  whatever is missing: no rival then
        return None
    if "llvmpipe" not in context.info["GL_RENDERER"]:
        return None
    back = np.argsort(-sprites.depth)
    program = context.program(vertex_shader=VERTEX, fragment_shader=SHADER)
    corners = context.buffer(np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32).tobytes())
    table = np.zeros(len(sprites), [("c", "f4", 2), ("s", "f4", 2), ("rgb", "f4", 3), ("label", "u4")])
    table["c"], table["s"], table["rgb"] = sprites.center[back], sprites.size[back], sprites.color[back]
    table["label"] = sprites.label[back]
    each = context.buffer(table.tobytes())
    array = context.vertex_array(
        program, [(corners, "2f", "corner"), (each, "2f 2f 3f 1u/i", "center", "size", "rgb", "label")]
    )
    frame = context.framebuffer([context.texture((WIDTH, HEIGHT), 4, dtype="f2")])
    context.enable(moderngl.BLEND)
    context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA

    def draw() -> object:
        frame.use()
        frame.clear()
        array.render(moderngl.TRIANGLE_STRIP, instances=len(sprites))
        return frame.read(components=4, dtype="f2")

    assert np.frombuffer(draw(), np.float16).max() > 0.5, "something is painted"
    return f"{context.info['GL_RENDERER'].split('(')[0].strip()}, the same shader", draw


def skia(sprites: paint.Sprites) -> tuple[str, Callable[[], object]] | None:
    """Masks from an atlas of bytes, without their procedural freedom."""
    try:
        import skia as sk
    except ImportError:
        return None
    masks = np.zeros((512, 512, 4), np.uint8)
    for k in range(64):
        a = (255 * paint.mask(k, 64, 64)).astype(np.uint8)
        masks[64 * (k // 8) : 64 * (k // 8) + 64, 64 * (k % 8) : 64 * (k % 8) + 64] = a[..., None]
    image = sk.Image.fromarray(masks)
    back = np.argsort(-sprites.depth)
    forms = [
        sk.RSXform(w / 64, 0, x - w / 2, y - w / 2)
        for (x, y), w in zip(sprites.center[back].tolist(), sprites.size[back, 0].tolist(), strict=True)
    ]
    places = [sk.Rect.MakeXYWH(64 * (k % 8), 64 * (k // 8 % 8), 64, 64) for k in range(len(sprites))]
    colors = [sk.ColorSetRGB(*c) for c in (255 * sprites.color[back]).astype(int).tolist()]
    surface = sk.Surface(WIDTH, HEIGHT)

    def draw() -> object:
        canvas = surface.getCanvas()
        canvas.clear(0)
        canvas.drawAtlas(
            image, forms, places, colors, sk.BlendMode.kModulate, sk.SamplingOptions(sk.FilterMode.kLinear)
        )
        return surface.toarray()

    assert draw()[..., :3].max() > 100, "something is painted"
    return f"skia-python {sk.__version__} drawAtlas", draw


def strokes() -> Iterator[Row]:
    """Hard order, upright, beside the rivals."""
    pa.set_num_threads(1)
    for n, size in CASES:
        sprites = cloud(n, size, WIDTH, HEIGHT)
        contenders = {"pleinair": lambda s=sprites: paint.composite(s, WIDTH, HEIGHT)}
        errors = {"pleinair": error(n, size, False)}
        for rival in (llvmpipe, skia) if n < 1_000_000 else ():
            made = rival(sprites)
            if made is not None:
                contenders[made[0]], errors[made[0]] = made[1], float("nan")
        task = f"hard order ({area(sprites):.1f} Mpx)"
        yield from race(ROOM, task, f"{n}×{size:g} px", contenders, errors, "1", rounds=5, budget=30)


def orders_and_twist() -> Iterator[Row]:
    """What slabs and rotation cost."""
    pa.set_num_threads(1)
    for n, size in CASES:
        upright, twisted = (cloud(n, size, WIDTH, HEIGHT, twist) for twist in (False, True))
        slab = {"order": "slab", "delta": 0.05}
        contenders = {
            "upright, hard order": lambda s=upright: paint.composite(s, WIDTH, HEIGHT),
            "upright, slabs": lambda s=upright: paint.composite(s, WIDTH, HEIGHT, order="slab", delta=0.05),
            "twisted, hard order": lambda s=twisted: paint.composite(s, WIDTH, HEIGHT),
        }
        errors = dict(
            zip(contenders, (error(n, size, False), error(n, size, False, **slab), error(n, size, True)), strict=True)
        )
        yield from race(ROOM, "slabs and twist", f"{n}×{size:g} px", contenders, errors, "1", rounds=3, budget=30)


def threads() -> Iterator[Row]:
    """Wall time with two threads over one."""
    for n, size in CASES:
        sprites = cloud(n, size, WIDTH, HEIGHT)

        def paint_with(count: int, sprites: paint.Sprites = sprites) -> object:
            pa.set_num_threads(count)
            return paint.composite(sprites, WIDTH, HEIGHT)

        contenders = {"two threads": lambda f=paint_with: f(2), "one thread": lambda f=paint_with: f(1)}
        wrong = error(n, size, False)
        yield from race(
            *(ROOM, "threads, wall", f"{n}×{size:g} px", contenders, dict.fromkeys(contenders, wrong), "1"),
            rounds=5,
            clock=time.perf_counter,
        )


def rows() -> Iterator[Row]:
    """Measure."""
    try:
        yield from strokes()
        yield from orders_and_twist()
        yield from threads()
    finally:
        pa.set_num_threads(None)
