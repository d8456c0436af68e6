// SPDX-License-Identifier: Apache-2.0
// Tests of the tests: every rule must catch a planted violation and must let its clean twin pass.
#include "meta/rules.h"

#include "meta/classes.h"

#include <gtest/gtest.h>

namespace velatura::meta {

namespace {

using Violations = std::vector<std::string>;

const std::string spdx = "SPDX-License-Identifier: Apache-2.0\n";

TEST(Rules, TierIsTheLongestFolderOfTheTable) {
    EXPECT_EQ(tier_of("src/usd/text/lexer.h"), "usd/text");
    EXPECT_EQ(tier_of("src/usd/text/detail/lexer.h"), "usd/text");
    EXPECT_EQ(tier_of("src/usd/text/generated/words_tables.cpp"), "usd/text");
    EXPECT_EQ(tier_of("src/base/math.h"), "base");
    EXPECT_EQ(tier_of("src/base/process/memory_limit.h"), "base/process");
    EXPECT_EQ(tier_of("compositor/mix/mix.h"), "compositor/mix");
    EXPECT_EQ(tier_of("compositor/window/session.h"), "compositor/window");
    EXPECT_EQ(tier_of("src/nowhere/a.h"), "");
    EXPECT_EQ(tier_of("tests/base/a.cpp"), "");
}

TEST(Rules, TierIncludes) {
    EXPECT_EQ(
        check_tier_includes(make_file("src/accel/bvh.h", "#include \"film/film.h\"\n")).size(), 1u);
    EXPECT_EQ(
        check_tier_includes(make_file("src/scene/a.cpp", "\n#include \"usd/stage/prim.h\"\n")),
        (Violations{"src/scene/a.cpp:2: scene must not include usd/stage (\"usd/stage/prim.h\")"}));
    EXPECT_EQ(check_tier_includes(make_file("compositor/mix/mix.cpp", "#include \"film/film.h\"\n"))
                  .size(),
              1u);
    for (const char* above : {"window/session.h", "bake/bake.h", "cli/commands.h"})
        EXPECT_EQ(
            check_tier_includes(make_file("compositor/mix/mix.cpp",
                                          std::string("#include \"compositor/") + above + "\"\n"))
                .size(),
            1u);
    EXPECT_EQ(check_tier_includes(make_file("src/usd/text/a.h", "#include \"usd/stage/prim.h\"\n"))
                  .size(),
              1u);
    EXPECT_EQ(check_tier_includes(make_file("src/base/a.h", "#include \"scene/scene.h\"\n")).size(),
              1u);
    EXPECT_EQ(
        check_tier_includes(make_file("src/base/a.h", "#include \"../scene/scene.h\"\n")).size(),
        1u);
    EXPECT_EQ(check_tier_includes(make_file("src/newroom/a.h", "\n")).size(), 1u);
    const std::string process = "#include \"base/process/memory_limit.h\"\n";
    EXPECT_EQ(check_tier_includes(make_file("src/base/process/a.h", "#include \"base/math.h\"\n")),
              (Violations{
                  "src/base/process/a.h:1: base/process must not include base (\"base/math.h\")"}));
    EXPECT_EQ(check_tier_includes(make_file("src/film/a.h", process)).size(), 1u);
    EXPECT_TRUE(check_tier_includes(make_file("src/base/a.h", process)).empty());
    EXPECT_TRUE(check_tier_includes(make_file("src/base/process/a.cpp", process)).empty());
    EXPECT_TRUE(check_tier_includes(
                    make_file("src/accel/bvh.h",
                              "#include \"base/math.h\"\n#include \"accel/node.h\"\n#include "
                              "\"geometry/point.h\"\n#include <vector>\n"))
                    .empty());
    EXPECT_TRUE(check_tier_includes(
                    make_file("compositor/bake/a.cpp",
                              "#include \"compositor/mix/mix.h\"\n#include \"image/exr.h\"\n"))
                    .empty());
}

TEST(Rules, OneRenderer) {
    const std::string world = "    const integrator::World world(scene, options);\n",
                      trial = "    x = integrator::try_splitting(world, options, window);\n";
    EXPECT_EQ(check_one_renderer(make_file("src/app/a.cpp", world + trial)).size(), 2u);
    EXPECT_EQ(check_one_renderer(make_file("examples/a.cpp", trial)).size(), 1u);
    EXPECT_TRUE(check_one_renderer(make_file("src/render/a.cpp", world + trial)).empty());
    EXPECT_TRUE(check_one_renderer(make_file("tests/a.cpp", world)).empty());
    EXPECT_TRUE(
        check_one_renderer(make_file("src/app/a.cpp", "void f(const integrator::World& world);\n"))
            .empty());
}

TEST(Rules, PrivateMethods) {
    const std::string head = "template <class T>\nclass Big final : public Base {\n";
    const auto sizes = [&](const std::string& body) {
        return classes_of(make_file("src/film/a.h", head + body + "};\n"));
    };
    // Methods: declared, defined, templates, operators, constructors with initializers
    const std::vector<ClassSize> all = sizes(
        "    void a();\n    int b() const { return c(1); }\n  public:\n    void open();\n"
        "  private:\n    template <class U>\n    std::pair<U, int> c(std::function<void(U)> f = "
        "{});\n"
        "    Big(int x) : x_(x), y_{x} { call(x); }\n    bool operator<(const Big&) const = "
        "default;\n"
        "    [[nodiscard]] Big& operator=(const Big&) = delete;\n");
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].name, "Big");
    EXPECT_EQ(all[0].line, 2u);
    EXPECT_EQ(all[0].private_methods, 6u);
    // Not methods
    const std::vector<ClassSize> none = sizes(
        "    std::function<void(int)> f_;\n    int x_ = max(1, 2), y_{max(1, 2)};\n"
        "    // void comment();\n    static_assert(sizeof(int) == 4);\n"
        "    friend void swap(Big&, Big&);\n    using F = void (*)(int);\n    void (*p_)(int);\n"
        "    const char* text_ = \"void f();\";\n    std::function<int()> g_ = [] { return f(); "
        "};\n"
        "    struct Part {\n        void shown();\n      private:\n        void hidden();\n    };\n"
        "    class Later;\n    enum class E { A, B };\n    alignas(8) int z_ = 1'000;\n");
    ASSERT_EQ(none.size(), 2u);
    EXPECT_EQ(none[0].name, "Part");
    EXPECT_EQ(none[0].private_methods, 1u);
    EXPECT_EQ(none[1].private_methods, 0u);

