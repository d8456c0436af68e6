// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

namespace velatura::usd::stage {

namespace {

constexpr std::string_view prefix = "primvars:";
constexpr std::array<std::string_view, 5> interpolation_names = {"constant", "uniform", "varying",
                                                                 "vertex", "faceVarying"};

bool ends_with_indices(std::string_view name) {
    return name.ends_with(":indices");
}

/// The primvar authored on this very prim; nullopt when it has no value.
std::optional<Primvar> own_primvar(const Prim& prim, std::string_view name) {
    const Attribute attribute = prim.attribute(std::string(prefix) + std::string(name));
    if (!attribute.is_authored() || !attribute.has_authored_value()) return std::nullopt;
    Primvar primvar = as_primvar(attribute, Interpolation::Constant);
    primvar.name = std::string(name);
    return primvar;
}

}  // namespace

std::optional<Interpolation> interpolation_from_name(std::string_view name) {
    const auto found = std::find(interpolation_names.begin(), interpolation_names.end(), name);
    if (found == interpolation_names.end()) return std::nullopt;
    return Interpolation(found - interpolation_names.begin());
}

std::string_view interpolation_name(Interpolation interpolation) {
    return interpolation_names[size_t(interpolation)];
}

std::vector<int> Primvar::index_values(TimeCode time) const {
    return indices.get<std::vector<int>>(time).value_or(std::vector<int>());
}

Primvar as_primvar(Attribute attribute, Interpolation fallback) {
    Primvar primvar;
    primvar.name = attribute.name().str();
    primvar.attribute = attribute;
    primvar.indices = attribute.prim().attribute(attribute.name().str() + ":indices");
    primvar.interpolation = fallback;
    if (const auto authored = attribute.metadata("interpolation")) {
        const auto* name = authored->get_if<layer::Token>();
        const auto known = name ? interpolation_from_name(name->view()) : std::nullopt;
        if (known) {
            primvar.interpolation = *known;
        } else {
            attribute.prim().diagnostics().warn(
                "usd-bad-interpolation", attribute.loc(), attribute.prim().path_string(),
                fmt::format(
                    "interpolation of {} is \"{}\", expected constant, uniform, varying, vertex or "
                    "faceVarying; {} is used",
                    attribute.name().str(), name ? name->str() : "", interpolation_name(fallback)));
        }
    }
    if (const auto size = attribute.metadata("elementSize")) {
        if (const int* count = size->get_if<int>(); count && *count > 0)
            primvar.element_size = *count;
    }
    return primvar;
}

std::optional<Primvar> find_primvar(Prim prim, std::string_view name) {
    if (auto own = own_primvar(prim, name)) return own;
    for (Prim above = prim.parent(); above && !above.is_pseudo_root(); above = above.parent()) {
        auto inherited = own_primvar(above, name);
        if (!inherited) continue;
        // The nearest opinion decides; only constant ones come down
        if (inherited->interpolation == Interpolation::Constant) return inherited;
        return std::nullopt;
    }
    return std::nullopt;
}

std::vector<Primvar> find_primvars(Prim prim) {
    std::map<std::string, Primvar> found;
    std::map<std::string, bool> hidden;
    for (Prim at = prim; at && !at.is_pseudo_root(); at = at.parent()) {
        for (const layer::Token& property : at.property_names()) {
            const std::string_view full = property.view();
            if (!full.starts_with(prefix) || ends_with_indices(full)) continue;
            const std::string name(full.substr(prefix.size()));
            if (found.count(name) != 0 || hidden.count(name) != 0) continue;
            auto primvar = own_primvar(at, name);
            if (!primvar) continue;
            if (at == prim || primvar->interpolation == Interpolation::Constant) {
                found.emplace(name, *std::move(primvar));
            } else {
                hidden.emplace(name, true);
            }
        }
    }
    std::vector<Primvar> result;
    for (auto& entry : found) result.push_back(std::move(entry.second));
    return result;
}

}  // namespace velatura::usd::stage
