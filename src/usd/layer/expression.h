// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::layer {

/// What a variable expression comes to.
struct ExpressionResult {
    /// string, bool, int64 or an array of one of them; Empty for None, for an empty list and where
    /// there are errors.
    Value value;
    bool is_empty_list = false;       ///< `[]`, which has no element type
    std::vector<std::string> errors;  ///< why there is no value
    /// Every variable that was looked up, whether or not it is there.
    std::set<std::string> used_variables;

    bool has_error() const { return !errors.empty(); }

    /// The string it comes to; nullptr for anything else.
    const std::string* as_string() const { return value.get_if<std::string>(); }
};

/// A variable expression, parsed: strings with `${VAR}` in them, integers, booleans, None, lists of
/// these, variables, and the functions if, and, or, not, eq, neq, lt, leq, gt, geq, contains, at,
/// len, defined. Immutable, shared on copy.
///
/// A variable may itself hold an expression; circular ones are an error. Inside a string a variable
/// without value stays as `${VAR}`, None is the empty string. Limits: 256 levels of nesting,
/// strings of 1 MiB.
/// Ref: Pixar, "USD Variable Expressions" (user guide) and its grammar.
class VariableExpression {
  public:
    struct Node;

    /// Parses text in backquotes. Never fails: errors() says what is wrong.
    explicit VariableExpression(std::string_view text);

    const std::vector<std::string>& errors() const { return errors_; }

    bool is_valid() const { return errors_.empty(); }

    ExpressionResult evaluate(const Dictionary& variables) const;

  private:
    friend class ExpressionEvaluation;
    std::shared_ptr<const Node> root_;
    std::vector<std::string> errors_;
};

/// True for text in backquotes, whether or not what is between them can be parsed.
bool is_expression(std::string_view text);

/// Parses and evaluates at once.
ExpressionResult evaluate_expression(std::string_view text, const Dictionary& variables);

}  // namespace velatura::usd::layer
