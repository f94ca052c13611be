// Reads STEP text and IGES files into bodies.

#include "model.hpp"

#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Check.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Reader.hxx>
#include <ShapeBuild_ReShape.hxx>
#include <ShapeFix_Shape.hxx>
#include <ShapeFix_Solid.hxx>
#include <StepData_StepModel.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionRelationship.hxx>
#include <StepGeom_CartesianPoint.hxx>
#include <StepRepr_ItemDefinedTransformation.hxx>
#include <StepRepr_ProductDefinitionShape.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepRepr_RepresentationRelationship.hxx>
#include <StepShape_ContextDependentShapeRepresentation.hxx>
#include <StepShape_FaceSurface.hxx>
#include <StepShape_ShapeDefinitionRepresentation.hxx>
#include <StepShape_ShapeRepresentation.hxx>
#include <StepShape_ShellBasedSurfaceModel.hxx>
#include <StepShape_SolidModel.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TransferBRep.hxx>
#include <Transfer_Binder.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>

#include <algorithm>
#include <cctype>
#include <climits>
#include <cmath>
#include <istream>
#include <map>
#include <memory>
#include <utility>
#include <streambuf>
#include <unordered_map>

namespace {

// The accuracy of edges on surfaces if no tolerance is given. The one that a file claims
// may be a thousandth of the part.
constexpr double PRECISION_MM = 1e-5;
// Greater coordinates are wrong in any unit: a kilometre in micrometres.
constexpr double FAR = 1e9;

// A stream of bytes without a copy.
struct Bytes : std::streambuf {
    Bytes(const uint8_t *bytes, size_t count) {
        char *start = const_cast<char *>(reinterpret_cast<const char *>(bytes));
        setg(start, start, start + count);
    }
};

// A solid or a shell of the file.
struct Item {
    int number = 0;
    std::string name;
};

// The file's data about shapes, by shape without its location.
struct Said {
    std::unordered_map<const TopoDS_TShape *, uint64_t> entities;
    std::unordered_map<const TopoDS_TShape *, Item> items;
};

template <class Map, class Value>
void note(Map &map, const TopoDS_Shape &shape, TopAbs_ShapeEnum kind, const Value &value) {
    for (TopExp_Explorer at(shape, kind); at.More(); at.Next())
        map.emplace(at.Current().TShape().get(), value);
}

Said said(const STEPControl_Reader &reader) {
    Said said;
    const auto model = Handle(StepData_StepModel)::DownCast(reader.Model());
    const auto process = reader.WS()->TransferReader()->TransientProcess();
    for (int k = 1; k <= model->NbEntities(); ++k) {
        const Handle(Standard_Transient) entity = model->Value(k);
        const auto item = Handle(StepRepr_RepresentationItem)::DownCast(entity);
        if (item.IsNull())
            continue;
        const bool is_face = entity->IsKind(STANDARD_TYPE(StepShape_FaceSurface));
        const bool is_body = entity->IsKind(STANDARD_TYPE(StepShape_SolidModel)) ||
                             entity->IsKind(STANDARD_TYPE(StepShape_ShellBasedSurfaceModel));
        if (!is_face && !is_body)
            continue;
        const Handle(Transfer_Binder) binder = process->Find(entity);
        if (binder.IsNull())
            continue;
        const TopoDS_Shape shape = TransferBRep::ShapeResult(binder);
        if (is_face) {
            note(said.entities, shape, TopAbs_FACE, uint64_t(model->IdentLabel(entity)));
        } else {
            const Item body{k, item->Name().IsNull() ? "" : item->Name()->ToCString()};
            note(said.items, shape, TopAbs_SOLID, body);
            note(said.items, shape, TopAbs_SHELL, body);
        }
    }
    return said;
}

// Returns solids, and shells outside solids; each once per location.
std::vector<TopoDS_Shape> bodies(const TopoDS_Shape &shape) {
    TopTools_IndexedMapOfShape found;
    for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next())
        found.Add(at.Current());
    for (TopExp_Explorer at(shape, TopAbs_SHELL, TopAbs_SOLID); at.More(); at.Next())
        found.Add(at.Current());
    return {found.cbegin(), found.cend()};
}

bool is_closed(const TopoDS_Shape &shape) {
    TopExp_Explorer at(shape, TopAbs_SHELL);
    if (!at.More())
        return false;
    for (; at.More(); at.Next())
        if (!BRep_Tool::IsClosed(at.Current()))
            return false;
    return true;
}

