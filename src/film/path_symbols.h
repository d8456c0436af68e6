// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_set.h"
#include "film/path_event.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::film {

/// The letters of light path expressions: the camera, then path events, then lights by group. An
/// expression sees each as a type, a scattering and a label.
struct PathSymbol {
    char type;        ///< C R T V L O B
    char scattering;  ///< D G S, or 0: none
    std::string_view label;
};

/// Which symbols an expression's event may be, by number.
using SymbolSet = std::vector<bool>;

class PathSymbols {
  public:
    /// groups: must outlive this. emissive: the group of surfaces that emit, by name.
    explicit PathSymbols(const std::vector<accumulate::LightGroup>& groups);

    size_t count() const { return symbols_.size(); }

    const PathSymbol& operator[](size_t i) const { return symbols_[i]; }

    static constexpr size_t camera = 0;

    static constexpr size_t of(PathEvent event) { return 1 + size_t(event); }

    static constexpr size_t of_group(size_t group) { return 1 + path_event_count + group; }

    SymbolSet none() const { return SymbolSet(count(), false); }

    /// Those of this type; domes are lights as well as the background.
    SymbolSet of_type(char type) const;
    /// strict: G is rough and S a mirror; else each is any specular.
    SymbolSet of_scattering(char scattering, bool is_strict) const;
    /// A lobe, a light group as the scene or as layers call it, or `env`, all domes, which may be
    /// none.
    SymbolSet of_label(std::string_view label) const;

    /// The words that of_label() knows.
    std::vector<std::string> labels() const;

  private:
    const std::vector<accumulate::LightGroup>& groups_;
    std::vector<PathSymbol> symbols_;
};

}  // namespace velatura::film
