/* Writes the pieces of a simulation as files that `tetralod part`, ParaView and VTK read: one `.vtu` for each rank, and a `.pvtu` that lists them.
 *
 * One file to include, in C99 or C++11, that needs the standard library alone:
 *
 *     tetralod_field fields[] = {{"T", 1, TETRALOD_FLOAT64, temperature}, {"u", 3, TETRALOD_FLOAT32, velocity}};
 *     tetralod_part part = {points, positions, tets, TETRALOD_INT32, corners, 2, fields};
 *     char message[256];
 *     if (rank == 0 && tetralod_part_list("step", ranks, fields, 2, message, sizeof message)) fail(message);
 *     if (tetralod_part_write("step", rank, &part, message, sizeof message)) fail(message);
 *
 * Ranks need not wait for one another: a file is written under another name and then renamed, so one that is there is complete. The folder must be
 * there, and hold no pieces of an earlier step. Points at which pieces meet are found by their positions, which must be exactly equal in all of
 * them; values there are those of the first piece. Arrays are written as they are in memory, without a copy.
 */
#ifndef TETRALOD_PART_H
#define TETRALOD_PART_H

#include <errno.h>
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What functions return. */
enum { TETRALOD_OK = 0, TETRALOD_BAD_ARGUMENT = 1, TETRALOD_NOT_WRITTEN = 2 };

/* Types of numbers. */
typedef enum { TETRALOD_FLOAT32, TETRALOD_FLOAT64, TETRALOD_INT32, TETRALOD_INT64 } tetralod_type;

/* Values at the points, those of one point one behind the other. */
typedef struct {
    const char *name; /* in UTF-8 */
    int components;
    tetralod_type type;
    const void *values;
} tetralod_field;

/* The piece of one rank. All ranks have the same fields. */
typedef struct {
    int64_t points;
    const double *positions; /* three of each point */
    int64_t tets;
    tetralod_type tets_type; /* of the numbers in `tets_points` */
    const void *tets_points; /* four points of each tetrahedron: numbers within this piece, from 0 */
    int fields;
    const tetralod_field *field;
} tetralod_part;

/* Writes FOLDER/piece-RANK.vtu. If that fails it returns another number than 0, and says why in so many characters of `message`. */
static inline int tetralod_part_write(const char *folder, int rank, const tetralod_part *part, char *message, size_t size);

/* Writes FOLDER/pieces.pvtu, the list of all pieces: by one rank, before or after the pieces. Of the fields the values do not count. */
static inline int tetralod_part_list(const char *folder, int ranks, const tetralod_field *field, int fields, char *message, size_t size);

/* The rest is for these two alone. */

typedef struct {
    FILE *out;
    char *path, *partial;
    uint64_t offset; /* in the appended data, of the next array */
    char *message;
    size_t size;
} tetralod_file_;

static inline size_t tetralod_bytes_(tetralod_type type) {
    return type == TETRALOD_FLOAT32 || type == TETRALOD_INT32 ? 4 : 8;
}

static inline const char *tetralod_name_(tetralod_type type) {
    static const char *const names[] = {"Float32", "Float64", "Int32", "Int64"};
    return names[type];
}

static inline const char *tetralod_byte_order_(void) {
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first ? "LittleEndian" : "BigEndian";
}

static inline int tetralod_not_written_(tetralod_file_ *file) {
    snprintf(file->message, file->size, "%s could not be written: %s", file->path ? file->path : "a file", strerror(errno));
    return TETRALOD_NOT_WRITTEN;
}

/* Begins a file under another name. */
static inline int tetralod_open_(tetralod_file_ *file, const char *folder, const char *name) {
    const size_t length = strlen(folder) + strlen(name) + sizeof "/..partial";
    file->path = (char *)malloc(length);
    file->partial = (char *)malloc(length);
    if (!file->path || !file->partial) return tetralod_not_written_(file);
    snprintf(file->path, length, "%s/%s", folder, name);
    snprintf(file->partial, length, "%s/.%s.partial", folder, name);
    file->out = fopen(file->partial, "wb");
    return file->out ? TETRALOD_OK : tetralod_not_written_(file);
}

