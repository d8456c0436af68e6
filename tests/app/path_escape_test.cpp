// SPDX-License-Identifier: Apache-2.0
// Scenes that name files which are not theirs: every way of spelling such a name, for every kind of
// asset. Each is refused with the place and the reason, and the rest is rendered.
#include "base/stored_zip.h"
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

namespace velatura::test {

namespace {

namespace fs = std::filesystem;

constexpr const char* outside = "is not below the scene's folder or an --asset-root";

/// A name of a file, and what is said when a confined scene uses it; "" = nothing, it is the
/// scene's own.
struct Spelling {
    std::string name;
    std::string rejection;
    bool is_refused_always = false;
    bool is_said_before =
        false;  ///< the same file as one before, where each file is read, and spoken of, once
};

/// A folder `in` with a scene's own files, a folder `out` beside it with such that are not, and
/// ways from one to the other.
struct Places {
    Workplace w;

    Places(const std::string& file, const std::string& content, const std::string& content_out)
        : file_(file) {
        for (const char* folder : {"in/sub", "out", "cwd"}) fs::create_directories(w.path(folder));
        for (const char* folder : {"in/", "in/sub/"}) w.write(folder + file, content);
        w.write("out/" + file, content_out);
        w.write("in/p.usdz", testing::stored_zip({{"m/" + file, content}}));
        w.write("out/p.usdz", testing::stored_zip({{"m/" + file, content_out}}));
        fs::create_symlink("../out/" + file, w.path("in/link_" + file));
        fs::create_symlink("link_" + file, w.path("in/chain_" + file));
        fs::create_symlink(w.path("out/" + file), w.path("in/absolute_" + file));
        fs::create_symlink(file, w.path("in/own_" + file));
        fs::create_directory_symlink("../out", w.path("in/folder"));
        fs::create_directory_symlink("sub", w.path("in/own"));
        fs::create_symlink("/dev/zero", w.path("in/zero_" + file));
        EXPECT_EQ(::mkfifo(w.path("in/pipe_" + file).c_str(), 0600), 0);
    }

    std::vector<Spelling> spellings() const {
        const std::string all = w.path("out/" + file_), up = "../out/" + file_;
        std::vector<Spelling> list = {
            {"./" + file_, ""},
            {w.path("in/" + file_), ""},
            {"./sub/../" + file_, ""},
            {"../in/own/" + file_, ""},
            {"./own_" + file_, ""},
            {all, outside},
            {"/proc/self/root" + all, outside},
            {up, outside},
            {"./a/../../out/" + file_, outside},
            {"sub/../../out/" + file_, outside},
            {"./link_" + file_, outside},
            {"./chain_" + file_, outside},
            {"./absolute_" + file_, outside},
            {"./folder/" + file_, outside},
            {"./folder/../out/" + file_, "does not exist", true},
            {"./zero_" + file_, outside},
            {"/dev/zero", outside},
            {"/proc/self/mem", outside},
            {"../out/p.usdz[m/" + file_ + "]", outside},
            {"../out/none_" + file_, outside},
            {"./pipe_" + file_, "is a pipe", true},
            {"./sub", "is a folder", true},
            {"./p.usdz[../../out/" + file_ + "]", "leaves the package", true},
            {"./p.usdz[" + all + "]", "leaves the package", true},
            {"./p.usdz[m/../../" + file_ + "]", "leaves the package", true},
            {"http://127.0.0.1:9/" + file_, "found a URL (http:)", true},
            {"file://" + all, "found a URL (file:)", true},
            {"//127.0.0.1/share/" + file_, "network share", true},
            {"\\\\host\\share\\" + file_, "network share", true},
            {std::string(5000, 'x') + file_, "bytes, expected at most 4095", true},
            {"./%2e%2e/out/" + file_, "does not exist", true},
            {"./..%2fout%2f" + file_, "does not exist", true},
        };
        return list;
    }

