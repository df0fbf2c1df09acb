# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the solver's tests: tetrahedral meshes of the cube of every kind, made once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings

from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS, Resolution
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.tets.mesh import TetMesh

from .baking import engine_available
from .meshes import icosphere, jittered_grid, kuhn_grid, random_delaunay

# On a busy machine any example can take long; how long a test may take is decided by its number of examples.
settings.register_profile("solver", deadline=None)
settings.load_profile("solver")


@pytest.fixture(scope="session", params=["kuhn grid", "jittered grid", "random delaunay", "delaunay", "tetwild"])
def mesh(request: pytest.FixtureRequest) -> TetMesh:
    """A mesh of the cube: three made here, and a sphere's surroundings by each engine."""
    made = {"kuhn grid": lambda: kuhn_grid(5), "jittered grid": lambda: jittered_grid(5, seed=1)}
    made["random delaunay"] = lambda: random_delaunay(150, seed=2)
    if request.param in made:
        return made[request.param]()
    if not engine_available(request.param):
        pytest.skip(f"the engine {request.param} cannot run here")
    return fill_cube(*icosphere(1), FitOptions(engine=request.param)).mesh


@pytest.fixture(scope="module")
def coarse_volume() -> Iterator[None]:
    """Quality ``normal`` ten times as fast, for what does not depend on how fine the volume is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(RESOLUTIONS, "normal", Resolution(spacing=0.07, slope=0.4, largest=0.2))
        yield
