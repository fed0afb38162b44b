"""Species of trees as parameters of growth: oak, poplar, birch, pine and others. Public as `pleinair.plants`."""

from __future__ import annotations

import functools
from typing import Any

from .._support.inputs import choice
from .tree_params import BranchParams, LeafParams, TreeParams, TrunkParams


# One unit is a metre. Shapes of free-standing trees, of two levels of branches where the outline needs them. Leaves are a
# painter's, twice as large as would be a botanist's, and as many of them stay in the distance as it takes to hold the
# silhouette (tests/papers/test_corot_detail.py).
@functools.cache
def _species() -> dict[str, TreeParams]:
    return {
        "oak": TreeParams(
            trunk=TrunkParams(
                width=(0.95, 0.06),
                steps=14,
                max_length=(9.5, 0.6),
                length=(0.7, 0.08),
                twist=(17, 8),
                taper=(0.93, 0.02),
                bend=6,
                roughness=0.05,
            ),
            branches=(
                BranchParams(
                    low=2.6,
                    probability=0.42,
                    joint_taper=(0.6, 0.1),
                    angle=58,
                    profile=(1.0, 1.15, 0.65),
                    steps=12,
                    max_length=(5.6, 0.7),
                    length=(0.55, 0.1),
                    twist=(8, 10),
                    taper=(0.9, 0.02),
                    bend=13,
                    tropism=3,
                ),
                BranchParams(
                    low=1.3,
                    probability=0.14,
                    joint_taper=(0.6, 0.1),
                    angle=48,
                    profile=(1.0, 0.8, 0.5),
                    steps=6,
                    max_length=(1.9, 0.4),
                    length=(0.4, 0.08),
                    taper=(0.85, 0.03),
                    bend=15,
                    tropism=2,
                ),
            ),
            leaves=LeafParams(
                lowest_step=11,
                from_center=4,
                probability=0.42,
                angle=125,
                distance=0.24,
                steps=6,
                wobble=28,
                size=(0.84, 0.72),
                bias=0.25,
                variance=0.2,
            ),
            name="oak",
            kind="oak",
        ),
        "poplar": TreeParams(
            trunk=TrunkParams(
                width=(0.5, 0.03),
                steps=30,
                max_length=(19, 1),
                length=(0.7, 0.08),
                twist=(23, 8),
                taper=(0.955, 0.01),
                bend=1.6,
                roughness=0.03,
            ),
            branches=(
                BranchParams(
                    low=1.8,
                    probability=0.62,
                    joint_taper=(0.3, 0.05),
                    angle=24,
                    profile=(0.9, 1.15, 0.45),
                    steps=9,
                    max_length=(3.6, 0.5),
                    length=(0.45, 0.08),
                    taper=(0.88, 0.02),
                    bend=6,
                    tropism=5,
                ),
            ),
            leaves=LeafParams(
                lowest_step=24,
                from_center=3,
                probability=0.34,
                angle=140,
                distance=0.2,
                steps=5,
                wobble=22,
                size=(0.68, 0.68),
                bias=0.15,
                variance=0.2,
            ),
            name="poplar",
            kind="poplar",
        ),
        "birch": TreeParams(
            trunk=TrunkParams(
                width=(0.32, 0.03),
                steps=24,
                max_length=(13, 1),
                length=(0.58, 0.06),
                twist=(25, 8),
                taper=(0.945, 0.01),
                bend=2.5,
                roughness=0.02,
            ),
            branches=(
                BranchParams(
                    low=3.2,
                    probability=0.62,
                    joint_taper=(0.42, 0.06),
                    angle=42,
                    profile=(1.0, 0.9, 0.35),
                    steps=11,
                    max_length=(3.9, 0.5),
                    length=(0.4, 0.07),
                    taper=(0.88, 0.02),
                    bend=8,
                    tropism=-4.5,
                ),
            ),
            leaves=LeafParams(
                lowest_step=20,
                from_center=4,
                probability=0.36,
                angle=130,
                distance=0.16,
                steps=7,
                wobble=16,
                droop=16,
                size=(0.56, 0.52),
                bias=0.45,
                variance=0.2,
            ),
            name="birch",
            kind="birch",
        ),
        "willow": TreeParams(
            trunk=TrunkParams(
                width=(0.9, 0.08),
                steps=11,
                max_length=(7.2, 0.3),
                length=(0.6, 0.08),
                twist=(18, 8),
                taper=(0.93, 0.02),
                bend=3.5,
                roughness=0.06,
            ),
            branches=(
                BranchParams(
                    low=3.4,
                    probability=0.75,
                    joint_taper=(0.5, 0.08),
                    angle=38,
                    profile=(0.8, 1.0, 1.0),
                    steps=14,
                    max_length=(5.8, 0.6),
                    length=(0.48, 0.08),
                    twist=(6, 8),
                    taper=(0.89, 0.02),
                    bend=9,
                    tropism=-6,
                ),
            ),
            leaves=LeafParams(
                lowest_step=9,
                from_center=3,
                probability=0.62,
                angle=120,
                distance=0.3,
                steps=8,
                wobble=13,
                droop=20,
                size=(0.4, 0.84),
                bias=0.35,
                variance=0.2,
                inside_growth=0.3,
            ),
            name="willow",
            kind="willow",
        ),
        "pine": TreeParams(
            trunk=TrunkParams(
                width=(0.5, 0.04),
                steps=34,
                max_length=(16, 1),
                length=(0.5, 0.04),
                twist=(31, 8),
                taper=(0.945, 0.008),
                bend=1.2,
                roughness=0.02,
            ),
            branches=(
                BranchParams(
                    low=2.4,
                    probability=0.75,
                    joint_taper=(0.26, 0.04),
                    angle=98,
                    profile=(1.0, 0.55, 0.06),
                    steps=12,
                    max_length=(4.4, 0.35),
                    length=(0.4, 0.05),
                    taper=(0.87, 0.02),
                    bend=4,
                    tropism=-1.2,
                ),
            ),
            leaves=LeafParams(
                lowest_step=32,
                from_center=2,
                probability=0.42,
                angle=120,
                distance=0.13,
                steps=4,
                wobble=14,
                droop=6,
                size=(0.84, 0.52),
                bias=0.1,
                variance=0.2,
                inside_growth=0.3,
            ),
            name="pine",
            kind="pine",
        ),
        "shrub": TreeParams(
            trunk=TrunkParams(
                width=(0.24, 0.04),
                steps=6,
                max_length=(0.95, 0.1),
                length=(0.16, 0.03),
                twist=(28, 10),
                taper=(0.92, 0.03),
                bend=8,
                roughness=0.04,
            ),
            branches=(
                BranchParams(
                    low=0.05,
                    probability=0.85,
                    joint=(0.02, 0.005),
                    joint_taper=(0.4, 0.08),
                    angle=40,
                    profile=(1.0, 1.1, 0.9),
                    steps=9,
                    max_length=(1.35, 0.25),
                    length=(0.17, 0.03),
                    taper=(0.88, 0.03),
                    bend=14,
                    tropism=2,
                ),
            ),
            leaves=LeafParams(
                lowest_step=5,
                from_center=3,
                probability=0.8,
                angle=120,
                distance=0.09,
                steps=5,
                wobble=30,
                size=(0.3, 0.26),
                bias=0.15,
                variance=0.25,
            ),
            name="shrub",
            kind="shrub",
        ),
        "bare": TreeParams(
            trunk=TrunkParams(
                width=(0.8, 0.06),
                steps=15,
                max_length=(9, 0.8),
                length=(0.65, 0.1),
                twist=(20, 10),
                taper=(0.9, 0.03),
                bend=9,
                roughness=0.07,
            ),
            branches=(
                BranchParams(
                    low=2.2,
                    probability=0.24,
                    joint_taper=(0.55, 0.1),
                    angle=50,
                    profile=(0.9, 1.0, 0.5),
                    steps=11,
                    max_length=(4.6, 0.9),
                    length=(0.48, 0.12),
                    taper=(0.86, 0.04),
                    bend=17,
                    roughness=0.06,
                    tropism=2,
                ),
                BranchParams(
                    low=0.8,
                    probability=0.28,
                    joint_taper=(0.6, 0.1),
                    angle=45,
                    profile=(1.0, 0.8, 0.4),
                    steps=7,
                    max_length=(1.7, 0.5),
                    length=(0.3, 0.08),
                    taper=(0.8, 0.04),
                    bend=18,
                    roughness=0.06,
                    tropism=2,
                ),
            ),
            leaves=LeafParams(probability=0.0),
            name="bare",
            kind="bare",
        ),
        # Fig. 13 does not give the bias.
        "thesis": TreeParams(leaves=LeafParams(bias=0.25), name="thesis", kind="thesis"),
    }


def presets() -> list[str]:
    """Return the kinds of trees.

    Returns
    -------
    list of str
        For `preset`: "oak", "poplar", "birch", "willow", "pine", "shrub", "bare" (a dead tree) and "thesis" (one level of
        branches, leaves by the numbers of Fig. 13).

    Examples
    --------
    >>> "oak" in presets()
    True
    """
    return list(_species())


def preset(name: str, /, **changes: Any) -> TreeParams:
    """Return the parameters of a kind of tree.

    Parameters
    ----------
    name : str
        One of `presets()`.
    **changes : Any
        As of `TreeParams.replace`.

    Returns
    -------
    TreeParams
        One unit is a metre.

    Raises
    ------
    ValueError, TypeError
        There is no such kind; a change is unknown or out of range.

    Examples
    --------
    >>> preset("willow", leaves__size=(0.1, 0.4)).leaves.size
    (0.1, 0.4)
    """
    choice(name, "name", tuple(_species()))
    return _species()[name].replace(**changes)
