// SPDX-License-Identifier: Apache-2.0
#include "app/render_layers.h"

#include "accumulate/data_layer.h"
#include "accumulate/layer_sources.h"
#include "accumulate/names.h"
#include "app/data_requests.h"
#include "base/unique_names.h"
#include "film/light_path_expression.h"
#include "film/lobe_layers.h"
#include "film/path_automaton.h"

#include <fmt/format.h>

#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

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
    for (const accumulate::LayerSource& s : accumulate::light_sources(set, table))
        names.emplace(s.entry.name, s.entry.lpe);
    // Also names of files and parts
    for (const char* data :
         {"beauty", "deep", "data", "rgba", "albedo", "N", "P", "Z", "st", "primId", "instanceId",
          "sampleCount", "variance", "invalid", "R", "G", "B", "A"})
        names.emplace(data, "");
    for (const accumulate::DataAlias& a : set.data_aliases) names.emplace(a.name, "");
    for (const accumulate::DataLayer& d : set.named_data) names.emplace(d.name, "");
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

    /// A render var of sourceType raw or primvar.
    std::string add_var(const scene::RenderVar& var, const scene::Scene& scene) {
        constexpr std::string_view prefix = "primvars:";
        std::string source = var.source_name.empty() ? var.name : var.source_name;
        bool is_primvar = var.source_type == "primvar";
        if (source.starts_with(prefix)) {
            source.erase(0, prefix.size());
            is_primvar = true;
        }
        std::string note;
        std::optional<accumulate::DataFilter> filter;
        if (!var.filter.empty()) {
            const Result<accumulate::DataFilter> parsed = parse_render_var_filter(var.filter);
            if (parsed)
                filter = *parsed;
            else
                note = parsed.error().message;
        }
        const std::optional<NumberType> type = number_type(var.data_type);
        if (!var.data_type.empty() && !type)
            add_note(note, fmt::format("dataType {} has no numbers; it is ignored", var.data_type));
        if (is_primvar) {
            add_note(note, add_primvar(var.name, source, filter, var.data_type, scene));
            return note;
        }
        const bool is_plain =
            filter.value_or(accumulate::DataFilter::Average) == accumulate::DataFilter::Average &&
            !(type && type->is_half);
        add_note(note, add_raw(var.name, source, filter, is_plain, type && type->is_half, scene));
        return note;
    }

    /// A data layer of --layers.
    std::string add_request(const DataRequest& request, const scene::Scene& scene) {
        if (request.source == accumulate::DataSource::Primvar)
            return add_primvar(request.name, request.primvar, request.filter, "", scene);
        const std::string source(accumulate::name_of(request.source));
        const bool is_plain = request.filter.value_or(accumulate::DataFilter::Average) ==
                              accumulate::DataFilter::Average;
        return add_raw(request.name, source, request.filter, is_plain, false, scene);
    }

  private:
    static void add_note(std::string& note, const std::string& more) {
        if (!more.empty()) note += (note.empty() ? "" : "; ") + more;
    }

    /// is_plain: filtered and stored as what files hold anyway.
    std::string add_raw(const std::string& name,
                        const std::string& source,
                        std::optional<accumulate::DataFilter> filter,
                        bool is_plain,
                        bool is_half,
                        const scene::Scene& scene) {
        const std::optional<std::string> of = data_layer(source);
        const bool is_beauty = of && (*of == "beauty" || *of == "alpha");
        const std::optional<accumulate::DataSource> known = accumulate::find_data_source(source);
        if (is_beauty || (of && !known) || (of && set_.data_layers && is_plain)) {
            const std::string note = add_alias(name, *of);
            return note.empty() && !is_plain
                       ? fmt::format("{} has no other filter and precision", *of)
                       : note;
        }
        if (known) {
            accumulate::DataLayer layer;
            layer.source = *known;
            layer.suffixes = accumulate::suffixes_of(*known);
            layer.is_premultiplied = accumulate::is_premultiplied(*known);
            layer.is_half = is_half;
            if (*known == accumulate::DataSource::Element)
                layer.filter = accumulate::DataFilter::Closest;
            return add_layer(std::move(layer), name, filter);
        }
        // Others have names of their own for what is a primvar
        if (make_primvar_layer(scene, source, ""))
            return add_primvar(name, source, filter, "", scene);
        return fmt::format(
            "there is no data layer \"{}\"; data layers: {}, beauty, alpha, primId, "
            "instanceId, sampleCount; {}",
            source, data_sources_text(), primvars_text(scene));
    }

    std::string add_primvar(const std::string& name,
                            const std::string& primvar,
                            std::optional<accumulate::DataFilter> filter,
                            const std::string& data_type,
                            const scene::Scene& scene) {
        Result<accumulate::DataLayer> layer = make_primvar_layer(scene, primvar, data_type);
        if (!layer) return layer.error().message;
        return add_layer(*std::move(layer), name, filter);
    }

    std::string add_layer(accumulate::DataLayer layer,
                          const std::string& name,
                          std::optional<accumulate::DataFilter> filter) {
        if (filter) layer.filter = *filter;
        layer.name = name;
        std::string note = find_name(layer.name);
        taken_.emplace(layer.name, "");
        set_.named_data.push_back(std::move(layer));
        return note;
    }

    /// What every file holds, under another name as well.
    std::string add_alias(const std::string& name, const std::string& of) {
        // Every file holds these, as R, G, B, A
        const bool is_beauty = of == "beauty" || of == "alpha";
        if (is_beauty && data_layer(name) == of) return "";
        if (!is_beauty && !set_.data_layers) return "--layers has no data";
        if (of == name) return "";
        accumulate::DataAlias alias{name, of};
        std::string note = find_name(alias.name);
        taken_.emplace(alias.name, "");
        set_.data_aliases.push_back(std::move(alias));
        return note;
    }

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

