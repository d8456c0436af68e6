// SPDX-License-Identifier: Apache-2.0
// Documents that are broken, or mean harm: a message with its place, and no more than that.
#include "materialx_fixture.h"

#include <fmt/format.h>

#include <random>

namespace velatura::usd::materialx {
namespace {

TEST_F(MaterialXTest, BrokenXmlHasAPlace) {
    const auto layer =
        read("<?xml version=\"1.0\"?>\n<materialx version=\"1.38\">\n  <a></b>\n</materialx>");
    EXPECT_FALSE(layer.has_value());
    EXPECT_EQ(layer.error().code, "mtlx-xml");
    ASSERT_EQ(diagnostics_.all().size(), 1u);
    EXPECT_EQ(diagnostics_.format(diagnostics_.all()[0]).find(path("test.mtlx") + ":3:"), 0u);
    EXPECT_FALSE(read("").has_value());
    EXPECT_FALSE(read("<?xml version=\"1.0\"?><materialx>").has_value());
    EXPECT_EQ(read("<?xml version=\"1.0\"?><svg/>").error().code, "mtlx-document");
}

TEST_F(MaterialXTest, SpaceBeforeTheDeclarationMovesNoPlace) {
    EXPECT_TRUE(read("\n <?xml version=\"1.0\"?><materialx version=\"1.38\"/>").has_value());
    EXPECT_FALSE(read("\n  <materialx><a></materialx>").has_value());
    ASSERT_EQ(diagnostics_.all().size(), 1u);
    EXPECT_EQ(diagnostics_.all()[0].loc.line, 2u);
    EXPECT_GT(diagnostics_.all()[0].loc.column, 13u);
}

// Ten entities of ten each, nine times: a gigabyte, were they expanded
TEST_F(MaterialXTest, EntitiesAreRefused) {
    std::string text = "<?xml version=\"1.0\"?>\n<!DOCTYPE m [\n<!ENTITY e0 \"ha\">\n";
    for (int i = 1; i < 10; ++i) {
        text += fmt::format("<!ENTITY e{} \"", i);
        for (int k = 0; k < 10; ++k) text += fmt::format("&e{};", i - 1);
        text += "\">\n";
    }
    EXPECT_FALSE(read(text + "]>\n<materialx>&e9;</materialx>").has_value());
    ASSERT_EQ(diagnostics_.all().size(), 1u);
    EXPECT_NE(diagnostics_.all()[0].message.find("document type"), std::string::npos);
    EXPECT_EQ(diagnostics_.all()[0].loc.line, 2u);
}

TEST_F(MaterialXTest, DeepElementsAreRefused) {
    std::string text = "<?xml version=\"1.0\"?><materialx>";
    for (int i = 0; i < 100000; ++i) text += "<nodegraph>";
    EXPECT_FALSE(read(text).has_value());
    EXPECT_EQ(count("mtlx-xml"), 1u);
}

TEST_F(MaterialXTest, OutputsThatNameEachOtherEnd) {
    const auto layer = layer_of(
        "<output name=\"a\" type=\"float\" output=\"b\"/>\n"
        "<output name=\"b\" type=\"float\" output=\"a\"/>\n"
        "<output name=\"c\" type=\"float\" nodename=\"k\"/>\n"
        "<constant name=\"k\" type=\"float\">"
        "<input name=\"value\" type=\"float\" output=\"a\"/></constant>\n"
        "<constant name=\"l\" type=\"float\">"
        "<input name=\"value\" type=\"float\" output=\"c\"/></constant>");
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(count("mtlx-cycle"), 1u);
    EXPECT_EQ(connection(*layer, "/MaterialX/NodeGraphs/k.inputs:value"), "");
    EXPECT_EQ(connection(*layer, "/MaterialX/NodeGraphs/l.inputs:value"),
              "/MaterialX/NodeGraphs/k.outputs:out");
}

TEST_F(MaterialXTest, NodesThatStandForThemselvesEnd) {
    // Each stands for two of the next, and the last for the first
    std::string text;
    for (int i = 0; i < 4; ++i) {
        text += fmt::format(
            "<nodedef name=\"ND_{0}\" node=\"n{0}\"><output name=\"out\" "
            "type=\"float\"/></nodedef>\n"
            "<nodegraph name=\"G{0}\" nodedef=\"ND_{0}\"><n{1} name=\"a\" type=\"float\"/><n{1} "
            "name=\"b\" type=\"float\"/><output name=\"out\" type=\"float\" nodename=\"a\"/>"
            "</nodegraph>\n",
            i, (i + 1) % 4);
    }
    const LayerPtr layer = layer_of(text + "<n0 name=\"start\" type=\"float\"/>");
    ASSERT_TRUE(layer);
    EXPECT_GT(count("mtlx-cycle"), 0u);
    EXPECT_LT(layer->spec_count(), size_t(1) << 20);
}

// Bytes that change, go and come twice: whatever comes of it, it is a layer or an error
TEST_F(MaterialXTest, BrokenBytesEndInALayerOrAnError) {
    const std::string good = R"xml(<?xml version="1.0"?>
<materialx version="1.38" colorspace="lin_rec709" fileprefix="tex/">
  <nodedef name="ND_a" node="a"><input name="x" type="float" value="1"/>
  <output name="out" type="color3"/></nodedef>
  <nodegraph name="NG_a" nodedef="ND_a">
    <convert name="c" type="color3"><input name="in" type="float" interfacename="x"/></convert>
    <output name="out" type="color3" nodename="c"/>
  </nodegraph>
  <nodegraph name="G">
    <a name="n" type="color3"/>
    <image name="i" type="color3"><input name="file" type="filename" value="p.png"/></image>
    <mix name="m" type="color3"><input name="fg" type="color3" nodename="n"/>
    <input name="bg" type="color3" nodename="i"/></mix>
    <output name="o" type="color3" nodename="m"/>
  </nodegraph>
  <standard_surface name="S" type="surfaceshader">
  <input name="base_color" type="color3" nodegraph="G" output="o"/></standard_surface>
  <surfacematerial name="M" type="material">
  <input name="surfaceshader" type="surfaceshader" nodename="S"/></surfacematerial>
</materialx>)xml";
    std::mt19937 random(20);
    const auto below = [&](size_t n) { return size_t(random() % n); };
    size_t layers = 0;
    for (int i = 0; i < 3000; ++i) {
        std::string text = good;
        for (size_t k = 0; k <= below(3); ++k) {
            const size_t at = below(text.size()), length = 1 + below(12);
            switch (below(3)) {
                case 0:
                    text[at] = char(random() % 256);
                    break;
                case 1:
                    text.erase(at, length);
                    break;
                default:
                    text.insert(below(text.size()), text.substr(at, length));
            }
        }
        Diagnostics quiet;
        layers += read_materialx_layer(make_asset_bytes(text), path("t.mtlx"), quiet).has_value();
    }
    EXPECT_GT(layers, 100u);
    EXPECT_LT(layers, 2900u);
}

TEST_F(MaterialXTest, WhatIsMissingIsNamed) {
    const LayerPtr layer = layer_of(R"xml(
      <xi:include href="none.mtlx"/>
      <look name="L"/>
      <nodegraph name="G">
        <add name="a" type="float">
          <input name="in1" type="float" nodename="nowhere"/>
          <input name="in2" type="float" value="red"/>
          <parameter name="old" type="float" value="1"/>
        </add>
      </nodegraph>
      <surfacematerial name="M" type="material">
        <input name="surfaceshader" type="surfaceshader" nodename="S"/>
      </surfacematerial>)xml");
    ASSERT_TRUE(layer);
    EXPECT_EQ(count("mtlx-include"), 1u);
    EXPECT_EQ(count("mtlx-missing"), 2u);
    EXPECT_EQ(count("mtlx-value"), 1u);
    EXPECT_EQ(count("mtlx-unsupported"), 2u);
    for (const Diagnostic& d : diagnostics_.all()) EXPECT_GT(d.loc.line, 2u) << d.message;
    EXPECT_EQ(type(*layer, "/MaterialX/Materials/M"), "Material");
}

}  // namespace
}  // namespace velatura::usd::materialx
