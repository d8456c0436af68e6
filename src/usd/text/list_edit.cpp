// SPDX-License-Identifier: Apache-2.0
#include "usd/text/list_edit.h"

#include <string>
#include <string_view>

namespace velatura::usd::text {

namespace {

std::vector<layer::Token> tokens(const std::vector<std::string>& texts) {
    std::vector<layer::Token> result;
    for (const std::string& text : texts) result.emplace_back(text);
    return result;
}

}  // namespace

ListEdit accept_list_edit(Scanner& scanner) {
    const std::string_view word = scanner.peek_identifier();
    const ListEdit edit = word == "prepend"   ? ListEdit::Prepend
                          : word == "append"  ? ListEdit::Append
                          : word == "delete"  ? ListEdit::Delete
                          : word == "add"     ? ListEdit::Add
                          : word == "reorder" ? ListEdit::Reorder
                                              : ListEdit::Explicit;
    if (edit != ListEdit::Explicit) scanner.accept_identifier();
    return edit;
}

bool parse_name_order(ParserContext& context,
                      layer::Path owner,
                      layer::Token field,
                      SourceLoc where) {
    if (!context.scanner.expect_assignment()) return false;
    std::vector<std::string> names;
    if (!context.values.names(names)) return false;
    context.layer.spec(owner)->set_field(field, layer::Value::array<layer::Token>(tokens(names)),
                                         where);
    return true;
}

}  // namespace velatura::usd::text
