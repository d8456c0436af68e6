// SPDX-License-Identifier: Apache-2.0
// `velatura-comp mattes` against a render of both scenes together.
#include "command.h"
#include "film/cryptomatte_decoder.h"
#include "image/exr.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace velatura::test {

namespace {

const std::string head = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 50
    float horizontalAperture = 20
    float verticalAperture = 20
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky"
{
}
)usda";

std::string material(const std::string& name, const std::string& input) {
    return "def Material \"" + name + "\"\n{\n token outputs:surface.connect = </" + name +
           "/S.outputs:surface>\n def Shader \"S\"\n {\n uniform token info:id = "
           "\"UsdPreviewSurface\"\n " +
           input + "\n token outputs:surface\n }\n}\n";
}

std::string placed(const std::string& type,
                   const std::string& name,
                   const std::string& material,
                   const std::string& at,
                   const std::string& size) {
    return "def " + type + " \"" + name +
           "\" (\n kind = \"component\"\n prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{\n "
           "rel "
           "material:binding = </" +
           material + ">\n " + size + "\n double3 xformOp:translate = " + at +
           "\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
}

// A wall behind all, a box beside the hero, and one that the hero hides
const std::string set =
    material("SetPaint", "float inputs:roughness = 0.5") +
    placed("Cube", "Wall", "SetPaint", "(0, 0, -8)", "double size = 12") +
    placed("Cube", "Box", "SetPaint", "(1.2, 1.2, 0)", "double size = 0.6") +
    placed("Cube", "Hidden", "SetPaint", "(-0.8, -0.8, -0.5)", "double size = 0.3");

// In front of it, solid and half there
const std::string hero =
    material("HeroPaint", "float inputs:roughness = 0.3") +
    material("Veil", "float inputs:opacity = 0.3\n token inputs:opacityMode = \"presence\"") +
    placed("Sphere", "Hero", "HeroPaint", "(-0.8, -0.8, 1)", "double radius = 0.8") +
    placed("Cube", "Cloth", "Veil", "(0.9, -0.9, 1)", "double size = 0.5");

class JoinedMattes : public testing::Test {
  protected:
    void render(const std::string& scene, const std::string& file, const std::string& more = "") {
        w.write(file + ".usda", head + scene);
        const CommandResult r = w.velatura(
            "render " + file + ".usda -o " + file +
            ".exr --res 40 40 --spp 16 --filter triangle --max-depth 1 --progress none -q "
            "--cryptomatte object,material,asset" +
            more);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    image::Image read(const std::string& file) {
        Result<image::Image> image = image::read_exr(w.path(file));
        if (!image) throw std::runtime_error(image.error().message);
        return std::move(*image);
    }

    Workplace w;
};

void expect_same(const CryptomatteDecoder& found,
                 const CryptomatteDecoder& expected,
                 const std::string& what) {
    ASSERT_EQ(found.pixels.size(), expected.pixels.size());
    size_t mixed = 0;
    for (size_t i = 0; i < found.pixels.size(); ++i) {
        mixed += size_t(expected.pixels[i].size() > 1);
        ASSERT_EQ(found.pixels[i].size(), expected.pixels[i].size()) << what << " " << i;
        for (const auto& [id, coverage] : expected.pixels[i]) {
            ASSERT_TRUE(found.pixels[i].contains(id)) << what << " " << i;
            ASSERT_NEAR(found.pixels[i].at(id), coverage, 1e-6f) << what << " " << i;
        }
    }
    EXPECT_GT(mixed, 50u) << what;
}

}  // namespace

