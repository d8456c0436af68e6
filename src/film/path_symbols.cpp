// SPDX-License-Identifier: Apache-2.0
#include "film/path_symbols.h"

#include "accumulate/names.h"

#include <algorithm>
#include <array>

namespace velatura::film {

namespace {

/// By PathEvent.
constexpr std::array<PathSymbol, path_event_count> events = {{
    {'R', 'D', "diffuse"},
    {'R', 'D', "subsurface"},
    {'R', 'G', "specular"},
    {'R', 'S', "specular"},
    {'R', 'G', "coat"},
    {'R', 'S', "coat"},
    {'T', 'D', "diffuse"},
    {'T', 'G', "transmission"},
    {'T', 'S', "transmission"},
    {'V', 0, "volume"},
}};

constexpr std::string_view domes = "env";

template <class Rule>
SymbolSet those(const std::vector<PathSymbol>& symbols, const Rule& is_in) {
    SymbolSet set(symbols.size(), false);
    for (size_t i = 0; i < symbols.size(); ++i) set[i] = is_in(symbols[i]);
    return set;
}

}  // namespace

PathSymbols::PathSymbols(const std::vector<accumulate::LightGroup>& groups) : groups_(groups) {
    symbols_.push_back({'C', 0, {}});
    symbols_.insert(symbols_.end(), events.begin(), events.end());
    for (const accumulate::LightGroup& g : groups)
        symbols_.push_back({g.name == accumulate::emissive_group ? 'O'
                            : g.is_dome                          ? 'B'
                                                                 : 'L',
                            0, g.name});
}

SymbolSet PathSymbols::of_type(char type) const {
    return those(symbols_, [type](const PathSymbol& s) {
        return s.type == type || (type == 'L' && s.type == 'B');
    });
}

SymbolSet PathSymbols::of_scattering(char scattering, bool is_strict) const {
    return those(symbols_, [=](const PathSymbol& s) {
        const bool are_specular = !is_strict && (scattering == 'G' || scattering == 'S');
        return s.scattering == scattering ||
               (are_specular && (s.scattering == 'G' || s.scattering == 'S'));
    });
}

SymbolSet PathSymbols::of_label(std::string_view label) const {
    const auto called = [this](std::string_view word) {
        SymbolSet set = those(symbols_, [word](const PathSymbol& s) { return s.label == word; });
        set[camera] = false;
        return set;
    };
    SymbolSet set = called(label);
    // What the scene calls a group comes before what layers call another
    const bool is_of_scene =
        std::any_of(groups_.begin(), groups_.end(),
                    [label](const accumulate::LightGroup& g) { return g.label == label; });
    for (size_t g = 0; g < groups_.size(); ++g) {
        if (label == domes)
            set[of_group(g)] = groups_[g].is_dome;
        else if (is_of_scene)
            set[of_group(g)] = groups_[g].label == label;
    }
    return set;
}

std::vector<std::string> PathSymbols::labels() const {
    std::vector<std::string> words;
    for (const PathSymbol& s : symbols_)
        if (!s.label.empty()) words.emplace_back(s.label);
    for (const accumulate::LightGroup& g : groups_)
        if (!g.label.empty()) words.push_back(g.label);
    words.emplace_back(domes);
    return words;
}

}  // namespace velatura::film
