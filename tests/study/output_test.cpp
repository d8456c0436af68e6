// SPDX-License-Identifier: Apache-2.0
#include "image/formats.h"
#include "study/compare.h"
#include "study/fake_render.h"
#include "study/images.h"
#include "study/png.h"
#include "study/raster.h"
#include "study/report_plots.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>

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
    FakeStudy s({{"way", "--way", {{"a"}, {"b"}}},
                 {"depth", "--depth", {{"4", BiasClass::Biased}, {"0"}}, "0"}});
    FakeRenderer r;
    r.settings["--way b"] = {.time = way_b_time};
    r.settings["--depth 0"] = {.scale = 1.03};
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
    for (const char* tag :
         {"table", "figure", "svg", "tr", "td", "div", "ul", "li", "p", "h2", "span"}) {
        const std::string name = tag;
        EXPECT_EQ(count(html, "<" + name + ">") + count(html, "<" + name + " "),
                  count(html, "</" + name + ">"))
            << tag;
    }
    EXPECT_EQ(count(html, "nan"), 0u);
    EXPECT_EQ(count(html, "<b>&"), 0u) << "names are not markup";
    // One plot of all settings and one for each knob; the image, its noise, its time and its bias
    EXPECT_EQ(count(html, "<svg"), 3u);
    EXPECT_EQ(count(html, "<img"), 4u);
}

