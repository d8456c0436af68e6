// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"

#include <string>
#include <string_view>

namespace velatura::usd::text {

/// The layer as text that reads back to the same layer: properties and metadata sorted by name,
/// prims in authored order, one statement per line. `header` is the first line. Ref: AOUSD Core
/// Specification 1.0.1, 16.2; the layout is that of Pixar's writer.
std::string write_text_layer(const layer::Layer& layer, std::string_view header = "#usda 1.0");

/// Order of names in written layers: letters regardless of case, runs of digits by their number.
bool dictionary_less(std::string_view a, std::string_view b);

}  // namespace velatura::usd::text