    std::string methods;
    for (int i = 0; i < 25; ++i) methods += "    void f" + std::to_string(i) + "();\n";
    EXPECT_TRUE(check_private_methods(make_file("src/film/a.h", head + methods + "};\n")).empty());
    methods += "    void one_more();\n";
    EXPECT_EQ(check_private_methods(make_file("src/film/a.h", head + methods + "};\n")),
              (Violations{"src/film/a.h:2: Big has 26 private methods, more than 25"}));
    EXPECT_TRUE(check_private_methods(make_file("tests/a.h", head + methods + "};\n")).empty());
}

TEST(Rules, NamedSources) {
    const std::vector<SourceFile> tree = {
        make_file("src/film/film.h", "struct Film;\nvoid add();\n"),
        make_file("src/film/film.cpp", "void Film::add() {}\n")};
    const auto violations = [&](const std::string& path, const std::string& text) {
        return check_named_sources(make_file(path, text + "\n"), tree);
    };
    const std::string page = "docs/engineering/architecture.md";
    EXPECT_TRUE(
        violations(page, "`src/film/film.h` (`Film`, sums; `Film::add()`), `film.cpp`").empty());
    EXPECT_TRUE(violations("src/film/README.md", "`film.h`: sums; `film/film.cpp`").empty());
    EXPECT_TRUE(violations("docs/reference/a.md", "`none.h`").empty());
    EXPECT_EQ(violations(page, "`film.cpp`"),
              (Violations{"docs/engineering/architecture.md:1: there is no film.cpp"}));
    EXPECT_EQ(violations(page, "`src/film/film.h` (`Film::take`)"),
              (Violations{"docs/engineering/architecture.md:1: src/film/film.h does not name "
                          "Film::take"}));
    EXPECT_EQ(violations("src/film/README.md", "`film.h`, `sums.h`").size(), 1u);
}

