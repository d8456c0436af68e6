// SPDX-License-Identifier: Apache-2.0
#include "app/render_layers.h"

#include "accumulate/layer_sources.h"
#include "accumulate/names.h"
#include "base/unique_names.h"
#include "film/light_path_expression.h"
#include "film/lobe_layers.h"
#include "film/path_automaton.h"

#include <fmt/format.h>

#include <cctype>
#include <map>
#include <optional>
#include <utility>

namespace velatura::app {

namespace {

/// Data layers, and the beauty and its alpha, by the names that others have for them (Hydra's
/// tokens, RenderMan, Arnold).
std::optional<std::string> data_layer(const std::string& name) {
    static const std::map<std::string, std::string> names = {
        {"color", "beauty"},
        {"Ci", "beauty"},
        {"C", "beauty"},
        {"RGBA", "beauty"},
        {"rgba", "beauty"},
        {"beauty", "beauty"},
        {"alpha", "alpha"},
        {"a", "alpha"},
        {"A", "alpha"},
        {"depth", "Z"},
        {"Z", "Z"},
        {"cameraDepth", "Z"},
        {"P", "P"},
        {"N", "N"},
        {"normal", "N"},
        {"st", "st"},
        {"albedo", "albedo"},
        {"primId", "primId"},
        {"instanceId", "instanceId"},
        {"sampleCount", "sampleCount"},
    };
    const auto at = names.find(name);
    if (at == names.end()) return std::nullopt;
    return at->second;
}

/// Names that the set's layers have, with their expressions.
std::map<std::string, std::string> stored_layers(const film::LayerSet& set) {
    std::map<std::string, std::string> names;
    const accumulate::AccumulatorTable table(set);
    const auto add = [&names](bool is_stored, const std::vector<accumulate::LayerSource>& sources) {
        if (!is_stored) return;
        for (const accumulate::LayerSource& s : sources) names.emplace(s.entry.name, s.entry.lpe);
    };
    add(set.matrix_layers, accumulate::matrix_sources(set, table));
    add(set.bounce_layers, accumulate::bounce_sources(set, table));
    add(set.group_layers, accumulate::group_sources(set, table));
    add(set.shadow_layers, accumulate::shadow_sources(set, table, true));
    add(set.shadow_layers, accumulate::shadow_sources(set, table, false));
    add(true, accumulate::path_sources(set, table, "lobes"));
    add(true, accumulate::path_sources(set, table, "paths"));
    // Also names of files and parts
    for (const char* data :
         {"beauty", "deep", "data", "rgba", "albedo", "N", "P", "Z", "st", "primId", "instanceId",
          "sampleCount", "variance", "invalid", "R", "G", "B", "A"})
        names.emplace(data, "");
    for (const accumulate::DataAlias& a : set.data_aliases) names.emplace(a.name, "");
    return names;
}

/// Whether files have a meaning for names like this.
bool is_reserved(const std::string& name) {
    for (const char* begin : {"sums", "clamp_", "Crypto", "U_", "S_", "C_"})
        if (name.starts_with(begin)) return true;
    return false;
}

/// Room for `.R`, and for `_hA` and `clamp_` where these come.
size_t longest_name(const film::LayerSet& set) {
    return accumulate::max_channel_name_bytes - 2 - (set.halves ? 3 : 0) -
           (set.has_clamp() ? 6 : 0);
}

Result<void> check_paths(const std::vector<accumulate::PathLayer>& layers,
                         const film::LayerSet& set) {
    const Result<film::PathAutomaton> made =
        film::PathAutomaton::make(layers, set.has_strict_paths, set.groups);
    if (!made) return made.error();
    return {};
}

/// Adds what was asked for by name, one after the other.
class LayerChoice {
  public:
    explicit LayerChoice(film::LayerSet set)
        : set_(std::move(set)), taken_(stored_layers(set_)), names_("_", longest_name(set_)) {
        for (const auto& [name, lpe] : taken_) names_.take(name);
    }

    const film::LayerSet& set() const { return set_; }

    /// Errors: "lpe". Returns: what there is to say.
    Result<std::string> add_path(const std::string& name, const std::string& text) {
        accumulate::PathLayer layer = film::make_path_layer(name, text, "paths");
        // A layer of that name may be what is meant
        const std::string lpe = accumulate::lpe_of(layer);
        if (name == "beauty" && (lpe == "C.*" || lpe == "C.*[LOB]")) return std::string();
        const auto known = taken_.find(name);
        if (known != taken_.end() && known->second == lpe) return std::string();
        if (const Result<void> ok = check_paths({layer}, set_); !ok) return ok.error();
        std::string note = find_name(layer.name);
        taken_.emplace(layer.name, lpe);
        set_.path_layers.push_back(std::move(layer));
        return note;
    }

    /// After the last: drops those that were added if all together tell too many paths apart, which
    /// is the error "lpe".
    Result<void> finish() {
        const Result<void> ok = check_paths(set_.path_layers, set_);
        if (!ok)
            std::erase_if(set_.path_layers,
                          [](const accumulate::PathLayer& p) { return p.family == "paths"; });
        return ok;
    }

