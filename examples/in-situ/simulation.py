"""A simulation whose ranks write their pieces: that of simulation.c, with the same bytes.

    python simulation.py FOLDER RANKS            ranks are threads
    mpirun -n 4 python simulation.py FOLDER      ranks are those of MPI, if mpi4py is installed
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import tetralod

CELLS = 8  # along each edge of the box

# The six tetrahedra of a cube, around the diagonal from corner 0 to corner 7: bit 0 of a corner is x, bit 1 y, bit 2 z.
CORNERS = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def run_rank(folder, rank, ranks):
    """Has one rank do its share and write it. A rank knows its slab alone: the cells from `first` to `end` along x."""
    first, end = CELLS * rank // ranks, CELLS * (rank + 1) // ranks
    along, across = end - first + 1, CELLS + 1
    z, y, x = np.meshgrid(np.arange(across), np.arange(across), np.arange(first, end + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) / CELLS
    z, y, x = (index.ravel()[:, None, None] for index in np.meshgrid(*2 * [np.arange(CELLS)], np.arange(end - first), indexing="ij"))
    tets = x + (CORNERS & 1) + along * (y + (CORNERS >> 1 & 1) + across * (z + (CORNERS >> 2)))
    x, y, z = points.T
    slope = np.column_stack([2 * x, z, y]).astype(np.float32)
    data = {"height": x * x + y * z, "slope": slope}
    if rank == 0:
        tetralod.part_list(folder, ranks, data)
    tetralod.part_write(folder, rank, points, tets.reshape(-1, 4).astype(np.int32), data)


def main(folder, *more):
    Path(folder).mkdir(parents=True, exist_ok=True)
    try:
        from mpi4py import MPI
    except ImportError:
        ranks = int(more[0]) if more else 4
        with ThreadPoolExecutor() as threads:
            list(threads.map(lambda rank: run_rank(folder, rank, ranks), range(ranks)))
    else:
        world = MPI.COMM_WORLD
        run_rank(folder, world.Get_rank(), world.Get_size())


if __name__ == "__main__":
    main(*sys.argv[1:])
