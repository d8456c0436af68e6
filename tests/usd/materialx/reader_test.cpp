// SPDX-License-Identifier: Apache-2.0
// What layer a document makes: the prims, names and values of OpenUSD's usdMtlx.
#include "materialx_fixture.h"
#include "usd/layer/fields.h"
#include "usd/materialx/node_names.h"

#include <map>
#include <string>

namespace velatura::usd::materialx {
namespace {

constexpr const char* brass = R"xml(
  <nodegraph name="NG_brass">
    <tiledimage name="picture" type="color3">
      <input name="file" type="filename" value="brass.jpg" colorspace="srgb_texture" />
      <input name="uvtiling" type="vector2" value="2.0, 3" />
    </tiledimage>
    <output name="out_color" type="color3" nodename="picture" />
  </nodegraph>
  <standard_surface name="SR_brass" type="surfaceshader">
    <input name="base" type="float" value="0.7" />
    <input name="coat_color" type="color3" nodegraph="NG_brass" output="out_color" />
    <input name="thin_walled" type="boolean" value="true" />
  </standard_surface>
  <surfacematerial name="Brass" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR_brass" />
  </surfacematerial>)xml";

TEST_F(MaterialXTest, AMaterialHasItsShaderInterfaceAndGraph) {
    const LayerPtr layer = layer_of(brass);
    ASSERT_TRUE(layer);
    const std::string m = "/MaterialX/Materials/Brass";
    EXPECT_EQ(layer->default_prim().to_string(), "/MaterialX");
    EXPECT_EQ(type(*layer, m), "Material");
    EXPECT_EQ(connection(*layer, m + ".outputs:mtlx:surface"), m + "/SR_brass.outputs:out");
    EXPECT_EQ(token(*layer, m + "/SR_brass.info:id"), "ND_standard_surface_surfaceshader");
    // Values are the material's, so that they can be set from outside; also those that the
    // document leaves alone
    ASSERT_TRUE(value(*layer, m + ".inputs:base"));
    EXPECT_EQ(value(*layer, m + ".inputs:base")->get_or(0.0f), 0.7f);
    EXPECT_EQ(connection(*layer, m + "/SR_brass.inputs:base"), m + ".inputs:base");
    EXPECT_EQ(connection(*layer, m + "/SR_brass.inputs:sheen"), m + ".inputs:sheen");
    EXPECT_TRUE(value(*layer, m + ".inputs:thin_walled")->get_or(false));
    EXPECT_EQ(type(*layer, m + ".inputs:coat_color"), "color3f");
    // The graph stands at its place, and in the material by reference
    EXPECT_EQ(connection(*layer, m + "/SR_brass.inputs:coat_color"),
              m + "/NG_brass.outputs:out_color");
    const auto* references = layer->field_as<layer::ReferenceListOp>(
        layer::Path::from(m + "/NG_brass"), layer::fields().references);
    ASSERT_TRUE(references);
    EXPECT_EQ(references->explicit_items[0].prim_path.to_string(),
              "/MaterialX/NodeGraphs/NG_brass");
    const std::string image = "/MaterialX/NodeGraphs/NG_brass/picture";
    EXPECT_EQ(token(*layer, image + ".info:id"), "ND_tiledimage_color3");
    EXPECT_EQ(value(*layer, image + ".inputs:file")->get_or(layer::AssetPath()).path, "brass.jpg");
    EXPECT_EQ(value(*layer, image + ".inputs:uvtiling")->get_or(layer::Vec2f()),
              layer::Vec2f(2, 3));
    EXPECT_EQ(layer->field(layer::Path::from(image + ".inputs:file"), layer::fields().color_space)
                  ->get_or(layer::Token())
                  .str(),
              "srgb_texture");
    EXPECT_TRUE(diagnostics_.all().empty());
    EXPECT_EQ(layer->spec(layer::Path::from(image))->loc().line, 5u);
}

/// UsdUVTexture has colors and numbers: what its input says of its own file counts, what the
/// document says of colors does not.
TEST_F(MaterialXTest, FilesOfUsdUVTextureKeepTheirOwnColorSpace) {
    const LayerPtr layer = layer_of(R"xml(
  <nodegraph name="G">
    <UsdUVTexture name="marked" type="multioutput">
      <input name="file" type="filename" value="a.png" colorspace="lin_ap1" />
    </UsdUVTexture>
    <UsdUVTexture name="bare" type="multioutput">
      <input name="file" type="filename" value="b.png" />
    </UsdUVTexture>
    <image name="image" type="color3">
      <input name="file" type="filename" value="c.png" />
    </image>
    <output name="o" type="color3" nodename="image" />
  </nodegraph>)xml",
                                    "version=\"1.38\" colorspace=\"srgb_texture\"");
    ASSERT_TRUE(layer);
    std::map<std::string, std::string> spaces;
    layer->for_each_spec(layer::Path::absolute_root(), [&](layer::Path path, const layer::Spec& s) {
        if (path.name() != "inputs:file") return;
        const auto* space = s.field_as<layer::Token>(layer::fields().color_space);
        spaces[path.parent().name().str()] = space ? space->str() : "";
    });
    EXPECT_EQ(spaces["marked"], "lin_ap1");
    EXPECT_EQ(spaces["bare"], "");
    EXPECT_EQ(spaces["image"], "srgb_texture");
}

