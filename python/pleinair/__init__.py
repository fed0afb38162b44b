"""Skies, clouds and painted landscapes: four papers as one system for outdoor scenes.

Rooms load when they are first touched (PEP 562): `import pleinair` loads nothing else, not even numpy.
"""

TYPE_CHECKING = False  # as typing's, which costs more to import than all of this
if TYPE_CHECKING:
    from . import (
        astro,
        batch,
        camera,
        clouds,
        color,
        demo,
        exports,
        fit,
        image,
        io,
        paint,
        plants,
        report,
        scene,
        sky,
        tone,
        weather,
    )
    from ._core import get_num_threads
    from ._explore import explore
    from ._support.inputs import DomainWarning
    from ._support.process import set_num_threads, show_versions, version
    from .astro import Moon, Place, Sun
    from .camera import Camera
    from .scene import Scene, Timeline

    __version__: str = version()
else:
    # What is public here, and the module that has it; None is a module itself.
    _HOMES = dict.fromkeys(
        (
            *("astro", "batch", "camera", "clouds", "color", "demo", "exports", "fit", "image", "io"),
            *("paint", "plants", "report", "scene", "sky", "tone", "weather"),
        )
    ) | {
        "Camera": "camera",
        "DomainWarning": "_support.inputs",
        "Moon": "astro",
        "Place": "astro",
        "Scene": "scene",
        "Sun": "astro",
        "Timeline": "scene",
        "explore": "_explore",
        "get_num_threads": "_core",
        "set_num_threads": "_support.process",
        "show_versions": "_support.process",
    }

    def __getattr__(name):
        from importlib import import_module

        if name == "__version__":
            value = import_module("._support.process", __name__).version()
        elif name in _HOMES:
            home = _HOMES[name]
            module = import_module(f".{home or name}", __name__)
            value = getattr(module, name) if home else module
        else:
            msg = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(msg)
        globals()[name] = value
        return value

    def __dir__():
        return sorted({*globals(), *__all__} - {"TYPE_CHECKING"})


__all__ = [
    "Camera",
    "DomainWarning",
    "Moon",
    "Place",
    "Scene",
    "Sun",
    "Timeline",
    "__version__",
    "astro",
    "batch",
    "camera",
    "clouds",
    "color",
    "demo",
    "explore",
    "exports",
    "fit",
    "get_num_threads",
    "image",
    "io",
    "paint",
    "plants",
    "report",
    "scene",
    "set_num_threads",
    "show_versions",
    "sky",
    "tone",
    "weather",
]