  private:
    std::string file_;
};

/// A kind of asset: its file, and a prim that names it. `@` stands for the name, `#` for a number.
struct Kind {
    std::string name, file, content, prim;
    bool reads_files_once = false;
};

std::string replaced(std::string text, char mark, const std::string& by) {
    for (size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + by.size()))
        text.replace(at, 1, by);
    return text;
}

const std::string layer_text = "#usda 1.0\n(defaultPrim = \"P\")\ndef Sphere \"P\" {}\n";
// One pixel. Ref: Ward 1991, "Real Pixels", Graphics Gems II
const std::string image =
    std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n") + "\x40\x50\x60\x80";
const std::string profile =
    "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1\n";

std::vector<Kind> kinds() {
    const auto textured = [](const char* path) {
        return std::string(
                   "def Material \"M#\" { token outputs:surface.connect = "
                   "</W/M#/S.outputs:surface>\ndef Shader \"S\" { uniform token info:id = "
                   "\"UsdPreviewSurface\"\ncolor3f inputs:diffuseColor.connect = "
                   "</W/M#/T.outputs:rgb>\ntoken outputs:surface\n}\ndef Shader "
                   "\"T\" { uniform token info:id = \"UsdUVTexture\"\nfloat3 outputs:rgb\nasset "
                   "inputs:file = ") +
               path +
               "\n}\n}\ndef Sphere \"B#\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { rel "
               "material:binding = </W/M#>\n}";
    };
    return {
        {"reference", "l.usda", layer_text, "def \"R#\" (references = @) {}"},
        {"payload", "l.usda", layer_text, "def \"R#\" (payload = @) {}"},
        {"instanced reference", "l.usda", layer_text,
         "def \"R#\" (instanceable = true\nreferences = @) {}"},
        {"texture", "t.hdr", image, textured("@")},
        {"dome", "t.hdr", image, "def DomeLight \"D#\" { asset inputs:texture:file = @\n}"},
        {"lamp's picture", "t.hdr", image,
         "def RectLight \"D#\" { asset inputs:texture:file = @\n}"},
        {"lamp's profile", "l.ies", profile,
         "def SphereLight \"D#\" (prepend apiSchemas = [\"ShapingAPI\"]) { asset "
         "inputs:shaping:ies:file = @\n}",
         true},
        {"volume", "v.vdb", "no grids",
         "def Volume \"V#\" { rel field:density = </W/V#/F>\ndef OpenVDBAsset \"F\" { token "
         "fieldName = \"density\"\nasset filePath = @\n}\n}",
         true},
    };
}

/// What is said of the fixtures, each on lines of its own.
class Said {
  public:
    explicit Said(const CommandResult& r) : output_(r.output) {}

    /// Lines of errors at lines [first, end) of a file.
    std::string of(const std::string& file, size_t first, size_t end) const {
        std::string found;
        for (size_t line = first; line < end; ++line) {
            const std::string place = fmt::format("{}:{}:", file, line);
            for (size_t at = output_.find(place); at != std::string::npos;
                 at = output_.find(place, at + 1)) {
                const std::string text = output_.substr(at, output_.find('\n', at) - at);
                if (text.find(": error: ") != std::string::npos) found += text + "\n";
            }
        }
        return found;
    }

  private:
    std::string output_;
};

/// Text with fixtures, and on which lines each of them stands.
struct Sheet {
    std::string text;
    std::vector<size_t> first_lines;

    void add(const std::string& fixture) {
        first_lines.push_back(line());
        text += fixture + "\n";
    }

    size_t line() const { return size_t(std::count(text.begin(), text.end(), '\n')) + 1; }
};

constexpr const char* quick = " -v --res 8 8 --spp 1 --progress none --threads 1";

size_t fixtures_seen = 0;

void check(const std::vector<Spelling>& spellings,
           const Sheet& sheet,
           const std::string& file,
           const CommandResult& confined,
           const CommandResult& free) {
    ASSERT_EQ(sheet.first_lines.size(), spellings.size());
    const Said said(confined), said_free(free);
    for (size_t i = 0; i < spellings.size(); ++i) {
        const Spelling& s = spellings[i];
        const size_t first = sheet.first_lines[i],
                     end = i + 1 < spellings.size() ? sheet.first_lines[i + 1] : sheet.line();
        const std::string text = said.of(file, first, end),
                          text_free = said_free.of(file, first, end);
        if (s.rejection.empty()) {
            EXPECT_EQ(text.find(outside), std::string::npos)
                << s.name << " is the scene's own: " << text;
            EXPECT_EQ(text, text_free) << s.name;
            continue;
        }
        ++fixtures_seen;
        if (s.is_said_before && text.empty()) continue;
        EXPECT_NE(text.find(s.rejection), std::string::npos)
            << s.name << ": expected \"" << s.rejection << "\" in: " << text;
        if (s.is_refused_always) {
            EXPECT_NE(text_free.find(s.rejection), std::string::npos)
                << s.name << " without --confine: " << text_free;
        } else {
            EXPECT_EQ(text_free.find(outside), std::string::npos)
                << s.name << " without --confine: " << text_free;
        }
    }
}

}  // namespace

