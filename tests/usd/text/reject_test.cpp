// SPDX-License-Identifier: Apache-2.0
#include "usd/text/reader.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::usd::text {
namespace {

struct BadCase {
    const char* name;
    const char* text;  ///< after the line "#usda 1.0"
    uint32_t line;
    uint32_t column;
    const char* code;
};

void PrintTo(const BadCase& c, std::ostream* out) {
    *out << c.name;
}

class Reject : public ::testing::TestWithParam<BadCase> {};

TEST_P(Reject, NamesThePlace) {
    const BadCase& c = GetParam();
    Diagnostics diagnostics;
    const auto layer =
        read_text_layer(std::string("#usda 1.0\n") + c.text, "bad.usda", diagnostics);
    ASSERT_FALSE(layer);
    EXPECT_EQ(layer.error().code, "usd-parse");
    const auto all = diagnostics.all();
    ASSERT_FALSE(all.empty());
    EXPECT_EQ(diagnostics.format(all[0]).substr(0, 9), "bad.usda:");
    EXPECT_EQ(all[0].loc.line, c.line) << all[0].message;
    EXPECT_EQ(all[0].loc.column, c.column) << all[0].message;
    EXPECT_EQ(all[0].code, c.code) << all[0].message;
}

const BadCase bad_cases[] = {
    // None empties a list; an edit of a list by nothing is none. Ref: Sdf's text parser. Targets
    // and connections may: the files of AOUSD Core Specification 1.0.1 have such
    {"added_payload_none", "def \"A\" (add payload = None) {}\n", 2, 24, "usd-empty-list-edit"},
    {"added_inherits_none", "def \"A\" (add inherits = None) {}\n", 2, 25, "usd-empty-list-edit"},
    {"appended_references_none", "def \"A\" (append references = None) {}\n", 2, 30,
     "usd-empty-list-edit"},
    {"deleted_specializes_none", "def \"A\" (delete specializes = None) {}\n", 2, 31,
     "usd-empty-list-edit"},
    {"empty_reference", "def \"A\" (references = @@) {}\n", 2, 23, "usd-value"},
    {"empty_reference_in_list", "def \"A\" (references = [</B>, @@</C>]) {}\n", 2, 30, "usd-value"},
    {"empty_payload", "def \"A\" (payload = @@@@@@) {}\n", 2, 20, "usd-value"},
    {"root_relocated", "def \"A\" (relocates = {</>: </B>}) {}\n", 2, 23, "usd-path"},
    {"relocated_to_the_root", "def \"A\" (relocates = {<B>: </>}) {}\n", 2, 28, "usd-path"},
    {"root_relocated_by_layer", "(\nrelocates = {\n</>: </B>\n}\n)\n", 4, 1, "usd-path"},
    {"property_relocated", "(\nrelocates = {</A.x>: </B>}\n)\n", 3, 14, "usd-path"},
    {"root_inherited", "def \"A\" (inherits = </>) {}\n", 2, 21, "usd-path"},
    {"unclosed_prim", "def \"A\"\n{\n", 4, 1, "usd-syntax"},
    {"no_specifier", "foo \"A\" {}\n", 2, 1, "usd-syntax"},
    {"empty_prim_name", "def \"\" {}\n", 2, 5, "usd-prim-name"},
    {"duplicate_prim", "def \"A\" {}\nover \"A\" {}\n", 3, 6, "usd-duplicate-prim"},
    {"two_prims_on_a_line", "def \"A\" {} def \"B\" {}\n", 2, 12, "usd-syntax"},
    {"statement_before_brace", "def \"A\" {\nint x = 1 }\n", 3, 11, "usd-syntax"},
    {"line_end_before_comma", "def \"A\" {\nint[] x = [1\n, 2]\n}\n", 4, 1, "usd-syntax"},
    {"line_end_after_equals", "def \"A\" {\nint x =\n1\n}\n", 3, 8, "usd-syntax"},
    {"short_tuple", "def \"A\" {\nfloat3 x = (1, 2)\n}\n", 3, 17, "usd-syntax"},
    {"long_tuple", "def \"A\" {\nfloat2 x = (1, 2, 3)\n}\n", 3, 19, "usd-syntax"},
    {"array_for_scalar", "def \"A\" {\nint x = [1]\n}\n", 3, 9, "usd-syntax"},
    {"scalar_for_array", "def \"A\" {\nint[] x = 1\n}\n", 3, 11, "usd-syntax"},
    {"nested_array", "def \"A\" {\nint[] x = [[1]]\n}\n", 3, 12, "usd-syntax"},
    {"fraction_for_int", "def \"A\" {\nint x = 1.5\n}\n", 3, 9, "usd-value"},
    {"int_too_large", "def \"A\" {\nint x = 2147483648\n}\n", 3, 9, "usd-value"},
    {"uint_below_zero", "def \"A\" {\nuint x = -1\n}\n", 3, 10, "usd-value"},
    {"uint64_too_large", "def \"A\" {\nuint64 x = 18446744073709551616\n}\n", 3, 12, "usd-value"},
    {"word_for_number", "def \"A\" {\nfloat x = one\n}\n", 3, 11, "usd-syntax"},
    {"control_in_asset_path", "def \"A\" {\nasset x = @a\x0e@\n}\n", 3, 13, "usd-syntax"},
    {"control_in_string_for_asset_path", "def \"A\" {\nasset x = \"a\x0e\"\n}\n", 3, 11,
     "usd-value"},
    {"line_end_in_string_for_asset_path", "def \"A\" {\nasset x = \"a\\nb\"\n}\n", 3, 11,
     "usd-value"},
    {"opaque_value", "def \"A\" {\nopaque x = 1\n}\n", 3, 12, "usd-syntax"},
    {"type_change", "def \"A\" {\nint x\nfloat x = 1\n}\n", 4, 1, "usd-type-change"},
    {"variability_change", "def \"A\" {\nint x\nuniform int x = 1\n}\n", 4, 1,
     "usd-variability-change"},
    {"rel_then_attribute", "def \"A\" {\nrel x\nint x\n}\n", 4, 1, "usd-duplicate-property"},
    {"duplicate_target", "def \"A\" {\nrel x = [</B>, </B>]\n}\n", 3, 16, "usd-duplicate-target"},
    {"variant_in_target", "def \"A\" {\nrel x = </B{v=a}C>\n}\n", 3, 9, "usd-path"},
    {"variant_in_reference", "def \"A\" (\nreferences = </B{v=a}C>\n) {}\n", 3, 14, "usd-path"},
    {"property_in_inherits", "def \"A\" (\ninherits = </B.x>\n) {}\n", 3, 12, "usd-path"},
    {"bad_path", "def \"A\" {\nrel x = </B//C>\n}\n", 3, 9, "usd-path"},
    {"path_above_root", "def \"A\" {\nrel x = <../../B>\n}\n", 3, 9, "usd-path"},
    {"unclosed_string", "def \"A\" {\nstring x = \"abc\n}\n", 3, 12, "usd-syntax"},
    {"unclosed_triple", "def \"A\" {\nstring x = '''abc\n\n", 3, 12, "usd-syntax"},
    {"unclosed_comment", "def \"A\" {\n/* abc\n\n", 3, 1, "usd-syntax"},
    {"unclosed_asset", "def \"A\" {\nasset x = @abc\n}\n", 3, 11, "usd-syntax"},
    {"empty_sublayer", "(\nsubLayers = [@@]\n)\n", 3, 14, "usd-value"},
    {"bad_variant_name", "def \"A\" {\nvariantSet \"v\" = { \"a.b\" {} }\n}\n", 3, 20,
     "usd-variant-name"},
    {"bad_permission", "def \"A\" (\npermission = none\n) {}\n", 3, 14, "usd-syntax"},
    {"wrong_metadata_type", "def \"A\" (\nactive = \"yes\"\n) {}\n", 3, 10, "usd-syntax"},
    {"list_edit_of_plain", "def \"A\" (\nprepend kind = \"a\"\n) {}\n", 3, 1, "usd-metadata"},
    {"relocate_from_nothing", "(\nrelocates = { <>: </A> }\n)\n", 3, 15, "usd-path"},
    {"stray_brace", "}\n", 2, 1, "usd-syntax"},
    {"bytes_not_utf8", "def \"A\" { # \xff\n}\n", 2, 13, "usd-encoding"},
};

INSTANTIATE_TEST_SUITE_P(Text, Reject, ::testing::ValuesIn(bad_cases), [](const auto& instance) {
    return std::string(instance.param.name);
});

TEST(RejectHeader, NamesTheFirstLine) {
    for (const char* text : {"", "#usda", "#usd 1.0\n", "#usda 2.0\n", "#usda x\n",
                             "def \"A\" {}\n", " #usda 1.0\n"}) {
        Diagnostics diagnostics;
        EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics)) << text;
        ASSERT_EQ(diagnostics.error_count(), 1u) << text;
        EXPECT_EQ(diagnostics.all()[0].loc.line, 1u);
    }
}