TEST(Rules, StandardIncludesOfHeaders) {
    const auto violations = [](const std::string& path, const std::string& text) {
        return check_standard_includes(make_file(path, text));
    };
    EXPECT_EQ(violations("src/a/b.h", "#include <string>\nstd::vector<std::string> x;\n"),
              (Violations{"src/a/b.h:2: std::vector needs #include <vector>"}));
    EXPECT_EQ(violations("src/a/b.h", "void f(uint64_t);\n").size(), 1u);
    EXPECT_TRUE(violations("src/a/b.h", "#include <string>\nvoid f(std::string_view);\n").empty());
    EXPECT_TRUE(violations("src/a/b.h", "// std::vector\n").empty());
    EXPECT_TRUE(violations("src/a/b.cpp", "std::vector<int> x;\n").empty());
}

TEST(Rules, LineLength) {
    const std::string just(100, 'x');
    EXPECT_TRUE(check_line_length(make_file("src/a/b.h", just + "\n")).empty());
    EXPECT_EQ(check_line_length(make_file("src/a/b.h", "\n" + just + "x\n")),
              (Violations{"src/a/b.h:2: more than 100 columns"}));
    std::string wide;
    for (int i = 0; i < 100; ++i) wide += "\u00d7";
    EXPECT_TRUE(check_line_length(make_file("src/a/b.h", wide + "\n")).empty());
}

TEST(Rules, Libraries) {
    EXPECT_EQ(
        check_libraries(make_file("src/film/a.cpp", "#include <OpenEXR/ImfHeader.h>\n")).size(),
        1u);
    EXPECT_EQ(
        check_libraries(make_file("src/shading/bsdf.cpp", "#include <OpenImageIO/texture.h>\n"))
            .size(),
        1u);
    EXPECT_EQ(
        check_libraries(make_file("src/accel/a.cpp", "#include <oneapi/tbb/parallel_for.h>\n"))
            .size(),
        1u);
    EXPECT_EQ(check_libraries(make_file("src/image/a.cpp", "#include <CLI/CLI.hpp>\n")).size(), 1u);
    EXPECT_EQ(check_libraries(make_file("compositor/mix/mix.cpp", "#include <imgui.h>\n")).size(),
              1u);
    EXPECT_EQ(check_libraries(make_file("src/accel/a.cpp", "#include <embree3/rtcore.h>\n")).size(),
              1u);
    EXPECT_EQ(check_libraries(make_file("src/base/a.cpp", "#include <boost/any.hpp>\n")).size(),
              1u);
    EXPECT_EQ(
        check_libraries(make_file("src/image/formats.cpp", "#include <OpenImageIO/imageio.h>\n"))
            .size(),
        1u);
    EXPECT_TRUE(check_libraries(make_file("plugins/openimageio/textures.cpp",
                                          "#include <OpenImageIO/texture.h>\n"))
                    .empty());
    EXPECT_TRUE(check_libraries(make_file("src/image/a.cpp",
                                          "#include <OpenEXR/ImfHeader.h>\n#include <sys/stat.h>\n"
                                          "#include <vector>\n#include <Imath/half.h>\n"))
                    .empty());
}

TEST(Rules, FileSize) {
    const auto lines = [](size_t n) { return std::string(n, '\n'); };
    EXPECT_EQ(check_file_size(make_file("src/base/a.cpp", lines(801))).size(), 1u);
    EXPECT_EQ(check_file_size(make_file("src/base/a.h", lines(401))).size(), 1u);
    EXPECT_TRUE(check_file_size(make_file("src/base/a.cpp", lines(800))).empty());
    EXPECT_TRUE(check_file_size(make_file("src/base/a.h", lines(400))).empty());
    EXPECT_TRUE(
        check_file_size(make_file("src/base/generated/sobol_tables.cpp", lines(5000))).empty());
}

TEST(Rules, Spdx) {
    EXPECT_EQ(check_spdx(make_file("src/base/a.h", "#pragma once\n// " + spdx)).size(), 1u);
    EXPECT_EQ(check_spdx(make_file("src/base/a.h", "")).size(), 1u);
    EXPECT_EQ(check_spdx(make_file("scenes/x/make.py", "#!/usr/bin/env python3\n")).size(), 1u);
    EXPECT_EQ(check_spdx(make_file("src/CMakeLists.txt", "// " + spdx)).size(), 1u);
    EXPECT_TRUE(check_spdx(make_file("src/base/a.h", "// " + spdx)).empty());
    EXPECT_TRUE(
        check_spdx(make_file("scenes/x/make.py", "#!/usr/bin/env python3\n# " + spdx)).empty());
    EXPECT_TRUE(check_spdx(make_file("README.md", "# Velatura\n")).empty());
}

