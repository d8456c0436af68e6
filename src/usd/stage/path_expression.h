// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::usd::stage {

/// A predicate on a prim: functions, joined by not, and, or.
struct PathPredicate {
    enum class Op : uint8_t { Call, Not, And, Or };
    Op op = Op::Call;
    std::vector<PathPredicate> operands;
    std::string function;
    std::vector<std::pair<std::string, std::string>> arguments;  ///< name ("" = by place), value
};

/// Part of a pattern between slashes. A stretch ("//") stands for any number of levels.
struct PathPatternPart {
    bool is_stretch = false;
    bool is_property = false;
    std::string text;                      ///< with wildcards * ? [a-z]; empty: any name
    std::vector<PathPredicate> predicate;  ///< none or one
};

/// A parsed path expression: patterns and references to collections, joined by set operators.
/// `+` or blanks are unions, `&` intersections, `-` differences, `~` the complement.
/// Ref: Pixar's SdfPathExpression, SdfPathPattern, SdfPredicateExpression.
struct PathExpressionNode {
    enum class Op : uint8_t {
        Nothing,
        Pattern,
        Collection,
        Weaker,
        Union,
        Intersection,
        Difference,
        Complement
    };
    Op op = Op::Nothing;
    std::vector<PathExpressionNode> operands;
    layer::Path prefix;  ///< of a pattern: what stands before its first wildcard
    std::vector<PathPatternPart> parts;
    layer::Path collection_prim;  ///< empty: the prim that holds the expression
    std::string collection_name;
};

/// Maps a path of the layer to the stage; empty when it lies outside of what the arcs bring in.
using PathMapper = std::function<layer::Path(layer::Path)>;

/// Parses an expression. Relative paths are relative to `anchor`; every literal path goes through
/// `to_stage`. On errors `error` says why and the node matches nothing.
PathExpressionNode parse_path_expression(std::string_view text,
                                         layer::Path anchor,
                                         const PathMapper& to_stage,
                                         std::string& error);

/// The same expression as text whose literal paths are those of the stage. What lies outside of the
/// arcs becomes "(~//)", which matches nothing; text that cannot be parsed stays as it is.
std::string path_expression_text(std::string_view text,
                                 layer::Path anchor,
                                 const PathMapper& to_stage);

/// What a collection's membershipExpression comes to: `%_` replaced by weaker opinions. Errors go
/// to the stage's diagnostics. Nothing when there is no opinion.
PathExpressionNode membership_expression(const Prim& prim, std::string_view attribute);

/// True when the expression matches a path of the stage. `in_collection(prim path, name, path)`
/// answers for references to collections, relative ones already made absolute.
using CollectionMembership =
    std::function<bool(const layer::Path& prim, const std::string& name, const layer::Path& path)>;
bool matches(const PathExpressionNode& expression,
             const layer::Path& path,
             const Prim& root,
             const CollectionMembership& in_collection);

/// Matches a name with * (any text), ? (any character) and [a-z], [!a-z] (one of a set).
bool glob_matches(std::string_view pattern, std::string_view name);

/// Name of the first function in the expression's predicates that this renderer does not know; ""
/// when it knows all.
std::string unknown_predicate(const PathExpressionNode& expression);

}  // namespace velatura::usd::stage
