// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"
#include "usd/layer/list_op.h"
#include "usd/text/parser_context.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace velatura::usd::text {

/// Word in front of a list edit.
enum class ListEdit : uint8_t { Explicit, Add, Delete, Append, Prepend, Reorder };

/// Takes the word if it comes next; Explicit when there is none.
ListEdit accept_list_edit(Scanner& scanner);

/// Reads the rest of a "reorder" statement, "= [names]", into a field of a spec of the layer. False
/// after having reported what is wrong, as below.
bool parse_name_order(ParserContext& context,
                      layer::Path owner,
                      layer::Token field,
                      SourceLoc where);

/// Puts items into the edit's list of a spec's list-op field.
template <class T>
bool store_list(ParserContext& context,
                layer::Spec& spec,
                layer::Token field,
                ListEdit edit,
                std::vector<T> items,
                SourceLoc where) {
    using layer::ListOp;
    const ListOp<T>* old = spec.field_as<ListOp<T>>(field);
    ListOp<T> op = old ? *old : ListOp<T>();
    if (context.is_legacy && edit != ListEdit::Explicit && items.empty()) {
        return context.scanner.error(
            "usd-empty-list-edit", where,
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
