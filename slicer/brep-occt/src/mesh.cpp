// Tessellates bodies, and evaluates surfaces.

#include "model.hpp"

#include <BRepMesh_Context.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <IMeshData_Face.hxx>
#include <IMeshData_Model.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>

#include <cmath>
#include <limits>
#include <memory>
#include <unordered_map>

struct LampOcctMesh {
    std::vector<LampOcctNode> nodes;
    std::vector<LampOcctTriangle> triangles;
    std::vector<LampOcctChain> chains;
    std::vector<uint32_t> chain_nodes;
    std::vector<LampOcctFault> faults;
};

namespace {

constexpr uint32_t NONE = std::numeric_limits<uint32_t>::max();

// The faults among the bits of IMeshData_Status; the other bits are informative.
constexpr uint32_t FAULTS = IMeshData_OpenWire | IMeshData_SelfIntersectingWire |
                            IMeshData_Failure | IMeshData_UnorientedWire;

// The deflection within faces, in chords.
constexpr double INTERIOR = 8;

// The faults of faces, by face without its location.
using Statuses = std::unordered_map<const TopoDS_TShape *, uint32_t>;

Statuses make_facets(const TopoDS_Shape &shape, double chord_mm, bool parallel) {
    // OpenCASCADE would keep facets of another chord if they are good enough.
    BRepTools::Clean(shape);
    IMeshTools_Parameters parameters;
    parameters.Deflection = chord_mm;
    parameters.Angle = 0.5;
    // Facets are halved later where that is needed; OpenCASCADE takes minutes for some faces.
    parameters.DeflectionInterior = INTERIOR * chord_mm;
    parameters.InParallel = parallel;
    parameters.Relative = false;
    const Handle(IMeshTools_Context) context = new BRepMesh_Context();
    BRepMesh_IncrementalMesh mesher;
    mesher.SetShape(shape);
    mesher.ChangeParameters() = parameters;
    mesher.Perform(context);
    Statuses statuses;
    const Handle(IMeshData_Model) model = context->GetModel();
    for (int k = 0; !model.IsNull() && k < model->FacesNb(); ++k) {
        const auto &face = model->GetFace(k);
        statuses[face->GetFace().TShape().get()] |= uint32_t(face->GetStatusMask());
    }
    return statuses;
}

// Numbers shapes from `first` on.
struct Numbers {
    TopTools_IndexedMapOfShape map;
    uint32_t first;

    uint32_t of(const TopoDS_Shape &shape) {
        return shape.IsNull() ? NONE : first + uint32_t(map.Add(shape)) - 1;
    }
};

struct Collector {
    LampOcctMesh &mesh;
    Numbers edges;
    Numbers vertices;

    void add_face(const TopoDS_Face &face, uint32_t number, uint32_t status) {
        TopLoc_Location location;
        const Handle(Poly_Triangulation) facets = BRep_Tool::Triangulation(face, location);
        const bool is_missing =
            facets.IsNull() || facets->NbTriangles() == 0 || !facets->HasUVNodes();
        if (is_missing || (status & FAULTS))
            mesh.faults.push_back({number, status | (is_missing ? LAMP_OCCT_MISSING : 0)});
        if (is_missing)
            return;
        const gp_Trsf place = location.Transformation();
        const size_t first = mesh.nodes.size();
        if (first + size_t(facets->NbNodes()) >= NONE)
            throw Standard_Failure("there are too many facets");
        for (int k = 1; k <= facets->NbNodes(); ++k) {
            const gp_Pnt point = facets->Node(k).Transformed(place);
            const gp_Pnt2d uv = facets->UVNode(k);
            mesh.nodes.push_back(
                {{point.X(), point.Y(), point.Z()}, {uv.X(), uv.Y()}, number});
        }
        const bool is_mirrored = place.VectorialPart().Determinant() < 0;
        const bool is_turned = (face.Orientation() == TopAbs_REVERSED) != is_mirrored;
        for (int k = 1; k <= facets->NbTriangles(); ++k) {
            int a, b, c;
            facets->Triangle(k).Get(a, b, c);
            if (is_turned)
                std::swap(b, c);
            const auto node = [first](int k) { return uint32_t(first) + uint32_t(k) - 1; };
            mesh.triangles.push_back({{node(a), node(b), node(c)}});
        }
        const TopoDS_Shape forward = face.Oriented(TopAbs_FORWARD);
        for (TopExp_Explorer at(forward, TopAbs_EDGE); at.More(); at.Next())
            add_chain(TopoDS::Edge(at.Current()), number, facets, location, uint32_t(first));
    }

