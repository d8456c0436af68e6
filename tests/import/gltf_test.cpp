// SPDX-License-Identifier: Apache-2.0
// What Assimp passes over in glTF files without a word.
#include "import/gltf.h"

#include "folder_test.h"
#include "import/import.h"
#include "usd/stage/stage.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <vector>

namespace velatura::import {

namespace {

using nlohmann::json;

/// The bytes of numbers.
template <class T>
std::string raw(const std::vector<T>& numbers) {
    std::string bytes(numbers.size() * sizeof(T), '\0');
    std::memcpy(bytes.data(), numbers.data(), bytes.size());
    return bytes;
}

/// A triangle of material "m" whose vertices are added one attribute after another.
class GltfTest : public FolderTest {
  protected:
    GltfTest() {
        file_ = json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{},"material":0}]}],
"accessors":[],"bufferViews":[],"buffers":[],"materials":[{"name":"m"}]})");
    }

    /// `stride`: bytes from one vertex to the next, 0 where they follow each other.
    void add_attribute(const char* name,
                       int component_type,
                       const char* type,
                       bool is_normalized,
                       const std::string& bytes,
                       size_t stride = 0) {
        file_["meshes"][0]["primitives"][0]["attributes"][name] = file_["accessors"].size();
        // Bytes that belong to nobody come before, to see that offsets add up
        const size_t at = buffer_.size();
        buffer_ += std::string(4, '\x7f') + bytes;
        json view = {{"buffer", 0}, {"byteOffset", at}, {"byteLength", 4 + bytes.size()}};
        if (stride > 0) view["byteStride"] = stride;
        file_["accessors"].push_back({{"bufferView", file_["bufferViews"].size()},
                                      {"byteOffset", 4},
                                      {"componentType", component_type},
                                      {"count", 3},
                                      {"type", type},
                                      {"normalized", is_normalized}});
        file_["bufferViews"].push_back(view);
        while (buffer_.size() % 4 != 0) buffer_ += '\0';
    }

    void add_float_positions() {
        add_attribute("POSITION", 5126, "VEC3", false, raw<float>({0, 0, 0, 2, 0, 0, 0, 3, 0}));
    }

    /// As a .gltf file with its buffer beside it.
    std::string text_file() {
        write("my data.bin", buffer_);
        file_["buffers"] =
            json::array({{{"byteLength", buffer_.size()}, {"uri", "my%20data.bin"}}});
        return write("scene.gltf", file_.dump());
    }

    std::string binary_file() {
        file_["buffers"] = json::array({{{"byteLength", buffer_.size()}}});
        std::string text = file_.dump();
        while (text.size() % 4 != 0) text += ' ';
        const auto word = [](size_t n) { return raw<uint32_t>({uint32_t(n)}); };
        return write("scene.glb", "glTF" + word(2) + word(28 + text.size() + buffer_.size()) +
                                      word(text.size()) + "JSON" + text + word(buffer_.size()) +
                                      std::string("BIN\0", 4) + buffer_);
    }

    usd::stage::Stage imported(const std::string& file) {
        const std::string output = (folder_ / "out.usda").string();
        const auto summary = import_file(file, output, diagnostics_);
        if (!summary) throw std::runtime_error(summary.error().message);
        auto stage = usd::stage::Stage::open(output, {}, diagnostics_);
        if (!stage) throw std::runtime_error(stage.error().message);
        return *stage;
    }

    size_t count(Severity severity, const std::string& part) const {
        const auto all = diagnostics_.all();
        return size_t(std::count_if(all.begin(), all.end(), [&](const Diagnostic& d) {
            return d.severity == severity && d.message.find(part) != std::string::npos;
        }));
    }

    json file_;
    std::string buffer_;
    Diagnostics diagnostics_;
};

template <class T>
std::vector<T> array_of(const usd::stage::Stage& stage, const char* attribute) {
    return stage.prim_at("/out/meshes_0_").attribute(attribute).get_or<std::vector<T>>({});
}

}  // namespace