/* Puts the file in its place if all went well, or removes it. */
static inline int tetralod_close_(tetralod_file_ *file, int result) {
    if (file->out) {
        /* A full disk may be told only now. */
        const int failed = ferror(file->out) != 0, is_open = fclose(file->out) != 0;
        if (result == TETRALOD_OK && (failed || is_open)) result = tetralod_not_written_(file);
#ifdef _WIN32
        if (result == TETRALOD_OK) remove(file->path);
#endif
        if (result == TETRALOD_OK && rename(file->partial, file->path) != 0) result = tetralod_not_written_(file);
        if (result != TETRALOD_OK) remove(file->partial);
    }
    free(file->path);
    free(file->partial);
    return result;
}

static inline void tetralod_put_(tetralod_file_ *file, const void *bytes, size_t count) {
    if (count) fwrite(bytes, 1, count, file->out);
}

/* Writes the element of an array, whose values follow behind all elements. */
static inline void tetralod_element_(tetralod_file_ *file, const char *element, const char *name, const char *type, int components) {
    const char *c;
    fprintf(file->out, "<%s type=\"%s\" Name=\"", element, type);
    for (c = name; *c; c++) {
        if (*c == '&') fputs("&amp;", file->out);
        else if (*c == '<') fputs("&lt;", file->out);
        else if (*c == '>') fputs("&gt;", file->out);
        else if (*c == '"') fputs("&quot;", file->out);
        else fputc(*c, file->out);
    }
    fprintf(file->out, "\" NumberOfComponents=\"%d\"", components);
}

static inline void tetralod_appended_(tetralod_file_ *file, const char *name, const char *type, int components, uint64_t bytes) {
    tetralod_element_(file, "DataArray", name, type, components);
    fprintf(file->out, " format=\"appended\" offset=\"%" PRIu64 "\"/>\n", file->offset);
    file->offset += 8 + bytes;
}

static inline void tetralod_data_(tetralod_file_ *file, const void *values, uint64_t bytes) {
    tetralod_put_(file, &bytes, 8);
    tetralod_put_(file, values, (size_t)bytes);
}

static inline int tetralod_check_fields_(const tetralod_field *field, int fields, char *message, size_t size) {
    int i;
    for (i = 0; i < fields; i++) {
        const unsigned char *c = (const unsigned char *)field[i].name;
        if (!c || !*c || field[i].components < 1 || (unsigned)field[i].type > TETRALOD_INT64) {
            snprintf(message, size, "field %d must have a name, a type, and at least one component", i);
            return TETRALOD_BAD_ARGUMENT;
        }
        for (; *c; c++) {
            if (*c < ' ') {
                snprintf(message, size, "the name of field %d has a control character", i);
                return TETRALOD_BAD_ARGUMENT;
            }
        }
    }
    return TETRALOD_OK;
}

static inline int tetralod_check_(int rank, const tetralod_part *part, char *message, size_t size) {
    const int32_t *narrow = (const int32_t *)part->tets_points;
    const int64_t *wide = (const int64_t *)part->tets_points;
    const int is_narrow = part->tets_type == TETRALOD_INT32;
    int64_t i;
    int f;
    if (rank < 0 || part->points < 0 || part->tets < 0 || part->fields < 0) {
        snprintf(message, size, "a rank or a count is negative");
        return TETRALOD_BAD_ARGUMENT;
    }
    if ((part->points && !part->positions) || (part->tets && !part->tets_points)) {
        snprintf(message, size, "the positions, or the points of tetrahedra, are missing");
        return TETRALOD_BAD_ARGUMENT;
    }
    if (!is_narrow && part->tets_type != TETRALOD_INT64) {
        snprintf(message, size, "the points of tetrahedra must be of type TETRALOD_INT32 or TETRALOD_INT64");
        return TETRALOD_BAD_ARGUMENT;
    }
    for (i = 0; i < 4 * part->tets; i++) {
        const int64_t point = is_narrow ? narrow[i] : wide[i];
        if (point < 0 || point >= part->points) {
            snprintf(message, size, "tetrahedron %" PRId64 " of rank %d has point %" PRId64 ", and there are %" PRId64, i / 4, rank, point,
                     part->points);
            return TETRALOD_BAD_ARGUMENT;
        }
    }
    for (f = 0; f < part->fields; f++) {
        if (part->points && !part->field[f].values) {
            snprintf(message, size, "field %d has no values", f);
            return TETRALOD_BAD_ARGUMENT;
        }
    }
    return tetralod_check_fields_(part->field, part->fields, message, size);
}

