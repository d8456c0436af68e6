// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/expression.h"

#include "usd/layer/expression_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <variant>

namespace velatura::usd::layer {

namespace {

using Node = VariableExpression::Node;

/// A list that is empty has no type of elements.
struct EmptyList {
    bool operator==(const EmptyList&) const = default;
};

struct None {
    bool operator==(const None&) const = default;
};

/// A value of the language.
using Item = std::variant<None,
                          bool,
                          int64_t,
                          std::string,
                          EmptyList,
                          std::vector<bool>,
                          std::vector<int64_t>,
                          std::vector<std::string>>;

std::string_view type_name_of(const Item& item) {
    constexpr std::string_view names[] = {"None", "bool", "int",  "string",
                                          "list", "list", "list", "list"};
    return names[item.index()];
}

template <class T>
std::vector<T> elements_of(const Value& value) {
    const auto all = value.as_array<T>();
    return {all.begin(), all.end()};
}

/// A variable's value as one of the language; false when it is of another type.
bool to_item(const Value& value, Item& out) {
    if (value.is_empty() || value.is_block()) {
        out = None{};
    } else if (const bool* flag = value.get_if<bool>()) {
        out = *flag;
    } else if (const int64_t* number = value.get_if<int64_t>()) {
        out = *number;
    } else if (const int32_t* small = value.get_if<int32_t>()) {
        out = int64_t(*small);
    } else if (const std::string* text = value.get_if<std::string>()) {
        out = *text;
    } else if (value.holds_array<bool>()) {
        out = elements_of<bool>(value);
    } else if (value.holds_array<int64_t>()) {
        out = elements_of<int64_t>(value);
    } else if (value.holds_array<int32_t>()) {
        const auto all = value.as_array<int32_t>();
        out = std::vector<int64_t>(all.begin(), all.end());
    } else if (value.holds_array<std::string>()) {
        out = elements_of<std::string>(value);
    } else {
        return false;
    }
    return true;
}

struct ToValue {
    Value operator()(None) const { return {}; }

    Value operator()(EmptyList) const { return {}; }

    template <class T>
    Value operator()(const T& scalar) const {
        return Value(scalar);
    }

    template <class T>
    Value operator()(const std::vector<T>& list) const {
        return Value::array(list);
    }
};

/// Position in `size` elements of a Python-style index; size when out of range.
size_t element_index(int64_t index, size_t size) {
    if (index < 0) index += int64_t(size);
    return index < 0 || size_t(index) >= size ? size : size_t(index);
}

/// lt, eq and the like, of values whose types have an order.
template <class T>
bool compare(std::string_view function, const T& x, const T& y) {
    if (function == "eq") return x == y;
    if (function == "neq") return x != y;
    if (function == "lt") return x < y;
    if (function == "leq") return x <= y;
    if (function == "gt") return x > y;
    return x >= y;
}

}  // namespace

/// One evaluation: variables looked up once each, errors collected.
class ExpressionEvaluation {
  public:
    ExpressionEvaluation(const Dictionary& variables, ExpressionResult& result)
        : variables_(variables), result_(result) {}

    /// False after an error.
    bool evaluate(const Node& node, Item& out);

  private:
    bool fail(std::string message) {
        result_.errors.push_back(std::move(message));
        return false;
    }

    bool variable(const std::string& name, Item& out, bool& is_defined);
    bool variable_expression(const std::string& name, const std::string& text, Item& out);
    bool string(const Node& node, std::string& out);
    bool list(const Node& node, Item& out);
    bool function(const Node& node, Item& out);
    bool choose(const Node& node, Item& out);
    bool logic(const std::string& name, const std::vector<Item>& arguments, Item& out);
    bool comparison(const std::string& name, const std::vector<Item>& arguments, Item& out);
    bool contains(const std::vector<Item>& arguments, Item& out);
    bool at(const std::vector<Item>& arguments, Item& out);
    bool length(const Item& source, Item& out);
    bool defined(const std::vector<Item>& arguments, Item& out);

