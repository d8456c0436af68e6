// SPDX-License-Identifier: Apache-2.0
// Assets that a scene names and that are not there: the rest is rendered and written, the message
// says where and with which consequence, and the exit code is 1 unless they are ignored.
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 8 8 --spp 1 --guiding off --splitting off --progress none";

struct Kind {
    std::string name;
    std::string scene;    ///< after "#usda 1.0"
    std::string message;  ///< part of it
    std::string counted;  ///< of the last line
    bool is_layer;        ///< known when the stage is composed: info and flatten miss it too
    std::string beside = {};
    std::string content_beside = {};
};

std::string with_sphere(const std::string& prims) {
    return prims + "def Sphere \"Shown\" {}\n";
}

std::vector<Kind> kinds() {
    const std::string mtlx =
        "<?xml version=\"1.0\"?>\n<materialx version=\"1.38\" "
        "xmlns:xi=\"http://www.w3.org/2001/XInclude\">\n<xi:include href=\"none.mtlx\"/>\n"
        "</materialx>\n";
    return {
        {"Reference", with_sphere("def \"A\" (references = @none.usda@) {}\n"),
         "s.usda:2:10: error: cannot open reference @none.usda@: ", "1 layer", true},
        {"Payload", with_sphere("def \"A\" (payload = @none.usda@) {}\n"),
         "cannot open payload @none.usda@: ", "1 layer", true},
        {"Sublayer", "(subLayers = [@none.usda@])\n" + with_sphere(""),
         "cannot open sublayer @none.usda@: ", "1 layer", true},
        {"DamagedReference", with_sphere("def \"A\" (references = @bad.usda@) {}\n"),
         "cannot open reference @bad.usda@: ", "1 layer", true, "bad.usda", "#usda 1.0\ndef {\n"},
        {"PrimOfReference", with_sphere("def \"A\" (references = @there.usda@</B>) {}\n"), "</B>",
         "1 prim", true, "there.usda", "#usda 1.0\ndef \"C\" {}\n"},
        {"DefaultPrim", with_sphere("def \"A\" (references = @there.usda@) {}\n"), "defaultPrim",
         "1 prim", true, "there.usda", "#usda 1.0\ndef \"C\" {}\n"},
        {"MaterialX", with_sphere("def \"A\" (references = @none.mtlx@) {}\n"),
         "cannot open reference @none.mtlx@: ", "1 layer", true},
        {"MaterialXInclude", with_sphere("def \"A\" (references = @doc.mtlx@</MaterialX>) {}\n"),
         "included file \"none.mtlx\" cannot be read", "1 MaterialX document", false, "doc.mtlx",
         mtlx},
        {"Texture", textured_ball("none.png"),
         "error: cannot read texture 'none.png': ", "1 texture", false},
        {"DamagedTexture", textured_ball("bad.png"),
         "error: cannot read texture 'bad.png': ", "1 texture", false, "bad.png", "no picture"},
        {"Udim", textured_ball("none.<UDIM>.png"), "none of the UDIM tiles 1001 to 1100 exists",
         "1 texture", false},
        {"DomeTexture",
         with_sphere("def DomeLight \"D\" { asset inputs:texture:file = @none.hdr@\n}\n"),
         "light emits without its texture: ", "1 light texture", false},
        {"RectTexture",
         with_sphere("def RectLight \"D\" { asset inputs:texture:file = @none.hdr@\n}\n"),
         "light emits without its texture: ", "1 light texture", false},
        {"IesProfile",
         with_sphere("def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { asset "
                     "inputs:shaping:ies:file = @none.ies@\n}\n"),
         "the light is rendered without it", "1 IES profile", false},
        {"ValueClip",
         with_sphere("def Sphere \"C\" (\nclips = { dictionary default = { asset[] assetPaths = "
                     "[@none.usda@]\nstring primPath = \"/C\"\ndouble2[] active = [(0, 0)]\n"
                     "double2[] times = [(0, 0)]\nasset manifestAssetPath = @m.usda@\n} }\n) {\n"
                     "double radius.timeSamples = {}\n}\n"),
         "clip layer @none.usda@ cannot be opened", "1 value clip", false, "m.usda",
         "#usda 1.0\nover \"C\"\n{\n    double radius\n}\n"},
    };
}

void PrintTo(const Kind& kind, std::ostream* out) {
    *out << kind.name;
}

class MissingAsset : public testing::TestWithParam<Kind> {};

/// Of a fallback the message says the value: (0, 0, 0, 1) is UsdUVTexture's.
constexpr const char* fallback = "using its fallback (0, 0, 0, 1)";

}  // namespace

