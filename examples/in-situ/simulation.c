/* A simulation whose ranks write their pieces: a wave in a box of tetrahedra, which ranks share by slabs.
 *
 *     cc -std=c99 -I workflows examples/in-situ/simulation.c -o simulation
 *     ./simulation FOLDER RANKS           writes the list and the pieces of all ranks, one after the other
 *     ./simulation FOLDER RANKS RANK      writes the piece of one rank, as a process of its own
 *     mpicc -std=c99 -DWITH_MPI -I workflows examples/in-situ/simulation.c -o simulation
 *     mpirun -n 4 ./simulation FOLDER     writes all, each by its rank
 */
#include "tetralod_part.h"

#ifdef WITH_MPI
#include <mpi.h>
#endif

enum { CELLS = 8 }; /* along each edge of the box */

/* The six tetrahedra of a cube, around the diagonal from corner 0 to corner 7: bit 0 of a corner is x, bit 1 y, bit 2 z. */
static const int CORNERS[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

/* Has one rank do its share and write it. A rank knows its slab alone: the cells from `first` to `end` along x. */
static int run_rank(const char *folder, int rank, int ranks, char *message, size_t size) {
    const int first = CELLS * rank / ranks, end = CELLS * (rank + 1) / ranks, along = end - first + 1, across = CELLS + 1;
    const int points = along * across * across, tets = 6 * (end - first) * CELLS * CELLS;
    double *positions = (double *)malloc(sizeof(double) * 3 * (size_t)points);
    double *height = (double *)malloc(sizeof(double) * (size_t)points);
    float *slope = (float *)malloc(sizeof(float) * 3 * (size_t)points);
    int32_t *corners = (int32_t *)malloc(sizeof(int32_t) * 4 * (size_t)tets + 1);
    tetralod_field fields[] = {{"height", 1, TETRALOD_FLOAT64, NULL}, {"slope", 3, TETRALOD_FLOAT32, NULL}};
    tetralod_part part = {0, NULL, 0, TETRALOD_INT32, NULL, 2, NULL};
    int x, y, z, t, c, result = TETRALOD_NOT_WRITTEN, point = 0, tet = 0;
    if (positions && height && slope && corners) {
        for (z = 0; z < across; z++)
            for (y = 0; y < across; y++)
                for (x = first; x <= end; x++, point++) {
                    const double at[3] = {(double)x / CELLS, (double)y / CELLS, (double)z / CELLS};
                    for (c = 0; c < 3; c++) positions[3 * point + c] = at[c];
                    height[point] = at[0] * at[0] + at[1] * at[2];
                    slope[3 * point] = (float)(2 * at[0]);
                    slope[3 * point + 1] = (float)at[2];
                    slope[3 * point + 2] = (float)at[1];
                }
        for (z = 0; z < CELLS; z++)
            for (y = 0; y < CELLS; y++)
                for (x = 0; x < end - first; x++)
                    for (t = 0; t < 6; t++, tet++)
                        for (c = 0; c < 4; c++) {
                            const int corner = CORNERS[t][c];
                            const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
                            corners[4 * tet + c] = x + dx + along * (y + dy + across * (z + dz));
                        }
        fields[0].values = height;
        fields[1].values = slope;
        part.points = points;
        part.positions = positions;
        part.tets = tets;
        part.tets_points = corners;
        part.field = fields;
        result = rank == 0 ? tetralod_part_list(folder, ranks, fields, 2, message, size) : TETRALOD_OK;
        if (result == TETRALOD_OK) result = tetralod_part_write(folder, rank, &part, message, size);
    } else {
        snprintf(message, size, "no memory");
    }
    free(positions);
    free(height);
    free(slope);
    free(corners);
    return result;
}

int main(int argc, char **argv) {
    char message[512] = "";
    int result = TETRALOD_OK, rank = 0, ranks = 1, last;
#ifdef WITH_MPI
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    last = rank;
#else
    if (argc > 2) ranks = atoi(argv[2]);
    last = ranks - 1;
    if (argc > 3) rank = last = atoi(argv[3]);
#endif
    if (argc < 2 || ranks < 1 || ranks > CELLS || last >= ranks) {
        fprintf(stderr, "usage: simulation FOLDER RANKS [RANK], of at most %d ranks\n", (int)CELLS);
        result = TETRALOD_BAD_ARGUMENT;
    }
    for (; result == TETRALOD_OK && rank <= last; rank++) {
        result = run_rank(argv[1], rank, ranks, message, sizeof message);
        if (result != TETRALOD_OK) fprintf(stderr, "rank %d: %s\n", rank, message);
    }
#ifdef WITH_MPI
    MPI_Finalize();
#endif
    return result;
}