TEST(RejectMany, ReportsEveryStatementThatIsWrong) {
    Diagnostics diagnostics;
    const std::string text =
        "#usda 1.0\n(\n    upAxis = 3\n    doc = 4\n)\ndef \"A\" (\n    active = maybe\n)\n{\n    "
        "int a = x\n"
        "    int b = 2\n    def \"B\"\n    {\n        float3[] p = [(1, 2),\n            (3, 4, "
        "5)]\n        int c = y\n"
        "    }\n}\ndef \"C\" {\n    int d = z\n}\n";
    EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics));
    std::vector<uint32_t> lines;
    for (const Diagnostic& d : diagnostics.all()) lines.push_back(d.loc.line);
    EXPECT_EQ(lines, (std::vector<uint32_t>{3, 4, 7, 10, 14, 16, 20}));
}

TEST(RejectMany, IndependentErrorsOfEveryKindHaveTheirPlaceAndWhatWasExpected) {
    const std::string text = R"(#usda 1.0
(
    upAxis = 1
    metersPerUnit = 0.01
)
def Xform "A" (
    kind = [1]
    active = true
    references = @x.usda@<not a path>
)
{
    float3 a = (1, 2)
    int b = "text"
    rel r = <//>
    token t = one
    def "1bad" {}
    def Mesh "Good"
    {
        int[] c = [1, 2 3]
        double d.timeSamples = { 1: 2, 3 4 }
    }
    variantSet "v" = {
        "one" {
            float e = --1
        }
    }
}
def "A" {}
over "B" {}
)";

    struct Expected {
        uint32_t line;
        uint32_t column;
    };

    constexpr Expected expected[] = {{3, 14},  {7, 12}, {9, 26},  {12, 21}, {13, 13}, {14, 13},
                                     {15, 15}, {16, 9}, {19, 25}, {20, 42}, {24, 23}, {28, 5}};
    Diagnostics diagnostics;
    EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics));
    const auto all = diagnostics.all();
    for (size_t i = 0; i < all.size(); ++i) {
        const std::string line = diagnostics.format(all[i]);
        EXPECT_NE(all[i].message.find("found "), std::string::npos) << line;
        EXPECT_NE(all[i].message.find("expected "), std::string::npos) << line;
        if (i >= std::size(expected)) continue;
        EXPECT_EQ(all[i].loc.line, expected[i].line) << line;
        EXPECT_EQ(all[i].loc.column, expected[i].column) << line;
    }
    EXPECT_EQ(all.size(), std::size(expected));
}