TEST(PathEscape, PrimsNameFilesOfTheirOwnAlone) {
    for (const Kind& kind : kinds()) {
        SCOPED_TRACE(kind.name);
        const Places places(kind.file, kind.content, kind.content);
        std::vector<Spelling> spellings = places.spellings();
        for (Spelling& s : spellings)
            s.is_said_before = kind.reads_files_once && s.rejection == outside &&
                               s.name.find("../out/" + kind.file) != std::string::npos;
        Sheet sheet{
            "#usda 1.0\ndef Sphere \"Shown\" {}\ndef DistantLight \"Sun\" {}\ndef \"W\" {\n", {}};
        for (size_t i = 0; i < spellings.size(); ++i)
            sheet.add(replaced(replaced(kind.prim, '#', std::to_string(i)), '@',
                               "@@@" + spellings[i].name + "@@@"));
        places.w.write("in/scene.usda", sheet.text + "}\n");
        const CommandResult confined =
            places.w.velatura(std::string("render in/scene.usda --confine -o x.exr") + quick);
        const CommandResult free =
            places.w.velatura(std::string("render in/scene.usda -o y.exr") + quick);
        EXPECT_EQ(confined.exit_code, 1) << confined.output;
        EXPECT_EQ(free.exit_code, 1) << free.output;
        EXPECT_TRUE(places.w.exists("x.exr"));
        check(spellings, sheet, "scene.usda", confined, free);
    }
    EXPECT_GE(fixtures_seen, 200u);
}

TEST(PathEscape, SublayersAreOfTheSceneAlone) {
    const Places places("l.usda", layer_text, layer_text);
    const std::vector<Spelling> spellings = places.spellings();
    std::string names;
    for (const Spelling& s : spellings) names += "@@@" + s.name + "@@@,\n";
    places.w.write("in/scene.usda",
                   "#usda 1.0\n(\nsubLayers = [\n" + names + "]\n)\ndef DistantLight \"Sun\" {}\n");
    const CommandResult confined =
        places.w.velatura(std::string("render in/scene.usda --confine -o x.exr") + quick);
    const CommandResult free =
        places.w.velatura(std::string("render in/scene.usda -o y.exr") + quick);
    EXPECT_EQ(confined.exit_code, 1) << confined.output;
    EXPECT_TRUE(places.w.exists("x.exr"));
    // All sublayers stand at the place of the list
    const auto said_of = [](const CommandResult& r, const Spelling& s) {
        const size_t at =
            r.output.find("scene.usda:3:1: error: cannot open sublayer @" + s.name + "@: ");
        return at == std::string::npos ? "" : r.output.substr(at, r.output.find('\n', at) - at);
    };
    for (const Spelling& s : spellings) {
        const std::string text = said_of(confined, s), text_free = said_of(free, s);
        EXPECT_EQ(text.empty(), s.rejection.empty()) << s.name << ": " << text;
        EXPECT_NE(text.find(s.rejection), std::string::npos) << s.name << ": " << text;
        EXPECT_EQ(text_free.find(s.is_refused_always ? s.rejection : std::string(outside)) !=
                      std::string::npos,
                  s.is_refused_always)
            << s.name << ": " << text_free;
    }
}