TEST_F(GltfTest, EmissiveStrengthMultipliesTheEmission) {
    add_float_positions();
    file_["extensionsUsed"] = {"KHR_materials_emissive_strength"};
    file_["materials"][0]["emissiveFactor"] = {0.5, 0.25, 1};
    file_["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
    for (const std::string& file : {text_file(), binary_file()}) {
        const usd::stage::Stage stage = imported(file);
        EXPECT_EQ(stage.prim_at("/out/Materials/m/Surface")
                      .attribute("inputs:emissiveColor")
                      .get<usd::layer::Vec3f>(),
                  usd::layer::Vec3f(4, 2, 8))
            << file;
        EXPECT_EQ(array_of<usd::layer::Vec3f>(stage, "points")[2], usd::layer::Vec3f(0, 3, 0));
    }
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(GltfTest, EmissiveStrengthThatIsNoneIsNamed) {
    for (const json& value : {json(-1), json("bright")}) {
        Diagnostics diagnostics;
        file_["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = {
            {"emissiveStrength", value}};
        EXPECT_FALSE(prepare_gltf(file_.dump(), folder_, diagnostics, {}));
        ASSERT_EQ(diagnostics.warning_count(), 1u);
        EXPECT_NE(diagnostics.all()[0].message.find("emissiveStrength " + value.dump()),
                  std::string::npos);
    }
}

TEST_F(GltfTest, EveryExtensionThatIsNotImportedIsNamedOnce) {
    add_float_positions();
    file_["extensionsUsed"] = {"KHR_materials_sheen", "EXT_made_up", "KHR_materials_ior",
                               "VENDOR_needed", "EXT_made_up"};
    file_["extensionsRequired"] = {"VENDOR_needed", "KHR_texture_transform"};
    imported(text_file());
    EXPECT_EQ(count(Severity::Warning, "KHR_materials_sheen"), 1u);
    EXPECT_EQ(count(Severity::Warning, "EXT_made_up"), 1u);
    EXPECT_EQ(count(Severity::Error, "VENDOR_needed"), 1u);
    EXPECT_EQ(diagnostics_.all().size(), 3u);
}

TEST_F(GltfTest, MaterialExtensionsReachTheLayer) {
    add_float_positions();
    file_["extensionsUsed"] = {"KHR_materials_unlit", "KHR_materials_transmission",
                               "KHR_materials_pbrSpecularGlossiness"};
    const auto surface = [&](const char* extension, const json& content) {
        json& material = file_["materials"][0];
        material = {{"name", "m"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}}}};
        material["extensions"][extension] = content;
        return imported(text_file());
    };
    constexpr const char* shader = "/out/Materials/m/Surface";
    const auto color = [&](const usd::stage::Stage& stage, const char* input) {
        return stage.prim_at(shader).attribute(input).get<usd::layer::Vec3f>();
    };
    const auto number = [&](const usd::stage::Stage& stage, const char* input) {
        return stage.prim_at(shader).attribute(input).get<float>();
    };
    const auto unlit = surface("KHR_materials_unlit", json::object());
    EXPECT_EQ(color(unlit, "inputs:emissiveColor"), usd::layer::Vec3f(1, 0.5f, 0));
    EXPECT_EQ(color(unlit, "inputs:diffuseColor"), usd::layer::Vec3f(0));
    const auto glass = surface("KHR_materials_transmission", {{"transmissionFactor", 0.75}});
    EXPECT_EQ(number(glass, "inputs:opacity"), 0.25f);
    const auto glossy =
        surface("KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0, 0, 1, 1}},
                                                        {"specularFactor", {0.5, 0.25, 0}},
                                                        {"glossinessFactor", 0.75}});
    EXPECT_EQ(color(glossy, "inputs:diffuseColor"), usd::layer::Vec3f(0, 0, 1));
    EXPECT_EQ(color(glossy, "inputs:specularColor"), usd::layer::Vec3f(0.5f, 0.25f, 0));
    EXPECT_EQ(number(glossy, "inputs:roughness"), 0.25f);
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(GltfTest, DracoMeshesAreRead) {
    // The same triangle as a Draco stream (edgebreaker, no quantization)
    const std::string stream =
        "RFJBQ08CAgEBAAAAAwEAAQAAAQf/AREB/"
        "wAAAQAJAwAAAAAAAEAAAAAAAAAAAAAAAAAAAEBAAAAAAAAAAAAAAAAAAAAA"
        "AA==";
    constexpr size_t size = 70;
    file_["buffers"] = {
        {{"byteLength", size}, {"uri", "data:application/octet-stream;base64," + stream}}};
    file_["extensionsUsed"] = file_["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    file_["bufferViews"] = {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", size}}};
    file_["accessors"] = {{{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}},
                          {{"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}}};
    json& primitive = file_["meshes"][0]["primitives"][0];
    primitive["attributes"]["POSITION"] = 0;
    primitive["indices"] = 1;
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0},
                                                             {"attributes", {{"POSITION", 0}}}};
    const std::string file = write("draco.gltf", file_.dump());
    Diagnostics diagnostics;
    const auto tried = import_file(file, (folder_ / "out.usda").string(), diagnostics);
    if (!tried && tried.error().message.find("Draco") != std::string::npos)
        GTEST_SKIP() << "this Assimp reads no Draco: " << tried.error().message;
    EXPECT_EQ(array_of<usd::layer::Vec3f>(imported(file), "points"),
              (std::vector<usd::layer::Vec3f>{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}}));
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(GltfTest, TextureTransformsMayChooseTheirCoordinates) {
    file_["images"] = {{{"uri", "a.png"}}};
    file_["textures"] = {{{"source", 0}}};
    file_["extensionsUsed"] = {"KHR_texture_transform"};
    file_["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", 0},
        {"texCoord", 0},
        {"extensions", {{"KHR_texture_transform", {{"scale", {2, 2}}, {"texCoord", 1}}}}}};
    add_float_positions();
    const usd::stage::Stage stage = imported(text_file());
    EXPECT_EQ(stage.prim_at("/out/Materials/m/Coordinates")
                  .attribute("inputs:varname")
                  .get_or<std::string>(""),
              "st1");
}