    const Dictionary& variables_;
    ExpressionResult& result_;
    std::map<std::string, Item> known_;  ///< variables evaluated before
    std::vector<std::string> open_;      ///< variables being evaluated
    int depth_ = 0;
};

bool ExpressionEvaluation::evaluate(const Node& node, Item& out) {
    if (depth_ > max_expression_depth) return fail("expression is nested too deeply");
    ++depth_;
    bool good = true;
    switch (node.kind) {
        case ExpressionKind::None:
            out = None{};
            break;
        case ExpressionKind::Boolean:
            out = node.boolean;
            break;
        case ExpressionKind::Integer:
            out = node.integer;
            break;
        case ExpressionKind::String:
            good = string(node, out.emplace<std::string>());
            break;
        case ExpressionKind::List:
            good = list(node, out);
            break;
        case ExpressionKind::Function:
            good = function(node, out);
            break;
        case ExpressionKind::Variable: {
            bool is_defined = false;
            good = variable(node.text, out, is_defined);
            if (good && !is_defined)
                good = fail(fmt::format("no value for variable '{}'", node.text));
            break;
        }
    }
    --depth_;
    return good;
}

bool ExpressionEvaluation::variable(const std::string& name, Item& out, bool& is_defined) {
    is_defined = true;
    if (const auto known = known_.find(name); known != known_.end()) {
        out = known->second;
        return true;
    }
    if (std::find(open_.begin(), open_.end(), name) != open_.end()) {
        std::string chain;
        for (const std::string& open : open_) chain += fmt::format("'{}', ", open);
        return fail(fmt::format("circular variable substitutions: [{}'{}']", chain, name));
    }
    result_.used_variables.insert(name);
    const Value* value = variables_.find(name);
    if (!value) {
        is_defined = false;
        return true;
    }
    const std::string* text = value->get_if<std::string>();
    if (text && is_expression(*text)) {
        if (!variable_expression(name, *text, out)) return false;
    } else if (!to_item(*value, out)) {
        return fail(
            fmt::format("variable '{}' has an unsupported type (bool, int, int64, string "
                        "and arrays of them are allowed)",
                        name));
    }
    known_[name] = out;
    return true;
}

bool ExpressionEvaluation::variable_expression(const std::string& name,
                                               const std::string& text,
                                               Item& out) {
    const VariableExpression inner(text);
    if (!inner.is_valid()) {
        for (const std::string& error : inner.errors())
            fail(fmt::format("{} (in variable '{}')", error, name));
        return false;
    }
    open_.push_back(name);
    const bool good = evaluate(*inner.root_, out);
    open_.pop_back();
    return good;
}

bool ExpressionEvaluation::string(const Node& node, std::string& out) {
    for (const Node& part : node.children) {
        if (part.kind != ExpressionKind::Variable) {
            out += part.text;
            continue;
        }
        Item value;
        bool is_defined = false;
        if (!variable(part.text, value, is_defined)) return false;
        if (!is_defined) {
            out += "${" + part.text + "}";
        } else if (const auto* text = std::get_if<std::string>(&value)) {
            out += *text;
        } else if (!std::holds_alternative<None>(value)) {
            return fail(fmt::format("variable '{}' in a string must be a string, not {}", part.text,
                                    type_name_of(value)));
        }
        if (out.size() > max_expression_string) return fail("string is longer than 1 MiB");
    }
    return true;
}

namespace {

/// Adds an element to a list of its type; false when the list is of another type.
struct AppendTo {
    Item& list;

    template <class T>
    bool operator()(const T& element) const {
        if (std::holds_alternative<EmptyList>(list)) list = std::vector<T>();
        auto* elements = std::get_if<std::vector<T>>(&list);
        if (elements) elements->push_back(element);
        return elements != nullptr;
    }

    bool operator()(None) const { return false; }

    bool operator()(EmptyList) const { return false; }

