// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "image/formats.h"
#include "study/compare.h"
#include "study/fake_render.h"
#include "study/png.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wfloat-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace velatura::test {

using namespace velatura::study;

namespace {

Report some_report(double way_b_time) {
    FakeStudy s({{"way", "--way", {{"a"}, {"b"}}}, {"depth", "--depth", {{"4", Promise::Approximates}, {"0"}}, "0"}});
    FakeRenderer r;
    r.settings["--way b"] = {.time = way_b_time};
    r.settings["--depth 0"] = {.scale = 1.02};
    s.subject.scene = "<b>&\"scene\".usda";
    return s.run(r);
}

size_t count(const std::string& text, const std::string& what) {
    size_t n = 0;
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
}

}  // namespace

TEST(Html, IsOneFileThatAsksForNoOther) {
    const std::string html = to_html(some_report(2));
    EXPECT_LT(html.size(), 5u << 20);
    EXPECT_EQ(count(html, "http"), 0u);
    EXPECT_EQ(count(html, "<script"), 0u);
    EXPECT_EQ(count(html, "url("), 0u);
    EXPECT_EQ(count(html, " src="), count(html, " src=\"data:image/png;base64,"));
    EXPECT_EQ(count(html, " href="), count(html, " href=\"data:,\""));
    for (const char* tag : {"table", "figure", "svg", "tr", "td", "div", "ul", "li", "p", "h2", "span"}) {
        const std::string name = tag;
        EXPECT_EQ(count(html, "<" + name + ">") + count(html, "<" + name + " "), count(html, "</" + name + ">")) << tag;
    }
    EXPECT_EQ(count(html, "nan"), 0u);
    EXPECT_EQ(count(html, "<b>&"), 0u) << "names are not markup";
    // One plot of all settings and one for each knob; the picture, its noise, its time and its bias
    EXPECT_EQ(count(html, "<svg"), 3u);
    EXPECT_EQ(count(html, "<img"), 4u);
}

TEST(Json, HoldsTheNumbersOfTheReport) {
    const Report report = some_report(2);
    const auto j = nlohmann::json::parse(to_json(report));
    EXPECT_EQ(j["schema"], "velatura.study/1");
    EXPECT_EQ(j["settings"].size(), report.settings.size());
    EXPECT_EQ(j["rows"].size(), 3u);
    EXPECT_DOUBLE_EQ(j["noise"]["value"], report.noise.value);
    EXPECT_DOUBLE_EQ(j["bias"], report.bias);
    EXPECT_EQ(j["rows"][0]["knob"], "depth");
}

TEST(Csv, HasALineForEachPointOfACurve) {
    const Report report = some_report(2);
    const std::string csv = to_csv(report);
    size_t points = 0;
    for (const SettingResult& s : report.settings) points += s.curve.size();
    EXPECT_EQ(count(csv, "\n"), points + 1);
    EXPECT_EQ(size_t(std::count(csv.begin(), csv.end(), ',')), 11 * (points + 1));
}

TEST(Compare, SaysWhatDiffers) {
    const std::string a = to_json(some_report(2)), b = to_json(some_report(1));
    const Result<std::string> same = compare_reports(a, a), other = compare_reports(a, b);
    ASSERT_TRUE(same.has_value() && other.has_value());
    EXPECT_EQ(count(*same, "differs"), 0u);
    const size_t line = other->find("--way b");
    ASSERT_NE(line, std::string::npos);
    EXPECT_NE(other->substr(line, other->find('\n', line) - line).find("differs"), std::string::npos) << *other;
    EXPECT_FALSE(compare_reports(a, "{}").has_value());
    EXPECT_FALSE(compare_reports("no json", b).has_value());
    EXPECT_FALSE(compare_reports(a, R"({"schema":"velatura.study/1"})").has_value());
}

TEST(Png, HoldsThePixels) {
    std::vector<float> rgb;
    for (int i = 0; i < 3 * 7 * 5; ++i) rgb.push_back(float((i * 37) % 101) / 90.0f - 0.05f);
    const std::string png = to_png(7, 5, rgb);
    int width = 0, height = 0, channels = 0;
    const std::unique_ptr<uint8_t, decltype(&std::free)> bytes(stbi_load_from_memory(reinterpret_cast<const uint8_t*>(png.data()), int(png.size()), &width, &height, &channels, 0), &std::free);
    ASSERT_TRUE(bytes);
    ASSERT_EQ((std::array<int, 3>{width, height, channels}), (std::array<int, 3>{7, 5, 3}));
    for (size_t i = 0; i < rgb.size(); ++i) EXPECT_EQ(bytes.get()[i], image::display_byte(rgb[i])) << i;
}

TEST(Base64, IsThatOfRfc4648) {
    EXPECT_EQ(to_base64(""), "");
    EXPECT_EQ(to_base64("M"), "TQ==");
    EXPECT_EQ(to_base64("Ma"), "TWE=");
    EXPECT_EQ(to_base64("Man"), "TWFu");
}

}  // namespace velatura::test
