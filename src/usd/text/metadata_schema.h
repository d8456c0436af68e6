// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/type_name.h"

#include <cstdint>
#include <string_view>

namespace velatura::usd::text {

/// What a metadata field of a known name holds.
enum class MetadataKind : uint8_t {
    Unknown,
    Typed,
    Dictionary,
    TokenList,
    StringList,
    IntList,
    Int64List,
    UIntList,
    UInt64List
};

struct MetadataType {
    MetadataKind kind = MetadataKind::Unknown;
    const layer::TypeInfo* type = nullptr;  ///< of Typed
};

/// The type of a field by its key; kind Unknown for names no schema declares.
/// Ref: AOUSD Core Specification 1.0.1, 7.6; the fields USD's own schemas register.
MetadataType metadata_type(std::string_view key);

}  // namespace velatura::usd::text
