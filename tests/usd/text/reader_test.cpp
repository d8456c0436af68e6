// SPDX-License-Identifier: Apache-2.0
#include "usd/text/reader.h"

#include "usd/layer/fields.h"
#include "usd/layer/spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace velatura::usd::text {
namespace {

using namespace layer;

class Reader : public ::testing::Test {
  protected:
    const Layer& read(const std::string& body) {
        auto result = read_text_layer("#usda 1.0\n" + body, "test.usda", diagnostics_);
        EXPECT_TRUE(result) << (diagnostics_.all().empty()
                                    ? ""
                                    : diagnostics_.format(diagnostics_.all()[0]));
        layer_ = result ? *result : std::make_shared<Layer>("none");
        return *layer_;
    }

    template <class T>
    T value(const char* declaration) {
        const Layer& l = read(std::string("def \"A\" {\n") + declaration + "\n}\n");
        const Spec& prim = *l.spec(Path::from("/A"));
        const Value* v =
            l.field(Path::from("/A").append_property(prim.properties()[0]), fields().default_value);
        EXPECT_TRUE(v && v->holds<T>()) << declaration;
        return v && v->holds<T>() ? *v->get_if<T>() : T{};
    }

    Diagnostics diagnostics_;
    std::shared_ptr<Layer> layer_;
};

/// Fields that only Sdf's own tests declare are unknown ones elsewhere: they hold anything.
TEST_F(Reader, IntegersThatDoNotFitMakeAFieldUnknown) {
    const Layer& l = read(
        "def \"A\" (\n prepend intListOpTest = [5000000000, 1]\n uintListOpTest = [-1]\n "
        "append int64ListOpTest = [9223372036854775808]\n uint64ListOpTest = [\"a\"]\n other = "
        "[5000000000]\n) {}\ndef \"B\" (prepend intListOpTest = [2147483647, -2147483648]) {}\n");
    const auto texts = [&](const char* key) {
        const Value* v = l.field(Path::from("/A"), Token(key));
        return v != nullptr && v->holds<ListOp<UnregisteredValue>>()
                   ? *v->get_if<ListOp<UnregisteredValue>>()
                   : ListOp<UnregisteredValue>();
    };
    ASSERT_EQ(texts("intListOpTest").prepended.size(), 2u);
    EXPECT_EQ(texts("intListOpTest").prepended[0].text, "5000000000");
    ASSERT_EQ(texts("uintListOpTest").explicit_items.size(), 1u);
    EXPECT_EQ(texts("uintListOpTest").explicit_items[0].text, "-1");
    EXPECT_EQ(texts("int64ListOpTest").appended.size(), 1u);
    EXPECT_EQ(texts("uint64ListOpTest").explicit_items.size(), 1u);
    EXPECT_EQ(diagnostics_.warning_count(), 4u);
    EXPECT_EQ(diagnostics_.error_count(), 0u);
    const Value* typed = l.field(Path::from("/B"), Token("intListOpTest"));
    ASSERT_NE(typed, nullptr);
    EXPECT_TRUE(typed->holds<ListOp<int32_t>>()) << "what fits keeps its type";
}

TEST_F(Reader, ReadsEveryScalarType) {
    EXPECT_EQ(value<bool>("bool a = true"), true);
    EXPECT_EQ(value<bool>("bool a = 0"), false);
    EXPECT_EQ(value<uint8_t>("uchar a = 255"), 255);
    EXPECT_EQ(value<int32_t>("int a = -2147483648"), INT32_MIN);
    EXPECT_EQ(value<uint32_t>("uint a = 4294967295"), UINT32_MAX);
    EXPECT_EQ(value<int64_t>("int64 a = -9223372036854775808"), INT64_MIN);
    EXPECT_EQ(value<uint64_t>("uint64 a = 18446744073709551615"), UINT64_MAX);
    EXPECT_EQ(float(value<Float16>("half a = 0.5")), 0.5f);
    EXPECT_EQ(value<float>("float a = .1"), 0.1f);
    EXPECT_EQ(value<double>("double a = -1.5e-3"), -1.5e-3);
    EXPECT_EQ(value<double>("double a = 5."), 5.0);
    EXPECT_EQ(value<double>("double a = 0.30000000000000004"), 0.30000000000000004);
    EXPECT_EQ(value<double>("double a = 123456789.123456"), 123456789.123456);
    EXPECT_EQ(value<double>("double a = 1e400"), HUGE_VAL);
    EXPECT_EQ(value<double>("double a = 1e-400"), 0.0);
    EXPECT_EQ(value<double>("double a = -inf"), -HUGE_VAL);
    EXPECT_TRUE(std::isnan(value<float>("float a = nan")));
    EXPECT_TRUE(std::signbit(value<float>("float a = -0")));
    EXPECT_EQ(value<TimeCodeValue>("timecode a = 24").value, 24.0);
    EXPECT_EQ(value<Token>("token a = \"t\"").str(), "t");
    EXPECT_EQ(value<AssetPath>("asset a = @a b.png@").path, "a b.png");
    EXPECT_EQ(value<PathExpression>("pathExpression a = \"//*\"").text, "//*");
    EXPECT_EQ(value<Vec3f>("color3f a = (1, 2, 3)"), Vec3f(1, 2, 3));
    EXPECT_EQ(value<Vec2i>("int2 a = (1, -2)"), Vec2i(1, -2));
    EXPECT_EQ(value<Vec4d>("double4 a = (1, 2, 3, 4,)"), Vec4d(1, 2, 3, 4));
    EXPECT_EQ(value<QuatFloat>("quatf a = (1, 2, 3, 4)"), QuatFloat(1, 2, 3, 4));
    EXPECT_EQ(value<Mat2d>("matrix2d a = ((1, 2), (3, 4))"), Mat2d(1, 2, 3, 4));
    EXPECT_EQ(value<Mat4d>("frame4d a = ((1,0,0,0),(0,1,0,0),(0,0,1,0),(5,6,7,1))")[3][1], 6.0);
}

TEST_F(Reader, ReadsStringsInEveryQuotes) {
    EXPECT_EQ(value<std::string>("string a = 'x'"), "x");
    EXPECT_EQ(value<std::string>("string a = \"it's\""), "it's");
    EXPECT_EQ(value<std::string>("string a = \"\"\"two\nlines \"quoted\" \"\"\""),
              "two\nlines \"quoted\" ");
    EXPECT_EQ(value<std::string>("string a = ''"), "");
    EXPECT_EQ(value<std::string>("string a = '''it's'''"), "it's");
    EXPECT_EQ(value<std::string>(R"(string a = "\a\b\f\n\r\t\v\\\"\'\x41\101\q")"),
              "\a\b\f\n\r\t\v\\\"'AAq");
    EXPECT_EQ(value<AssetPath>("asset a = @@@a@b\\@@@c@@@").path, "a@b@@@c");
    EXPECT_EQ(value<AssetPath>("asset a = @@").path, "");
    EXPECT_EQ(value<AssetPath>("asset a = @@@@x@@@@").path, "@x@");
}

TEST_F(Reader, ReadsArraysFastAndWithLineEnds) {
    const Layer& l = read(
        "def \"A\" {\n  point3f[] p = [(1, 2, 3), # first\n    (4.5,-5,6e1),\n  ]\n  int[] e = []\n"
        "  token[] t = [\"a\", 'b']\n  bool[] b = [true, 0]\n}\n");
    const auto p = l.field(Path::from("/A.p"), fields().default_value)->as_array<Vec3f>();
    ASSERT_EQ(p.size(), 2u);
    EXPECT_EQ(p[1], Vec3f(4.5f, -5, 60));
    EXPECT_EQ(l.spec(Path::from("/A.p"))->type_name().str(), "point3f[]");
    EXPECT_TRUE(l.field(Path::from("/A.e"), fields().default_value)->holds_array<int32_t>());
    EXPECT_EQ(l.field(Path::from("/A.t"), fields().default_value)->as_array<Token>()[1].str(), "b");
    EXPECT_FALSE(l.field(Path::from("/A.b"), fields().default_value)->as_array<bool>()[1]);
}

TEST_F(Reader, SkipsEveryKindOfComment) {
    const Layer& l = read(
        "# one\n// two\n/* three\n lines */ def /* four */ \"A\" // five\n( # six\n  kind = \"x\" "
        "# seven\n)\n{\n"
        "  int a = /* eight */ 1 // nine\n  int b = 2; int c = 3;\n}\n");
    EXPECT_EQ(l.spec(Path::from("/A"))->properties().size(), 3u);
    EXPECT_EQ(l.spec(Path::from("/A.c"))->loc().line, 11u);
}

TEST_F(Reader, KeepsPlacesOfSpecsAndOpinions) {
    const Layer& l = read(
        "def Xform \"A\" (\n    active = false\n)\n{\n    double x = 5\n    double x.timeSamples = "
        "{\n"
        "        1: 2\n    }\n}\n");
    EXPECT_EQ(l.spec(Path::from("/A"))->loc(), (SourceLoc{l.file_id(), 2, 1}));
    EXPECT_EQ(l.spec(Path::from("/A"))->field_loc(Token("active")), (SourceLoc{l.file_id(), 3, 5}));
    EXPECT_EQ(l.spec(Path::from("/A.x"))->field_loc(fields().default_value),
              (SourceLoc{l.file_id(), 6, 16}));
    EXPECT_EQ(l.spec(Path::from("/A.x"))->field_loc(fields().time_samples).line, 7u);
    EXPECT_EQ(l.file_id(), diagnostics_.file_id("test.usda"));
}

TEST_F(Reader, ReadsBlocksAndTimeSamples) {
    const Layer& l = read(
        "def \"A\" {\n  float x = None\n  float x.timeSamples = { 2: 1, 1: None, -3.5: 7 }\n}\n");
    EXPECT_TRUE(l.field(Path::from("/A.x"), fields().default_value)->is_block());
    const TimeSamples& s = *l.field_as<TimeSamples>(Path::from("/A.x"), fields().time_samples);
    ASSERT_EQ(s.size(), 3u);
    EXPECT_EQ(s.times()[0], -3.5);
    EXPECT_TRUE(s.value(1).is_block());
    EXPECT_EQ(s.value(2).get_or(0.0f), 1.0f);
}

TEST_F(Reader, ReadsListEditsWithTheLaterKindWinning) {
    const Layer& l = read(
        "def \"A\" (\n  references = </X>\n  prepend references = [@a.usda@</Y> (offset = 2; scale "
        "= 3), </Z>]\n"
        "  delete references = @b.usda@\n  prepend apiSchemas = [\"P\"]\n  append inherits = "
        "</C>\n) {\n"
        "  rel r = [</B>, <../C>, <.x>]\n  delete rel s = </B>\n  add token t.connect = "
        "</B.out>\n}\n");
    const Spec& a = *l.spec(Path::from("/A"));
    const ReferenceListOp& refs = *a.field_as<ReferenceListOp>(fields().references);
    EXPECT_FALSE(refs.is_explicit);
    ASSERT_EQ(refs.prepended.size(), 2u);
    EXPECT_EQ(refs.prepended[0].asset, "a.usda");
    EXPECT_EQ(refs.prepended[0].offset, (LayerOffset{2, 3}));
    EXPECT_EQ(refs.prepended[1].prim_path.to_string(), "/Z");
    EXPECT_TRUE(refs.deleted[0].prim_path.is_empty());
    EXPECT_EQ(a.field_as<TokenListOp>(fields().api_schemas)->prepended[0].str(), "P");
    EXPECT_EQ(a.field_as<PathListOp>(fields().inherit_paths)->appended[0].to_string(), "/C");
    const PathListOp& r = *l.field_as<PathListOp>(Path::from("/A.r"), fields().target_paths);
    EXPECT_TRUE(r.is_explicit);
    EXPECT_EQ(r.explicit_items[1].to_string(), "/C");
    EXPECT_EQ(r.explicit_items[2].to_string(), "/A.x");
    EXPECT_EQ(l.field_as<PathListOp>(Path::from("/A.s"), fields().target_paths)->deleted.size(),
              1u);
    EXPECT_EQ(l.field_as<PathListOp>(Path::from("/A.t"), fields().connection_paths)->added.size(),
              1u);
}

TEST_F(Reader, ReadsNestedVariants) {
    const Layer& l = read(
        "def \"A\" (\n  variants = { string v = \"x\" }\n  prepend variantSets = \"v\"\n) {\n  "
        "variantSet \"v\" = {\n"
        "    \"x\" (kind = \"k\") {\n      int i = 1\n      def \"B\" { }\n      variantSet \"w\" "
        "= { \"y\" {\n"
        "        rel r = <B>\n      } }\n    }\n    \"z\" { }\n  }\n}\n");
    EXPECT_EQ(l.spec(Path::from("/A{v=}"))->variants().size(), 2u);
    EXPECT_EQ(l.spec(Path::from("/A{v=x}"))->field_as<Token>(fields().kind)->str(), "k");
    EXPECT_TRUE(l.has_spec(Path::from("/A{v=x}.i")));
    EXPECT_TRUE(l.has_spec(Path::from("/A{v=x}B")));
    // Targets are paths of the composed scene, without selections
    EXPECT_EQ(l.field_as<PathListOp>(Path::from("/A{v=x}{w=y}.r"), fields().target_paths)
                  ->explicit_items[0]
                  .to_string(),
              "/A/B");
    const auto& selections =
        *l.spec(Path::from("/A"))->field_as<VariantSelections>(fields().variant_selection);
    EXPECT_EQ(selections, (VariantSelections{{"v", "x"}}));
}

TEST_F(Reader, ReadsLayerMetadata) {
    const Layer& l = read(
        "(\n  \"a comment\"\n  doc = 'd'; upAxis = \"Z\"\n  metersPerUnit = 1\n  defaultPrim = "
        "\"W\"\n"
        "  subLayers = [@a.usda@ (offset = 1; scale = 2), @b.usda@]\n  relocates = { </A/B>: "
        "</A/C>, </D>: <> }\n"
        "  customLayerData = { int i = 3; dictionary d = { string[] s = [\"x\"] } }\n"
        "  expressionVariables = { string v = \"w\" }\n  unheardOf = [1, (2.50, \"x\"), @p@]\n)\n"
        "reorder rootPrims = [\"b\", \"a\"]\n");
    const std::vector<SubLayer> subs = l.sub_layers();
    ASSERT_EQ(subs.size(), 2u);
    EXPECT_EQ(subs[0].offset, (LayerOffset{1, 2}));
    EXPECT_EQ(subs[1].asset, "b.usda");
    ASSERT_NE(l.relocates(), nullptr);
    EXPECT_EQ((*l.relocates())[0].second.to_string(), "/A/C");
    EXPECT_TRUE((*l.relocates())[1].second.is_empty());
    const Spec& root = l.pseudo_root();
    EXPECT_EQ(*root.field_as<double>(fields().meters_per_unit), 1.0);
    EXPECT_EQ(root.field_as<Dictionary>(Token("customLayerData"))
                  ->find("d")
                  ->get_if<Dictionary>()
                  ->find("s")
                  ->as_array<std::string>()[0],
              "x");
    EXPECT_EQ(root.field_as<UnregisteredValue>(Token("unheardOf"))->text, "[1, (2.5, \"x\"), @p@]");
    EXPECT_EQ(root.field(fields().prim_order)->as_array<Token>()[0].str(), "b");
    EXPECT_EQ(*root.field_as<std::string>(fields().comment), "a comment");
    EXPECT_EQ(l.default_prim().to_string(), "/W");
}

TEST_F(Reader, KeepsUnknownTypesAndSplinesAndSaysSo) {
    const Layer& l = read(
        "def \"A\" {\n  Some::Type x = [a, b]\n  float s.spline = { bezier, 1: 2; post linear "
        "}\n}\n");
    EXPECT_EQ(l.field_as<UnregisteredValue>(Path::from("/A.x"), fields().default_value)->text,
              "[a, b]");
    const SplineValue& spline = *l.field_as<SplineValue>(Path::from("/A.s"), fields().spline);
    ASSERT_EQ(spline.knots.size(), 1u);
    EXPECT_EQ(spline.knots[0].value, 2.0);
    EXPECT_EQ(spline.knots[0].next, SplineInterpolation::Linear);
    EXPECT_EQ(diagnostics_.warning_count(), 1u);
}

TEST_F(Reader, ReadsLegacyTypeNamesAsModernOnes) {
    const Layer& l =
        read("def \"A\" {\n  Vec3f v = (1, 2, 3)\n  PointFloat[] p = [(1, 2, 3)]\n}\n");
    EXPECT_EQ(l.spec(Path::from("/A.v"))->type_name().str(), "float3");
    EXPECT_EQ(l.spec(Path::from("/A.p"))->type_name().str(), "point3f[]");
}

TEST_F(Reader, TakesKeywordsAsPropertyNamesAndAnyLineEnd) {
    const Layer& l = read(
        "def \"A\"\r\n{\r\n  float def = 1\r  rel custom = </B>\r\n  uniform token over:rel\r\n}");
    EXPECT_EQ(l.spec(Path::from("/A"))->properties().size(), 3u);
    EXPECT_EQ(l.spec(Path::from("/A.custom"))->loc().line, 5u);
    EXPECT_EQ(l.spec(Path::from("/A.over:rel"))->variability(), Variability::Uniform);
}

TEST_F(Reader, AllowsVariantsInArcPathsWhenAsked) {
    const std::string text = "#usda 1.0\ndef \"A\" (\n  references = </B{v=x}C>\n) {}\n";
    EXPECT_FALSE(read_text_layer(text, "a.usda", diagnostics_));
    TextOptions options;
    options.allow_variants_in_arc_paths = true;
    EXPECT_TRUE(read_text_layer(text, "a.usda", diagnostics_, options));
}

TEST_F(Reader, SamplesAtNoTimeAreLeftOutWithAWarning) {
    const Layer& l = read("def \"A\" {\nfloat x.timeSamples = { 1: 2, nan: 4, inf: 5 }\n}\n");
    const auto* samples = l.field_as<TimeSamples>(Path::from("/A.x"), fields().time_samples);
    ASSERT_TRUE(samples);
    EXPECT_EQ(samples->size(), 2u);
    ASSERT_EQ(diagnostics_.warning_count(), 1u);
    EXPECT_EQ(diagnostics_.all()[0].code, "usd-sample-time");
    EXPECT_EQ(diagnostics_.all()[0].loc.line, 3u);
    EXPECT_EQ(diagnostics_.all()[0].loc.column, 31u);
}

}  // namespace
}  // namespace velatura::usd::text