// Gives faces made from another one its entity.
void keep(Said &said, const TopoDS_Shape &face, const TopoDS_Shape &made) {
    const auto known = said.entities.find(face.TShape().get());
    if (known != said.entities.end() && !made.IsNull())
        note(said.entities, made, TopAbs_FACE, uint64_t(known->second));
}

// Repairs the geometry of a body.
TopoDS_Shape mended(const TopoDS_Shape &body, double heal_mm, Said &said) {
    ShapeFix_Shape fix(body);
    fix.SetPrecision(heal_mm);
    fix.SetMaxTolerance(heal_mm);
    fix.Perform();
    for (TopExp_Explorer at(body, TopAbs_FACE); at.More(); at.Next())
        keep(said, at.Current(), fix.Context()->Apply(at.Current()));
    return fix.Shape();
}

// Joins faces whose edges are within the tolerance.
TopoDS_Shape sewn(const std::vector<TopoDS_Shape> &pieces, double heal_mm, Said &said) {
    BRepBuilderAPI_Sewing sewing(heal_mm);
    for (const TopoDS_Shape &piece : pieces)
        sewing.Add(piece);
    sewing.Perform();
    for (const TopoDS_Shape &piece : pieces)
        for (TopExp_Explorer at(piece, TopAbs_FACE); at.More(); at.Next())
            keep(said, at.Current(), sewing.Modified(at.Current()));
    return sewing.SewedShape();
}

// Turns a closed shell into a solid whose faces point outwards.
TopoDS_Shape outwards(const TopoDS_Shape &body) {
    if (body.ShapeType() != TopAbs_SHELL || !BRep_Tool::IsClosed(body))
        return body;
    return ShapeFix_Solid().SolidFromShell(TopoDS::Shell(body));
}

// Computes the box of control points; returns false if the surface has none.
bool control_box(const Sheet &sheet, double box[6]) {
    Handle(Geom_Surface) surface = sheet.surface;
    const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface);
    if (!trimmed.IsNull())
        surface = trimmed->BasisSurface();
    const auto spline = Handle(Geom_BSplineSurface)::DownCast(surface);
    const auto bezier = Handle(Geom_BezierSurface)::DownCast(surface);
    if (spline.IsNull() && bezier.IsNull())
        return false;
    std::fill(box, box + 3, INFINITY);
    std::fill(box + 3, box + 6, -INFINITY);
    const int rows = spline.IsNull() ? bezier->NbUPoles() : spline->NbUPoles();
    const int columns = spline.IsNull() ? bezier->NbVPoles() : spline->NbVPoles();
    for (int i = 1; i <= rows; ++i)
        for (int j = 1; j <= columns; ++j) {
            gp_Pnt pole = spline.IsNull() ? bezier->Pole(i, j) : spline->Pole(i, j);
            pole.Transform(sheet.place);
            for (int k = 0; k < 3; ++k) {
                box[k] = std::min(box[k], pole.Coord(k + 1));
                box[k + 3] = std::max(box[k + 3], pole.Coord(k + 1));
            }
        }
    return true;
}

void add_face(LampOcctModel &model, const TopoDS_Face &face, uint32_t body, const Said &said) {
    Sheet sheet;
    TopLoc_Location location;
    sheet.surface = BRep_Tool::Surface(face, location);
    sheet.place = location.Transformation();
    sheet.is_placed = !location.IsIdentity();
    LampOcctFace info = {GeomAbs_OtherSurface, body, 0, 0, {}, {}};
    const auto known = said.entities.find(face.TShape().get());
    if (known != said.entities.end())
        info.entity = known->second;
    if (!sheet.surface.IsNull()) {
        info.kind = GeomAdaptor_Surface(sheet.surface).GetType();
        BRepTools::UVBounds(face, info.range[0], info.range[1], info.range[2], info.range[3]);
        info.has_box = control_box(sheet, info.box_mm);
        auto &[u, v] = sheet.range;
        sheet.surface->Bounds(u[0], u[1], v[0], v[1]);
        sheet.comes_again[0] = sheet.surface->IsUClosed() && !sheet.surface->IsUPeriodic();
        sheet.comes_again[1] = sheet.surface->IsVClosed() && !sheet.surface->IsVPeriodic();
    }
    model.faces.push_back(face);
    model.infos.push_back(info);
    model.sheets.push_back(sheet);
}

