// The model as OpenCASCADE holds it.
#pragma once

#include "shim.hpp"

#include <Geom_Surface.hxx>
#include <TopoDS_Face.hxx>
#include <gp_Trsf.hxx>

#include <cstdio>
#include <exception>
#include <mutex>
#include <string>
#include <vector>

#include <Standard_Failure.hxx>

// A face's surface and its location.
struct Sheet {
    Handle(Geom_Surface) surface;
    gp_Trsf place;
    bool is_placed = false;
    // Whether u and v are periodic although the surface does not say so, and their ranges.
    bool comes_again[2] = {false, false};
    double range[2][2] = {{0, 0}, {0, 0}};
};

struct LampOcctModel {
    std::string unit;
    std::vector<std::string> names;
    // The entities of IGES that are curves or points and bound no face.
    std::vector<uint64_t> curves;
    // The bodies, and all their faces.
    std::vector<TopoDS_Shape> bodies;
    std::vector<TopoDS_Face> faces;
    std::vector<LampOcctFace> infos;
    std::vector<Sheet> sheets;
    // Meshing changes the shapes themselves: one caller at a time.
    mutable std::mutex meshing;
};

inline void say(LampOcctError *error, const char *text) {
    std::snprintf(error->text, sizeof error->text, "%s", text);
}

// Runs a function and turns exceptions into an error message.
template <class F> auto guarded(LampOcctError *error, F run) -> decltype(run()) {
    try {
        return run();
    } catch (const Standard_Failure &failure) {
        const char *text = failure.GetMessageString();
        say(error, text && *text ? text : failure.DynamicType()->Name());
    } catch (const std::exception &failure) {
        say(error, failure.what());
    } catch (...) {
        say(error, "an unknown failure");
    }
    return nullptr;
}

template <class T> LampOcctList listed(const std::vector<T> &list) {
    return {list.data(), list.size()};
}
