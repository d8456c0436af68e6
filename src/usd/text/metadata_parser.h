// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/text/arc_parser.h"
#include "usd/text/list_edit.h"
#include "usd/text/parser_context.h"

#include <string>

namespace velatura::usd::text {

/// Reads the metadata of a layer, prim, variant or property: fields of known types, fields with a
/// syntax of their own, and unknown ones, which are kept as text. Functions return false after
/// having reported what is wrong. Ref: AOUSD Core Specification 1.0.1, 16.2.
class MetadataParser {
  public:
    explicit MetadataParser(ParserContext& context)
        : context_(context),
          s_(context.scanner),
          values_(context.values),
          names_(context.names),
          arcs_(context) {}

    /// "( item … )" into a spec. `owner`: the prim or variant that relative paths start from.
    bool block(layer::Path owner, layer::Spec& spec);

  private:
    bool next_item(layer::Path owner, layer::Spec& spec);
    bool item_end();
    /// Fields with a syntax of their own; `is_special` comes out false for others.
    bool special_item(layer::Path owner,
                      layer::Spec& spec,
                      const std::string& key,
                      ListEdit edit,
                      SourceLoc where,
                      bool& is_special);
    bool prim_item(layer::Path owner,
                   layer::Spec& spec,
                   const std::string& key,
                   ListEdit edit,
                   SourceLoc where,
                   bool& is_special);
    bool plain_item(layer::Spec& spec, const std::string& key, ListEdit edit, SourceLoc where);
    bool unknown_item(layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool string_field(layer::Spec& spec, layer::Token field, SourceLoc where);
    bool word_field(layer::Spec& spec, layer::Token field, SourceLoc where);
    template <class T>
    bool list_op_field(layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    /// The same of integers; those that do not fit make it unknown metadata.
    template <class T>
    bool integer_list_field(layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool variant_selections(layer::Spec& spec, SourceLoc where);
    bool variant_set_names(layer::Spec& spec, ListEdit edit, SourceLoc where);

    ParserContext& context_;
    Scanner& s_;
    ValueParser& values_;
    const layer::FieldNames& names_;
    ArcParser arcs_;
};

}  // namespace velatura::usd::text