// Returns whether an entity describes shapes or their locations.
bool is_shape(const Handle(Standard_Transient) & entity) {
    for (const auto &type :
         {STANDARD_TYPE(StepRepr_RepresentationItem), STANDARD_TYPE(StepShape_ShapeRepresentation),
          STANDARD_TYPE(StepRepr_RepresentationRelationship),
          STANDARD_TYPE(StepRepr_ItemDefinedTransformation),
          STANDARD_TYPE(StepRepr_ProductDefinitionShape),
          STANDARD_TYPE(StepShape_ShapeDefinitionRepresentation),
          STANDARD_TYPE(StepShape_ContextDependentShapeRepresentation),
          STANDARD_TYPE(StepBasic_ProductDefinition),
          STANDARD_TYPE(StepBasic_ProductDefinitionRelationship)})
        if (entity->IsKind(type))
            return true;
    return false;
}

// Returns the error in an entity's numbers and references, or null if only a text is wrong.
const char *failure(const Interface_Check &check) {
    for (int k = 1; k <= check.NbFails(); ++k) {
        const std::string text = check.CFail(k);
        const auto is_of = [&text](const char *what) { return text.find(what) != text.npos; };
        if (!is_of("name)") && !is_of("description)") && !is_of("(id)"))
            return check.CFail(k);
    }
    return nullptr;
}

// Returns the error of a shape's entity, or an empty string. OpenCASCADE would assume that
// missing data exists, and work with points at infinity forever.
std::string unsound(const StepData_StepModel &model) {
    for (int k = 1; k <= model.NbEntities(); ++k) {
        const Handle(Standard_Transient) entity = model.Value(k);
        if (!is_shape(entity))
            continue;
        const std::string number = "#" + std::to_string(model.IdentLabel(entity));
        if (const char *text = failure(*model.Check(k, Standard_True)))
            return number + ": " + text;
        const auto point = Handle(StepGeom_CartesianPoint)::DownCast(entity);
        for (int axis = 1; !point.IsNull() && axis <= point->NbCoordinates(); ++axis)
            // Negated, so that NaN fails too.
            if (!(std::abs(point->CoordinatesValue(axis)) < FAR))
                return number + " is no point near a part";
    }
    return "";
}

std::string unit_of(STEPControl_Reader &reader) {
    TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
    reader.FileUnits(lengths, angles, solid_angles);
    std::string unit = lengths.IsEmpty() ? "" : lengths.First().ToCString();
    for (char &letter : unit)
        letter = char(std::tolower(static_cast<unsigned char>(letter)));
    return unit;
}

// Silences OpenCASCADE's terminal output and sets its global reader settings.
void set_up() {
    Message::DefaultMessenger()->ChangePrinters().Clear();
    STEPControl_Controller::Init();
    IGESControl_Controller::Init();
    Interface_Static::SetCVal("xstep.cascade.unit", "MM");
}

// The settings of readers are global to the process.
struct OneAtATime {
    OneAtATime() : lock(mutex) {
        static const bool is_set_up = (set_up(), true);
        (void)is_set_up;
    }
    static std::mutex mutex;
    std::lock_guard<std::mutex> lock;
};
std::mutex OneAtATime::mutex;

// Adds a body and its faces to a model.
void add_body(LampOcctModel &model, const TopoDS_Shape &body, const std::string &name,
              const Said &about) {
    const auto number = uint32_t(model.bodies.size());
    for (TopExp_Explorer at(body, TopAbs_FACE); at.More(); at.Next())
        add_face(model, TopoDS::Face(at.Current()), number, about);
    model.bodies.push_back(body);
    model.names.push_back(name);
}

