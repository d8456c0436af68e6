// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::text {

/// Writes one layer into a string.
class LayerWriter {
  public:
    LayerWriter(const layer::Layer& layer, std::string& out);

    void write(std::string_view header);

  private:
    // writer.cpp: structure
    void prim(layer::Path path, int indent);
    void body(layer::Path path, const layer::Spec& spec, int indent);
    void variant_sets(layer::Path path, const layer::Spec& spec, int indent);
    void reorder(std::string_view what, const layer::Spec& spec, layer::Token field, int indent);
    void attribute(layer::Path path, const layer::Spec& spec, int indent);
    void relationship(layer::Path path, const layer::Spec& spec, int indent);
    void samples(const layer::TimeSamples& samples, int indent);
    void target_list(std::string_view declaration,
                     std::string_view suffix,
                     const layer::PathListOp& op,
                     int indent);

    // metadata_writer.cpp
    bool has_metadata(const layer::Spec& spec) const;
    /// " (", the fields, ")"; nothing when there is no metadata.
    void metadata(const layer::Spec& spec, int indent);
    void metadata_fields(const layer::Spec& spec, int indent);
    void field(const layer::Field& field, int indent);
    bool list_op_field(const std::string& key, const layer::Value& value, int indent);
    void sub_layers(int indent);
    void dictionary(const layer::Dictionary& dictionary, int indent);
    void paths(const std::string& key, const std::vector<layer::Path>& paths, int indent);
    template <class Arc>
    void arcs(const std::string& key, const std::vector<Arc>& arcs, int indent);
    template <class Arc>
    void arc(const Arc& arc, int indent);
    template <class T>
    void words(const std::string& key,
               const std::vector<T>& items,
               bool is_bare_when_single,
               int indent);

    void line(int indent, std::string_view text);

    void start(int indent) { out_.append(size_t(indent) * 4, ' '); }

    const layer::Layer& layer_;
    const layer::FieldNames& names_;
    std::string& out_;
};

/// Calls write(prefix, items) for every list of an op that has an opinion, in the order of written
/// layers.
template <class T, class Write>
void for_each_edit(const layer::ListOp<T>& op, const Write& write) {
    if (op.is_explicit) {
        write("", op.explicit_items);
        return;
    }
    if (!op.deleted.empty()) write("delete ", op.deleted);
    if (!op.added.empty()) write("add ", op.added);
    if (!op.prepended.empty()) write("prepend ", op.prepended);
    if (!op.appended.empty()) write("append ", op.appended);
    if (!op.ordered.empty()) write("reorder ", op.ordered);
}

}  // namespace velatura::usd::text