TEST(Rules, Namespace) {
    EXPECT_EQ(check_namespace(make_file("src/film/a.h", "namespace velatura::scene {\n")).size(),
              1u);
    EXPECT_EQ(
        check_namespace(
            make_file("src/film/a.h", "namespace velatura::accel {\nnamespace velatura::film {\n"))
            .size(),
        1u);
    EXPECT_EQ(check_namespace(make_file("src/usd/text/a.h", "namespace velatura::usd {\n")).size(),
              2u);
    EXPECT_EQ(check_namespace(make_file("src/base/a.h", "namespace velatura::base {\n")).size(),
              2u);
    EXPECT_TRUE(check_namespace(make_file("src/usd/text/a.h", "namespace velatura::usd::text {\n"))
                    .empty());
    EXPECT_TRUE(check_namespace(make_file("src/base/a.h", "namespace velatura {\n")).empty());
    const std::string process = "namespace velatura {\ninline namespace process {\n";
    EXPECT_TRUE(check_namespace(make_file("src/base/process/a.h", process)).empty());
    EXPECT_FALSE(
        check_namespace(make_file("src/base/process/a.h", "namespace velatura {\n")).empty());
    const std::string room = "namespace velatura::translate {\ninline namespace context {\n";
    EXPECT_TRUE(check_namespace(make_file("src/translate/context/a.h", room)).empty());
    EXPECT_FALSE(
        check_namespace(make_file("src/translate/color/a.h", "namespace velatura::translate {\n"))
            .empty());
    EXPECT_TRUE(
        check_namespace(
            make_file("src/film/a.h", "namespace velatura::scene {\nnamespace velatura::film {\n"))
            .empty());
    EXPECT_TRUE(check_namespace(make_file("src/app/main.cpp", "int main() {}\n")).empty());
}

TEST(Rules, PragmaOnce) {
    EXPECT_EQ(check_pragma_once(make_file("src/base/a.h", "#ifndef A\n")).size(), 1u);
    EXPECT_TRUE(check_pragma_once(make_file("src/base/a.h", "#pragma once\n")).empty());
}

TEST(Rules, OwnHeaderFirst) {
    const std::vector<SourceFile> tree = {make_file("src/base/a.h", ""),
                                          make_file("compositor/b.h", "")};
    EXPECT_EQ(check_own_header_first(
                  make_file("src/base/a.cpp", "#include <vector>\n#include \"base/a.h\"\n"), tree)
                  .size(),
              1u);
    EXPECT_EQ(check_own_header_first(make_file("src/base/a.cpp", "\n"), tree).size(), 1u);
    EXPECT_TRUE(check_own_header_first(
                    make_file("src/base/a.cpp", "#include \"base/a.h\"\n#include <vector>\n"), tree)
                    .empty());
    EXPECT_TRUE(
        check_own_header_first(make_file("compositor/b.cpp", "#include \"compositor/b.h\"\n"), tree)
            .empty());
    EXPECT_TRUE(
        check_own_header_first(make_file("src/base/c.cpp", "#include <vector>\n"), tree).empty());
}

TEST(Rules, MachinePaths) {
    const std::string home = "/home";
    const std::string work = "/work";
    EXPECT_EQ(check_machine_paths(make_file("docs/a.md", "see " + home + "/ann/x\n")).size(), 1u);
    EXPECT_EQ(
        check_machine_paths(make_file("src/base/a.cpp", "open(\"" + work + "/main/x\");\n")).size(),
        1u);
    EXPECT_TRUE(
        check_machine_paths(make_file("docs/a.md", "a prim </World" + home +
                                                       "/door>, ../shared/assets, /usr/share\n"))
            .empty());
}

TEST(Rules, BannedWords) {
    const auto caught = [](const char* line) {
        return check_banned_words(make_file("src/base/a.cpp", line)).size();
    };
    EXPECT_EQ(caught("// TODO later\n"), 1u);
    EXPECT_EQ(caught("#if 0\n"), 1u);
    EXPECT_EQ(caught("auto s = std::format(\"{}\", 1);\n"), 1u);
    EXPECT_EQ(caught("std::views::iota(0)\n"), 1u);
    EXPECT_EQ(caught("TEST(A, DISABLED_B) {}\n"), 1u);
    EXPECT_EQ(caught("fmt::format(\"{}\", 1); // previews, methods to do\n"), 0u);
}