LampOcctModel *read(const uint8_t *bytes, size_t count, double heal_mm, LampOcctError *error) {
    const OneAtATime settings;
    Interface_Static::SetIVal("read.precision.mode", 1);
    Interface_Static::SetRVal("read.precision.val", heal_mm > 0 ? heal_mm : PRECISION_MM);
    Bytes buffer(bytes, count);
    std::istream stream(&buffer);
    STEPControl_Reader reader;
    if (reader.ReadStream("part.step", stream) != IFSelect_RetDone) {
        say(error, "it is not a STEP file, or is cut off");
        return nullptr;
    }
    const auto entities = Handle(StepData_StepModel)::DownCast(reader.Model());
    const std::string wrong = unsound(*entities);
    if (!wrong.empty()) {
        say(error, wrong.c_str());
        return nullptr;
    }
    auto model = std::make_unique<LampOcctModel>();
    model->unit = unit_of(reader);
    reader.TransferRoots();
    const TopoDS_Shape shape = reader.OneShape();
    Said about = said(reader);
    // Open pieces of one item in one location belong together.
    std::vector<std::pair<Item, std::vector<TopoDS_Shape>>> wholes;
    std::map<std::pair<int, int>, size_t> open;
    for (const TopoDS_Shape &piece : bodies(shape)) {
        const auto known = about.items.find(piece.TShape().get());
        const Item item = known == about.items.end() ? Item() : known->second;
        const TopoDS_Shape body = heal_mm > 0 ? mended(piece, heal_mm, about) : piece;
        if (body.IsNull())
            continue;
        if (heal_mm > 0 && !is_closed(body)) {
            const std::pair key(item.number, piece.Location().HashCode(INT_MAX));
            const auto [whole, is_new] = open.emplace(key, wholes.size());
            if (!is_new) {
                wholes[whole->second].second.push_back(body);
                continue;
            }
        }
        wholes.push_back({item, {body}});
    }
    for (const auto &[item, pieces] : wholes) {
        const bool is_whole = heal_mm <= 0 || is_closed(pieces.front());
        const TopoDS_Shape joined = is_whole ? pieces.front() : sewn(pieces, heal_mm, about);
        for (const TopoDS_Shape &part : bodies(joined))
            add_body(*model, outwards(part), item.name, about);
    }
    if (model->bodies.empty()) {
        say(error, "it holds no solid that belongs to a product");
        return nullptr;
    }
    return model.release();
}

// Returns whether an entity of IGES is a face. These are bounded, trimmed, and of a solid.
bool is_iges_face(int type) { return type == 143 || type == 144 || type == 510; }

// Returns whether an entity is a curve or a point.
bool is_iges_curve(int type) {
    return type < 108 || (type > 108 && type < 114) || type == 116 || type == 126 || type == 130;
}

// Returns whether an entity is a curve, a surface or a solid. The others are drawings, attributes and
// structure; 124 is a place.
bool is_iges_shape(int type) {
    return (type >= 100 && type < 200 && type != 124) || (type >= 500 && type < 520);
}

// Returns whether an entity is a solid: of constructive geometry, which OpenCASCADE passes over, or of
// faces.
bool is_iges_solid(int type) { return type >= 150 && type <= 186; }

// Returns the number of an entity in the directory, by which IGES names it.
uint64_t iges_number(int k) { return uint64_t(2 * k - 1); }

std::string iges_name(int k, int type) {
    return "D" + std::to_string(iges_number(k)) + ", of type " + std::to_string(type) + ",";
}

// Returns the error of an entity that describes shapes, or an empty string. OpenCASCADE's own words on it
// are templates without their numbers.
std::string unsound(const IGESData_IGESModel &model) {
    for (int k = 1; k <= model.NbEntities(); ++k) {
        const int type = model.Entity(k)->TypeNumber();
        if (is_iges_shape(type) && model.Check(k, Standard_True)->NbFails() > 0)
            return iges_name(k, type) + " has wrong numbers or references";
    }
    return "";
}

// Notes the entities of faces, and curves and points that bound none. Returns the first surface or solid
// that OpenCASCADE left out, or an empty string.
std::string note_shapes(IGESControl_Reader &reader, const IGESData_IGESModel &model,
                        Said &about, std::vector<uint64_t> &curves) {
    const auto process = reader.WS()->TransferReader()->TransientProcess();
    std::unordered_map<int, bool> is_root;
    for (int k = 1; k <= reader.NbRootsForTransfer(); ++k)
        is_root[model.Number(reader.RootForTransfer(k))] = true;
    for (int k = 1; k <= model.NbEntities(); ++k) {
        const Handle(IGESData_IGESEntity) entity = model.Entity(k);
        const int type = entity->TypeNumber();
        const Handle(Transfer_Binder) binder = process->Find(entity);
        const TopoDS_Shape shape =
            binder.IsNull() ? TopoDS_Shape() : TransferBRep::ShapeResult(binder);
        const bool has_face = !shape.IsNull() && TopExp_Explorer(shape, TopAbs_FACE).More();
        // A surface may be a face without further ado; solids (186) are not.
        const bool is_alone = is_root.count(k) && is_iges_shape(type) && type < 186;
        if (has_face && (is_iges_face(type) || is_alone))
            note(about.entities, shape, TopAbs_FACE, iges_number(k));
        const bool is_wanted = is_iges_face(type) || is_iges_solid(type) || is_root.count(k);
        if (has_face || !is_iges_shape(type) || !is_wanted)
            continue;
        if (!is_iges_curve(type))
            return iges_name(k, type) + " cannot be read";
        curves.push_back(iges_number(k));
    }
    return "";
}

