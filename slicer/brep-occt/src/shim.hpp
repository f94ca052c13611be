// Declares the functions that Rust calls; calls.rs has the same types.
//
// No function throws. One that fails returns null and writes a message to `error`. Lists
// belong to the object that returned them.
#pragma once

#include <cstddef>
#include <cstdint>

extern "C" {

constexpr uint32_t LAMP_OCCT_MISSING = 1u << 31;

struct LampOcctModel;
struct LampOcctMesh;

// A zero-terminated error message.
struct LampOcctError {
    char text[256];
};

struct LampOcctList {
    const void *data;
    size_t count;
};

struct LampOcctFace {
    // A value of GeomAbs_SurfaceType.
    uint32_t kind;
    uint32_t body;
    // The entity's number in the file, or 0.
    uint64_t entity;
    // Whether the surface has control points, and their box.
    uint64_t has_box;
    double box_mm[6];
    // The ranges of u and v.
    double range[4];
};

struct LampOcctNode {
    double point[3];
    double uv[2];
    // The face of its facets.
    uint64_t face;
};

struct LampOcctTriangle {
    uint32_t nodes[3];
};

// The nodes of one face along one edge, in the edge's direction.
struct LampOcctChain {
    uint32_t face;
    uint32_t edge;
    // The vertices at the edge's ends, or UINT32_MAX.
    uint32_t ends[2];
    // The position of its first node among all chains' nodes.
    uint32_t first;
    uint32_t count;
};

// A face with faults.
struct LampOcctFault {
    uint32_t face;
    // Bits of IMeshData_Status, and LAMP_OCCT_MISSING if there are no facets.
    uint32_t status;
};

LampOcctModel *lamp_occt_read(const uint8_t *bytes, size_t count, double heal_mm,
                              LampOcctError *error);
// The path is zero-terminated.
LampOcctModel *lamp_occt_read_iges(const char *path, double heal_mm, LampOcctError *error);
void lamp_occt_free(LampOcctModel *model);
size_t lamp_occt_bodies(const LampOcctModel *model);
LampOcctList lamp_occt_name(const LampOcctModel *model, size_t body);
LampOcctList lamp_occt_unit(const LampOcctModel *model);
LampOcctList lamp_occt_faces(const LampOcctModel *model);
LampOcctList lamp_occt_curves(const LampOcctModel *model);

// Writes nine numbers to `jets` for each pair in `uv`.
void lamp_occt_evaluate(const LampOcctModel *model, size_t face, const double *uv, size_t count,
                        double *jets);

LampOcctMesh *lamp_occt_mesh(const LampOcctModel *model, double chord_mm, bool parallel,
                             LampOcctError *error);
void lamp_occt_mesh_free(LampOcctMesh *mesh);
LampOcctList lamp_occt_nodes(const LampOcctMesh *mesh);
LampOcctList lamp_occt_triangles(const LampOcctMesh *mesh);
LampOcctList lamp_occt_chains(const LampOcctMesh *mesh);
LampOcctList lamp_occt_chain_nodes(const LampOcctMesh *mesh);
LampOcctList lamp_occt_faults(const LampOcctMesh *mesh);
}
