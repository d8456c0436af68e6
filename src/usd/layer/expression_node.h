// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/expression.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::layer {

/// Depth of nesting of expressions and of variables in variables.
inline constexpr int max_expression_depth = 256;
/// Bytes of a string made by an expression.
inline constexpr size_t max_expression_string = size_t(1) << 20;

enum class ExpressionKind : uint8_t { None, Boolean, Integer, String, Variable, List, Function };

/// A node of a parsed expression. A String has parts: Variables, and Strings without parts, whose
/// text counts.
struct VariableExpression::Node {
    ExpressionKind kind = ExpressionKind::None;
    bool boolean = false;
    int64_t integer = 0;
    std::string text;            ///< of a part of a string; name of a variable or function
    std::vector<Node> children;  ///< parts, elements or arguments
};

/// Parses text in backquotes into `root`; the error, or "".
std::string parse_expression(std::string_view text, VariableExpression::Node& root);

}  // namespace velatura::usd::layer
