"""The calls that differ between dolfinx 0.5 and 0.11, each in one form for all these versions."""

import inspect

import basix
import dolfinx.fem.petsc  # noqa: F401
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

# Since dolfinx 0.7 elements are those of basix.
IS_NEW = hasattr(fem, "functionspace")
if IS_NEW:
    import basix.ufl

# Forms are compiled for this processor.
JIT = {"jit_options" if IS_NEW else "jit_params": {"cffi_extra_compile_args": ["-O3", "-march=native"]}}
atan2 = ufl.atan2 if hasattr(ufl, "atan2") else ufl.atan_2


def form(expression):
    return fem.form(expression, **JIT)


def space(domain, family, degree, is_vector=False):
    """The space of Lagrange elements, continuous or not; of vectors in the plane, or of numbers."""
    if IS_NEW:
        return fem.functionspace(domain, (family, degree, (2,)) if is_vector else (family, degree))
    return (fem.VectorFunctionSpace if is_vector else fem.FunctionSpace)(domain, (family, degree))


def quadrature_space(domain, degree):
    """The functions that are known at the points of a quadrature rule of this degree; these points."""
    if IS_NEW:
        element = basix.ufl.quadrature_element("triangle", degree=degree)
    else:
        element = ufl.FiniteElement("Quadrature", ufl.triangle, degree, quad_scheme="default")
    points, _ = basix.make_quadrature(basix.CellType.triangle, degree)
    return (fem.functionspace if IS_NEW else fem.FunctionSpace)(domain, element), points


def interpolation_points(space):
    points = space.element.interpolation_points
    return points() if callable(points) else points


def dofs(space):
    """Per cell: its degrees of freedom."""
    return np.reshape(getattr(space.dofmap.list, "array", space.dofmap.list), (-1, space.dofmap.dof_layout.num_dofs))


def values(expression, domain, cells):
    """The values of a `fem.Expression` at its points in these cells."""
    return expression.eval(domain, cells) if IS_NEW else expression.eval(cells)


def create_mesh(cells, points, degree):
    """A mesh of triangles whose sides are polynomials of this degree."""
    if IS_NEW:
        element = basix.ufl.element("Lagrange", "triangle", degree, shape=(2,))
    else:
        element = ufl.VectorElement("Lagrange", ufl.triangle, degree)
    name = "e" if "e" in inspect.signature(mesh.create_mesh).parameters else "domain"
    return mesh.create_mesh(MPI.COMM_SELF, cells, x=points, **{name: ufl.Mesh(element)})
