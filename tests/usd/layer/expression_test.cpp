// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/expression.h"

#include <gtest/gtest.h>

#include <limits>

// Oracle: Pixar's user guide "USD Variable Expressions" and the behavior it documents.

namespace velatura::usd::layer {
namespace {

using Strings = std::vector<std::string>;
using Ints = std::vector<int64_t>;

Dictionary variables(std::initializer_list<std::pair<const std::string, Value>> entries) {
    Dictionary result;
    result.entries = entries;
    return result;
}

Value text(std::string s) {
    return Value(std::move(s));
}

Value number(int64_t n) {
    return Value(n);
}

struct Case {
    const char* expression;
    Value expected;
};

void expect_values(const std::vector<Case>& cases, const Dictionary& given = {}) {
    for (const Case& c : cases) {
        const ExpressionResult result = evaluate_expression(c.expression, given);
        EXPECT_TRUE(result.errors.empty())
            << c.expression << ": " << (result.has_error() ? result.errors.front() : "");
        EXPECT_TRUE(result.value == c.expected) << c.expression;
    }
}

void expect_invalid(const std::vector<const char*>& cases) {
    for (const char* c : cases) EXPECT_FALSE(VariableExpression(c).is_valid()) << c;
}

struct BadCase {
    const char* expression;
    const char* message;
};

void expect_errors(const std::vector<BadCase>& cases, const Dictionary& given = {}) {
    for (const BadCase& c : cases) {
        const VariableExpression parsed(c.expression);
        EXPECT_TRUE(parsed.is_valid()) << c.expression;
        const ExpressionResult result = parsed.evaluate(given);
        EXPECT_TRUE(result.value.is_empty()) << c.expression;
        ASSERT_FALSE(result.errors.empty()) << c.expression;
        EXPECT_EQ(result.errors.front(), c.message) << c.expression;
    }
}

TEST(VariableExpression, IsTextInBackquotes) {
    EXPECT_TRUE(is_expression("`foo`"));
    EXPECT_FALSE(is_expression("foo"));
    EXPECT_FALSE(is_expression("``"));
    EXPECT_FALSE(is_expression("`foo"));
}

TEST(VariableExpression, YieldsTheExactValueOfAVariable) {
    const Dictionary given = variables({{"S", text("string")},
                                        {"I", Value(int32_t(42))},
                                        {"B", Value(true)},
                                        {"N", Value()},
                                        {"L", Value::array(Strings{"foo", "bar"})},
                                        {"J", Value::array(std::vector<int32_t>{1, 2})}});
    expect_values({{"`${S}`", text("string")},
                   {"`${I}`", number(42)},
                   {"`${B}`", Value(true)},
                   {"`${N}`", Value()},
                   {"`${L}`", Value::array(Strings{"foo", "bar"})},
                   {"`${J}`", Value::array(Ints{1, 2})}},
                  given);
    EXPECT_EQ(evaluate_expression("`if(${B}, ${S})`", given).used_variables,
              (std::set<std::string>{"B", "S"}));
    expect_errors({{"`${FOO}`", "no value for variable 'FOO'"}});
    expect_invalid({"`${FO-O}`", "`${FOO`", "`${}`", "`$FOO`"});
}

TEST(VariableExpression, SubstitutesInsideStrings) {
    const Dictionary given = variables(
        {{"A", text("substitution")}, {"B", text("works")}, {"N", Value()}, {"I", number(0)}});
    expect_values({{"`''`", text("")},
                   {"`\"basic\"`", text("basic")},
                   {R"(`"quoted_\"double\"_'single'"`)", text("quoted_\"double\"_'single'")},
                   {R"(`'quoted_"double"_\'single\''`)", text("quoted_\"double\"_'single'")},
                   {"`\"string_${A}_${B}\"`", text("string_substitution_works")},
                   {"`'none_${N}'`", text("none_")},
                   {R"(`"no_\${A}_\${B}"`)", text("no_${A}_${B}")},
                   {R"(`"C:\\USD\\test.usd"`)", text("C:\\USD\\test.usd")},
                   {R"(`"\`"`)", text("`")},
                   {R"(`"a\nb\x41\101"`)", text("a\nbAA")},
                   {"`'keeps_${UNKNOWN}'`", text("keeps_${UNKNOWN}")}},
                  given);
    expect_errors({{"`'bad_${I}'`", "variable 'I' in a string must be a string, not int"}}, given);
    expect_invalid({"`\"unescaped_\"quotes\"_are_bad\"`", "`\"bad_${FOO\"`", "`\"bad_${FO-O}\"`",
                    "`'`", "`\"`"});
}

TEST(VariableExpression, ReadsIntegersBooleansAndNone) {
    expect_values({{"`0`", number(0)},
                   {"`-1`", number(-1)},
                   {"`9223372036854775807`", number(std::numeric_limits<int64_t>::max())},
                   {"`-9223372036854775808`", number(std::numeric_limits<int64_t>::min())},
                   {"`True`", Value(true)},
                   {"`true`", Value(true)},
                   {"`False`", Value(false)},
                   {"`false`", Value(false)},
                   {"`None`", Value()},
                   {"`none`", Value()}});
    expect_invalid({"`9223372036854775808`", "`-9223372036854775809`", "`42abc`", "`Truee`",
                    "`TRUE`", "`FALSE`", "`Nonee`", "`foo`", "` 1`", "`1 `", "`-`", "`1` `2`"});
}

TEST(VariableExpression, MakesListsOfOneType) {
    const Dictionary given = variables({{"FOO", number(1)},
                                        {"S", text("a")},
                                        {"N", Value()},
                                        {"L", text("`[]`")},
                                        {"J", Value::array(std::vector<int32_t>{1, 2})}});
    const ExpressionResult empty = evaluate_expression("`[]`", {});
    EXPECT_TRUE(empty.is_empty_list && empty.value.is_empty() && !empty.has_error());
    expect_values({{"`[1, 2, 3]`", Value::array(Ints{1, 2, 3})},
                   {"`[${FOO}, 2]`", Value::array(Ints{1, 2})},
                   {"`['${S}a', 'b']`", Value::array(Strings{"aa", "b"})},
                   {"`[true,false]`", Value::array(std::vector<bool>{true, false})}},
                  given);
    expect_errors({{"`[None, 2, 3]`", "unexpected value of type None in list at element 0"},
                   {"`[1, ${N}, 3]`", "unexpected value of type None in list at element 1"},
                   {"`[${L}]`", "unexpected value of type list in list at element 0"},
                   {"`[${J}]`", "unexpected value of type list in list at element 0"}},
                  given);
    EXPECT_EQ(evaluate_expression("`[1, 'foo', False, ${L}]`", given).errors.size(), 3u);
    expect_invalid({"`[[1, 2]]`", "`[`", "`[foo]`", "`[1,]`", "`[1 2]`"});
}

TEST(VariableExpression, ChoosesWithIf) {
    const Dictionary given = variables({{"T", Value(true)}, {"F", Value(false)}});
    expect_values({{"`if(True, 'true', 'false')`", text("true")},
                   {"`if(False, 'true', 'false')`", text("false")},
                   {"`if( False , 'true' )`", Value()},
                   {"`if(${T}, if(${F}, 1, 2), if(${F}, 3, 4))`", number(2)},
                   {"`if(False, None, 1)`", number(1)},
                   {"`if(defined('X'), ${X}, None)`", Value()},
                   {"`if(defined('X'), ${X}, 'other')`", text("other")}},
                  given);
    expect_errors({{"`if('no', 1, 0)`", "if: condition must be a boolean value"},
                   {"`if(False, 1, 'foo')`",
                    "if: if-value and else-value must evaluate to the same type or None"},
                   {"`if(eq(1, '1'), 1, 0)`", "eq: cannot compare values of type int and string"},
                   {"`if(true, ${X}, 1)`", "no value for variable 'X'"}});
    expect_invalid(
        {"`if()`", "`if(True)`", "`if(True, 1, 2, 3)`", "`fi(True, 1)`", "`if(True, 1`"});
}

TEST(VariableExpression, Compares) {
    const Value yes(true);
    const Value no(false);
    expect_values({{"`eq(1, 1)`", yes},
                   {"`eq('a', 'b')`", no},
                   {"`neq(1, 2)`", yes},
                   {"`eq(None, None)`", yes},
                   {"`neq(None, None)`", no},
                   {"`lt(10,12)`", yes},
                   {"`gt(\"Abc\", \"abc\")`", no},
                   {"`gt('applecart', 'apple')`", yes},
                   {"`gt(true, false)`", yes},
                   {"`leq(2, 2)`", yes},
                   {"`geq(1, 2)`", no}});
    expect_errors({{"`lt(0, 'a')`", "lt: cannot compare values of type int and string"},
                   {"`eq(0, None)`", "eq: cannot compare values of type int and None"},
                   {"`lt(None, None)`", "lt: values of type None cannot be compared"},
                   {"`eq([1], [1])`", "eq: values of type list cannot be compared"}});
    expect_invalid({"`eq()`", "`eq(1)`", "`eq(1,2,3)`"});
}

TEST(VariableExpression, CombinesBooleans) {
    const Value yes(true);
    const Value no(false);
    expect_values({{"`and(true, true)`", yes},
                   {"`and(true, true, false)`", no},
                   {"`or( false, true, false )`", yes},
                   {"`or(false, false)`", no},
                   {"`not(True)`", no},
                   {"`not(False)`", yes}});
    expect_errors({{"`and(true, 1)`", "and: invalid type int for argument 1"},
                   {"`or(true, None)`", "or: invalid type None for argument 1"},
                   {"`not('foo')`", "not: invalid type string for argument 0"}});
    expect_invalid({"`and()`", "`or(True)`", "`not()`", "`not(True, False)`"});
}

TEST(VariableExpression, SearchesListsAndStrings) {
    const Dictionary given =
        variables({{"E", Value::array(std::vector<int32_t>{})}, {"A", text("a")}});
    expect_values({{"`contains([], 1)`", Value(false)},
                   {"`contains(${E}, 1)`", Value(false)},
                   {"`contains([1, 2, 3], 1)`", Value(true)},
                   {"`contains([${A}, 'b'], 'c')`", Value(false)},
                   {"`contains('12345678', '45')`", Value(true)},
                   {"`at([1, 2, 3], 0)`", number(1)},
                   {"`at([1, 2, 3], -3)`", number(1)},
                   {"`at('123456',-2)`", text("5")},
                   {"`len([])`", number(0)},
                   {"`len('hello')`", number(5)},
                   {"`if( gt(len(['x']), 0), at(['x'],0), 'default')`", text("x")}},
                  given);
    expect_errors({{"`contains([1, 2], 'a')`", "contains: invalid search value"},
                   {"`contains('abcd', None)`", "contains: invalid search value"},
                   {"`contains(1, 1)`", "contains: value to search must be a list or string"},
                   {"`at([1, 2, 3], 3)`", "at: index out of range"},
                   {"`at([], 0)`", "at: index out of range"},
                   {"`at('', 0)`", "at: index out of range"},
                   {"`at([1], True)`", "at: index must be an integer"},
                   {"`len(1)`", "len: unsupported type"}});
    expect_invalid({"`contains('abcd')`", "`len()`"});
}

TEST(VariableExpression, KnowsWhatIsDefined) {
    const Dictionary given = variables({{"X", number(0)}});
    expect_values({{"`defined('X')`", Value(true)},
                   {"`defined('Y')`", Value(false)},
                   {"`defined('X','Y')`", Value(false)}},
                  given);
    expect_errors({{"`defined(1)`", "defined: invalid type int for argument 0"}});
    expect_invalid({"`defined()`"});
}

TEST(VariableExpression, EvaluatesExpressionsInVariables) {
    const Dictionary given = variables({{"A", text("`'sub_${FOO}'`")},
                                        {"FOO", text("`'${BAR}'`")},
                                        {"BAR", text("`'ok'`")},
                                        {"B", text("`${A}`")},
                                        {"LOOP", text("`${POOL}`")},
                                        {"POOL", text("`${LOOP}`")},
                                        {"BAD", text("`${BAZ`")},
                                        {"D", Value(1.5)}});
    expect_values({{"`'${A}_${B}'`", text("sub_ok_sub_ok")}}, given);
    expect_errors({{"`${LOOP}`", "circular variable substitutions: ['LOOP', 'POOL', 'LOOP']"},
                   {"`${BAD}`", "missing ending '}' at character 6 (in variable 'BAD')"},
                   {"`'t_${D}'`",
                    "variable 'D' has an unsupported type (bool, int, int64, string and arrays of "
                    "them are allowed)"}},
                  given);
}

TEST(VariableExpression, LimitsWhatHostileVariablesCost) {
    // 60 doublings would be 2^60 bytes
    Dictionary doubling = variables({{"V0", text("xxxxxxxx")}});
    for (int i = 1; i < 60; ++i) {
        const std::string before = "${V" + std::to_string(i - 1) + "}";
        doubling.entries["V" + std::to_string(i)] = text("`'" + before + before + "'`");
    }
    expect_errors({{"`${V59}`", "string is longer than 1 MiB"}}, doubling);
    Dictionary chain = variables({{"V0", text("end")}});
    for (int i = 1; i < 100000; ++i) {
        chain.entries["V" + std::to_string(i)] = text("`${V" + std::to_string(i - 1) + "}`");
    }
    expect_errors({{"`${V99999}`", "expression is nested too deeply"}}, chain);
    std::string deep = "`";
    for (int i = 0; i < 100000; ++i) deep += "not(";
    EXPECT_FALSE(VariableExpression(deep + "`").is_valid());
}

}  // namespace
}  // namespace velatura::usd::layer
