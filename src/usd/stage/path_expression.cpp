// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/path_expression.h"

#include "usd/layer/fields.h"
#include "usd/stage/prim_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;

namespace {

using Node = PathExpressionNode;

constexpr std::array<std::string_view, 9> known_predicates = {
    "abstract", "defined", "model", "group", "kind", "specifier", "isa", "hasAPI", "variant"};

/// A word of an argument that is meant as yes or no.
bool is_yes(std::string_view text) {
    return text == "true" ||
           (!text.empty() && (text[0] == '1' || text[0] == 'y' || text[0] == 'Y'));
}

/// The single argument of predicates such as `model` and `model:false`.
bool wanted(const PathPredicate& call) {
    return call.arguments.empty() || is_yes(call.arguments.front().second);
}

bool is_strict(const PathPredicate& call) {
    return std::any_of(call.arguments.begin(), call.arguments.end(), [](const auto& argument) {
        return argument.first == "strict" && is_yes(argument.second);
    });
}

/// The built-in hierarchy of kinds.
bool kind_is_a(std::string kind, std::string_view base) {
    while (!kind.empty()) {
        if (kind == base) return true;
        kind = kind == "assembly" ? "group" : kind == "group" || kind == "component" ? "model" : "";
    }
    return false;
}

std::string_view specifier_name(layer::Specifier specifier) {
    return specifier == layer::Specifier::Def     ? "def"
           : specifier == layer::Specifier::Class ? "class"
                                                  : "over";
}

bool has_api(const Prim& prim, const PathPredicate& call) {
    std::string instance;
    for (const auto& argument : call.arguments) {
        if (argument.first == "instanceName") instance = argument.second;
    }
    for (const auto& argument : call.arguments) {
        if (!argument.first.empty()) continue;
        const std::string name =
            instance.empty() ? argument.second : argument.second + ":" + instance;
        if (prim.has_api(name)) return true;
    }
    return false;
}

bool has_variants(const Prim& prim, const PathPredicate& call) {
    const auto selections = prim.variant_selections();
    return std::all_of(call.arguments.begin(), call.arguments.end(), [&](const auto& argument) {
        return std::any_of(selections.begin(), selections.end(), [&](const auto& selection) {
            return selection.first == argument.first &&
                   glob_matches(argument.second, selection.second);
        });
    });
}

bool call_holds(const PathPredicate& call, const Prim& prim, bool is_prim) {
    const std::string& name = call.function;
    if (name == "abstract") return prim.is_abstract() == wanted(call);
    if (name == "defined") return prim.is_defined() == wanted(call);
    // The others are about prims only
    if (!is_prim) return false;
    if (name == "model") return prim.is_model() == wanted(call);
    if (name == "group") return prim.data()->is_group == wanted(call);
    if (name == "hasAPI") return has_api(prim, call);
    if (name == "variant") return has_variants(prim, call);
    const bool strict = is_strict(call);
    return std::any_of(call.arguments.begin(), call.arguments.end(), [&](const auto& argument) {
        if (!argument.first.empty()) return false;
        const std::string& value = argument.second;
        if (name == "specifier") return value == specifier_name(prim.specifier());
        if (name == "kind") return strict ? prim.kind() == value : kind_is_a(prim.kind(), value);
        if (name == "isa") return strict ? prim.type_name() == value : prim.is_a(value);
        return false;
    });
}

bool holds(const PathPredicate& predicate, const Prim& prim, bool is_prim) {
    switch (predicate.op) {
        case PathPredicate::Op::Call:
            return call_holds(predicate, prim, is_prim);
        case PathPredicate::Op::Not:
            return !holds(predicate.operands[0], prim, is_prim);
        case PathPredicate::Op::And:
            return holds(predicate.operands[0], prim, is_prim) &&
                   holds(predicate.operands[1], prim, is_prim);
        case PathPredicate::Op::Or:
            return holds(predicate.operands[0], prim, is_prim) ||
                   holds(predicate.operands[1], prim, is_prim);
    }
    return false;
}

/// The prim at a path, going down by names: paths of the stage may be asked for any root.
Prim prim_at(const Prim& root, const Path& path) {
    Prim at = root;
    for (const Path& step : path.prefixes()) {
        if (!at || !step.is_prim()) return {};
        at = at.child(step.name().view());
    }
    return at;
}

/// Matches the elements of a path behind the prefix with the parts of a pattern.
class PatternMatch {
  public:
    PatternMatch(const Node& pattern, const std::vector<Path>& elements, const Prim& root)
        : parts_(pattern.parts), elements_(elements), root_(root) {}

    /// Every way of filling the stretches, from the left; reached_[j] = parts so far match j
    /// elements.
    bool run() {
        std::vector<bool> reached(elements_.size() + 1, false);
        reached[0] = true;
        for (const PathPatternPart& part : parts_) {
            std::vector<bool> next(elements_.size() + 1, false);
            bool any = false;
            for (size_t j = 0; j <= elements_.size(); ++j) {
                if (part.is_stretch) {
                    any = any || reached[j];
                    // A stretch within a pattern goes over prims, at its end over properties too
                    next[j] = any;
                } else if (j > 0 && reached[j - 1]) {
                    next[j] = element_matches(part, elements_[j - 1]);
                }
            }
            reached = std::move(next);
        }
        return reached.back();
    }

  private:
    bool element_matches(const PathPatternPart& part, const Path& element) const {
        if (element.is_property() != part.is_property) return false;
        if (!part.text.empty() && !glob_matches(part.text, element.name().view())) return false;
        if (part.predicate.empty()) return true;
        const Prim prim = prim_at(root_, element.prim_path());
        return prim && holds(part.predicate.front(), prim, !element.is_property());
    }