/// Products that share the samples of the one that is rendered.
std::vector<const scene::RenderProduct*> shared_products(const scene::RenderSettings& settings) {
    std::vector<const scene::RenderProduct*> products;
    for (const scene::RenderProduct& product : settings.products)
        if (product.view == settings.products[settings.product].view) products.push_back(&product);
    return products;
}

/// Notes go to report(var, note, is_error).
template <class Report>
void add_vars(const scene::Scene& scene, LayerChoice& choice, const Report& report) {
    std::set<scene::ProvenanceId> known;
    for (const scene::RenderProduct* product : shared_products(scene.settings)) {
        for (const scene::RenderVar& var : product->vars) {
            // Products may share their vars as well
            if (var.provenance != scene::none && !known.insert(var.provenance).second) continue;
            if (var.source_type == "lpe") {
                const Result<std::string> note = choice.add_path(var.name, var.source_name);
                if (!note)
                    report(var, note.error().message, true);
                else if (!note->empty())
                    report(var, *note, false);
            } else if (var.source_type == "raw" || var.source_type == "primvar") {
                const std::string note = choice.add_var(var, scene);
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
    for (const DataRequest& request : job.data) {
        const auto told_elsewhere = choice.add_request(request, scene);
        (void)told_elsewhere;
    }
    add_vars(scene, choice, [](const scene::RenderVar&, const std::string&, bool) {});
    const auto told_elsewhere = choice.finish();
    (void)told_elsewhere;
    return choice.set();
}

std::vector<scene::MomentKind> moments_of(const film::LayerSet& layers) {
    using accumulate::DataSource;
    using scene::MomentKind;
    std::set<MomentKind> kinds;
    for (const accumulate::DataLayer& d : layers.named_data) {
        if (d.source == DataSource::Motion)
            kinds.insert({MomentKind::Frame, MomentKind::NextFrame});
        if (d.source == DataSource::BackwardMotion)
            kinds.insert({MomentKind::Frame, MomentKind::PreviousFrame});
        if (d.source == DataSource::ShutterMotion)
            kinds.insert({MomentKind::ShutterOpen, MomentKind::ShutterClose});
    }
    return {kinds.begin(), kinds.end()};
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
    for (const DataRequest& request : job.data) {
        const std::string note = choice.add_request(request, scene);
        if (!note.empty())
            diagnostics.warn("data-layer", {}, {},
                             fmt::format("--layers {}: {}", request.text, note));
    }
    add_vars(
        scene, choice, [&](const scene::RenderVar& var, const std::string& note, bool is_error) {
            const bool is_known = var.provenance < scene.provenance.size();
            const SourceLoc loc = is_known ? scene.provenance[var.provenance].loc : SourceLoc{};
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
