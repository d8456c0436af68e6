// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <optional>
#include <string>
#include <string_view>

namespace velatura::usd::materialx {

/// USD's name for a MaterialX type ("color3" → "color3f"); "token" for those that USD does not
/// have (shaders, custom types).
std::string_view usd_type(std::string_view type);

/// The value of an attribute `value="…"` of a MaterialX type; nullopt when the text is not one.
/// Ref: MaterialX Specification 1.38, "MaterialX Data Types".
std::optional<layer::Value> parse_value(std::string_view type, std::string_view text);

/// A MaterialX name as a name of USD: namespaces end in "__" instead of ':', other characters that
/// cannot stand in one become '_'. Ref: OpenUSD, usdMtlx.
std::string usd_name(std::string_view name);

}  // namespace velatura::usd::materialx