static inline void tetralod_write_part_(tetralod_file_ *file, const tetralod_part *part) {
    const uint64_t points = (uint64_t)part->points, tets = (uint64_t)part->tets;
    const uint64_t corner_bytes = 4 * tets * tetralod_bytes_(part->tets_type);
    int64_t ends[512];
    unsigned char types[512];
    uint64_t i, bytes;
    int f;
    fprintf(file->out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n"
            "<UnstructuredGrid>\n<Piece NumberOfPoints=\"%" PRIu64 "\" NumberOfCells=\"%" PRIu64 "\">\n<PointData>\n",
            tetralod_byte_order_(), points, tets);
    for (f = 0; f < part->fields; f++) {
        const tetralod_field *field = part->field + f;
        bytes = points * (uint64_t)field->components * tetralod_bytes_(field->type);
        tetralod_appended_(file, field->name, tetralod_name_(field->type), field->components, bytes);
    }
    fputs("</PointData>\n<CellData>\n</CellData>\n<Points>\n", file->out);
    tetralod_appended_(file, "Points", "Float64", 3, 24 * points);
    fputs("</Points>\n<Cells>\n", file->out);
    tetralod_appended_(file, "connectivity", tetralod_name_(part->tets_type), 1, corner_bytes);
    tetralod_appended_(file, "offsets", "Int64", 1, 8 * tets);
    tetralod_appended_(file, "types", "UInt8", 1, tets);
    fputs("</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_", file->out);
    for (f = 0; f < part->fields; f++) {
        const tetralod_field *field = part->field + f;
        tetralod_data_(file, field->values, points * (uint64_t)field->components * tetralod_bytes_(field->type));
    }
    tetralod_data_(file, part->positions, 24 * points);
    tetralod_data_(file, part->tets_points, corner_bytes);
    bytes = 8 * tets;
    tetralod_put_(file, &bytes, 8);
    for (i = 0; i < tets; i++) {
        ends[i % 512] = (int64_t)(4 * (i + 1));
        if (i % 512 == 511 || i + 1 == tets) tetralod_put_(file, ends, 8 * (size_t)(i % 512 + 1));
    }
    tetralod_put_(file, &tets, 8);
    memset(types, 10, sizeof types); /* VTK's number of a tetrahedron */
    for (i = 0; i < tets; i += 512) tetralod_put_(file, types, (size_t)(tets - i < 512 ? tets - i : 512));
    fputs("\n</AppendedData>\n</VTKFile>\n", file->out);
}

static inline int tetralod_part_write(const char *folder, int rank, const tetralod_part *part, char *message, size_t size) {
    tetralod_file_ file = {NULL, NULL, NULL, 0, message, size};
    char name[64];
    int result = tetralod_check_(rank, part, message, size);
    if (result != TETRALOD_OK) return result;
    snprintf(name, sizeof name, "piece-%d.vtu", rank);
    result = tetralod_open_(&file, folder, name);
    if (result == TETRALOD_OK) tetralod_write_part_(&file, part);
    return tetralod_close_(&file, result);
}

static inline int tetralod_part_list(const char *folder, int ranks, const tetralod_field *field, int fields, char *message, size_t size) {
    tetralod_file_ file = {NULL, NULL, NULL, 0, message, size};
    int i, result = tetralod_check_fields_(field, fields, message, size);
    if (result == TETRALOD_OK && ranks < 1) {
        snprintf(message, size, "there must be at least one rank");
        result = TETRALOD_BAD_ARGUMENT;
    }
    if (result != TETRALOD_OK) return result;
    result = tetralod_open_(&file, folder, "pieces.pvtu");
    if (result == TETRALOD_OK) {
        fprintf(file.out,
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n"
                "<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n",
                tetralod_byte_order_());
        for (i = 0; i < fields; i++) {
            tetralod_element_(&file, "PDataArray", field[i].name, tetralod_name_(field[i].type), field[i].components);
            fputs("/>\n", file.out);
        }
        fputs("</PPointData>\n<PPoints>\n", file.out);
        tetralod_element_(&file, "PDataArray", "Points", "Float64", 3);
        fputs("/>\n</PPoints>\n", file.out);
        for (i = 0; i < ranks; i++) fprintf(file.out, "<Piece Source=\"piece-%d.vtu\"/>\n", i);
        fputs("</PUnstructuredGrid>\n</VTKFile>\n", file.out);
    }
    return tetralod_close_(&file, result);
}

#endif