TEST(Rules, PlainWords) {
    const auto caught = [](const char* path, const char* text) {
        return check_plain_words(make_file(path, text)).size();
    };
    EXPECT_EQ(caught("src/app/a.cpp", "warn(\"the light is left out\");\n"), 1u);
    // Parts of one string, and where it starts
    EXPECT_EQ(check_plain_words(make_file("src/app/a.cpp",
                                          "int i;\nwarn(\"the light is left \"\n     \"out\");\n"))
                  .at(0)
                  .find("src/app/a.cpp:2: "),
              0u);
    EXPECT_EQ(caught("compositor/a.cpp", "f(\"COLOUR of the Pictures\");\n"), 2u);
    EXPECT_EQ(caught("src/app/a.cpp", "f(\"it is no number\");\n"), 1u);
    EXPECT_EQ(caught("src/app/a.cpp", "f(R\"(asks for it)\");\n"), 1u);
    EXPECT_EQ(caught("README.md", "The body may go on.\n"), 3u);
    EXPECT_EQ(caught("docs/guide/a.md", "It knows\n"), 1u);
    EXPECT_EQ(caught("docs/engineering/a.md", "A warning says so.\n"), 1u);
    EXPECT_EQ(caught("docs/adr/0001-a.md", "A warning says so.\n"), 1u);
    EXPECT_EQ(caught("docs/engineering/hard_cases.md", "A warning says so.\n"), 0u);
    EXPECT_EQ(caught("docs/engineering/a.md", "It includes what it may include.\n"), 0u);

    EXPECT_EQ(caught("src/app/a.cpp", "f(\"there is no number\"); // no picture, left out\n"), 0u);
    EXPECT_EQ(caught("src/app/a.cpp", "f(\"nested-bodies\", '\"', \"a black body\");\n"), 0u);
    EXPECT_EQ(caught("src/app/a.cpp", "#include \"image/a picture.h\"\n/* \"may it\" */\n"), 0u);
    EXPECT_EQ(caught("src/app/a.cpp", "f(R\"css(body { color: grey })css\", \"<body> x\");\n"), 0u);
    EXPECT_EQ(caught("tests/app/a.cpp", "f(\"it may be\");\n"), 0u);
    EXPECT_EQ(caught("docs/guide/a.md", "`a picture`\n```\nmay go on\n```\n[x](may_go_on.md)\n"),
              0u);
}

TEST(Rules, Silence) {
    EXPECT_EQ(check_silence(make_file("src/film/a.cpp", "std::cerr << 1;\n")).size(), 1u);
    EXPECT_EQ(check_silence(make_file("src/film/a.cpp", "std::fprintf(stderr, \"x\");\n")).size(),
              1u);
    EXPECT_EQ(check_silence(make_file("compositor/mix/mix.cpp", "fmt::print(\"x\");\n")).size(),
              1u);
    EXPECT_TRUE(
        check_silence(make_file("src/film/a.cpp", "std::snprintf(b, 3, \"x\");\n")).empty());
    EXPECT_TRUE(check_silence(make_file("src/app/main.cpp", "fmt::print(\"x\");\n")).empty());
    EXPECT_TRUE(
        check_silence(make_file("compositor/cli/main.cpp", "fmt::print(\"x\");\n")).empty());
}

TEST(Rules, TestIsReal) {
    const auto caught = [](const char* line) {
        return check_test_is_real(make_file("tests/base/a.cpp", line)).size();
    };
    EXPECT_EQ(caught("EXPECT_TRUE(true);\n"), 1u);
    EXPECT_EQ(caught("EXPECT_EQ(a, a);\n"), 1u);
    EXPECT_EQ(caught("SUCCEED();\n"), 1u);
    EXPECT_EQ(caught("EXPECT_EQ(a, b);\n"), 0u);
}

TEST(Rules, TestAssets) {
    const std::string line = "getenv(\"VELATURA_TEST_ASSETS\");\n";
    EXPECT_EQ(check_test_assets(make_file("tests/film/a.cpp", line)).size(), 1u);
    EXPECT_EQ(check_test_assets(make_file("tests/film/a.cpp", "\"../shared/assets\"\n")).size(),
              1u);
    EXPECT_TRUE(check_test_assets(make_file("tests/base/test_assets.h", line)).empty());
    EXPECT_TRUE(
        check_test_assets(make_file("tests/film/a.cpp", "test_assets() / \"hdri\"\n")).empty());
}

