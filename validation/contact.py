"""The contact problem (26) in algebra: minimise ½ uᵀKu − fᵀu within bounds on u.

PETSc's SNES `vinewtonrsls` (a reduced-space active-set Newton method for variational
inequalities) finds the active set; one linear solve on that set then gives u to
round-off, and the KKT conditions are checked before anybody sees the answer.
"""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc


@dataclass
class Bounds:
    """Prescribed unknowns with their values, and bounds (±inf where there is none)."""

    fixed: np.ndarray
    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@dataclass
class ContactSolution:
    """Displacement, residual K u − f (the reactions) and the normal reactions on Γ_C."""

    displacement: np.ndarray
    residual: np.ndarray
    contact_force: float
    active: int


class ContactError(Exception):
    """The variational inequality was not solved to the accuracy a reference needs."""


def solve_linear(stiffness, load, fixed, values):
    """K u = f with u prescribed on `fixed`: MUMPS LU and two rounds of refinement."""
    fixed = np.asarray(fixed, PETSc.IntType)
    u = stiffness.createVecRight()
    u.array[fixed] = values
    reduced = stiffness.copy()
    reduced.zeroRowsColumns(fixed, diag=_diagonal_scale(stiffness))
    factor = PETSc.KSP().create(PETSc.COMM_SELF)
    factor.setOperators(reduced)
    _direct(factor)
    residual, correction = u.duplicate(), u.duplicate()
    for _ in range(3):
        stiffness.mult(u, residual)
        residual.aypx(-1.0, load)  # f − K u
        residual.array[fixed] = 0.0
        factor.solve(residual, correction)
        u.axpy(1.0, correction)
    return u.array.copy()


def solve_contact(stiffness, load, bounds, tolerance=1e-9):
    """The minimiser within the bounds, certified: relative KKT residuals ≤ `tolerance`."""
    bounded = np.flatnonzero(np.isfinite(bounds.lower) | np.isfinite(bounds.upper))
    active = bounded
    u = _rest_on(stiffness, load, bounds, active)
    if len(bounded):
        # Full contact is the first guess: without it a body may be free to move.
        active = _active_set(stiffness, load, bounds, u)
        u = _rest_on(stiffness, load, bounds, active)
    return _certify(stiffness, load, bounds, u, active, tolerance)


def _rest_on(stiffness, load, bounds, active):
    """The solution in which exactly the `active` unknowns rest on their bound."""
    at = np.where(np.isfinite(bounds.lower), bounds.lower, bounds.upper)[active]
    return solve_linear(stiffness, load, np.r_[bounds.fixed, active], np.r_[bounds.values, at])


def _active_set(stiffness, load, bounds, guess):
    """Indices of the unknowns that rest on their bound, by SNES `vinewtonrsls`."""
    u = stiffness.createVecRight()
    u.array[:] = guess
    fixed = np.asarray(bounds.fixed, PETSc.IntType)
    scale = _diagonal_scale(stiffness)
    jacobian = stiffness.copy()
    jacobian.zeroRowsColumns(fixed, diag=scale)

    def residual(_snes, x, out):
        stiffness.mult(x, out)
        out.axpy(-1.0, load)
        out.array[fixed] = scale * (x.array_r[fixed] - bounds.values)

    lower, upper = u.duplicate(), u.duplicate()
    lower.array[:] = np.where(np.isfinite(bounds.lower), bounds.lower, PETSc.NINFINITY)
    upper.array[:] = np.where(np.isfinite(bounds.upper), bounds.upper, PETSc.INFINITY)

    # PETSc counts u as active within an absolute 1e-8 of its bound unless told otherwise:
    # a length with no meaning here, where displacements may be 1e-5.
    PETSc.Options()["vi_snes_vi_zero_tolerance"] = 0.0
    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    snes.setOptionsPrefix("vi_")
    snes.setType("vinewtonrsls")
    out = u.duplicate()
    snes.setFunction(residual, out)
    snes.setJacobian(lambda *_: None, jacobian)
    snes.setVariableBounds(lower, upper)
    _direct(snes.getKSP())
    snes.setFromOptions()
    size = max(load.norm(), scale * u.norm(), np.finfo(float).tiny)
    snes.setTolerances(rtol=0.0, atol=1e-10 * size, stol=0.0, max_it=200)
    snes.solve(None, u)
    if snes.getConvergedReason() <= 0:
        raise ContactError(
            f"SNES vinewtonrsls stopped with reason {snes.getConvergedReason()} "
            f"after {snes.getIterationNumber()} iterations"
        )
    residual(snes, u, out)
    x, r = u.array_r, out.array_r
    return np.flatnonzero(((x <= bounds.lower) & (r > 0)) | ((x >= bounds.upper) & (r < 0)))


def _certify(stiffness, load, bounds, u, active, tolerance):
    """KKT: r = K u − f is zero off the bounds, presses against them, and u stays within."""
    x, r = stiffness.createVecRight(), stiffness.createVecRight()
    x.array[:] = u
    stiffness.mult(x, r)
    r = r.array - load.array_r
    free = np.ones(len(u), bool)
    free[bounds.fixed] = free[active] = False
    force = max(np.abs(load.array_r).max(), np.abs(r).max(), np.finfo(float).tiny)
    length = max(np.abs(u).max(), np.finfo(float).tiny)
    lower, upper = np.isfinite(bounds.lower), np.isfinite(bounds.upper)
    pull = np.r_[-r[active][lower[active]], r[active][upper[active]], 0.0]
    beyond = np.r_[(bounds.lower - u)[lower], (u - bounds.upper)[upper], 0.0]
    worst = max(np.abs(r[free]).max(initial=0.0) / force, pull.max() / force, beyond.max() / length)
    if not worst <= tolerance:
        raise ContactError(f"the KKT conditions hold only to {worst:.1e} (relative)")
    constrained = lower | upper
    return ContactSolution(u, r, float(np.abs(r[constrained]).sum()), len(active))


def _direct(ksp):
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")


def _diagonal_scale(stiffness):
    """A diagonal entry of the stiffness's own size keeps prescribed rows in scale."""
    return stiffness.getDiagonal().norm(PETSc.NormType.NORM_INFINITY)