TEST_F(GltfTest, VerticesOfSmallIntegersKeepTheirValues) {
    // Positions as KHR_mesh_quantization has them, with a stride; the decoded value is c / 255,
    // c / 65535, max(c / 127, -1), max(c / 32767, -1) or c itself
    file_["extensionsUsed"] = {"KHR_mesh_quantization"};
    file_["extensionsRequired"] = {"KHR_mesh_quantization"};
    add_attribute("POSITION", 5122, "VEC3", false,
                  raw<int16_t>({0, 0, 0, 77, 100, -20, 0, 77, 0, 300, -5, 77}), 8);
    add_attribute("NORMAL", 5120, "VEC3", true,
                  raw<int8_t>({0, 0, 127, 77, 0, 127, 0, 77, -128, 0, 0, 77}), 4);
    add_attribute("TEXCOORD_0", 5123, "VEC2", true, raw<uint16_t>({0, 0, 65535, 0, 65535, 13107}));
    add_attribute("TEXCOORD_1", 5121, "VEC2", true,
                  raw<uint8_t>({0, 0, 9, 9, 255, 0, 9, 9, 51, 255, 9, 9}), 4);
    add_attribute("COLOR_0", 5123, "VEC3", true,
                  raw<uint16_t>({0, 0, 65535, 9, 13107, 0, 0, 9, 0, 0, 0, 9}), 8);
    for (const std::string& file : {text_file(), binary_file()}) {
        const usd::stage::Stage stage = imported(file);
        using usd::layer::Vec2f;
        using usd::layer::Vec3f;
        EXPECT_EQ(array_of<Vec3f>(stage, "points"),
                  (std::vector<Vec3f>{{0, 0, 0}, {100, -20, 0}, {0, 300, -5}}));
        EXPECT_EQ(array_of<Vec3f>(stage, "normals"),
                  (std::vector<Vec3f>{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}));
        // Images start at the top in glTF, at the bottom in USD
        EXPECT_EQ(array_of<Vec2f>(stage, "primvars:st"),
                  (std::vector<Vec2f>{{0, 1}, {1, 1}, {1, 1 - 0.2f}}));
        EXPECT_EQ(array_of<Vec2f>(stage, "primvars:st1"),
                  (std::vector<Vec2f>{{0, 1}, {1, 1}, {0.2f, 0}}));
        EXPECT_EQ(array_of<Vec3f>(stage, "primvars:displayColor"),
                  (std::vector<Vec3f>{{0, 0, 1}, {0.2f, 0, 0}, {0, 0, 0}}));
    }
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(GltfTest, VerticesWhoseBytesAreNotThereAreErrors) {
    add_attribute("POSITION", 5122, "VEC3", false, raw<int16_t>({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    write("plain.bin", buffer_);
    file_["buffers"] = {{{"uri", "plain.bin"}}};
    const auto why = [&](const std::function<void(json&)>& edit) {
        json file = file_;
        edit(file);
        Diagnostics diagnostics;
        EXPECT_FALSE(prepare_gltf(file.dump(), folder_, diagnostics, {}));
        EXPECT_EQ(diagnostics.error_count(), 1u);
        return diagnostics.all().empty() ? "" : diagnostics.all()[0].message;
    };
    const std::vector<std::pair<const char*, std::function<void(json&)>>> cases = {
        {"ends beyond its view", [](json& f) { f["accessors"][0]["count"] = 4; }},
        {"ends beyond its view", [](json& f) { f["accessors"][0]["count"] = ~uint64_t(0); }},
        {"ends beyond its view", [](json& f) { f["accessors"][0]["byteOffset"] = ~uint64_t(0); }},
        {"ends beyond its view", [](json& f) { f["bufferViews"][0]["byteStride"] = 0; }},
        {"ends beyond its buffer", [](json& f) { f["bufferViews"][0]["byteLength"] = 999; }},
        {"its bytes are missing", [](json& f) { f["buffers"][0]["uri"] = "absent.bin"; }},
        {"its bytes are missing", [](json& f) { f["buffers"][0].erase("uri"); }},
        {"incomplete", [](json& f) { f["accessors"][0]["type"] = "MAT4"; }},
        {"incomplete", [](json& f) { f["accessors"][0]["count"] = -3; }},
        {"sparse", [](json& f) { f["accessors"][0]["sparse"] = json::object(); }},
    };
    for (const auto& [expected, edit] : cases)
        EXPECT_NE(why(edit).find(expected), std::string::npos) << expected << ": " << why(edit);
}

TEST_F(GltfTest, FilesThatAreNoneAreLeftToTheReader) {
    for (const std::string& bytes :
         {std::string(), std::string("{"), std::string("[1]"), std::string("glTF"),
          "glTF" + raw<uint32_t>({2, 20, 400}) + "JSON{}", std::string(2000, '[')}) {
        Diagnostics diagnostics;
        EXPECT_FALSE(prepare_gltf(bytes, folder_, diagnostics, {}));
        EXPECT_EQ(diagnostics.warning_count(), 1u) << bytes;
    }
}

TEST_F(GltfTest, NestingTakesNoStack) {
    constexpr size_t depth = 1000000;
    const std::string bytes =
        R"({"materials":[{"extras":)" + std::string(depth, '[') + std::string(depth, ']') + "}]}";
    Diagnostics diagnostics;
    EXPECT_FALSE(prepare_gltf(bytes, folder_, diagnostics, {}));
    EXPECT_EQ(diagnostics.warning_count(), 1u);
}

TEST_F(GltfTest, NamesOfBuffersMayBeNoText) {
    write("\xff.bin", "1234");
    Diagnostics diagnostics;
    const auto better =
        prepare_gltf(R"({"buffers":[{"uri":"%ff.bin","byteLength":4}]})", folder_, diagnostics, {});
    ASSERT_TRUE(better);
    EXPECT_FALSE(json::parse(*better, nullptr, false).is_discarded());
}

}  // namespace velatura::import