TEST(RejectMany, ABrokenMetadataBlockIsNotReadOnForEver) {
    Diagnostics diagnostics;
    const std::string text =
        "#usda 1.0\ndef \"A\" (\n    kind = \"x\"\n{\n    int a = 1\n    int b = 2\n}\ndef \"B\" "
        "{}\n";
    EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics));
    EXPECT_LE(diagnostics.error_count(), 2u);
}

TEST(RejectMany, GoesOnInsidePrims) {
    Diagnostics diagnostics;
    const std::string text =
        "#usda 1.0\ndef \"A\"\n{\n    int a = x\n    int b = 2\n    def \"B\"\n    {\n        "
        "float3[] p = [(1, 2),\n"
        "            (3, 4, 5)]\n        int c = y\n    }\n    string s = 4 \n}\n";
    EXPECT_FALSE(read_text_layer(text, "bad.usda", diagnostics));
    std::vector<uint32_t> lines;
    for (const Diagnostic& d : diagnostics.all()) lines.push_back(d.loc.line);
    EXPECT_EQ(lines, (std::vector<uint32_t>{4, 8, 10, 12}));
}

std::string repeated(const std::string& text, int count) {
    std::string result;
    for (int i = 0; i < count; ++i) result += text;
    return result;
}

TEST(RejectDepth, RefusesDeepNestingWithoutCrashing) {
    const std::string deep_cases[] = {
        repeated("def \"A\" {\n", 100000),
        "def \"A\" {\nfoo x = " + repeated("[", 100000),
        "def \"A\" {\nfoo x = " + repeated("(", 100000),
        "(\ncustomLayerData = " + repeated("{ dictionary a = ", 100000),
        "def \"A\" {\n" + repeated("variantSet \"v\" = { \"a\" {\n", 100000),
    };
    for (const std::string& text : deep_cases) {
        Diagnostics diagnostics;
        EXPECT_FALSE(read_text_layer("#usda 1.0\n" + text, "deep.usda", diagnostics));
        ASSERT_EQ(diagnostics.all().size(), 1u) << text.substr(0, 60);
        EXPECT_EQ(diagnostics.all()[0].code, "usd-depth") << text.substr(0, 60);
    }
}

