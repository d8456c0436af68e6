// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/text/reader.h"
#include "usd/text/scanner.h"
#include "usd/text/value_parser.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::text {

/// Nesting of prims and variants beyond which a layer is refused.
inline constexpr int max_prim_depth = 1024;

/// Word in front of a list edit.
enum class ListEdit : uint8_t { Explicit, Add, Delete, Append, Prepend, Reorder };

/// Reads one layer. Functions return false after having reported what is wrong.
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
    // layer_parser.cpp: the layer and its prims
    bool header();
    bool layer_item();
    bool prim(layer::Path parent);
    bool prim_head(layer::Path parent, layer::Path& path);
    bool block(layer::Path owner);
    void contents(layer::Path owner);
    bool contents_item(layer::Path owner);
    bool variant_set(layer::Path owner);
    bool variant_head(layer::Path owner, layer::Token set, layer::Path& path);
    bool reorder_names(layer::Path owner, layer::Token field, SourceLoc where);
    bool statement_end();
    bool line_end(std::string_view after);

    // property_parser.cpp: attributes and relationships
    bool property(layer::Path owner);
    struct Declaration;
    bool relationship(layer::Path owner, Declaration& declaration);
    bool relationship_extra(layer::Path owner, layer::Spec& spec, Declaration& declaration);
    bool attribute(layer::Path owner, Declaration& declaration);
    bool attribute_extra(layer::Path owner, layer::Spec& spec, const Declaration& declaration);
    layer::Spec* property_spec(layer::Path owner,
                               layer::SpecKind kind,
                               const Declaration& declaration);
    bool attribute_value(const Declaration& declaration, layer::Value& out);
    bool sample_value(const Declaration& declaration, layer::Value& out);
    /// "time :"; a time of nan is warned about.
    bool sample_time(double& time);
    bool attribute_samples(layer::Spec& spec, const Declaration& declaration);
    bool relationship_samples(layer::Path owner, layer::Spec& spec);
    bool spline(layer::Spec& spec);
    bool target_list(
        layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool target_path(layer::Path owner, layer::Path& out);

    // metadata_parser.cpp
    bool metadata_block(layer::Path owner, layer::Spec& spec);
    bool metadata_end();
    bool metadata_item(layer::Path owner, layer::Spec& spec);
    bool special_metadata(layer::Path owner,
                          layer::Spec& spec,
                          const std::string& key,
                          ListEdit edit,
                          SourceLoc where,
                          bool& is_special);
    bool prim_metadata(layer::Path owner,
                       layer::Spec& spec,
                       const std::string& key,
                       ListEdit edit,
                       SourceLoc where,
                       bool& is_special);
    bool plain_metadata(layer::Spec& spec, const std::string& key, ListEdit edit, SourceLoc where);
    bool unknown_metadata(layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool string_field(layer::Spec& spec, layer::Token field, SourceLoc where);
    bool word_field(layer::Spec& spec, layer::Token field, SourceLoc where);
    bool sub_layers(layer::Spec& spec, SourceLoc where);
    bool layer_offset(layer::LayerOffset& offset, layer::Dictionary* custom_data);
    template <class Arc>
    bool arc_list(
        layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    template <class Arc>
    bool arc(layer::Path owner, Arc& out);
    bool path_list(
        layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool prim_path(layer::Path owner, bool may_be_empty, layer::Path& out);
    bool relocates(layer::Path owner, layer::Spec& spec, layer::Token field, SourceLoc where);
    bool relocate_path(layer::Path owner, bool may_be_empty, layer::Path& out);
    bool variant_selections(layer::Spec& spec, SourceLoc where);
    bool variant_set_names(layer::Spec& spec, ListEdit edit, SourceLoc where);

    template <class T>
    bool list_op_metadata(layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    /// The same of integers; those that do not fit make it unknown metadata.
    template <class T>
    bool integer_list_metadata(layer::Spec& spec,
                               layer::Token field,
                               ListEdit edit,
                               SourceLoc where);

    /// Puts items into the edit's list of a spec's list-op field.
    template <class T>
    bool store_list(layer::Spec& spec,
                    layer::Token field,
                    ListEdit edit,
                    std::vector<T> items,
                    SourceLoc where);

    ListEdit accept_list_edit();
    /// Reads None for a list of arcs, if it is no edit of another list; an error where it is.
    bool accept_none(ListEdit edit, bool& is_none);
    bool expect_assignment();

    Scanner s_;
    ValueParser values_;
    layer::Layer& layer_;
    const TextOptions& options_;
    const layer::FieldNames& names_;
    int prim_depth_ = 0;
    bool is_legacy_ = false;  ///< "#sdf": stricter on empty list edits
};

struct LayerParser::Declaration {
    SourceLoc where;
    ListEdit edit = ListEdit::Explicit;
    bool is_custom = false;
    layer::Variability variability = layer::Variability::Varying;
    std::string type_name;                  ///< of attributes, with "[]"
    const layer::TypeInfo* type = nullptr;  ///< nullptr: unknown
    std::string name;
};

template <class T>
bool LayerParser::store_list(
    layer::Spec& spec, layer::Token field, ListEdit edit, std::vector<T> items, SourceLoc where) {
    using layer::ListOp;
    const ListOp<T>* old = spec.field_as<ListOp<T>>(field);
    ListOp<T> op = old ? *old : ListOp<T>();
    if (is_legacy_ && edit != ListEdit::Explicit && items.empty()) {
        return s_.error("usd-empty-list-edit", where,
                        "found None or an empty list, expected items for an edit of a list");
    }
    // An explicit list and edits exclude one another: the later statement wins
    if (edit == ListEdit::Explicit || op.is_explicit) op = {};
    switch (edit) {
        case ListEdit::Explicit:
            op = ListOp<T>::make_explicit(std::move(items));
            break;
        case ListEdit::Add:
            op.added = std::move(items);
            break;
        case ListEdit::Delete:
            op.deleted = std::move(items);
            break;
        case ListEdit::Append:
            op.appended = std::move(items);
            break;
        case ListEdit::Prepend:
            op.prepended = std::move(items);
            break;
        case ListEdit::Reorder:
            op.ordered = std::move(items);
            break;
    }
    spec.set_field(field, layer::Value(std::move(op)), where);
    return true;
}

}  // namespace velatura::usd::text
