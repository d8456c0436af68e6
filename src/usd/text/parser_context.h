// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/text/reader.h"
#include "usd/text/scanner.h"
#include "usd/text/value_parser.h"

#include <cstdint>
#include <string_view>

namespace velatura::usd::text {

/// What the parsers of one layer share: its text, the layer that it becomes, and its dialect.
struct ParserContext {
    ParserContext(std::string_view text,
                  uint32_t file_id,
                  layer::Layer& result,
                  Diagnostics& diagnostics,
                  const TextOptions& text_options)
        : scanner(text, file_id, diagnostics),
          values(scanner),
          layer(result),
          options(text_options),
          names(layer::fields()) {}

    ParserContext(const ParserContext&) = delete;
    ParserContext& operator=(const ParserContext&) = delete;

    Scanner scanner;
    ValueParser values;
    layer::Layer& layer;
    const TextOptions& options;
    const layer::FieldNames& names;
    bool is_legacy = false;  ///< "#sdf": stricter on empty list edits
};

}  // namespace velatura::usd::text