    template <class T>
    bool operator()(const std::vector<T>&) const {
        return false;
    }
};

}  // namespace

bool ExpressionEvaluation::list(const Node& node, Item& out) {
    out = EmptyList{};
    bool good = true;
    for (size_t i = 0; i < node.children.size(); ++i) {
        Item element;
        if (!evaluate(node.children[i], element)) {
            good = false;
        } else if (!std::visit(AppendTo{out}, element)) {
            good = fail(fmt::format("unexpected value of type {} in list at element {}",
                                    type_name_of(element), i));
        }
    }
    return good;
}

bool ExpressionEvaluation::function(const Node& node, Item& out) {
    const std::string& name = node.text;
    if (name == "if") return choose(node, out);
    std::vector<Item> arguments(node.children.size());
    bool good = true;
    for (size_t i = 0; i < arguments.size(); ++i)
        good = evaluate(node.children[i], arguments[i]) && good;
    if (!good) return false;
    if (name == "and" || name == "or" || name == "not") return logic(name, arguments, out);
    if (name == "contains") return contains(arguments, out);
    if (name == "at") return at(arguments, out);
    if (name == "len") return length(arguments.front(), out);
    if (name == "defined") return defined(arguments, out);
    return comparison(name, arguments, out);
}

bool ExpressionEvaluation::choose(const Node& node, Item& out) {
    Item condition;
    if (!evaluate(node.children[0], condition)) return false;
    const bool* flag = std::get_if<bool>(&condition);
    if (!flag) return fail("if: condition must be a boolean value");
    // Both branches are evaluated, so that their types can be compared, but errors of the branch
    // that is not taken do not count: if(defined("X"), ${X}, None)
    Item branches[2];
    bool good[2] = {true, true};
    const size_t taken = *flag ? 0 : 1;
    for (size_t i = 0; i < 2 && i + 1 < node.children.size(); ++i) {
        const size_t errors_before = result_.errors.size();
        const int depth_before = depth_;
        good[i] = evaluate(node.children[i + 1], branches[i]);
        depth_ = depth_before;
        if (good[i]) continue;
        branches[i] = None{};
        if (i != taken) result_.errors.resize(errors_before);
    }
    if (!good[taken]) return false;
    const bool has_none =
        std::holds_alternative<None>(branches[0]) || std::holds_alternative<None>(branches[1]);
    if (!has_none && branches[0].index() != branches[1].index())
        return fail("if: if-value and else-value must evaluate to the same type or None");
    out = branches[taken];
    return true;
}

bool ExpressionEvaluation::logic(const std::string& name,
                                 const std::vector<Item>& arguments,
                                 Item& out) {
    bool good = true;
    bool all = true;
    bool any = false;
    for (size_t i = 0; i < arguments.size(); ++i) {
        const bool* flag = std::get_if<bool>(&arguments[i]);
        if (!flag) {
            good = fail(fmt::format("{}: invalid type {} for argument {}", name,
                                    type_name_of(arguments[i]), i));
            continue;
        }
        all = all && *flag;
        any = any || *flag;
    }
    out = name == "and" ? all : name == "or" ? any : !any;
    return good;
}

bool ExpressionEvaluation::comparison(const std::string& name,
                                      const std::vector<Item>& arguments,
                                      Item& out) {
    const Item& x = arguments[0];
    const Item& y = arguments[1];
    if (x.index() != y.index()) {
        return fail(fmt::format("{}: cannot compare values of type {} and {}", name,
                                type_name_of(x), type_name_of(y)));
    }
    if (const bool* flag = std::get_if<bool>(&x)) {
        out = compare(name, *flag, std::get<bool>(y));
    } else if (const int64_t* number = std::get_if<int64_t>(&x)) {
        out = compare(name, *number, std::get<int64_t>(y));
    } else if (const std::string* text = std::get_if<std::string>(&x)) {
        out = compare(name, *text, std::get<std::string>(y));
    } else if (std::holds_alternative<None>(x) && (name == "eq" || name == "neq")) {
        out = name == "eq";
    } else {
        return fail(fmt::format("{}: values of type {} cannot be compared", name, type_name_of(x)));
    }
    return true;
}

namespace {

/// Looks for a value in a list or string; -1 when that cannot be asked.
struct FindIn {
    const Item& value;

