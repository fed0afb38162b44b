"""Parameters of a procedural tree: those of the thesis' two panels and a few more. Public as `pleinair.plants`."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any, ClassVar

from .._support.inputs import flag, instance, integer, real, several, vector
from .._support.schema import JsonFields

Pair = tuple[float, float]


def base_and_deviation(value: Any, name: str, low: float, high: float, unit: str = "1") -> Pair:
    """Return (base, deviation); a number alone has no deviation."""
    try:
        base, sigma = (value, 0.0) if not hasattr(value, "__len__") else value
    except (TypeError, ValueError):
        msg = f"{name} must be a number or (base, deviation) [{unit}], got {value!r}"
        raise TypeError(msg) from None
    return real(base, name, low, high, unit), real(sigma, f"{name} deviation", 0, 1e9, unit)


def size_of(value: Any, name: str, unit: str) -> Pair:
    """Return (width, height); a number alone is both."""
    try:
        width, height = (value, value) if not hasattr(value, "__len__") else value
    except (TypeError, ValueError):
        msg = f"{name} must be a number or (width, height) [{unit}], got {value!r}"
        raise TypeError(msg) from None
    return real(width, name, 0, 1e9, unit), real(height, name, 0, 1e9, unit)


def _stem(part: Any, what: str) -> None:
    put = object.__setattr__
    put(part, "steps", integer(part.steps, f"{what}.steps", 0, 100_000))
    put(part, "max_length", base_and_deviation(part.max_length, f"{what}.max_length", 0, 1e9, "unit"))
    put(part, "length", base_and_deviation(part.length, f"{what}.length", 1e-6, 1e6, "unit"))
    put(part, "twist", base_and_deviation(part.twist, f"{what}.twist", -60, 60, "°"))
    put(part, "taper", base_and_deviation(part.taper, f"{what}.taper", 0.01, 1))
    put(part, "bend", real(part.bend, f"{what}.bend", 0, 90, "°"))
    put(part, "roughness", real(part.roughness, f"{what}.roughness", 0, 0.2))
    put(part, "tropism", real(part.tropism, f"{what}.tropism", -90, 90, "°"))


@dataclass(frozen=True)
class TrunkParams:
    """How a trunk grows: a cube, extruded step by step (Fig. 11).

    Lengths are in the tree's `unit`. A pair is a base value and the deviation of its normal variation, cut off at three
    deviations; a number alone does not vary.

    Parameters
    ----------
    width : float or (float, float)
        Edge of the first cube, in [1e-6, 1e6] [unit].
    steps : int
        Most extrusions, in [0, 100000] [1].
    max_length : float or (float, float)
        Length along the axis at which it ends, the cube included; the last step is shortened to it [unit].
    max_height : float or None
        Height above the ground at which it ends [unit]; None is none.
    length : float or (float, float)
        Of an extrusion, in [1e-6, 1e6]; never below a twentieth of the base [unit].
    twist : float or (float, float)
        Turn about the axis of a step, in [-60, 60] [°].
    taper : float or (float, float)
        Factor of the width of a step, in [0.01, 1] [1].
    bend : float
        Deviation of the tilt of a step about a random axis, in [0, 90] [°]. A step does not bend so far that it would
        fold through the one before.
    roughness : float
        Deviation of each corner's place as a share of the width, in [0, 0.2] [1]; the section's area never grows.
    tropism : float
        Turn towards the zenith of a step, below 0 towards the ground, in [-90, 90] [°].

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> TrunkParams(taper=0.9).taper
    (0.9, 0.0)
    """

    width: Any = (0.8, 0.05)
    steps: int = 20
    max_length: Any = (16.0, 1.0)
    max_height: float | None = None
    length: Any = (0.8, 0.1)
    twist: Any = (12.0, 6.0)
    taper: Any = (0.92, 0.02)
    bend: float = 4.0
    roughness: float = 0.03
    tropism: float = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "width", base_and_deviation(self.width, "trunk.width", 1e-6, 1e6, "unit"))
        if self.max_height is not None:
            put(self, "max_height", real(self.max_height, "trunk.max_height", 0, 1e12, "unit"))
        _stem(self, "trunk")


@dataclass(frozen=True)
class BranchParams:
    """How one level of branches grows from the faces of the level before (Fig. 11, 12).

    Pairs as in `TrunkParams`.

    Parameters
    ----------
    low : float
        Lowest place of a face that may branch [unit]: for branches of the trunk the height of the face's centroid above
        the ground, for finer ones the distance along their parent.
    high : float or None
        Highest such place [unit]; None is none.
    probability : float
        That such a face branches, in [0, 1] [1].
    joint : float or (float, float)
        Height of the first extrusion, above 0 [unit]. The face is then made planar and square; a small joint leaves no
        bulge.
    joint_taper : float or (float, float)
        Width of the branch as a share of the face's, in [0.01, 1] [1].
    angle : float
        To the parent's direction, taken within three steps, in [0, 180] [°]; 90 is the thesis'.
    profile : (float, float, float)
        Factors of `max_length` at the lowest, middle and highest place, between them a parabola, in [0, 100] [1].
    steps : int
        Most extrusions after the joint, in [0, 100000] [1].
    max_length : float or (float, float)
        Length along the axis at which it ends [unit].
    length : float or (float, float)
        Of an extrusion [unit].
    twist : float or (float, float)
        Turn about the axis of a step, in [-60, 60] [°].
    taper : float or (float, float)
        Factor of the width of a step, in [0.01, 1] [1].
    bend : float
        Deviation of the tilt of a step, in [0, 90] [°].
    roughness : float
        Deviation of each corner's place as a share of the width, in [0, 0.2] [1].
    tropism : float
        Turn towards the zenith of a step, below 0 towards the ground, in [-90, 90] [°].

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> BranchParams(probability=1).probability
    1.0
    """

    low: float = 4.0
    high: float | None = None
    probability: float = 0.4
    joint: Any = (0.05, 0.01)
    joint_taper: Any = (0.5, 0.08)
    angle: float = 60.0
    profile: Any = (1.0, 1.0, 0.4)
    steps: int = 9
    max_length: Any = (5.0, 0.8)
    length: Any = (0.6, 0.1)
    twist: Any = (0.0, 8.0)
    taper: Any = (0.86, 0.03)
    bend: float = 8.0
    roughness: float = 0.03
    tropism: float = 2.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "low", real(self.low, "branches.low", -1e12, 1e12, "unit"))
        if self.high is not None:
            put(self, "high", real(self.high, "branches.high", -1e12, 1e12, "unit"))
        put(self, "probability", real(self.probability, "branches.probability", 0, 1))
        put(self, "joint", base_and_deviation(self.joint, "branches.joint", 1e-9, 1e6, "unit"))
        put(self, "joint_taper", base_and_deviation(self.joint_taper, "branches.joint_taper", 0.01, 1))
        put(self, "angle", real(self.angle, "branches.angle", 0, 180, "°"))
        put(self, "profile", vector(self.profile, "branches.profile", 0, 100))
        _stem(self, "branches")


@dataclass(frozen=True)
class LeafParams:
    """Where leaves sprout and how they fade with distance (Fig. 13, whose numbers are the defaults).

    Parameters
    ----------
    lowest_step : int
        Lowest step of the trunk that sprouts, at least 0 [1].
    trim_top : int
        Topmost steps of the trunk that do not, at least 0 [1].
    from_center : int
        First step of a branch that sprouts, at least 0 [1]; 1 is the end of the joint.
    from_tip : int
        Last steps of a branch that do not, at least 0 [1].
    first_level : int
        Coarsest stems that sprout, at least 0 [1]: 0 with the trunk, 1 branches only.
    probability : float
        That a vertex sprouts, in [0, 1] [1].
    angle : float
        Of the first particle's normal to the backward direction of the stem, in [0, 180] [°].
    distance : float
        Between particles of a chain [unit].
    steps : int
        Particles of a chain, in [0, 60000] [1].
    wobble : float
        Deviation of the turn of a step; turns add up along the chain, in [0, 180] [°].
    droop : float
        Angle by which a chain hangs more with each step, in [0, 90] [°]; normals do not. Ours.
    center : (float, float, float) or None
        Centre of the tree above its foot, x east, y north, z up [unit]; None is the mean of the leaves. It moves no leaf.
    size : float or (float, float)
        Width and height of a particle [unit].
    variance : float
        Deviation of the size as a share of it, in [0, 1] [1].
    inside_growth : float
        Growth of the innermost over the outermost particle as a share, in [-0.9, 100] [1].
    fades : bool
        Whether leaves fade with distance.
    bias : float
        Added to both thresholds, in [-10, 10] [1].
    threshold_sigma : float
        Deviation of the thresholds, in [0, 10] [1].
    fade_length : float or (float, float)
        Length of a fade in steps of a chain, at least 0 [1]; the whole chain is the whole range of distances.
    fade_min : float
        Shortest fade in steps of a chain, at least 0 [1].
    outer : float
        Share of the distance from the centre in the order of vanishing, in [0, 1] [1]; the rest is chance. 1 is the
        thesis', 0.5 keeps the silhouette better.

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> LeafParams(size=0.5).size
    (0.5, 0.5)
    """

    lowest_step: int = 9
    trim_top: int = 0
    from_center: int = 2
    from_tip: int = 0
    first_level: int = 0
    probability: float = 0.75
    angle: float = 140.0
    distance: float = 0.45
    steps: int = 7
    wobble: float = 2.45
    droop: float = 0.0
    center: Any = None
    size: Any = (0.9, 0.9)
    variance: float = 0.15
    inside_growth: float = 0.5
    fades: bool = True
    bias: float = 0.0
    threshold_sigma: float = 0.05
    fade_length: Any = (3.0, 0.0)
    fade_min: float = 1.5
    outer: float = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("lowest_step", "trim_top", "from_center", "from_tip", "first_level"):
            put(self, name, integer(getattr(self, name), f"leaves.{name}", 0, 1_000_000))
        put(self, "steps", integer(self.steps, "leaves.steps", 0, 60_000))
        for name, low, high, unit in (
            ("probability", 0, 1, "1"),
            ("angle", 0, 180, "°"),
            ("distance", 0, 1e9, "unit"),
            ("wobble", 0, 180, "°"),
            ("droop", 0, 90, "°"),
            ("variance", 0, 1, "1"),
            ("inside_growth", -0.9, 100, "1"),
            ("bias", -10, 10, "1"),
            ("threshold_sigma", 0, 10, "1"),
            ("fade_min", 0, 1e6, "1"),
            ("outer", 0, 1, "1"),
        ):
            put(self, name, real(getattr(self, name), f"leaves.{name}", low, high, unit))
        put(self, "size", size_of(self.size, "leaves.size", "unit"))
        put(self, "fade_length", base_and_deviation(self.fade_length, "leaves.fade_length", 0, 1e6))
        put(self, "fades", flag(self.fades, "leaves.fades"))
        if self.center is not None:
            put(self, "center", vector(self.center, "leaves.center"))


@dataclass(frozen=True)
class TreeParams(JsonFields):
    """Everything that makes a tree but chance.

    Parameters
    ----------
    trunk : TrunkParams
        The trunk.
    branches : tuple of BranchParams
        One for each level of branches; the thesis has one.
    leaves : LeafParams
        The leaves.
    unit : float
        Metres of one unit, in [1e-6, 1e6] [m].
    name : str
        Of the tree.
    kind : str
        What sort of tree it is.

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> TreeParams(unit=0.5).branches[0].probability
    0.4
    >>> TreeParams.from_json(TreeParams(unit=0.1).to_json()) == TreeParams(unit=0.1)
    True
    """

    NESTED: ClassVar = {"trunk": TrunkParams, "branches": BranchParams, "leaves": LeafParams}

    trunk: TrunkParams = field(default_factory=TrunkParams)
    branches: tuple[BranchParams, ...] = (BranchParams(),)
    leaves: LeafParams = field(default_factory=LeafParams)
    unit: float = 1.0
    name: str = "tree"
    kind: str = "tree"

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.trunk, "trunk", TrunkParams)
        instance(self.leaves, "leaves", LeafParams)
        levels = several((self.branches,) if isinstance(self.branches, BranchParams) else self.branches, "branches")
        put(self, "branches", tuple(instance(level, "branches", BranchParams) for level in levels))
        put(self, "unit", real(self.unit, "unit", 1e-6, 1e6, "m"))
        for name in ("name", "kind"):
            instance(getattr(self, name), name, str)

    def replace(self, **changes: Any) -> TreeParams:
        """Return a changed copy.

        Parameters
        ----------
        **changes : Any
            Parameters of the tree, or of its parts behind the part's name and two underscores: `leaves__probability`.
            `branches__` changes every level of branches.

        Returns
        -------
        TreeParams
            The copy.

        Raises
        ------
        ValueError, TypeError
            A parameter is unknown or out of range.

        Examples
        --------
        >>> TreeParams().replace(leaves__size=0.3, unit=2).leaves.size
        (0.3, 0.3)
        """
        top: dict[str, Any] = {}
        inner: dict[str, dict[str, Any]] = {}
        for name, value in changes.items():
            part, _, rest = name.partition("__")
            if rest:
                inner.setdefault(part, {})[rest] = value
            else:
                top[name] = value
        known = {f.name for f in dataclasses.fields(self)}
        unknown = sorted(set(top) - known) + sorted(set(inner) - {"trunk", "branches", "leaves"})
        for part, values in inner.items():
            kind = {"trunk": TrunkParams, "branches": BranchParams, "leaves": LeafParams}.get(part)
            unknown += [f"{part}__{n}" for n in values if kind and n not in {f.name for f in dataclasses.fields(kind)}]
        if unknown:
            msg = f"changes have unknown parameters {unknown}"
            raise TypeError(msg)
        for part, values in inner.items():
            now = top.get(part, getattr(self, part))
            if part == "branches":
                top[part] = tuple(dataclasses.replace(level, **values) for level in now)
            else:
                top[part] = dataclasses.replace(now, **values)
        return dataclasses.replace(self, **top)