TEST(RejectDepth, ReadsPrimsAndVariantsDownToTheLimit) {
    const auto nested = [](const std::string& open, const std::string& close, int count) {
        return "#usda 1.0\n" + repeated(open, count) + repeated(close, count);
    };
    const int limit = 1024;
    const std::string open = "def \"A\"\n{\n", close = "}\n";
    Diagnostics diagnostics;
    const auto prims = read_text_layer(nested(open, close, limit), "prims.usda", diagnostics);
    ASSERT_TRUE(prims);
    const layer::Path deepest = layer::Path::parse(repeated("/A", limit)).value();
    EXPECT_TRUE((*prims)->has_spec(deepest));
    // Values count on their own: 256 lists in the innermost prim
    const std::string lists = "foo x = " + repeated("[", 256) + repeated("]", 256) + "\n";
    EXPECT_TRUE(
        read_text_layer("#usda 1.0\n" + repeated(open, limit) + lists + repeated(close, limit),
                        "both.usda", diagnostics));
    // A prim and a variant are two levels
    EXPECT_TRUE(read_text_layer(
        nested("def \"A\" {\nvariantSet \"v\" = {\n\"a\" {\n", "}\n}\n}\n", limit / 2),
        "variants.usda", diagnostics));
    Diagnostics refused;
    EXPECT_FALSE(read_text_layer(nested(open, close, limit + 1), "deep.usda", refused));
    ASSERT_EQ(refused.all().size(), 1u);
    EXPECT_EQ(refused.all()[0].code, "usd-depth");
    EXPECT_EQ(refused.all()[0].loc.line, uint32_t(1 + 2 * limit + 2));
}

TEST(RejectDepth, OneMissingBraceIsOneError) {
    Diagnostics diagnostics;
    const auto result =
        read_text_layer("#usda 1.0\n" + repeated("def \"A\" {\n", 50) + repeated("}\n", 49),
                        "open.usda", diagnostics);
    EXPECT_FALSE(result);
    EXPECT_EQ(diagnostics.all().size(), 1u);
}

}  // namespace
}  // namespace velatura::usd::text
