// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/text/metadata_parser.h"
#include "usd/text/parser_context.h"
#include "usd/text/property_parser.h"
#include "usd/text/reader.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace velatura::usd::text {

/// Nesting of prims and variants beyond which a layer is refused.
inline constexpr int max_prim_depth = 1024;

/// Reads one layer: its head, prims and variant sets. Functions return false after having reported
/// what is wrong.
class LayerParser {
  public:
    LayerParser(std::string_view text,
                uint32_t file_id,
                layer::Layer& layer,
                Diagnostics& diagnostics,
                const TextOptions& options);

    void parse();

    size_t error_count() const { return s_.error_count(); }

  private:
    bool header();
    bool layer_item();
    bool prim(layer::Path parent);
    bool prim_head(layer::Path parent, layer::Path& path);
    bool block(layer::Path owner);
    void contents(layer::Path owner);
    bool contents_item(layer::Path owner);
    bool variant_set(layer::Path owner);
    bool variant_head(layer::Path owner, layer::Token set, layer::Path& path);
    bool statement_end();
    bool line_end(std::string_view after);

    ParserContext context_;
    Scanner& s_;
    layer::Layer& layer_;
    const layer::FieldNames& names_;
    MetadataParser metadata_;
    PropertyParser properties_;
    int prim_depth_ = 0;
};

}  // namespace velatura::usd::text