TEST_F(MaterialXTest, NodesOfTheDocumentAreAGraphOfTheirOwn) {
    const LayerPtr layer = layer_of(R"xml(
      <constant name="red" type="color3"><input name="value" type="color3" value="1,0,0"/>
      </constant>
      <open_pbr_surface name="S" type="surfaceshader">
        <input name="base_color" type="color3" nodename="red"/>
      </open_pbr_surface>
      <surfacematerial name="M" type="material">
        <input name="surfaceshader" type="surfaceshader" nodename="S"/>
      </surfacematerial>)xml");
    ASSERT_TRUE(layer);
    EXPECT_EQ(connection(*layer, "/MaterialX/Materials/M/S.inputs:base_color"),
              "/MaterialX/Materials/M/NodeGraphs/red.outputs:out");
    EXPECT_EQ(token(*layer, "/MaterialX/NodeGraphs/red.info:id"), "ND_constant_color3");
}

TEST_F(MaterialXTest, OwnNodesBecomeCopiesOfTheirGraph) {
    const LayerPtr layer = layer_of(R"xml(
      <nodedef name="ND_tinted" node="tinted">
        <input name="tint" type="color3" value="0.5,0.5,0.5"/>
        <output name="result" type="color3"/>
      </nodedef>
      <nodegraph name="NG_tinted" nodedef="ND_tinted">
        <multiply name="twice" type="color3">
          <input name="in1" type="color3" interfacename="tint"/>
          <input name="in2" type="float" value="2"/>
        </multiply>
        <output name="result" type="color3" nodename="twice"/>
      </nodegraph>
      <nodegraph name="G">
        <tinted name="a" type="color3"/>
        <tinted name="b" type="color3"><input name="tint" type="color3" value="1,0,0"/></tinted>
        <add name="sum" type="color3">
          <input name="in1" type="color3" nodename="a"/>
          <input name="in2" type="color3" nodename="b"/>
        </add>
        <output name="out" type="color3" nodename="sum"/>
      </nodegraph>)xml");
    ASSERT_TRUE(layer);
    const std::string g = "/MaterialX/NodeGraphs/G";
    EXPECT_EQ(type(*layer, g + "/a"), "NodeGraph");
    EXPECT_EQ(token(*layer, g + "/a/twice.info:id"), "ND_multiply_color3FA");
    EXPECT_EQ(connection(*layer, g + "/a/twice.inputs:in1"), g + "/a.inputs:tint");
    EXPECT_EQ(value(*layer, g + "/a.inputs:tint")->get_or(layer::Vec3f()), layer::Vec3f(0.5f));
    EXPECT_EQ(value(*layer, g + "/b.inputs:tint")->get_or(layer::Vec3f()), layer::Vec3f(1, 0, 0));
    EXPECT_EQ(connection(*layer, g + "/sum.inputs:in2"), g + "/b.outputs:result");
    // The graph of a definition is no graph of the document
    EXPECT_EQ(type(*layer, "/MaterialX/NodeGraphs/NG_tinted"), "nothing");
}