    std::string add_data(const std::string& name, const std::string& source) {
        const std::optional<std::string> of = data_layer(source.empty() ? name : source);
        if (!of) return "there is no such layer";
        // Every file holds these, as R, G, B, A
        const bool is_beauty = *of == "beauty" || *of == "alpha";
        if (is_beauty && data_layer(name) == of) return "";
        if (!is_beauty && !set_.data_layers) return "--layers has no data";
        if (*of == name) return "";
        accumulate::DataAlias alias{name, *of};
        const std::string note = find_name(alias.name);
        taken_.emplace(alias.name, "");
        set_.data_aliases.push_back(std::move(alias));
        return note;
    }

  private:
    /// Makes the name one that no layer has and files take. Returns: a note if that changed it.
    std::string find_name(std::string& name) {
        std::string legal;
        for (const char c : name)
            legal += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
        // As half images are called, also where it is cut short
        for (size_t at = 0; (at = legal.find("_h", at)) != std::string::npos; ++at)
            if (at + 2 < legal.size() && (legal[at + 2] == 'A' || legal[at + 2] == 'B'))
                legal.replace(at, 2, "_half");
        if (!accumulate::is_legal_channel_name(legal.substr(0, 1)) || is_reserved(legal))
            legal = "layer_" + legal;
        legal = names_.make(legal);
        if (legal == name) return {};
        const std::string note = fmt::format(
            "it is stored as {}: {}", legal,
            taken_.contains(name)
                ? "a layer of that name exists"
                : "its name is not a valid layer name, or is reserved for another kind of layer");
        name = legal;
        return note;
    }

    film::LayerSet set_;
    std::map<std::string, std::string> taken_;  ///< names, with the expressions of layers of light
    UniqueNames names_;
};

std::pair<std::string, std::string> split_lpe(const std::string& text) {
    const size_t at = text.find('=');
    return {text.substr(0, at), text.substr(at + 1)};
}

/// The var's notes go to tell(var, note, is_error).
template <class Report>
void add_vars(const scene::RenderSettings& settings, LayerChoice& choice, const Report& report) {
    if (settings.products.empty()) return;
    for (const scene::RenderVar& var : settings.products.front().vars) {
        if (var.source_type == "lpe") {
            const Result<std::string> note = choice.add_path(var.name, var.source_name);
            if (!note)
                report(var, note.error().message, true);
            else if (!note->empty())
                report(var, *note, false);
        } else if (var.source_type == "raw") {
            const std::string note = choice.add_data(var.name, var.source_name);
            if (!note.empty()) report(var, note, false);
        } else if (var.source_type != "intrinsic") {
            // Intrinsic ones were told of where they were read
            report(var,
                   fmt::format("sourceType {} is not supported; the render var is skipped",
                               var.source_type),
                   false);
        }
    }
}

LayerChoice without_vars(const RenderJob& job, const scene::Scene& scene) {
    return LayerChoice(render::with_rows(job.settings.layers, scene));
}

}  // namespace

film::LayerSet layers_of(const RenderJob& job, const scene::Scene& scene) {
    LayerChoice choice = without_vars(job, scene);
    for (const std::string& text : job.arguments.lpe) {
        const auto [name, expression] = split_lpe(text);
        const auto told_elsewhere = choice.add_path(name, expression);
        (void)told_elsewhere;
    }
    add_vars(scene.settings, choice, [](const scene::RenderVar&, const std::string&, bool) {});
    const auto told_elsewhere = choice.finish();
    (void)told_elsewhere;
    return choice.set();
}

Result<void> check_render_vars(const RenderJob& job,
                               const scene::Scene& scene,
                               Diagnostics& diagnostics) {
    LayerChoice choice = without_vars(job, scene);
    for (const std::string& text : job.arguments.lpe) {
        const auto [name, expression] = split_lpe(text);
        const Result<std::string> note = choice.add_path(name, expression);
        if (!note) return Error{"lpe", fmt::format("--lpe {}: {}", name, note.error().message)};
        if (!note->empty())
            diagnostics.warn("lpe", {}, {}, fmt::format("--lpe {}: {}", name, *note));
    }
    add_vars(scene.settings, choice,
             [&](const scene::RenderVar& var, const std::string& note, bool is_error) {
                 const bool is_known = var.provenance < scene.provenance.size();
                 const SourceLoc loc =
                     is_known ? scene.provenance[var.provenance].loc : SourceLoc{};
                 const std::string prim =
                     is_known ? scene.provenance[var.provenance].prim_path : scene.settings.name;
                 const std::string message = fmt::format("render var {}: {}", var.name, note);
                 if (is_error)
                     diagnostics.error("render-var", loc, prim, message);
                 else
                     diagnostics.warn("render-var", loc, prim, message);
             });
    if (const Result<void> ok = choice.finish(); !ok) {
        if (!job.arguments.lpe.empty()) return ok;
        diagnostics.error(
            "render-var", {}, scene.settings.name,
            ok.error().message + "; light path expressions of render vars are skipped");
    }
    return {};
}

}  // namespace velatura::app
