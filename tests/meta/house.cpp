// SPDX-License-Identifier: Apache-2.0
#include "meta/house.h"

#include <algorithm>
#include <array>

namespace velatura::meta {

const std::map<std::string, std::set<std::string>>& tier_table() {
    static const std::set<std::string> core = {
        "image",    "accumulate", "statistics", "layers",  "sampling", "guiding", "scene",
        "geometry", "accel",      "camera",     "shading", "media",    "lights",  "film"};
    static const auto with = [](std::set<std::string> more) {
        more.insert(core.begin(), core.end());
        return more;
    };
    // A tier that is divided into modules includes all of them, and no other tier includes one
    static const auto module = [](std::set<std::string> below) {
        std::set<std::string> all = {"usd/stage", "usd/layer", "scene"};
        for (const std::string& name : below) all.insert("translate/" + name);
        return all;
    };
    static const auto room_of_compositor = [](std::set<std::string> below,
                                              std::set<std::string> more = {}) {
        std::set<std::string> all = {"image", "layers"};
        for (const std::string& name : below) all.insert("compositor/" + name);
        all.insert(more.begin(), more.end());
        return all;
    };
    static const std::map<std::string, std::set<std::string>> table = {
        {"base/process", {}},
        {"base", {"base/process"}},
        {"canvas", {}},
        {"image", {"plugin", "base/process"}},
        {"accumulate", {"image"}},
        {"statistics", {"accumulate", "image"}},
        {"layers", {"accumulate", "statistics", "image"}},
        {"sampling", {}},
        {"guiding", {"sampling"}},
        {"plugin", {"base/process"}},
        {"usd/layer", {}},
        {"usd/text", {"usd/layer"}},
        {"usd/crate", {"usd/layer"}},
        {"usd/package", {}},
        {"usd/materialx", {"usd/layer"}},
        {"usd/compose", {"usd/layer", "usd/text", "usd/crate", "usd/package", "usd/materialx"}},
        {"usd/stage", {"usd/layer", "usd/compose"}},
        {"import", {"usd/layer", "usd/text"}},
        {"scene", {}},
        {"translate/context", module({})},
        {"translate/color", module({"context"})},
        {"translate/motion", module({"context"})},
        {"translate/materials", module({"context", "color"})},
        {"translate/lights", module({"context", "color", "materials"})},
        {"translate/geometry", module({"context", "color", "motion", "materials", "lights"})},
        {"translate/linking", module({"context", "lights", "geometry"})},
        {"translate/volumes", module({"context", "color", "materials", "geometry"})},
        {"translate/instancing",
         module({"context", "color", "motion", "materials", "lights", "geometry", "linking"})},
        {"translate", module({"context", "color", "motion", "materials", "lights", "geometry",
                              "linking", "volumes", "instancing"})},
        {"geometry", {"scene"}},
        {"accel", {"scene", "geometry", "base/process"}},
        {"camera", {"scene", "sampling"}},
        {"shading", {"scene", "geometry", "sampling", "image", "plugin", "base/process"}},
        {"media", {"scene", "sampling"}},
        {"lights", {"scene", "geometry", "sampling", "shading"}},
        {"film", {"scene", "image", "accumulate", "statistics", "layers"}},
        {"display", {"film", "image", "accumulate"}},
        {"integrator/classic", {"scene", "geometry", "sampling", "shading", "lights"}},
        {"integrator", with({"integrator/classic"})},
        {"render", with({"integrator", "plugin", "translate", "usd/stage", "base/process"})},
        {"selftest", with({"integrator", "render"})},
        {"study", {"statistics", "image", "canvas"}},
        {"farm", {"image", "layers"}},
        {"app", with({"plugin", "import", "usd/layer", "usd/text", "usd/crate", "usd/package",
                      "usd/materialx", "usd/compose", "usd/stage", "translate", "integrator",
                      "render", "selftest", "study", "farm", "display", "base/process"})},
        {"view", with({"app", "integrator", "render", "base/process", "compositor/io",
                       "compositor/look", "compositor/bake", "compositor/window"})},
        {"python", with({"app", "plugin", "render", "translate", "integrator", "usd/layer",
                         "usd/text", "usd/stage", "compositor/io", "compositor/look",
                         "compositor/mix", "compositor/noise"})},
        {"compositor/io", room_of_compositor({})},
        {"compositor/look", room_of_compositor({"io"})},
        {"compositor/mix", room_of_compositor({"io", "look"})},
        {"compositor/denoise", room_of_compositor({"io"})},
        {"compositor/noise", room_of_compositor({"io", "look", "mix"}, {"statistics", "canvas"})},
        {"compositor/bake", room_of_compositor({"io", "look", "mix", "noise"})},
        {"compositor/exports", room_of_compositor({"io", "look", "mix"})},
        {"compositor/inspect", room_of_compositor({"io", "look"}, {"statistics", "canvas"})},
        {"compositor", {}},
        {"compositor/cli",
         room_of_compositor({"io", "look", "mix", "denoise", "noise", "bake", "exports", "inspect"},
                            {"base/process"})},
        {"compositor/window",
         room_of_compositor({"io", "look", "mix", "denoise", "noise", "bake", "exports"},
                            {"base/process", "canvas"})},
    };
    return table;
}

const std::vector<Library>& library_table() {
    static const std::vector<Library> table = {
        {"Imath", {}},
        {"half.h", {}},
        {"fmt/", {}},
        {"nlohmann/", {}},
        {"OpenEXR/", {"src/image/", "src/layers/"}},
        {"Imf", {"src/image/", "src/layers/"}},
        {"OpenColorIO/", {"src/image/"}},
        {"OpenImageIO/", {"plugins/openimageio/"}},
        {"openssl/", {"src/image/"}},
        {"oneapi/tbb", {"src/base/"}},
        {"tbb/", {"src/base/"}},
        {"hwy/", {"src/accel/", "src/lights/"}},
        {"lz4", {"src/usd/crate/"}},
        {"expat.h", {"src/usd/materialx/"}},
        {"zlib.h", {"compositor/exports/"}},
        {"CLI/",
         {"src/base/command_line.cpp", "src/base/help_page.cpp", "src/base/usage_problem.cpp"}},
        {"assimp/", {"src/import/"}},
        {"imgui.h", {"compositor/window/", "src/view/"}},
        {"backends/imgui_impl_", {"compositor/window/"}},
        {"GLFW/", {"compositor/window/"}},
        {"opensubdiv/", {"plugins/subdivision/"}},
        {"openvdb/", {"plugins/volume/"}},
        {"nanovdb/", {"plugins/volume/"}},
        {"embree3/", {"plugins/embree/"}},
        {"pxr/", {"plugins/hydra/"}},
        {"stb/", {"src/canvas/", "src/study/"}},
        {"pybind11/", {"src/python/"}},
    };
    return table;
}

bool is_system_header(std::string_view header) {
    static constexpr std::array<std::string_view, 19> posix = {
        "cxxabi.h",  "dirent.h",   "dlfcn.h", "fcntl.h",  "fnmatch.h", "immintrin.h", "poll.h",
        "pthread.h", "pwd.h",      "sched.h", "signal.h", "spawn.h",   "termios.h",   "unistd.h",
        "limits.h",  "execinfo.h", "fenv.h",  "malloc.h", "netdb.h"};
    if (header.starts_with("sys/") || header.starts_with("linux/")) return true;
    if (std::find(posix.begin(), posix.end(), header) != posix.end()) return true;
    return header.find('.') == std::string_view::npos && header.find('/') == std::string_view::npos;
}

}  // namespace velatura::meta
