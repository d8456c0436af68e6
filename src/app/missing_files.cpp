// SPDX-License-Identifier: Apache-2.0
#include "app/missing_files.h"

#include "base/asset_bytes.h"
#include "base/asset_roots.h"
#include "base/udim.h"

#include <fmt/format.h>

#include <set>
#include <string>
#include <utility>

namespace velatura::app {

namespace {

using usd::stage::Attribute;
using usd::stage::Prim;

/// Why a file cannot be opened; empty: it is there.
std::string problem_of(const std::string& file) {
    if (file.empty()) return "file not found";
    if (is_udim_name(file))
        return udim_files(file).empty() ? "none of the UDIM tiles 1001 to 1100 exists" : "";
    const Result<std::string> admitted = admit_asset(file);
    if (!admitted) return admitted.error().message;
    return asset_exists(*admitted) ? "" : fmt::format("file \"{}\" does not exist", file);
}

class FileSearch {
  public:
    FileSearch(const usd::stage::Stage& stage, usd::stage::TimeCode time, Diagnostics& diagnostics)
        : stage_(stage), time_(time), diagnostics_(diagnostics) {}

    NamedFiles run() {
        visit_children(stage_.pseudo_root());
        return found_;
    }

  private:
    void visit_children(const Prim& parent) {
        for (const Prim& prim : parent.children()) {
            visit(prim);
            // One instance of a prototype names the files of all
            if (!prim.is_instance() || prim.prototype() == prim) visit_children(prim);
        }
    }

    void visit(const Prim& prim) {
        const std::string type = prim.type_name().str();
        if (type == "Shader" && reads_texture(prim))
            check(source_of(prim.attribute("inputs:file")), "texture-unreadable", "texture",
                  "uses the fallback color");
        if (prim.is_a("DomeLight") || prim.is_a("DomeLight_1") || prim.is_a("RectLight"))
            check(prim.attribute("inputs:texture:file"), "light-texture", "light texture",
                  "has the light without its texture");
        if (type.ends_with("Light"))
            check(prim.attribute("inputs:shaping:ies:file"), "ies-unreadable", "IES profile",
                  "has the light without it");
        if (type == "OpenVDBAsset")
            check(prim.attribute("filePath"), "volume-file", "volume file", "skips the volume");
    }

    bool reads_texture(const Prim& shader) const {
        const std::string id = shader.attribute("info:id").get_or<std::string>({}, time_);
        return id == "UsdUVTexture" || id.starts_with("ND_");
    }

    /// The attribute that an input is connected to through interfaces, or the input itself.
    Attribute source_of(Attribute input) const {
        constexpr int max_connections = 64;
        for (int i = 0; i < max_connections && input; ++i) {
            const auto connections = input.connections();
            if (connections.empty()) return input;
            const Prim prim = stage_.prim_at(connections.front().prim_path());
            if (!prim || prim.type_name().str() == "Shader") return {};
            input = prim.attribute(connections.front().name().str());
        }
        return {};
    }

    void check(const Attribute& attribute, const char* code, const char* kind, const char* effect) {
        if (!attribute || !attribute.has_authored_value()) return;
        const std::string authored = attribute.get_or<std::string>({}, time_);
        if (authored.empty()) return;
        const std::string file = attribute.resolved_asset_path(time_);
        if (!looked_at_.emplace(attribute.path_string(), file).second) return;
        ++found_.count;
        const std::string problem = problem_of(file);
        if (problem.empty()) return;
        ++found_.missing;
        diagnostics_.error(
            code, attribute.loc(), attribute.prim().path_string(),
            fmt::format("cannot read {} '{}': {}; a render {}", kind, authored, problem, effect));
    }

    const usd::stage::Stage& stage_;
    usd::stage::TimeCode time_;
    Diagnostics& diagnostics_;
    NamedFiles found_;
    std::set<std::pair<std::string, std::string>> looked_at_;  ///< attribute and file
};

}  // namespace

NamedFiles report_missing_files(const usd::stage::Stage& stage,
                                usd::stage::TimeCode time,
                                Diagnostics& diagnostics) {
    return FileSearch(stage, time, diagnostics).run();
}

}  // namespace velatura::app
