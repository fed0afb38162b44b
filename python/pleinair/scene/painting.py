"""Strokes of a frame as radiance: shaded, lit, mirrored in water, behind air; the canvas and the layers of a picture.

Far away, where a style has an atmosphere of its own, a stroke of a ground stands for many whose normals cancel: its light goes
part of the way to that of a level ground, as the thesis has contrast fall with distance (S16).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._core import scene_in_view
from ..camera import Camera
from ..paint import Canvas, Shading, Strokes, composite, join, shade
from .frame import Environment, combined_visibility, lit, reflectance
from .objects import Ground, Placed
from .parts import UNDERCOAT, Part, material_of, own_material
from .report import Account, Layer, accounted, layer, layer_rows, visibility_report
from .sky_strokes import sky_strokes
from .stroke_shadows import distance_of, stroke_shadows
from .strokes import lean, standing
from .water import frame_box, fresnel_reflection, mirror_camera, mirrored_canvas
from .weather import falling, lies, on_ground, on_strokes

# Slabs are a share of a stroke's own width thick, to both sides [1]. Strokes of a ground are broad and lie close to
# what stands on it, with which they should not mix.
_SLAB, _SLAB_OF_LEAVES = 0.25, 1.0
# How far the light of a ground goes to that of a level one in the background [1].
_CALM = 0.5

# Left, top, right and bottom of a part of a picture [px].
Window = tuple[float, float, float, float]


def light_left(scene: Any, part: Part, strokes: Strokes) -> list[Any]:
    """Return which share of each lamp's light the shadows of strokes and clouds leave where strokes are."""
    environment: Environment = scene._environment
    bare = part.kind == UNDERCOAT or np.ndim(strokes.lit) == 0
    shares: list[Any] = []
    for (to, _), shaded in zip(environment.lamps, scene._clouded, strict=True):
        left = scene._backdrop.cloud_shadow(to, strokes.position) if shaded else None
        own = None if bare else strokes.lit
        shares.append(own if left is None else left if own is None else left * own)
    return shares