TEST(Html, TheMapOfTimeHasTheTimeOfTheImage) {
    // Of the renders each sample takes another time by the clock than by the CPU: 15 s for 1 s
    const Report report = some_report(2);
    const auto map = std::find_if(report.maps.begin(), report.maps.end(),
                                  [](const StudyMap& m) { return m.name == "time"; });
    ASSERT_NE(map, report.maps.end());
    const double ms_per_pixel = 1e3 * report.settings[0].cpu_s / (480.0 * 320.0);
    EXPECT_NE(map->caption.find(fmt::format("CPU time per pixel at {} samples per pixel, mean of ",
                                            report.subject.spp)),
              std::string::npos)
        << map->caption;
    EXPECT_NE(map->caption.find(fmt::format("orange {:.3g} ms (the mean)", ms_per_pixel)),
              std::string::npos)
        << map->caption;
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
    EXPECT_NE(other->substr(line, other->find('\n', line) - line).find("differs"),
              std::string::npos)
        << *other;
    EXPECT_FALSE(compare_reports(a, "{}").has_value());
    EXPECT_FALSE(compare_reports("no json", b).has_value());
    EXPECT_FALSE(compare_reports(a, R"({"schema":"velatura.study/1"})").has_value());
    EXPECT_FALSE(compare_reports(a, R"({"schema":1})").has_value());
    const std::string deep =
        R"({"schema":"velatura.study/1","noise":{"value":0,"low":0,"high":0},"bias":0,
            "settings":[{"cpu_s":1,"knob":)" +
        std::string(1000000, '[') + std::string(1000000, ']') + "}]}";
    EXPECT_FALSE(compare_reports(deep, deep).has_value());
}

TEST(Png, HoldsThePixels) {
    std::vector<float> rgb;
    for (int i = 0; i < 3 * 7 * 5; ++i) rgb.push_back(float((i * 37) % 101) / 90.0f - 0.05f);
    const std::string png = to_png(7, 5, rgb);
    int width = 0, height = 0, channels = 0;
    const std::unique_ptr<uint8_t, decltype(&std::free)> bytes(
        stbi_load_from_memory(reinterpret_cast<const uint8_t*>(png.data()), int(png.size()), &width,
                              &height, &channels, 0),
        &std::free);
    ASSERT_TRUE(bytes);
    ASSERT_EQ((std::array<int, 3>{width, height, channels}), (std::array<int, 3>{7, 5, 3}));
    for (size_t i = 0; i < rgb.size(); ++i)
        EXPECT_EQ(bytes.get()[i], image::display_byte(rgb[i])) << i;
}

TEST(Plots, AreImagesOfTheirOwn) {
    const std::vector<ReportPlot> plots = report_plots(some_report(2));
    ASSERT_EQ(plots.size(), 3u);
    EXPECT_EQ(plots[0].name, "all");
    for (const ReportPlot& plot : plots) {
        const std::string png = to_png(plot);
        int width = 0, height = 0, channels = 0;
        const std::unique_ptr<uint8_t, decltype(&std::free)> bytes(
            stbi_load_from_memory(reinterpret_cast<const uint8_t*>(png.data()), int(png.size()),
                                  &width, &height, &channels, 3),
            &std::free);
        ASSERT_TRUE(bytes);
        EXPECT_EQ(width, 1200);
        // Where the page has a dot, the image has its color
        const PlotDrawing drawing = plot.drawing();
        for (const PlotDrawing::Dot& d : drawing.dots) {
            if (d.color != 0) continue;
            const double scale = 1200.0 / drawing.width;
            const uint8_t* const pixel =
                bytes.get() + 3 * (size_t(scale * (d.y + 24)) * 1200 + size_t(scale * d.x));
            EXPECT_EQ((std::array<int, 3>{pixel[0], pixel[1], pixel[2]}),
                      (std::array<int, 3>{0x1b, 0x1b, 0x1a}))
                << plot.name;
        }
    }
}

TEST(Raster, LinesCoverWhatTheyAreLongAndWide) {
    canvas::Canvas canvas = plot_paper(100, 60);
    PlotDrawing drawing{.width = 50,
                        .height = 30,
                        .lines = {{{{5, 5}, {45, 25}}, 1, 2.0, false}},
                        .dots = {},
                        .texts = {}};
    const std::vector<float> before = canvas.rgb();
    draw_plot(canvas, drawing, 2, 0, 0);
    double covered = 0;
    for (size_t i = 0; i < before.size(); i += 3)
        covered += double((before[i] - canvas.rgb()[i]) / (before[i] - 42 / 255.0f));
    // As wide as two thirds of the plot's units, with a round end of half a circle each
    const double width = 2 * 2.0 * 0.7, length = 2 * std::hypot(40, 20);
    EXPECT_NEAR(covered, width * length + 3.14159 / 4 * width * width, 0.03 * width * length);
}

TEST(Raster, LettersStandWhereTheyAreAnchored) {
    for (const auto anchor :
         {PlotDrawing::Anchor::Start, PlotDrawing::Anchor::Middle, PlotDrawing::Anchor::End}) {
        canvas::Canvas canvas = plot_paper(400, 60);
        const PlotDrawing drawing{.width = 400,
                                  .height = 60,
                                  .lines = {},
                                  .dots = {},
                                  .texts = {{200, 40, "HHHHHHHH", anchor}}};
        const std::vector<float> before = canvas.rgb();
        draw_plot(canvas, drawing, 1, 0, 0);
        int left = 400, right = 0, top = 60, bottom = 0;
        for (int y = 0; y < 60; ++y) {
            for (int x = 0; x < 400; ++x) {
                if (canvas.rgb()[3 * (size_t(y) * 400 + size_t(x))] == before[0]) continue;
                left = std::min(left, x);
                right = std::max(right, x);
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
        }
        ASSERT_LT(left, right);
        EXPECT_EQ(bottom, 39) << "on the base line";
        EXPECT_NEAR(bottom - top, 14, 4);
        const int at = anchor == PlotDrawing::Anchor::Start ? left
                       : anchor == PlotDrawing::Anchor::End ? right
                                                            : (left + right) / 2;
        EXPECT_NEAR(at, 200, 6) << "but for the space behind a letter";
    }
}

TEST(Images, ShowTheNoisiestPartInEqualTime) {
    FakeStudy s({{"way", "--way", {{"a"}, {"b"}, {"c"}}}});
    FakeRenderer fake;
    fake.settings["--way b"] = {.noise = 0.5, .time = 0.5};
    Report report = s.run(fake);
    // The noise of the fake grows from the first pixel to the last
    const Region region = noisiest_region(report, s.tallies, 120, 80);
    EXPECT_EQ(region.width, 120);
    EXPECT_EQ(region.height, 80);
    EXPECT_GT(region.y, 200);
    EXPECT_LE(region.y + region.height, 320);
    std::vector<RenderRequest> requests;
    const auto render = [&](const RenderRequest& r) {
        requests.push_back(r);
        return fake(r);
    };
    add_images(report, s.tallies, render, 1e6);
    ASSERT_EQ(report.images.size(), 2u);
    EXPECT_EQ(report.images[1].name, "--way b");
    EXPECT_EQ(report.images[1].width, 128);
    EXPECT_EQ(report.images[1].rgb.size(), 3u * 128 * 96);
    EXPECT_EQ(requests[0].spp, std::vector<uint64_t>{64});
    EXPECT_NEAR(double(requests[1].spp[0]), 128, 16);
    EXPECT_EQ(count(to_html(report), "<img"), 5u) << "and the picture, its noise and its time";
    // None where there is no time
    Report hurried = s.run(fake);
    add_images(hurried, s.tallies, std::ref(fake), 1e-6);
    EXPECT_TRUE(hurried.images.empty());
}

}  // namespace velatura::test