    const std::vector<PathPatternPart>& parts_;
    const std::vector<Path>& elements_;
    const Prim& root_;
};

bool pattern_matches(const Node& pattern, const Path& path, const Prim& root) {
    if (!path.has_prefix(pattern.prefix)) return false;
    if (pattern.parts.empty()) return path == pattern.prefix;
    std::vector<Path> elements;
    for (Path at = path; at != pattern.prefix && !at.is_empty() && !at.is_absolute_root();
         at = at.parent())
        elements.push_back(at);
    std::reverse(elements.begin(), elements.end());
    return PatternMatch(pattern, elements, root).run();
}

/// The expression with `%_` replaced.
void replace_weaker(Node& node, const Node& weaker) {
    if (node.op == Node::Op::Weaker) {
        node = weaker;
        return;
    }
    for (Node& operand : node.operands) replace_weaker(operand, weaker);
}

const std::string* first_unknown(const PathPredicate& predicate) {
    if (predicate.op == PathPredicate::Op::Call) {
        const bool is_known = std::find(known_predicates.begin(), known_predicates.end(),
                                        predicate.function) != known_predicates.end();
        return is_known ? nullptr : &predicate.function;
    }
    for (const PathPredicate& operand : predicate.operands) {
        if (const std::string* found = first_unknown(operand)) return found;
    }
    return nullptr;
}

}  // namespace

bool glob_matches(std::string_view pattern, std::string_view name) {
    size_t p = 0;
    size_t n = 0;
    size_t star = std::string_view::npos;
    size_t from = 0;
    // One character of the pattern against one of the name; steps p past it
    const auto one = [&](char c) {
        if (pattern[p] == '?') return ++p, true;
        if (pattern[p] != '[') return pattern[p] == c ? (++p, true) : false;
        const size_t end = pattern.find(']', p + 2);
        if (end == std::string_view::npos) return pattern[p] == c ? (++p, true) : false;
        size_t i = p + 1;
        const bool is_negated = pattern[i] == '!' || pattern[i] == '^';
        if (is_negated) ++i;
        bool found = false;
        for (; i < end; ++i) {
            const bool is_range = i + 2 < end && pattern[i + 1] == '-';
            found = found || (is_range ? pattern[i] <= c && c <= pattern[i + 2] : pattern[i] == c);
            if (is_range) i += 2;
        }
        if (found == is_negated) return false;
        p = end + 1;
        return true;
    };
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            from = n;
        } else if (p < pattern.size() && one(name[n])) {
            ++n;
        } else if (star != std::string_view::npos) {
            p = star + 1;
            n = ++from;
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

PathExpressionNode membership_expression(const Prim& prim, std::string_view attribute) {
    const PrimData& data = *prim.data();
    std::vector<Node> strongest_first;
    for (const PropertySpec& spec : property_specs(data, Token(attribute))) {
        const auto* text =
            spec.spec->field_as<layer::PathExpression>(layer::fields().default_value);
        if (!text) continue;
        const compose::Node& node = data.index.nodes()[size_t(spec.prim_spec->node)];
        std::string error;
        strongest_first.push_back(parse_path_expression(
            text->text, node.path.strip_variant_selections(),
            [&](Path path) { return compose::map_to_root(node, path); }, error));
        const SourceLoc loc = spec.spec->field_loc(layer::fields().default_value);
        if (!error.empty()) {
            prim.diagnostics().warn("usd-path-expression", loc, prim.path_string(),
                                    fmt::format("path expression \"{}\" of {} matches nothing: {}",
                                                text->text, attribute, error));
        }
        const std::string unknown = unknown_predicate(strongest_first.back());
        if (!unknown.empty()) {
            prim.diagnostics().warn(
                "usd-path-expression", loc, prim.path_string(),
                fmt::format("unknown predicate \"{}\" of {}; it matches nothing", unknown,
                            attribute));
        }
    }
    Node result;
    for (auto it = strongest_first.rbegin(); it != strongest_first.rend(); ++it) {
        replace_weaker(*it, result);
        result = std::move(*it);
    }
    return result;
}

bool matches(const PathExpressionNode& expression,
             const Path& path,
             const Prim& root,
             const CollectionMembership& in_collection) {
    const auto operand = [&](size_t i) {
        return matches(expression.operands[i], path, root, in_collection);
    };
    switch (expression.op) {
        case Node::Op::Nothing:
        case Node::Op::Weaker:
            return false;
        case Node::Op::Pattern:
            return pattern_matches(expression, path, root);
        case Node::Op::Collection:
            return in_collection(expression.collection_prim, expression.collection_name, path);
        case Node::Op::Union:
            return operand(0) || operand(1);
        case Node::Op::Intersection:
            return operand(0) && operand(1);
        case Node::Op::Difference:
            return operand(0) && !operand(1);
        case Node::Op::Complement:
            return !operand(0);
    }
    return false;
}

std::string unknown_predicate(const PathExpressionNode& expression) {
    for (const PathPatternPart& part : expression.parts) {
        for (const PathPredicate& predicate : part.predicate) {
            if (const std::string* found = first_unknown(predicate)) return *found;
        }
    }
    for (const Node& operand : expression.operands) {
        std::string found = unknown_predicate(operand);
        if (!found.empty()) return found;
    }
    return {};
}

}  // namespace velatura::usd::stage