TEST(PathEscape, MaterialXIncludesAreOfTheSceneAlone) {
    const std::string document =
        "<?xml version=\"1.0\"?>\n<materialx version=\"1.38\" "
        "xmlns:xi=\"http://www.w3.org/2001/XInclude\">\n";
    const Places places("i.mtlx", document + "</materialx>\n", document + "</materialx>\n");
    std::vector<Spelling> spellings = places.spellings();
    // Includes know no packages
    std::erase_if(spellings,
                  [](const Spelling& s) { return s.name.find("usdz") != std::string::npos; });
    std::string scene = "#usda 1.0\ndef Sphere \"S\" {}\n";
    for (size_t i = 0; i < spellings.size(); ++i) {
        places.w.write(
            fmt::format("in/doc{}.mtlx", i),
            document + "<xi:include href=\"" + spellings[i].name + "\"/>\n</materialx>\n");
        scene += fmt::format("def \"M{0}\" (references = @./doc{0}.mtlx@) {{}}\n", i);
    }
    places.w.write("in/scene.usda", scene);
    const CommandResult confined =
        places.w.velatura(std::string("render in/scene.usda --confine -o x.exr") + quick);
    const CommandResult free =
        places.w.velatura(std::string("render in/scene.usda -o y.exr") + quick);
    EXPECT_EQ(confined.exit_code, 1) << confined.output;
    EXPECT_TRUE(places.w.exists("x.exr"));
    for (size_t i = 0; i < spellings.size(); ++i)
        check({spellings[i]}, {"\n\n\n", {3}}, fmt::format("doc{}.mtlx", i), confined, free);
}

/// What a package holds names what it holds, and by search what lies beside it, with the option or
/// without.
TEST(PathEscape, PackagesAreClosed) {
    const Places places("t.hdr", image, image);
    const std::vector<std::string> names = {"./t.hdr",           "t.hdr",
                                            "../out/t.hdr",      "./../../out/t.hdr",
                                            "a/../../out/t.hdr", places.w.path("out/t.hdr"),
                                            "../in/t.hdr",       places.w.path("in/t.hdr")};
    Sheet sheet{"#usda 1.0\n", {}};
    for (size_t i = 0; i < names.size(); ++i)
        sheet.add(fmt::format("def DomeLight \"D{}\" {{ asset inputs:texture:file = @{}@\n}}", i,
                              names[i]));
    places.w.write("in/scene.usdz",
                   testing::stored_zip({{"root.usda", sheet.text}, {"t.hdr", image}}));
    for (const char* option : {"", " --confine"}) {
        const CommandResult r =
            places.w.velatura(std::string("render in/scene.usdz -o x.exr") + option + quick);
        EXPECT_EQ(r.exit_code, 1) << r.output;
        const Said said(r);
        for (size_t i = 0; i < names.size(); ++i) {
            const std::string text =
                said.of("scene.usdz[root.usda]", sheet.first_lines[i], sheet.first_lines[i] + 2);
            if (i < 2) {
                EXPECT_EQ(text, "") << names[i];
            } else {
                EXPECT_NE(text.find("leaves the package"), std::string::npos)
                    << names[i] << ": " << r.output;
            }
        }
    }
}

/// Assimp looks for a file in its own ways, so it is asked whether the color of another's file
/// arrives.
TEST(PathEscape, ModelsNameFilesOfTheirOwnAlone) {
    const Places places("m.mtl", "newmtl a\nKd 0.125 0.125 0.125\n",
                        "newmtl a\nKd 0.875 0.875 0.875\n");
    size_t read_when_free = 0;
    for (const Spelling& s : places.spellings()) {
        // Longer than what Assimp reads of a line
        if (s.name.size() > 1000) continue;
        places.w.write("in/model.obj",
                       "mtllib " + s.name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
        const auto colors_with = [&](const std::string& option) {
            const CommandResult r =
                places.w.velatura("import in/model.obj -o in/model.usda" + option);
            EXPECT_EQ(r.exit_code, 0) << s.name << ": " << r.output;
            return places.w.velatura("flatten in/model.usda").output;
        };
        const std::string colors = colors_with(" --confine");
        EXPECT_EQ(colors.find("0.875"), std::string::npos) << s.name;
        EXPECT_TRUE(!s.rejection.empty() || !s.name.starts_with("./") ||
                    colors.find("0.125") != std::string::npos)
            << s.name << ": " << colors;
        if (!s.rejection.empty()) ++fixtures_seen;
        if (s.rejection == outside && colors_with("").find("0.875") != std::string::npos)
            ++read_when_free;
    }
    EXPECT_GE(read_when_free, 5u);
    for (const char* uri : {"../out/m.mtl", "%2e%2e/out/m.mtl", "folder/m.mtl", "pipe_m.mtl"}) {
        places.w.write("in/g.gltf",
                       fmt::format(
                           R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
                    "nodes":[{{"mesh":0}}],
                        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],
    "max":[1,1,0]}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,
        "uri":"{}"}}]}})",
                           uri));
        const CommandResult r = places.w.velatura("import in/g.gltf --confine -o in/g.usda");
        EXPECT_EQ(r.exit_code, 1) << uri << ": " << r.output;
        EXPECT_NE(r.output.find(uri[0] == 'p' ? "is a pipe" : outside), std::string::npos)
            << uri << ": " << r.output;
    }
}

