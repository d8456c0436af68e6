// SPDX-License-Identifier: Apache-2.0
#include "crate_fixture.h"

namespace velatura::usd::crate {
namespace {

int minor_version(const std::string& text) {
    return crate_of(*layer_of("#usda 1.0\n" + text))[9];
}

TEST(CrateWriter, WritesTheOldestVersionThatHoldsTheContent) {
    EXPECT_EQ(minor_version("def \"A\" {\n timecode t = 1\n}\n"), 9);
    EXPECT_EQ(minor_version("def \"A\" {\n pathExpression p = \"/A\"\n}\n"), 10);
    EXPECT_EQ(minor_version("(\n relocates = { </A/B>: </A/C> }\n)\n"), 11);
    EXPECT_EQ(minor_version("def \"A\" {\n double s.spline = { 1: 2 }\n}\n"), 12);
    EXPECT_EQ(minor_version("def \"A\" {\n double s.spline = { bezier, 1: 2; post curve (1, 2, "
                            "autoEase) }\n}\n"),
              13);
}

TEST(CrateWriter, WritesEqualLayersToEqualBytes) {
    EXPECT_EQ(crate_of(*layer_of(every_kind)), crate_of(*layer_of(every_kind)));
}

TEST(CrateWriter, StoresEqualValuesOnce) {
    const std::string one = "    float3[] a = [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6)]\n";
    std::string many = "#usda 1.0\ndef \"A\" {\n" + one;
    const size_t size_of_one = crate_of(*layer_of(many + "}\n")).size();
    std::string b = one;
    b[b.find(" a ") + 1] = 'b';
    EXPECT_LT(crate_of(*layer_of(many + b + "}\n")).size(), size_of_one + 24);
}

TEST(CrateWriter, WarnsOfWhatTheFormatCannotHold) {
    const LayerPtr l = layer_of("#usda 1.0\ndef \"A\" {\n rel r\n rel r.default = </A>\n}\n");
    Diagnostics diagnostics;
    ASSERT_TRUE(write_crate_layer(*l, diagnostics));
    ASSERT_EQ(diagnostics.warning_count(), 1u);
    EXPECT_EQ(diagnostics.all()[0].code, "usd-crate-unwritable");
}

TEST(CrateWriter, WritesNamespacesDeeperThanTheStack) {
    layer::Layer deep("deep");
    layer::Path path = layer::Path::absolute_root();
    for (int i = 0; i < 4000; ++i) {
        path = path.append_child("a");
        deep.create_spec(path, layer::SpecKind::Prim, {});
    }
    Diagnostics diagnostics;
    const auto bytes = write_crate_layer(deep, diagnostics);
    ASSERT_TRUE(bytes);
    const auto back = read_crate_layer(make_asset_bytes(*bytes), "deep.usdc", diagnostics);
    ASSERT_TRUE(back);
    EXPECT_EQ((*back)->spec_count(), 4001u);
    EXPECT_TRUE((*back)->has_spec(path));
}

TEST(CrateWriter, RefusesTextsThatTheFileWouldEnd) {
    layer::Layer l("zero");
    l.pseudo_root().set_field(layer::Token("comment"), layer::Value(std::string("a\0b", 3)), {});
    Diagnostics diagnostics;
    EXPECT_FALSE(write_crate_layer(l, diagnostics));
}

TEST(CrateWriter, RefusalsNameTheSpecAndItsField) {
    const LayerPtr l =
        layer_of("#usda 1.0\ndef \"A\" {\n string t = \"fine\"\n string s = \"x\"\n}\n");
    const layer::Path path = layer::Path::absolute_root().append_child("A").append_property("s");
    l->spec(path)->set_field(layer::Token("default"), layer::Value(std::string("a\0b", 3)), {});
    Diagnostics diagnostics;
    const auto bytes = write_crate_layer(*l, diagnostics);
    ASSERT_FALSE(bytes);
    EXPECT_NE(bytes.error().message.find("field 'default' of </A.s>"), std::string::npos)
        << bytes.error().message;
}

TEST(CrateWriter, KeepsSplinesWithoutKnots) {
    const std::string text =
        "#usda 1.0\n\ndef \"A\"\n{\n    float s.spline = {\n        pre: linear,\n    }\n"
        "    half t.spline = {\n    }\n}\n\n";
    const LayerPtr l = layer_of(text);
    Diagnostics diagnostics;
    const auto back = read_crate_layer(make_asset_bytes(crate_of(*l)), "s.usdc", diagnostics);
    ASSERT_TRUE(back);
    EXPECT_EQ(text::write_text_layer(**back), text);
}

TEST(CrateWriter, RefusesVersionsItDoesNotWrite) {
    Diagnostics diagnostics;
    const LayerPtr l = layer_of("#usda 1.0\n");
    EXPECT_FALSE(write_crate_layer(*l, diagnostics, {Version{0, 2, 0}}));
    EXPECT_FALSE(write_crate_layer(*l, diagnostics, {Version{0, 14, 0}}));
}

}  // namespace
}  // namespace velatura::usd::crate
