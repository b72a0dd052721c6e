"""Very large tetrahedral volumes at every level of detail.

``tetralod.build`` makes a Multi-Tessellation (MT) of a mesh: of arrays, of a PyVista or meshio object, or of a file.
``tetralod.open`` opens an MT file here or on a server. ``Mt.refine`` takes the mesh out of it that is needed, as NumPy
arrays: accurate here, coarse there, around an isovalue, at most so many tetrahedra. ``tetralod.show`` draws it in a notebook.

>>> import numpy as np, tetralod
>>> axis = np.linspace(0, 1, 9)
>>> x, y, z = (a.ravel() for a in np.meshgrid(axis, axis, axis))
>>> mt = tetralod.build(np.column_stack([x, y, z]), point_data={"r": np.hypot(x, y)}, kind="vertex", method="insert")
>>> mesh = mt.refine(error="5%")
>>> mesh.stats.relative_error_bound <= 0.05
True
>>> mesh.points.shape[1], mesh.tets.shape[1], list(mesh.point_data)
(3, 4, ['r'])
"""

from ._build import build
from ._errors import TetralodError
from ._info import Field, Info, Region, Regions, VectorPart
from ._mesh import FieldStats, Lines, Mesh, RefineStats, Surface
from ._mt import Mt, open
from ._part import part_list, part_write
from ._show import show

__all__ = [
    "Field",
    "FieldStats",
    "Info",
    "Lines",
    "Mesh",
    "Mt",
    "RefineStats",
    "Region",
    "Regions",
    "Surface",
    "TetralodError",
    "VectorPart",
    "build",
    "open",
    "part_list",
    "part_write",
    "show",
]