    int operator()(EmptyList) const { return 0; }

    int operator()(const std::string& text) const {
        const auto* part = std::get_if<std::string>(&value);
        return part ? int(text.find(*part) != std::string::npos) : -1;
    }

    template <class T>
    int operator()(const std::vector<T>& list) const {
        const T* element = std::get_if<T>(&value);
        return element ? int(std::find(list.begin(), list.end(), *element) != list.end()) : -1;
    }

    template <class T>
    int operator()(const T&) const {
        return -2;
    }
};

/// The element at an index; None when out of range.
struct ElementAt {
    int64_t index;

    Item operator()(const std::string& text) const {
        const size_t i = element_index(index, text.size());
        return i < text.size() ? Item(text.substr(i, 1)) : Item(None{});
    }

    template <class T>
    Item operator()(const std::vector<T>& list) const {
        const size_t i = element_index(index, list.size());
        return i < list.size() ? Item(T(list[i])) : Item(None{});
    }

    template <class T>
    Item operator()(const T&) const {
        return None{};
    }
};

struct LengthOf {
    int64_t operator()(EmptyList) const { return 0; }

    int64_t operator()(const std::string& text) const { return int64_t(text.size()); }

    template <class T>
    int64_t operator()(const std::vector<T>& list) const {
        return int64_t(list.size());
    }

    template <class T>
    int64_t operator()(const T&) const {
        return -1;
    }
};

bool has_elements(const Item& item) {
    return std::visit(LengthOf{}, item) >= 0;
}

}  // namespace

bool ExpressionEvaluation::contains(const std::vector<Item>& arguments, Item& out) {
    const int found = std::visit(FindIn{arguments[1]}, arguments[0]);
    if (found == -2) return fail("contains: value to search must be a list or string");
    if (found == -1) return fail("contains: invalid search value");
    out = found == 1;
    return true;
}

bool ExpressionEvaluation::at(const std::vector<Item>& arguments, Item& out) {
    const int64_t* index = std::get_if<int64_t>(&arguments[1]);
    if (!index) return fail("at: index must be an integer");
    if (!has_elements(arguments[0])) return fail("at: only supported for lists or strings");
    out = std::visit(ElementAt{*index}, arguments[0]);
    return !std::holds_alternative<None>(out) || fail("at: index out of range");
}

bool ExpressionEvaluation::length(const Item& source, Item& out) {
    if (!has_elements(source)) return fail("len: unsupported type");
    out = std::visit(LengthOf{}, source);
    return true;
}

bool ExpressionEvaluation::defined(const std::vector<Item>& arguments, Item& out) {
    bool good = true;
    bool all = true;
    for (size_t i = 0; i < arguments.size(); ++i) {
        if (const auto* name = std::get_if<std::string>(&arguments[i])) {
            all = all && variables_.find(*name) != nullptr;
        } else {
            good = fail(fmt::format("defined: invalid type {} for argument {}",
                                    type_name_of(arguments[i]), i));
        }
    }
    out = all;
    return good;
}

// ---- VariableExpression ----

VariableExpression::VariableExpression(std::string_view text) {
    Node root;
    std::string error = parse_expression(text, root);
    if (error.empty()) {
        root_ = std::make_shared<const Node>(std::move(root));
    } else {
        errors_.push_back(std::move(error));
    }
}

ExpressionResult VariableExpression::evaluate(const Dictionary& variables) const {
    ExpressionResult result;
    result.errors = errors_;
    Item item;
    if (!root_ || !ExpressionEvaluation(variables, result).evaluate(*root_, item)) return result;
    result.is_empty_list = std::holds_alternative<EmptyList>(item);
    result.value = std::visit(ToValue{}, item);
    return result;
}

bool is_expression(std::string_view text) {
    return text.size() > 2 && text.front() == '`' && text.back() == '`';
}

ExpressionResult evaluate_expression(std::string_view text, const Dictionary& variables) {
    return VariableExpression(text).evaluate(variables);
}

}  // namespace velatura::usd::layer