def box_of(scene: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest corner of a box around all strokes of a scene [m]."""
    places = [standing(part, scene._style, scene.grown).position for part in scene.parts]
    places = [p for p in places if len(p)]
    if not places:
        return np.zeros(3), np.zeros(3)
    return np.min([p.min(axis=0) for p in places], axis=0), np.max([p.max(axis=0) for p in places], axis=0)


def clouded(scene: Any) -> list[bool]:
    """Return for each lamp whether clouds take any of its light from strokes: known before one of them is looked at."""
    lamps = scene._environment.lamps
    return [scene.cast_shadows and scene._backdrop.clouds_reach(to, *scene._box) for to, _ in lamps]


def plain_of(scene: Any) -> tuple[NDArray[np.float64], float] | None:
    """Return reflectance and level [m] of the broadest ground of a scene."""
    grounds = [(p, p.object.particles) for p in scene.parts if p.kind == UNDERCOAT and isinstance(p.object, Ground)]
    if not grounds:
        return None
    part, p = max(grounds, key=lambda pair: float(np.ptp(pair[1].position[:, :2], axis=0).prod()))
    albedo = on_ground(reflectance(scene._style.material(own_material(part))), scene.weather)
    return albedo, float(np.median(p.position[:, 2]))


def lit_strokes(
    scene: Any, camera: Camera | None, window: Window | None = None, mirror: float | None = None
) -> dict[Part, Strokes]:
    """Return the strokes of all parts, each with the light that reaches it; with a window only those that may be in it.

    With `mirror` those above that level, which may hang in it mirrored.
    """
    found = {part: standing(part, scene._style, scene.grown) for part in scene.parts}
    found = {part: strokes for part, strokes in found.items() if len(strokes)}
    chosen: dict[Part, NDArray[np.int64] | None] = dict.fromkeys(found)
    if camera is not None and window is not None:
        for part, strokes in found.items():
            grown = 1.0 if strokes.growth is None else float(strokes.growth[:, 0].max())
            there = scene_in_view(camera, strokes.position, strokes.size, grown, window, mirror)
            if strokes.fade is not None and len(there):
                # What has faded is not painted.
                d = distance_of(strokes, camera, scene.circles)
                there = there[
                    strokes.fade[there, 1] > (d[there] if strokes.object is None else d[strokes.object[there]])
                ]
            chosen[part] = None if len(there) == len(strokes) else there
    out = {}
    lights = scene.light() if scene.cast_shadows else ()
    shares: list[Any] = []
    if found and lights:
        casts = [part.casts for part in found]
        lists, which = list(found.values()), list(chosen.values())
        with layer("shadows of strokes"):
            shares = [
                stroke_shadows(
                    lists, casts, light.direction, scene._style, camera, scene.circles, which, scene._moving_sun
                )
                for light in lights
            ]
    above: Any = None
    if found and lies(scene.weather):
        # Snow falls from above: what stands in its way is what would stand in a light's.
        casts, lists, which = [part.casts for part in found], list(found.values()), list(chosen.values())
        with layer("shadows of strokes"):
            above = stroke_shadows(lists, casts, (0.0, 0.0, 1.0), scene._style, camera, scene.circles, which, False)
    for k, (part, strokes) in enumerate(found.items()):
        index = chosen[part]
        if index is not None and not len(index):
            continue
        turned = camera is not None and part.kind == "trunk" and isinstance(part.object, Placed)
        twist = lean(part, camera, slice(None) if index is None else index) if turned else None  # type: ignore[arg-type]
        one = strokes._with(index) if twist is None else strokes._with(index, twist=twist)
        # Only what a surface looks like depends on its own strokes: it is lit as if it lay bare.
        if shares and part.kind != UNDERCOAT:
            own = [share[k] for share in shares]
            one = one._with(lit=own[0] if len(own) == 1 else combined_visibility(one, lights, own))
        if above is not None:
            object.__setattr__(one, "_from_above", above[k])
        out[part] = one
    return out


def visible_strokes(scene: Any, camera: Camera) -> dict[Part, Strokes]:
    """Return the strokes that may be in a frame, each with the light that reaches it."""
    return lit_strokes(scene, camera, (0.0, 0.0, float(camera.width), float(camera.height)))


def shaded_parts(scene: Any, parts: dict[Part, Strokes], camera: Camera) -> list[Shading]:
    """Return the strokes of all parts as they are painted."""

    def shaded(part: Part, strokes: Strokes, camera: Camera, lights: Any, original: Strokes) -> Shading:
        circles = scene.trunk_circles if part.kind == "trunk" and scene.trunk_circles else scene.circles
        style = scene._full_size_style if part.kind in ("trunk", UNDERCOAT) else scene._effective_style
        one = shade(strokes, style, camera, lights, circles=circles, close=scene.close)
        left = light_left(scene, part, original)
        falls = scene._environment.irradiance(original.normal, left)
        if isinstance(part.object, Ground) and scene.visibility is None and style.atmosphere.strength > 0:
            level = np.zeros_like(original.normal)
            level[:, 2] = 1
            calm = (_CALM * one.distance)[:, None]
            falls = falls + calm * (scene._environment.irradiance(level, left) - falls)
        material = style.material(strokes.material)
        one = lit(one, material, falls)
        if scene.weather and not is_mirror(part, scene):
            open_ = getattr(original, "_from_above", None)
            leaves = part.kind == "leaves"
            return on_strokes(scene.weather, one, reflectance(material), falls, original.normal, open_, leaves)
        return one

    def behind_air(one: Shading, strokes: Strokes, camera: Camera) -> Shading:
        backdrop, sprites = scene._backdrop, one.sprites
        backdrop.through_air(strokes.position, camera, scene.visibility, sprites.color, sprites.variation)
        return one

    def dry_shaded(part: Part, original: Strokes) -> Any:
        def of(strokes: Strokes, camera: Camera, lights: Any) -> Shading:
            return behind_air(shaded(part, strokes, camera, lights, original), strokes, camera)

        return of

    def hung(water: Shading, level: float) -> Canvas | None:
        """Paint what stands above water as it hangs below it, where the water is in the frame."""
        view = mirror_camera(camera)
        window = frame_box(water.sprites, camera, view)
        if window is None:
            return None
        found = lit_strokes(scene, view, window, level)
        dry = [(strokes, dry_shaded(p, strokes)) for p, strokes in found.items() if not is_mirror(p, scene)]
        return mirrored_canvas(dry, level, view, scene.light()) if dry else None

    out = []
    for part, strokes in parts.items():
        one = shaded(part, strokes, camera, scene.light(), strokes)
        if is_mirror(part, scene):
            level = float(standing(part, scene._style, scene.grown).position[:, 2].mean())
            with layer("water"):
                reflected = hung(one, level) if camera.position[2] > level else None
                one = fresnel_reflection(one, strokes, camera, scene._backdrop, reflected, scene.visibility, level)
        out.append(behind_air(one, strokes, camera))
    return out


def is_mirror(part: Part, scene: Any) -> bool:
    """Return whether a part shows what is above it."""
    return isinstance(part.object, Ground) and part.kind != UNDERCOAT and material_of(part, scene._style).reflective


Frame: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32]]


def canvas_of(parts: dict[Part, Strokes], shaded: list[Shading], camera: Camera, order: str, **more: Any) -> Canvas:
    """Composite the strokes of all parts, the nearest over the others, in slabs or not."""
    delta = None
    if order == "slab":
        shares = [_SLAB_OF_LEAVES if part.kind == "leaves" else _SLAB for part in parts]
        widths = [strokes.size[:, 0].astype(np.float64) for strokes in parts.values()]
        delta = np.concatenate([share * width for share, width in zip(shares, widths, strict=True)])
    sprites = join(one.sprites for one in shaded)
    return composite(sprites, camera.width, camera.height, order=order, delta=delta, **more)


def behind(scene: Any, camera: Camera, through: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
    """Return what is behind the strokes of a frame: sky, clouds and the plain, this only where strokes let it through."""
    with layer("sky"):
        seen = above(scene, camera)
    if scene._plain is not None:
        with layer("plain"):
            paint_plain(scene, seen, camera, through)
    return seen


def above(scene: Any, camera: Camera) -> NDArray[np.float32]:
    """Return sky and clouds, in strokes where they are painted."""
    seen: NDArray[np.float32]
    seen, through = scene._backdrop.picture(camera, scene.visibility)
    if not scene.sky_strokes:
        return seen
    # Discs and stars are no paint: they are laid over the strokes.
    points = scene._backdrop.points(camera)
    if points is not None and through is not None:
        points *= through[..., None]
    soft = seen if points is None else seen - points
    with layer("sky strokes"):
        painted = sky_strokes(soft, camera, scene.sky_strokes).over(soft)
    return painted if points is None else painted + points


def radiance_of(scene: Any, camera: Camera, order: str, method: str, progress: Any, mirrors: float = 1.0) -> Frame:
    """Return a frame as radiance, water lighter by a factor, and how much of each of its pixels is sky."""
    try:
        seen, share = _radiance_of(scene, camera, order, method, progress, mirrors)
        if scene.weather:
            backdrop = scene._backdrop
            with layer("weather"):
                falling(scene.weather, seen, camera, backdrop._around + backdrop.spread, scene.time)
        return seen, share
    finally:
        scene._backdrop.done()


def sky_share(scene: Any, camera: Camera) -> NDArray[np.float32]:
    """Return how much of each pixel is sky (height, width) where no strokes are: all but a plain."""
    if scene._plain is None:
        return np.ones((camera.height, camera.width), np.float32)
    up: NDArray[np.float64] = scene._backdrop.directions(camera)[..., 2]
    return (up >= 0).astype(np.float32)


def _radiance_of(scene: Any, camera: Camera, order: str, method: str, progress: Any, mirrors: float) -> Frame:
    parts = visible_strokes(scene, camera)
    if not parts:
        return behind(scene, camera), sky_share(scene, camera)
    with layer("strokes"):
        near = near_clouds(scene, parts, camera)
        shaded = shaded_parts(scene, parts, camera)
        if mirrors != 1:
            for part, one in zip(parts, shaded, strict=True):
                if is_mirror(part, scene):
                    for color in (one.sprites.color, one.sprites.variation):
                        np.multiply(color, np.float32(mirrors), out=color)
        canvas = canvas_of(parts, shaded, camera, order, method=method, progress=progress, seen=near)
        seen: NDArray[np.float32] = canvas.over(behind(scene, camera, canvas.transmittance))
        if near:
            veiled(scene, seen, canvas, camera)
        share = canvas.transmittance * sky_share(scene, camera)
    return seen, share


def veiled(scene: Any, picture: NDArray[np.float32], canvas: Canvas, camera: Camera) -> None:
    """Lay clouds that are nearer than strokes over them, in place: in each pixel by the distance of the two."""
    if canvas.depth is None:
        return
    for one in scene._backdrop.clouds_seen(camera, scene.visibility):
        front = (one.distance < canvas.depth) & (one.transmittance < 1) & (canvas.transmittance < 1)
        if front.any():
            hidden, through = 1 - canvas.transmittance[front][:, None], one.transmittance[front][:, None]
            picture[front] += hidden * one.rgb[front] - (1 - through) * canvas.rgb[front]


def near_clouds(scene: Any, parts: dict[Part, Strokes], camera: Camera) -> bool:
    """Return whether a cloud in view may be nearer than a stroke."""
    eye = np.array(camera.position)
    # Of the box around all: as far as anything may be.
    low, high = scene._box
    farthest = float(np.linalg.norm(np.maximum(np.abs(low - eye), np.abs(high - eye)))) if parts else 0.0
    for (cloud, _), within in zip(scene._backdrop.clouds, scene._backdrop.in_view(camera), strict=True):
        low, high = cloud.volume.bounds + cloud.at(scene.time)
        if within and np.linalg.norm(np.maximum(np.maximum(low - eye, eye - high), 0)) < farthest:
            return True
    return False


def paint_plain(
    scene: Any, picture: NDArray[np.float32], camera: Camera, through: NDArray[np.float32] | None = None
) -> NDArray[np.float64]:
    """Paint the ground beyond the broadest one up to the horizon, where it is the horizon's; return distances [m]."""
    albedo, level = scene._plain
    world = scene._environment
    open_, shade_ = (
        albedo * one.irradiance(np.array([[0, 0, 1]], np.float32), None)[0] / np.pi
        for one in (world, replace(world, lamps=world.lamps[1:]))
    )
    away: NDArray[np.float64] = scene._backdrop.ground_plane(
        picture, camera, open_, shade_, level, scene.visibility, through
    )
    return away


# Which layers the steps of a frame consist of.
_STEPS = {
    "sky": ("sky", "clouds", "plain", "sky strokes"),
    "strokes and shadows": ("shadows of strokes", "shadows of clouds"),
    "painting": ("frame", "strokes", "water", "air"),
    "eye": ("eye",),
}


def explained(scene: Any, camera: Camera) -> dict[str, Any]:
    """Paint a frame and return what was modelled, what each layer cost, and what was left out."""
    account = Account()
    with accounted(account), layer("frame"):
        scene.paint(camera)
        parts = {part: standing(part, scene._style, scene.grown) for part in scene.parts}
        parts = {part: strokes for part, strokes in parts.items() if len(strokes)}
        rows, left = visibility_report(parts, camera)
        there = scene._backdrop.in_view(camera)
        dark = len(scene._backdrop._bare._lights()) - len(scene._backdrop.light_sources)
    for k, within in enumerate(there):
        if not within:
            left.append("the cloud is out of view" if len(there) == 1 else f"cloud {k + 1} is out of view")
    if dark and scene.lights is None:
        left.append(f"{dark} of Sun and Moon: set, or too faint beside the other")
    why = {}
    if not parts:
        why = dict.fromkeys(("strokes", "shadows of strokes", "water"), "there are no objects")
    elif not scene.cast_shadows:
        left.append("shadows are switched off")
        why = dict.fromkeys(("shadows of strokes", "shadows of clouds"), "shadows are switched off")
    if not there:
        why |= dict.fromkeys(("clouds", "shadows of clouds"), "there are no clouds")
    elif not any(there) and "clouds" not in account.computed:
        why["clouds"] = "all are out of view"
    if not scene.sky_strokes:
        why["sky strokes"] = "the sky is smooth"
    if scene._plain is None:
        why["plain"] = "there is no ground"
    if parts and not any(is_mirror(part, scene) for part in parts):
        why["water"] = "nothing reflects"
    if not np.any(scene._backdrop._air(scene.visibility)[0]):
        why["air"] = "this sky has no air of its own, and no visibility is given"
    layers = layer_rows(account, why)
    seconds = {step: sum(account.seconds.get(name, 0.0) for name in names) for step, names in _STEPS.items()}
    sky = getattr(scene.sky, "parts", None)
    return {"strokes": rows, "layers": layers, "seconds": seconds, "sky": sky, "left out": left}


def layers_of(scene: Any, camera: Camera) -> dict[str, Layer]:
    """Return a frame in layers, the farthest first."""
    try:
        return _layers_of(scene, camera)
    finally:
        scene._backdrop.done()


def _layers_of(scene: Any, camera: Camera) -> dict[str, Layer]:
    shape = (camera.height, camera.width)
    nothing, far = np.zeros(shape, np.float32), np.full(shape, np.inf, np.float32)
    clouds = [] if scene.sky_strokes else scene._backdrop.clouds_seen(camera, scene.visibility)
    if clouds:
        out = {"sky": Layer(scene._backdrop.bare_picture(camera), nothing, far)}
        light, left, depth = np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32), far
        for one in clouds:
            light, left = one.rgb + one.transmittance[..., None] * light, one.transmittance * left
            depth = np.where(one.transmittance < 1, np.minimum(one.distance, depth), depth)
        out["clouds"] = Layer(light, np.minimum(left, 1), depth)
    else:
        # Strokes of a sky are of its clouds too.
        out = {"sky": Layer(above(scene, camera), nothing, far)}
    if scene._plain is not None:
        below = scene._backdrop.directions(camera)[..., 2] < 0
        plain = np.zeros((*shape, 3), np.float32)
        away = paint_plain(scene, plain, camera).astype(np.float32)
        out["plain"] = Layer(plain, np.where(below, 0, 1).astype(np.float32), away)
    parts = visible_strokes(scene, camera)
    if parts:
        canvas = canvas_of(parts, shaded_parts(scene, parts, camera), camera, "hard", seen=True)
        light = canvas.rgb.copy()
        if near_clouds(scene, parts, camera):
            veiled(scene, light, canvas, camera)
        out["strokes"] = Layer(light, canvas.transmittance, far if canvas.depth is None else canvas.depth)
    return out
