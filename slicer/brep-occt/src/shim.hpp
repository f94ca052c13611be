// What the Rust side calls: see calls.rs, which has the same types.
//
// No function throws. Where one may fail, it returns null and leaves a sentence
// in `error`. Lists belong to what they were asked of, and end with it.
#pragma once

#include <cstddef>
#include <cstdint>

extern "C" {

constexpr uint32_t LAMP_OCCT_MISSING = 1u << 31;

struct LampOcctModel;
struct LampOcctMesh;

// A place for a sentence, which ends with a zero.
struct LampOcctError {
    char text[256];
};

struct LampOcctList {
    const void *data;
    size_t count;
};

struct LampOcctFace {
    // A GeomAbs_SurfaceType.
    uint32_t kind;
    uint32_t body;
    // The number of its entity in the file, or 0.
    uint64_t entity;
    // The box of its surface's control points, if it has some.
    uint64_t has_box;
    double box_mm[6];
    // The least and the greatest u and v.
    double range[4];
};

struct LampOcctNode {
    double point[3];
    double uv[2];
    // Which face's facets it belongs to.
    uint64_t face;
};

struct LampOcctTriangle {
    uint32_t nodes[3];
};

// The nodes of one face along one edge, in the edge's direction.
struct LampOcctChain {
    uint32_t face;
    uint32_t edge;
    // The edge's ends; the greatest number where it has none.
    uint32_t ends[2];
    // Where its nodes are in the list of chains' nodes.
    uint32_t first;
    uint32_t count;
};

// A face that is not as it should be.
struct LampOcctFault {
    uint32_t face;
    // Of IMeshData_Status, and LAMP_OCCT_MISSING if there are no facets.
    uint32_t status;
};

LampOcctModel *lamp_occt_read(const uint8_t *bytes, size_t count, double heal_mm,
                              LampOcctError *error);
void lamp_occt_free(LampOcctModel *model);
size_t lamp_occt_bodies(const LampOcctModel *model);
LampOcctList lamp_occt_name(const LampOcctModel *model, size_t body);
LampOcctList lamp_occt_unit(const LampOcctModel *model);
LampOcctList lamp_occt_faces(const LampOcctModel *model);

// `jets` takes nine numbers for each pair in `uv`.
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