// OpenCASCADE reads IGES from files alone.
LampOcctModel *read_iges(const char *path, double heal_mm, LampOcctError *error) {
    const OneAtATime settings;
    // Faces of IGES are loose: the file states how far apart their edges may be.
    Interface_Static::SetIVal("read.precision.mode", heal_mm > 0 ? 1 : 0);
    Interface_Static::SetRVal("read.precision.val", heal_mm > 0 ? heal_mm : PRECISION_MM);
    IGESControl_Reader reader;
    const bool is_read = reader.ReadFile(path) == IFSelect_RetDone;
    const auto entities = Handle(IGESData_IGESModel)::DownCast(reader.Model());
    if (!is_read || entities.IsNull() || entities->NbEntities() == 0) {
        say(error, "it is not an IGES file, or is cut off");
        return nullptr;
    }
    std::string wrong = unsound(*entities);
    Said about;
    auto model = std::make_unique<LampOcctModel>();
    if (wrong.empty()) {
        reader.TransferRoots();
        wrong = note_shapes(reader, *entities, about, model->curves);
    }
    if (!wrong.empty()) {
        say(error, wrong.c_str());
        return nullptr;
    }
    const IGESData_GlobalSection global = entities->GlobalSection();
    const double stated_mm = global.Resolution() * global.UnitValue();
    // Negated, so that NaN is replaced, too.
    const double own_mm = !(stated_mm > PRECISION_MM) ? PRECISION_MM : std::min(stated_mm, 0.1);
    model->unit = global.UnitName().IsNull() ? "" : global.UnitName()->ToCString();
    for (char &letter : model->unit)
        letter = char(std::tolower(static_cast<unsigned char>(letter)));
    const TopoDS_Shape shape = reader.OneShape();
    // Closed bodies stay as they are; all other faces are sewn.
    std::vector<TopoDS_Shape> pieces = bodies(shape), open;
    // Each once: groups may share faces.
    TopTools_IndexedMapOfShape loose;
    for (TopExp_Explorer at(shape, TopAbs_FACE, TopAbs_SHELL); at.More(); at.Next())
        loose.Add(at.Current());
    pieces.insert(pieces.end(), loose.cbegin(), loose.cend());
    for (const TopoDS_Shape &piece : pieces) {
        const TopoDS_Shape healed = heal_mm > 0 ? mended(piece, heal_mm, about) : piece;
        const TopoDS_Shape body = healed.IsNull() ? piece : healed;
        if (is_closed(body))
            add_body(*model, outwards(body), "", about);
        else
            open.push_back(body);
    }
    if (!open.empty()) {
        const TopoDS_Shape joined = sewn(open, std::max(heal_mm, own_mm), about);
        for (const TopoDS_Shape &part : bodies(joined))
            add_body(*model, outwards(part), "", about);
        // A face that meets no other is a body that is open.
        for (TopExp_Explorer at(joined, TopAbs_FACE, TopAbs_SHELL); at.More(); at.Next()) {
            TopoDS_Shell alone;
            BRep_Builder().MakeShell(alone);
            BRep_Builder().Add(alone, at.Current());
            add_body(*model, outwards(alone), "", about);
        }
    }
    if (model->bodies.empty()) {
        say(error, "it holds no face");
        return nullptr;
    }
    return model.release();
}

} // namespace

extern "C" {

LampOcctModel *lamp_occt_read(const uint8_t *bytes, size_t count, double heal_mm,
                              LampOcctError *error) {
    return guarded(error, [&] { return read(bytes, count, heal_mm, error); });
}

LampOcctModel *lamp_occt_read_iges(const char *path, double heal_mm, LampOcctError *error) {
    return guarded(error, [&] { return read_iges(path, heal_mm, error); });
}

void lamp_occt_free(LampOcctModel *model) { delete model; }

size_t lamp_occt_bodies(const LampOcctModel *model) { return model->bodies.size(); }

LampOcctList lamp_occt_name(const LampOcctModel *model, size_t body) {
    const std::string &name = model->names[body];
    return {name.data(), name.size()};
}

LampOcctList lamp_occt_unit(const LampOcctModel *model) {
    return {model->unit.data(), model->unit.size()};
}

LampOcctList lamp_occt_faces(const LampOcctModel *model) { return listed(model->infos); }

LampOcctList lamp_occt_curves(const LampOcctModel *model) { return listed(model->curves); }
}