TEST(PathEscape, RootsOpenMoreFoldersByOptionAndByEnvironment) {
    const Places places("l.usda", layer_text, layer_text);
    places.w.write("in/scene.usda", "#usda 1.0\ndef \"R\" (references = @../out/l.usda@) {}\n");
    const auto is_refused = [&](const std::string& options) {
        const CommandResult r = places.w.velatura("info in/scene.usda " + options);
        const bool says_so = r.output.find(outside) != std::string::npos;
        EXPECT_EQ(r.exit_code, says_so ? 1 : 0) << r.output;
        return says_so;
    };
    EXPECT_FALSE(is_refused(""));
    EXPECT_TRUE(is_refused("--confine"));
    EXPECT_TRUE(is_refused("--asset-root cwd"));
    EXPECT_FALSE(is_refused("--asset-root cwd --asset-root out --confine"));
    ::setenv("VELATURA_ASSET_ROOTS", places.w.path("cwd").c_str(), 1);
    EXPECT_TRUE(is_refused(""));
    ::setenv("VELATURA_ASSET_ROOTS", (places.w.path("cwd") + ":" + places.w.path("out")).c_str(),
             1);
    EXPECT_FALSE(is_refused("--confine"));
    ::unsetenv("VELATURA_ASSET_ROOTS");
    EXPECT_EQ(places.w.velatura("info in/scene.usda --asset-root nowhere").exit_code, 2);
}

TEST(PathEscape, AllCommandsThatOpenScenesAreConfined) {
    const Places places("l.usda", layer_text, layer_text);
    places.w.write("in/scene.usda",
                   "#usda 1.0\ndef \"R\" (references = @../out/l.usda@) {}\ndef Sphere \"S\" {}\n");
    fs::create_symlink("../in/scene.usda", places.w.path("cwd/scene.usda"));
    for (const std::string& command :
         {std::string("info"), std::string("info --dump"), std::string("flatten"),
          std::string("plan --res 8 8"), std::string("render -o x.exr") + quick,
          std::string("study -o s --time 1s --res 8 8")}) {
        EXPECT_NE(places.w.velatura(command + " --confine in/scene.usda").output.find(outside),
                  std::string::npos)
            << command;
    }
    // A link to a scene stands for it
    const CommandResult r =
        places.w.velatura(std::string("render --confine cwd/scene.usda -o y.exr") + quick);
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_TRUE(places.w.exists("y.exr"));
}

TEST(PathEscape, AConfinedSceneDoesNotChooseWhereItIsWritten) {
    const Places places("l.usda", layer_text, layer_text);
    places.w.write(
        "in/scene.usda",
        "#usda 1.0\n(renderSettingsPrimPath = \"/Render/S\")\ndef Sphere \"B\" {}\ndef Scope "
        "\"Render\" { def RenderSettings \"S\" { rel products = </Render/P>\n}\ndef "
        "RenderProduct \"P\" { token productName = \"out/x.exr\"\n}\n}\n");
    const CommandResult r =
        places.w.velatura(std::string("render --confine in/scene.usda") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_FALSE(places.w.exists("out/x.exr"));
    EXPECT_TRUE(places.w.exists("x.exr")) << r.output;
}

}  // namespace velatura::test