TEST_P(MissingAsset, EndsWithCode1AfterTheImageIsWrittenUnlessIgnored) {
    const Kind& kind = GetParam();
    const Workplace w;
    w.write("s.usda", "#usda 1.0\n" + kind.scene);
    if (!kind.beside.empty()) w.write(kind.beside, kind.content_beside);
    const std::string render = std::string("render s.usda --frames 0") + quick;

    const CommandResult failed = w.velatura(render + " -o x.exr");
    EXPECT_EQ(failed.exit_code, 1) << failed.output;
    EXPECT_NE(failed.output.find(kind.message), std::string::npos) << failed.output;
    EXPECT_NE(failed.output.find("missing assets: " + kind.counted + ";"), std::string::npos)
        << failed.output;
    EXPECT_TRUE(w.exists("x.exr"));
    if (kind.counted == "1 texture") {
        EXPECT_NE(failed.output.find(fallback), std::string::npos) << failed.output;
    }

    const CommandResult ignored = w.velatura(render + " --missing-assets ignore -o y.exr");
    EXPECT_EQ(ignored.exit_code, 0) << ignored.output;
    EXPECT_NE(ignored.output.find(kind.message), std::string::npos) << ignored.output;
    EXPECT_EQ(w.hash("x.exr"), w.hash("y.exr"));

    if (!kind.is_layer) return;
    for (const std::string command :
         {"plan s.usda --res 8 8", "info s.usda --materialx", "flatten s.usda --materialx"}) {
        EXPECT_EQ(w.velatura(command).exit_code, 1) << command;
        EXPECT_EQ(w.velatura(command + " --missing-assets ignore").exit_code, 0) << command;
    }
}

INSTANTIATE_TEST_SUITE_P(OfAKind, MissingAsset, testing::ValuesIn(kinds()), [](const auto& kind) {
    return kind.param.name;
});

/// `info` looks for the files without rendering, and states each at its attribute.
TEST(MissingAssets, InfoNamesThem) {
    const Workplace w;
    w.write("there.png", "x");
    w.write("s.usda", "#usda 1.0\n" + textured_ball("none.png") +
                          "def DomeLight \"D\" { asset inputs:texture:file = @none.hdr@\n}\n"
                          "def DomeLight \"E\" { asset inputs:texture:file = @there.png@\n}\n"
                          "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { asset "
                          "inputs:shaping:ies:file = @none.ies@\n}\n"
                          "def OpenVDBAsset \"V\" { asset filePath = @none.vdb@\n}\n");
    const CommandResult r = w.velatura("info s.usda");
    EXPECT_EQ(r.exit_code, 1) << r.output;
    for (const char* text :
         {"error: cannot read texture 'none.png': file \"", "[texture-unreadable]",
          "error: cannot read light texture 'none.hdr': ", "at </D>",
          "error: cannot read IES profile 'none.ies': ",
          "error: cannot read volume file 'none.vdb': ",
          "5 files of textures, lights and volumes, 4 missing",
          "missing assets: 1 IES profile, 1 light texture, 1 texture, 1 volume file;"})
        EXPECT_NE(r.output.find(text), std::string::npos) << text << "\n" << r.output;
    EXPECT_EQ(r.output.find("there.png"), std::string::npos) << r.output;
    EXPECT_EQ(w.velatura("info s.usda --missing-assets ignore").exit_code, 0);
    w.write("tiles.1012.png", "x");
    w.write("t.usda", "#usda 1.0\n" + textured_ball("tiles.<UDIM>.png"));
    EXPECT_EQ(w.velatura("info t.usda").exit_code, 0);
}

/// A frame that --strict refuses is not said to be written.
TEST(MissingAssets, NoResultIsStatedWhereNothingIsRendered) {
    const Workplace w;
    w.write("s.usda", "#usda 1.0\n" + textured_ball("none.png"));
    for (const char* option : {" --strict", " --missing-textures error"}) {
        const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + option + quick);
        EXPECT_EQ(r.exit_code, 1) << r.output;
        EXPECT_NE(r.output.find("error: missing assets: 1 texture [missing-assets]"),
                  std::string::npos)
            << r.output;
        EXPECT_EQ(r.output.find("the result lacks them"), std::string::npos) << r.output;
        EXPECT_FALSE(w.exists("x.exr"));
    }
}

TEST(MissingAssets, SeveralAreCountedByKind) {
    const Workplace w;
    w.write("s.usda",
            "#usda 1.0\ndef \"A\" (references = @none.usda@) {}\ndef \"B\" (references = "
            "@other.usda@) {}\ndef DomeLight \"D\" { asset inputs:texture:file = @none.hdr@\n}\n");
    const CommandResult r = w.velatura(std::string("render s.usda -q -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_NE(r.output.find("missing assets: 2 layers, 1 light texture;"), std::string::npos)
        << r.output;
}

TEST(MissingAssets, NothingIsMissingWhereNothingIsNamed) {
    const Workplace w;
    for (const std::string prims :
         {"def \"A\" (inherits = </_none>) {}\n", "def DomeLight \"D\" {}\n",
          "def RectLight \"D\" { asset inputs:texture:file = @@\n}\n"}) {
        w.write("s.usda", "#usda 1.0\n" + with_sphere(prims));
        const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + quick);
        EXPECT_EQ(r.exit_code, 0) << prims << r.output;
    }
}

}  // namespace velatura::test