TEST_F(MaterialXTest, NodeNamesAreThoseOfTheLibrary) {
    const auto name = [](std::string_view category, std::string_view type,
                         std::map<std::string_view, std::string_view> inputs, bool is_old = true) {
        return node_definition({category, type, std::move(inputs), is_old});
    };
    EXPECT_EQ(name("add", "color3", {{"in1", "color3"}, {"in2", "color3"}}), "ND_add_color3");
    EXPECT_EQ(name("power", "color3", {{"in1", "color3"}, {"in2", "float"}}), "ND_power_color3FA");
    EXPECT_EQ(name("add", "float", {{"in2", "float"}}), "ND_add_float");
    EXPECT_EQ(name("clamp", "vector2", {{"low", "float"}}), "ND_clamp_vector2FA");
    EXPECT_EQ(name("convert", "color3", {{"in", "float"}}), "ND_convert_float_color3");
    EXPECT_EQ(name("swizzle", "float", {{"in", "vector2"}}), "ND_swizzle_vector2_float");
    EXPECT_EQ(name("extract", "float", {{"in", "color3"}}), "ND_extract_color3");
    EXPECT_EQ(name("dotproduct", "float", {{"in1", "vector3"}}), "ND_dotproduct_vector3");
    EXPECT_EQ(name("separate3", "multioutput", {{"in", "color3"}}), "ND_separate3_color3");
    EXPECT_EQ(name("combine2", "color4", {{"in1", "color3"}, {"in2", "float"}}),
              "ND_combine2_color4CF");
    EXPECT_EQ(name("mix", "color3", {{"mix", "color3"}}), "ND_mix_color3_color3");
    EXPECT_EQ(name("mix", "color3", {{"mix", "float"}}), "ND_mix_color3");
    EXPECT_EQ(name("ifgreater", "color3", {{"value1", "integer"}}), "ND_ifgreater_color3I");
    EXPECT_EQ(name("noise3d", "color3", {{"amplitude", "float"}}), "ND_noise3d_color3FA");
    EXPECT_EQ(name("normalmap", "vector3", {}), "ND_normalmap");
    EXPECT_EQ(name("normalmap", "vector3", {{"scale", "float"}}, false), "ND_normalmap_float");
    EXPECT_EQ(name("geompropvalue", "vector2", {}), "ND_geompropvalue_vector2");
}

TEST_F(MaterialXTest, IncludesAreRead) {
    std::filesystem::create_directory(folder_ / "lib");
    write("lib/nodes.mtlx", R"xml(<?xml version="1.0"?>
      <materialx version="1.38" fileprefix="tex/">
        <xi:include href="nodes.mtlx"/>
        <image name="picture" type="color3"><input name="file" type="filename" value="a.png"/>
        </image>
      </materialx>)xml");
    const LayerPtr layer = layer_of("<xi:include href=\"lib/nodes.mtlx\"/>");
    ASSERT_TRUE(layer);
    // A file that it names is beside the included one
    const layer::Value* file = value(*layer, "/MaterialX/NodeGraphs/picture.inputs:file");
    ASSERT_TRUE(file);
    EXPECT_EQ(file->get_or(layer::AssetPath()).path, "lib/tex/a.png");
    EXPECT_TRUE(diagnostics_.all().empty());
}

}  // namespace
}  // namespace velatura::usd::materialx
