// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/text/list_edit.h"
#include "usd/text/parser_context.h"

#include <string_view>

namespace velatura::usd::text {

/// Reads the values of metadata that composition follows: sublayers, references, payloads,
/// inherits, specializes and relocates. `owner` is the prim that relative paths start from.
/// Functions return false after having reported what is wrong. Ref: AOUSD Core
/// Specification 1.0.1, 16.2.
class ArcParser {
  public:
    explicit ArcParser(ParserContext& context)
        : context_(context), s_(context.scanner), values_(context.values), names_(context.names) {}

    bool sub_layers(layer::Spec& spec, SourceLoc where);
    bool references(layer::Path owner, layer::Spec& spec, ListEdit edit, SourceLoc where);
    bool payloads(layer::Path owner, layer::Spec& spec, ListEdit edit, SourceLoc where);
    /// Prims of the same layer: inherits and specializes.
    bool paths(
        layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool relocates(layer::Path owner, layer::Spec& spec, layer::Token field, SourceLoc where);

  private:
    /// One item, a list of them, or None, into the edit's list of a field. read(Item&): one item.
    template <class Item, class ReadItem>
    bool item_list(layer::Spec& spec,
                   layer::Token field,
                   ListEdit edit,
                   SourceLoc where,
                   const ReadItem& read);
    template <class Arc>
    bool arc(layer::Path owner, Arc& out);
    /// "( offset = …; scale = … )", with customData where there is a dictionary for it.
    bool layer_offset(layer::LayerOffset& offset, layer::Dictionary* custom_data);
    /// "<path>" below the owner, and its text; "<>" gives an empty one where it can be empty.
    bool absolute_path(layer::Path owner,
                       bool can_be_empty,
                       std::string_view& text,
                       layer::Path& out);
    bool prim_path(layer::Path owner, bool can_be_empty, layer::Path& out);
    bool relocate_path(layer::Path owner, bool can_be_empty, layer::Path& out);
    /// Reads None for a list of arcs, if it is no edit of another list; an error where it is.
    bool accept_none(ListEdit edit, bool& is_none);

    ParserContext& context_;
    Scanner& s_;
    ValueParser& values_;
    const layer::FieldNames& names_;
};

}  // namespace velatura::usd::text
