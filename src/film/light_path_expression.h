// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_set.h"
#include "base/result.h"
#include "film/path_symbols.h"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::film {

/// A regular expression over path events, as read.
struct PathPattern {
    enum class Kind : uint8_t { Event, Sequence, Choice, Repeat };

    Kind kind = Kind::Event;
    SymbolSet event;                 ///< of an Event
    std::vector<PathPattern> parts;  ///< of the others; one for Repeat
    int min = 0, max = 0;            ///< of Repeat; most < 0: any number
};

/// The longest expression, the deepest brackets and the largest count in {n} that are read.
inline constexpr size_t longest_expression = 4096;
inline constexpr int deepest_expression = 64, largest_repeat = 64;

/// Splits off `lpe:` and what says which light is meant. name, family: as wanted.
accumulate::PathLayer make_path_layer(std::string name, std::string_view text, std::string family);

/// Reads what make_path_layer() left: the grammar of Open Shading Language's lpeparse.cpp without
/// nested groups. Events C R T V L O B; scatterings D G S; <type scattering 'label'>, '.', '*',
/// '+', {n}, {n,m}, {n,},
/// [...], [^...], (...), |, 'label'.
/// Errors: "lpe", with column (from 1) and token.
Result<PathPattern> parse_path_expression(std::string_view text,
                                          const PathSymbols& symbols,
                                          bool is_strict);

}  // namespace velatura::film