TEST_F(JoinedMattes, AreThoseOfBothScenesTogether) {
    render(hero, "hero");
    render(set, "set");
    render(set + hero, "both");
    const CommandResult r = w.comp("mattes hero.exr set.exr -o joined.exr");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const image::Image joined = read("joined.exr"), both = read("both.exr");
    for (const char* layer : {"CryptoObject", "CryptoMaterial", "CryptoAsset"}) {
        const CryptomatteDecoder found(joined, layer), expected(both, layer);
        expect_same(found, expected, layer);
        for (const auto& [name, id] : expected.manifest) EXPECT_EQ(found.manifest.at(name), id);
    }
    // Names of what the front hides are those of the file behind
    EXPECT_TRUE(CryptomatteDecoder(joined, "CryptoObject").manifest.contains("/Hidden"));
    // Six ranks of each
    EXPECT_NE(joined.find("CryptoObject05.A"), nullptr);
    EXPECT_EQ(joined.find("CryptoObject06.A"), nullptr);

    // A part of the front in front of all of it
    render(hero, "crop", " --crop 0.25 1 0 0.75");
    ASSERT_EQ(w.comp("mattes crop.exr set.exr -o cropped.exr --levels 4").exit_code, 0);
    const image::Image cropped = read("cropped.exr");
    EXPECT_EQ(cropped.data.width(), 40);
    EXPECT_NE(cropped.find("CryptoObject01.A"), nullptr);
    EXPECT_EQ(cropped.find("CryptoObject02.A"), nullptr);
    const std::vector<float> wall = CryptomatteDecoder(cropped, "CryptoObject").matte("/Wall");
    EXPECT_EQ(wall[35 * 40], 1.0f) << "outside of the crop nothing is hidden";

    // The other way around the wall hides all
    ASSERT_EQ(w.comp("mattes set.exr hero.exr -o hidden.exr").exit_code, 0);
    expect_same(CryptomatteDecoder(read("hidden.exr"), "CryptoObject"),
                CryptomatteDecoder(read("set.exr"), "CryptoObject"), "behind the wall");
}

// What `info` says of a file without light: the mean coverage of every object.
TEST_F(JoinedMattes, AreSummarizedByInfo) {
    render(hero, "hero");
    render(set, "set");
    ASSERT_EQ(w.comp("mattes hero.exr set.exr -o joined.exr").exit_code, 0);
    const CommandResult said = w.comp("info joined.exr"), j = w.comp("info joined.exr --json");
    ASSERT_EQ(said.exit_code, 0) << said.output;
    ASSERT_EQ(j.exit_code, 0) << j.output;
    const nlohmann::json info = nlohmann::json::parse(j.output);
    EXPECT_EQ(info.at("size"), nlohmann::json({40, 40}));
    EXPECT_EQ(info.at("hash"), w.hash("joined.exr"));
    ASSERT_EQ(info.at("mattes").size(), 3u);
    const image::Image joined = read("joined.exr");
    size_t objects = 0;
    for (const nlohmann::json& matte : info.at("mattes")) {
        const CryptomatteDecoder decoder(joined, matte.at("name").get<std::string>());
        ASSERT_EQ(matte.at("covered").size(), decoder.manifest.size());
        for (const auto& [name, share] : matte.at("covered").items()) {
            double sum = 0;
            for (const float coverage : decoder.matte(name)) sum += double(coverage);
            EXPECT_NEAR(share.get<double>(), sum / 1600, 1e-9) << name;
            EXPECT_NE(said.output.find(name), std::string::npos);
            objects += sum > 0 ? 1 : 0;
        }
    }
    EXPECT_GT(objects, 5u);
    // A picture that is neither
    EXPECT_EQ(w.comp("info hero.usda").exit_code, 1);
}

TEST_F(JoinedMattes, RefuseWhatIsNoImageOfBoth) {
    render(hero, "hero");
    render(set, "set");
    w.write("plain.usda", head + set);
    ASSERT_EQ(w.velatura("render plain.usda -o plain.exr --res 40 40 --spp 1 -q").exit_code, 0);
    ASSERT_EQ(w.velatura("render plain.usda -o small.exr --res 20 20 --spp 1 -q --cryptomatte "
                         "object")
                  .exit_code,
              0);
    for (const auto& [files, code] : {std::pair{"hero.exr plain.exr", "matte-layer"},
                                      std::pair{"hero.exr small.exr", "files-differ"}}) {
        const CommandResult r = w.comp(std::string("mattes ") + files + " -o out.exr");
        EXPECT_EQ(r.exit_code, 2) << files;
        EXPECT_NE(r.output.find(code), std::string::npos) << r.output;
    }
}

}  // namespace velatura::test