TEST(Rules, WorstOfNumbers) {
    const std::string line = "worst_loss = std::max(worst_loss, error);\n",
                      header = "#include \"hard_case.h\"\n";
    EXPECT_EQ(check_worst_of_numbers(make_file("tests/film/a.cpp", header + line)).size(), 1u);
    EXPECT_TRUE(check_worst_of_numbers(make_file("tests/film/a.cpp", line)).empty());
    EXPECT_TRUE(
        check_worst_of_numbers(
            make_file("tests/film/a.cpp", header + "worst = hardcase::larger(worst, error);\n"))
            .empty());
}

TEST(Rules, Pages) {
    const std::vector<SourceFile> tree = {
        make_file("docs/light.md", ""),          make_file("docs/adr/0001-light.md", ""),
        make_file("docs/reference/lamp.md", ""), make_file("docs/a/b/deep.md", ""),
        make_file("src/film/README.md", ""),     make_file("README.md", "")};
    const auto caught = [&](const char* path, const char* text) {
        return check_pages(make_file(path, text), tree);
    };
    EXPECT_EQ(caught("src/film/a.h", "\n/// Format: SHADE.md, section 5.\n"),
              (Violations{"src/film/a.h:2: there is no page SHADE.md"}));
    EXPECT_EQ(caught("docs/light.md", "[a](shade.md), [b](adr/0002-shade.md)\n").size(), 2u);
    EXPECT_EQ(caught("docs/adr/0001-light.md", "[a](light.md#top), [b](../light.md)\n").size(), 1u);
    EXPECT_EQ(caught("src/film/README.md", "[a](../light.md)\n").size(), 1u);
    EXPECT_TRUE(caught("src/film/a.h", "// docs/light.md, light.md; adr/0001-light.md\n").empty());
    EXPECT_TRUE(caught("src/film/README.md", "[a](../../docs/light.md#top), light.md\n").empty());
    EXPECT_TRUE(caught("tests/a.cpp", "open(root + \"/docs/light.md\");\n").empty());
    // By its name alone, in a part of docs/; a link says where
    EXPECT_TRUE(caught("src/film/a.h", "// lamp.md\n").empty());
    EXPECT_EQ(caught("src/film/a.h", "// deep.md\n").size(), 1u);
    EXPECT_EQ(caught("docs/light.md", "[lamp.md](lamp.md)\n").size(), 1u);
    EXPECT_TRUE(caught("docs/light.md", "https://example.org/shade.md\n").empty());
}

TEST(Rules, TierReadmes) {
    const SourceFile cmake = make_file("src/film/CMakeLists.txt", "");
    EXPECT_EQ(check_tier_readmes({cmake}).size(), 1u);
    EXPECT_EQ(
        check_tier_readmes({cmake, make_file("src/film/README.md", std::string(41, '\n'))}).size(),
        1u);
    EXPECT_TRUE(check_tier_readmes({cmake, make_file("src/film/README.md", std::string(40, '\n'))})
                    .empty());
}

TEST(Rules, ListedInCMake) {
    const SourceFile source = make_file("src/film/film.cpp", "");
    EXPECT_EQ(check_listed_in_cmake(
                  {source, make_file("src/film/CMakeLists.txt", "SOURCES other_film.cpp\n")})
                  .size(),
              1u);
    EXPECT_TRUE(check_listed_in_cmake(
                    {source, make_file("src/film/CMakeLists.txt", "SOURCES film.cpp other.cpp\n")})
                    .empty());
    EXPECT_TRUE(check_listed_in_cmake({make_file("src/film/a/b.cpp", ""),
                                       make_file("src/film/CMakeLists.txt", "  a/b.cpp)\n")})
                    .empty());
    EXPECT_TRUE(
        check_listed_in_cmake({make_file("src/film/generated/b_tables.cpp", ""),
                               make_file("src/film/CMakeLists.txt", " generated/b_tables.cpp\n")})
            .empty());
}

TEST(Rules, RootEntries) {
    EXPECT_EQ(check_root_entries({"src", "notes.txt"}).size(), 1u);
    EXPECT_TRUE(check_root_entries({"src", "README.md", "build", "compile_commands.json"}).empty());
    EXPECT_TRUE(
        check_root_entries({"CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "NOTICE", ".github",
                            ".clangd", ".editorconfig", ".git-blame-ignore-revs"})
            .empty());
}

}  // namespace

}  // namespace velatura::meta