    void add_chain(const TopoDS_Edge &edge, uint32_t face, const Handle(Poly_Triangulation) &facets,
                   const TopLoc_Location &location, uint32_t first) {
        // On a seam, the edge's orientation selects the side.
        const auto nodes = BRep_Tool::PolygonOnTriangulation(edge, facets, location);
        if (nodes.IsNull())
            return;
        const TopoDS_Edge forward = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
        const uint32_t start = vertices.of(TopExp::FirstVertex(forward));
        const uint32_t end = vertices.of(TopExp::LastVertex(forward));
        const auto at = uint32_t(mesh.chain_nodes.size());
        const auto count = uint32_t(nodes->NbNodes());
        mesh.chains.push_back({face, edges.of(edge), {start, end}, at, count});
        for (int k = 1; k <= nodes->NbNodes(); ++k)
            mesh.chain_nodes.push_back(first + uint32_t(nodes->Node(k)) - 1);
    }
};

LampOcctMesh *mesh_of(const LampOcctModel &model, double chord_mm, bool parallel) {
    const std::lock_guard<std::mutex> one_at_a_time(model.meshing);
    BRep_Builder builder;
    TopoDS_Compound all;
    builder.MakeCompound(all);
    for (const TopoDS_Shape &body : model.bodies)
        builder.Add(all, body);
    const Statuses statuses = make_facets(all, chord_mm, parallel);
    auto mesh = std::make_unique<LampOcctMesh>();
    uint32_t edges = 0, vertices = 0;
    for (size_t face = 0, body = 0; body < model.bodies.size(); ++body) {
        Collector collector{*mesh, {{}, edges}, {{}, vertices}};
        for (; face < model.faces.size() && model.infos[face].body == body; ++face) {
            const auto status = statuses.find(model.faces[face].TShape().get());
            collector.add_face(model.faces[face], uint32_t(face),
                               status == statuses.end() ? 0 : status->second);
        }
        edges += uint32_t(collector.edges.map.Extent());
        vertices += uint32_t(collector.vertices.map.Extent());
    }
    BRepTools::Clean(all);
    return mesh.release();
}

// Returns a periodic parameter within its range.
double wrapped(double t, const double range[2]) {
    if (t >= range[0] && t <= range[1])
        return t;
    const double period = range[1] - range[0];
    return t - period * std::floor((t - range[0]) / period);
}

void evaluate(const Sheet &sheet, const double *uv, size_t count, double *jets) {
    for (size_t k = 0; k < count; ++k, uv += 2, jets += 9) {
        gp_Pnt point;
        gp_Vec du, dv;
        const double u = sheet.comes_again[0] ? wrapped(uv[0], sheet.range[0]) : uv[0];
        const double v = sheet.comes_again[1] ? wrapped(uv[1], sheet.range[1]) : uv[1];
        sheet.surface->D1(u, v, point, du, dv);
        if (sheet.is_placed) {
            point.Transform(sheet.place);
            du.Transform(sheet.place);
            dv.Transform(sheet.place);
        }
        for (int axis = 0; axis < 3; ++axis) {
            jets[axis] = point.Coord(axis + 1);
            jets[axis + 3] = du.Coord(axis + 1);
            jets[axis + 6] = dv.Coord(axis + 1);
        }
    }
}

} // namespace

extern "C" {

void lamp_occt_evaluate(const LampOcctModel *model, size_t face, const double *uv, size_t count,
                        double *jets) {
    std::fill(jets, jets + 9 * count, std::numeric_limits<double>::quiet_NaN());
    try {
        const Sheet &sheet = model->sheets[face];
        if (!sheet.surface.IsNull())
            evaluate(sheet, uv, count, jets);
    } catch (...) {
        // Jets that were not evaluated stay NaN.
    }
}

LampOcctMesh *lamp_occt_mesh(const LampOcctModel *model, double chord_mm, bool parallel,
                             LampOcctError *error) {
    return guarded(error, [&] { return mesh_of(*model, chord_mm, parallel); });
}

void lamp_occt_mesh_free(LampOcctMesh *mesh) { delete mesh; }

LampOcctList lamp_occt_nodes(const LampOcctMesh *mesh) { return listed(mesh->nodes); }
LampOcctList lamp_occt_triangles(const LampOcctMesh *mesh) { return listed(mesh->triangles); }
LampOcctList lamp_occt_chains(const LampOcctMesh *mesh) { return listed(mesh->chains); }
LampOcctList lamp_occt_chain_nodes(const LampOcctMesh *mesh) { return listed(mesh->chain_nodes); }
LampOcctList lamp_occt_faults(const LampOcctMesh *mesh) { return listed(mesh->faults); }
}
