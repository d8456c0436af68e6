// SPDX-License-Identifier: Apache-2.0
#include "plugin/manifest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace velatura::plugin {
namespace {

constexpr const char* good = R"(# a comment
name: clouds
abi: 1
  provides :	volume_source
provides: field
trigger: prim_type OpenVDBAsset

trigger: option  accel=two words
summary: what it is: for people
)";

std::string errors_of(const std::string& text) {
    Diagnostics diagnostics;
    const auto manifest = parse_manifest(text, "p/plugin.txt", diagnostics);
    EXPECT_EQ(manifest.has_value(), diagnostics.error_count() == 0);
    std::string out;
    for (const Diagnostic& d : diagnostics.all()) out += diagnostics.format(d) + "\n";
    return out;
}

// `good` with one line replaced.
std::string with(const std::string& line, const std::string& replacement) {
    std::string text = good;
    const size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    return text.replace(at, line.size(), replacement);
}

TEST(Manifest, IsReadWithBlanksAndComments) {
    Diagnostics diagnostics;
    std::string windows;
    for (const char c : std::string(good)) windows += c == '\n' ? "\r\n" : std::string(1, c);
    for (const std::string& text : {std::string(good), windows}) {
        const auto m = parse_manifest(text, "some/where/plugin.txt", diagnostics);
        ASSERT_TRUE(m);
        EXPECT_EQ(m->name, "clouds");
        EXPECT_EQ(m->abi, 1u);
        EXPECT_EQ(m->library, "velatura_clouds.so");
        EXPECT_EQ(m->folder, "some/where");
        EXPECT_EQ(m->provides, (std::vector<std::string>{"volume_source", "field"}));
        EXPECT_TRUE(m->has_trigger({"prim_type", "OpenVDBAsset"}));
        EXPECT_TRUE(m->has_trigger({"option", "accel=two words"}));
        EXPECT_FALSE(m->has_trigger({"option", "accel"}));
        EXPECT_TRUE(m->has_interface("field"));
        EXPECT_FALSE(m->has_interface("fields"));
        EXPECT_EQ(m->summary, "what it is: for people");
        EXPECT_EQ(m->loc, (SourceLoc{diagnostics.file_id("some/where/plugin.txt"), 2, 7}));
        EXPECT_EQ(m->abi_loc.line, 3u);
    }
    EXPECT_TRUE(diagnostics.all().empty());
}

TEST(Manifest, ErrorsNameLineAndColumn) {
    const struct {
        const char *line, *replacement, *expected;
    } cases[] = {
        {"abi: 1", "abi: one",
         "p/plugin.txt:3:6: error: expected a number from 1 to 4294967295, found \"one\""},
        {"abi: 1", "abi: 0", "p/plugin.txt:3:6: error: expected a number"},
        {"abi: 1", "abi: 1x", "p/plugin.txt:3:6: error: expected a number"},
        {"abi: 1", "abi: 99999999999", "p/plugin.txt:3:6: error: expected a number"},
        {"abi: 1", "abi:", "p/plugin.txt:3:5: error: expected a value of abi, found nothing"},
        {"abi: 1", "abi: 1\nabi: 1", "p/plugin.txt:4:1: error: expected one abi, found another"},
        {"abi: 1", "abi: 1\nmemory: much",
         "p/plugin.txt:4:9: error: expected megabytes from 1 to 100000, found"},
        {"abi: 1", "abi: 1\nmemory: 0", "p/plugin.txt:4:9: error: expected megabytes"},
        {"abi: 1", "abi: 1\nmemory: 1\nmemory: 2",
         "p/plugin.txt:5:1: error: expected one memory, found another"},
        {"abi: 1", "abi 1", "p/plugin.txt:3:1: error: expected \"key: value\", found \"abi 1\""},
        {"name: clouds", "name: ../clouds",
         "p/plugin.txt:2:7: error: expected a name of letters, digits, _ and -, found "
         "\"../clouds\""},
        {"name: clouds", "name: clouds\nlibrary: ../evil.so",
         "p/plugin.txt:3:10: error: expected a file name without folders, found \"../evil.so\""},
        {"name: clouds", "  colour: red",
         "p/plugin.txt:2:3: error: expected one of name, abi, library, provides, trigger, memory, "
         "summary, "
         "found \"colour\""},
        {"provides: field", "provides: volume_source",
         "p/plugin.txt:5:11: error: expected another interface, found \"volume_source\" again"},
        {"provides: field", "provides: two words",
         "p/plugin.txt:5:11: error: expected the name of an interface"},
        {"trigger: prim_type OpenVDBAsset", "trigger: prim_type",
         "p/plugin.txt:6:10: error: expected a kind and a value"},
        {"summary: what", "summary: \x01what",
         "p/plugin.txt:9:1: error: expected text, found control characters"},
    };

    for (const auto& c : cases) {
        const std::string errors = errors_of(with(c.line, c.replacement));
        EXPECT_TRUE(errors.starts_with(c.expected)) << c.replacement << "\n" << errors;
    }
}

TEST(Manifest, NamesWhatIsMissing) {
    for (const char* key : {"name", "abi"}) {
        const std::string line = key == std::string("name") ? "name: clouds\n" : "abi: 1\n";
        const std::string errors = errors_of(with(line, ""));
        EXPECT_NE(errors.find(std::string("expected a line \"") + key), std::string::npos)
            << errors;
    }
    EXPECT_NE(errors_of("").find("p/plugin.txt:1:1: error: expected a line \"name: "),
              std::string::npos);
    EXPECT_NE(errors_of("name: a\nabi: 1\ntrigger: a b\n").find("\"provides: "), std::string::npos);
    EXPECT_NE(errors_of("name: a\nabi: 1\nprovides: a\n").find("\"trigger: "), std::string::npos);
}

TEST(Manifest, ReportsEveryBadLineAtOnce) {
    const std::string errors = errors_of("name: a b\nabi: x\ncolour: red\n");
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 3) << errors;
}

}  // namespace
}  // namespace velatura::plugin
