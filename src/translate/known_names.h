// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/schema_support.h"
#include "usd/stage/schema_tables.h"
#include "usd/stage/stage.h"

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura::translate {

/// Whether one of the texts apart by '|' is this one.
bool is_one_of(std::string_view text, std::string_view choices);

/// Property names that the type and the applied schemas of a prim know.
struct KnownNames {
    std::vector<std::string> names;
    /// What the schemas declare, by name; the strongest schema counts.
    std::unordered_map<std::string, const usd::stage::SchemaAttribute*> attributes;
};

KnownNames known_names(usd::stage::Prim prim);

/// Names of all typed schemas that a prim may have, and of all that can be applied.
const std::vector<std::string>& known_types();
const std::vector<std::string>& known_apis();
/// Whether the schema is known, and says nothing of the image.
bool is_without_image(std::string_view schema);

/// Whose an attribute of another renderer is, and what it asks for.
struct ForeignName {
    const ForeignRenderer* renderer = nullptr;  ///< nullptr: it is of none
    const ForeignRequest* request = nullptr;    ///< nullptr: nothing that could be seen
};

ForeignName foreign_name(std::string_view attribute);

}  // namespace velatura::translate
