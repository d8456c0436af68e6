// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge.h"

#include "compositor/inspect/diff.h"
#include "compositor/io/merge_parts.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/layer_file.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"
#include "layers/sums_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor {
namespace {

const image::Window window{0, 0, 18, 10};

film::LayerSet full_set() {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = set.halves = true;
    set.mattes = {true, true};
    return set;
}

using Change = std::function<void(film::LayerSet&, film::FileInfo&)>;

std::string crop(const std::string& name,
                 const image::Window& pixels,
                 uint64_t first,
                 uint64_t end,
                 const Change& change = {}) {
    film::LayerSet set = full_set();
    film::FileInfo info;
    info.store_sums = true;
    info.display = window;
    info.seed = 5;
    info.scene_hash = "scene";
    info.scene_json = R"({"layers": ["s.usda", "--set /K.x=1"]})";
    info.settings_hash = "settings";
    info.settings_json =
        R"({"build": "b", "firstSample": 0, "settings": {"--filter": "box", "--max-depth": "4"}})";
    info.matte_names = {film::test_objects(), {"only"}};
    if (change) change(set, info);
    film::Film film(pixels, set);
    film::render(film, first, end);
    const std::string path = film::temporary_file("merge_" + name + ".exr");
    const auto written = film.write(path, info);
    EXPECT_TRUE(written.has_value()) << written.error().message;
    return path;
}

std::string part(const std::string& name, uint64_t first, uint64_t end, const Change& change = {}) {
    return crop(name, window, first, end, change);
}

Result<layers::WriteReport> merge(const std::vector<std::string>& inputs,
                                  const std::string& output,
                                  const MergeOptions& options = {}) {
    MergeReport report;
    return merge_files(inputs, output, options, report);
}

TEST(Merge, ReproducesTheSingleRenderBitForBit) {
    const auto whole = layers::read_layer_file(
        part("whole", 0, 13, [](auto&, auto& info) { info.store_sums = false; }));
    const std::string out = film::temporary_file("merge_out.exr");
    const std::vector<std::vector<uint64_t>> splits = {{0, 8, 13}, {0, 5, 13}, {0, 1, 2, 7, 13}};
    for (const auto& split : splits) {
        std::vector<std::string> inputs;
        for (size_t i = 0; i + 1 < split.size(); ++i) {
            inputs.push_back(part("part" + std::to_string(i), split[i], split[i + 1]));
        }
        // The order on the command line does not matter
        std::reverse(inputs.begin(), inputs.end());
        const auto merged = merge(inputs, out);
        ASSERT_TRUE(merged.has_value()) << merged.error().message;
        const auto image = layers::read_layer_file(out);
        EXPECT_EQ(merged->sha256, image::digest_of(*whole));
        const auto difference = inspect::compare(*image, *whole);
        ASSERT_TRUE(difference.has_value());
        EXPECT_TRUE(difference->is_equal);
        EXPECT_EQ(image->text("velatura/samples"), whole->text("velatura/samples"));
        EXPECT_EQ(image->text("velatura/layers"), whole->text("velatura/layers"));
        EXPECT_EQ(image->text("velatura/closure"), whole->text("velatura/closure"));
        EXPECT_EQ(image->text("cryptomatte/3ae39a5/manifest"),
                  whole->text("cryptomatte/3ae39a5/manifest"));
        EXPECT_NE(image->text("cryptomatte/3ae39a5/manifest"), "");
    }
}

TEST(Merge, GoesOnFromAMergedFile) {
    const std::string ab = film::temporary_file("merge_ab.exr"),
                      abc = film::temporary_file("merge_abc.exr");
    ASSERT_TRUE(merge({part("a", 0, 3), part("b", 3, 6)}, ab, {.keep_sums = true, .expected = {}})
                    .has_value());
    const auto merged = merge({ab, part("c", 6, 11)}, abc);
    ASSERT_TRUE(merged.has_value()) << merged.error().message;
    EXPECT_EQ(merged->sha256, image::digest_of(*layers::read_layer_file(part("all", 0, 11))));
}

/// Crops that begin within the tiles of the sums, with other ranges of samples in each.
TEST(Merge, JoinsCropsAndSampleRanges) {
    const auto whole = layers::read_layer_file(
        part("whole", 0, 13, [](auto&, auto& info) { info.store_sums = false; }));
    const std::string out = film::temporary_file("merge_crops.exr");
    const std::vector<std::string> inputs = {
        crop("c0", {0, 0, 7, 10}, 0, 13),  crop("c1", {7, 0, 18, 3}, 0, 5),
        crop("c2", {7, 0, 18, 3}, 5, 13),  crop("c3", {7, 3, 18, 10}, 0, 8),
        crop("c4", {7, 3, 17, 10}, 8, 13), crop("c5", {17, 3, 18, 10}, 8, 13)};
    const auto merged = merge({inputs[4], inputs[2], inputs[0], inputs[5], inputs[1], inputs[3]},
                              out, {.expected = SampleRange{0, 13}});
    ASSERT_TRUE(merged.has_value()) << merged.error().message;
    const auto image = layers::read_layer_file(out);
    EXPECT_EQ(merged->sha256, image::digest_of(*whole));
    EXPECT_EQ(image->data, window);
    EXPECT_EQ(image->text("velatura/samples"), whole->text("velatura/samples"));
    EXPECT_EQ(image->text("velatura/layers"), whole->text("velatura/layers"));
    EXPECT_EQ(image->text("cryptomatte/3ae39a5/manifest"),
              whole->text("cryptomatte/3ae39a5/manifest"));
    // A merge of some goes on with the others
    const std::string right = film::temporary_file("merge_right.exr");
    ASSERT_TRUE(merge({inputs[1], inputs[2], inputs[3], inputs[4], inputs[5]}, right,
                      {.keep_sums = true, .expected = {}})
                    .has_value());
    EXPECT_EQ(layers::read_layer_file(right)->data, (image::Window{7, 0, 18, 10}));
    EXPECT_EQ(merge({right, inputs[0]}, out)->sha256, image::digest_of(*whole));
}

TEST(Merge, NamesThePixelsThatCropsLackOrShare) {
    const std::string out = film::temporary_file("merge_refused.exr");
    std::filesystem::remove(out);
    const std::string left = crop("left", {0, 0, 9, 10}, 0, 4);

    struct Case {
        const char *kind, *says;
        std::vector<std::string> others;
        std::optional<image::Window> where;
    };

    const std::vector<Case> cases = {
        {"gap",
         "no file has the samples 0:4 of the pixels 9,7 to 18,10",
         {crop("upper", {9, 0, 18, 7}, 0, 4)},
         image::Window{9, 7, 18, 10}},
        {"gap",
         "no file has the samples 2:4 of the pixels 9,0 to 18,10",
         {crop("short", {9, 0, 18, 10}, 0, 2)},
         image::Window{9, 0, 18, 10}},
        {"gap",
         "no file has the samples 1:2 of the pixels 9,0 to 18,10",
         {crop("one", {9, 0, 18, 10}, 0, 1), crop("two", {9, 0, 18, 10}, 2, 4)},
         image::Window{9, 0, 18, 10}},
        {"overlap",
         "has 0:4 of the pixels 8,0 to 9,10",
         {crop("wide", {8, 0, 18, 10}, 0, 4)},
         image::Window{8, 0, 9, 10}},
        {"window",
         "are of images with different sizes: pixels 0,0 to 18,10 and 0,0 to 36,20",
         {crop("large", {9, 0, 18, 10}, 0, 4,
               [](auto&, auto& info) {
                   info.display = {0, 0, 36, 20};
               })},
         std::nullopt},
    };
    for (const Case& c : cases) {
        std::vector<std::string> inputs = c.others;
        inputs.push_back(left);
        MergeReport report;
        EXPECT_FALSE(merge_files(inputs, out, {}, report).has_value()) << c.says;
        ASSERT_EQ(report.faults.size(), 1u) << c.says;
        EXPECT_EQ(report.faults[0].kind, c.kind);
        EXPECT_NE(report.faults[0].text.find(c.says), std::string::npos) << report.faults[0].text;
        EXPECT_EQ(report.faults[0].window, c.where) << c.says;
        EXPECT_FALSE(std::filesystem::exists(out));
    }
}

/// Crops place trial paths of their own, of which no file of all can speak.
TEST(Merge, StatisticsAreThoseThatAllCropsShare) {
    const auto with_stats = [](const char* json) {
        return [json](auto&, auto& info) { info.stats_json = json; };
    };
    const std::string
        a = crop(
            "a", {0, 0, 9, 10}, 0, 4,
            with_stats(R"({"scene": {"lights": 2}, "splitting": {"paths": 7, "branches": 2}})")),
        b = crop(
            "b", {9, 0, 18, 10}, 0, 4,
            with_stats(R"({"scene": {"lights": 2}, "splitting": {"paths": 8, "branches": 2}})")),
        out = film::temporary_file("merge_stats.exr");
    ASSERT_TRUE(merge({a, b}, out).has_value());
    EXPECT_EQ(layers::read_layer_file(out)->text("velatura/stats"),
              R"({"scene":{"lights":2},"splitting":{"branches":2}})");
}

TEST(Merge, RefusesWhatDoesNotFit) {
    const std::string first = part("first", 0, 4), out = film::temporary_file("merge_refused.exr");
    std::filesystem::remove(out);

    struct Case {
        const char* says;
        std::string other;
    };

    const std::vector<Case> cases = {
        {"overlap", part("overlap", 3, 6)},
        {"overlap", part("same", 0, 4)},
        {"gap", part("gap", 5, 8)},
        {"different scenes",
         part("scene", 4, 8, [](auto&, auto& info) { info.scene_hash = "other"; })},
        // What stands in the list of layers of one only is named
        {"different scenes: --set /K.x=1 in the first, --set /K.x=2, more.usda in the second",
         part("set", 4, 8,
              [](auto&, auto& info) {
                  info.scene_hash = "other";
                  info.scene_json = R"({"layers": ["s.usda", "--set /K.x=2", "more.usda"]})";
              })},
        {"different settings, which they do not name",
         part("settings", 4, 8, [](auto&, auto& info) { info.settings_hash = "other"; })},
        {"different settings: --filter box and gaussian, --max-depth 4 and nothing",
         part("named", 4, 8,
              [](auto&, auto& info) {
                  info.settings_hash = "other";
                  info.settings_json =
                      R"({"build": "b", "firstSample": 4, "settings": {"--filter": "gaussian"}})";
              })},
        {"different settings: build b and c",
         part("build", 4, 8,
              [](auto&, auto& info) {
                  info.settings_json =
                      R"({"build": "c", "settings": {"--filter": "box", "--max-depth": "4"}})";
              })},
        {"different seeds: 5 and 6", part("seed", 4, 8, [](auto&, auto& info) { info.seed = 6; })},
        {"different layers: halves true and false",
         part("layers", 4, 8, [](auto& set, auto&) { set.halves = false; })},
        {"different layers",
         part("lights", 4, 8, [](auto& set, auto&) { set.groups[1].name = "rim"; })},
        {"no sums", part("sums", 4, 8, [](auto&, auto& info) { info.store_sums = false; })},
    };
    for (const Case& c : cases) {
        const auto merged = merge({first, c.other}, out);
        ASSERT_FALSE(merged.has_value()) << c.says;
        EXPECT_EQ(merged.error().code, "merge-refused");
        EXPECT_NE(merged.error().message.find(c.says), std::string::npos) << merged.error().message;
        EXPECT_FALSE(std::filesystem::exists(out));
    }
}

const image::Window tall{0, 0, 18, 70};

/// A part of an image of five rows of tiles, its last one not whole.
std::string tall_part(const std::string& name,
                      const image::Window& pixels,
                      uint64_t first,
                      uint64_t end) {
    return crop(name, pixels, first, end, [](auto&, auto& info) { info.display = tall; });
}

/// Adds one to the first sample of two pixels in different strips.
void move_two_pixels(const std::string& path, bool has_digest_of_them) {
    auto image = image::read_exr(path);
    for (image::Part& p : image->parts)
        for (image::Channel& c : p.channels)
            if (c.name == "sums_first")
                for (const int y : {20, 65})
                    ++std::get<std::vector<uint32_t>>(c.data)[image->data.index(7, y)];
    if (has_digest_of_them)
        image->attributes[layers::sums_attribute] = layers::sums_json(full_set(), *image);
    EXPECT_TRUE(layers::write_image_file(path, *image).has_value());
}

/// Strips of one row of tiles: crops that begin and end within a strip, and samples that need
/// several nodes until the last part comes.
TEST(Merge, StripsMakeNoDifference) {
    const MergeOptions strips{.expected = {}, .strip_bytes = 1};
    const std::string out = film::temporary_file("merge_strips.exr");
    const std::string whole = crop("whole", tall, 0, 16, [](auto&, auto& info) {
        info.display = tall;
        info.store_sums = false;
    });
    const std::vector<std::string> inputs = {
        tall_part("s0", {0, 0, 18, 37}, 0, 5), tall_part("s1", {0, 0, 18, 37}, 5, 15),
        tall_part("s2", {0, 37, 18, 70}, 0, 7), tall_part("s3", {0, 37, 18, 70}, 7, 15),
        tall_part("s4", tall, 15, 16)};
    const auto merged = merge(inputs, out, strips);
    ASSERT_TRUE(merged.has_value()) << merged.error().message;
    const auto image = layers::read_layer_file(out), expected = layers::read_layer_file(whole);
    EXPECT_EQ(merged->sha256, image::digest_of(*expected));
    for (const char* name : {"velatura/samples", "velatura/layers", "velatura/closure"})
        EXPECT_EQ(image->text(name), expected->text(name)) << name;
    // Those that go on: the same sums
    MergeOptions kept = strips;
    kept.keep_sums = true;
    const std::vector<std::string> four(inputs.begin(), inputs.end() - 1);
    ASSERT_TRUE(merge(four, out, kept).has_value());
    const std::string sums = layers::SumsReader::open(out)->header().text(layers::sums_attribute);
    kept.strip_bytes = layers::default_strip_bytes;
    ASSERT_TRUE(merge(four, out, kept).has_value());
    EXPECT_EQ(layers::SumsReader::open(out)->header().text(layers::sums_attribute), sums);
    EXPECT_EQ(merge({out, inputs[4]}, film::temporary_file("merge_on.exr"), strips)->sha256,
              merged->sha256);
}

/// Pixels of adaptive sampling have up to 8 times the samples that the range states; what is folded
/// before the last of them would be rounded otherwise than in one render.
TEST(Merge, FoldsNothingBeforeTheLastSampleOfAnyPixel) {
    std::vector<PartHeader> parts(2);
    parts[0].part.samples = {0, 20};
    parts[0].samples.end = 160;
    parts[1].part.samples = {20, 32};
    parts[1].samples.end = 64;
    EXPECT_EQ(end_of_samples(parts), 160u);
    // Interrupted
    parts[0].samples.end = 20;
    parts[1].samples.end = 24;
    EXPECT_EQ(end_of_samples(parts), 32u);
}

TEST(Merge, FaultsInAnyStripAreNamedWhole) {
    const std::string out = film::temporary_file("merge_fault.exr");
    const std::string first = tall_part("f0", tall, 0, 4), second = tall_part("f1", tall, 4, 8);
    for (const size_t bytes : {size_t(1), layers::default_strip_bytes}) {
        const std::string last = tall_part("f2", tall, 8, 12);
        move_two_pixels(second, true);
        MergeReport report;
        EXPECT_FALSE(
            merge_files({first, second, last}, out, {.expected = {}, .strip_bytes = bytes}, report)
                .has_value());
        ASSERT_EQ(report.faults.size(), 1u);
        EXPECT_EQ(report.faults[0].kind, "gap");
        EXPECT_NE(report.faults[0].text.find("in 2 of 1260 pixels"), std::string::npos)
            << report.faults[0].text;
        EXPECT_NE(report.faults[0].text.find("pixel 7,20 has samples 0:4 and 5:8"),
                  std::string::npos)
            << report.faults[0].text;
        // Values that nobody wrote are damage, whatever they look like
        tall_part("f1", tall, 4, 8);
        move_two_pixels(second, false);
        EXPECT_FALSE(
            merge_files({first, second, last}, out, {.expected = {}, .strip_bytes = bytes}, report)
                .has_value());
        ASSERT_EQ(report.faults.size(), 1u);
        EXPECT_EQ(report.faults[0].kind, "damaged");
        EXPECT_EQ(report.faults[0].files, std::vector<std::string>{second});
        tall_part("f1", tall, 4, 8);
    }
}

TEST(Merge, RefusesDamagedSums) {
    const std::string first = part("first", 0, 4), second = part("damaged", 4, 8);
    auto image = image::read_exr(second);
    for (image::Part& p : image->parts) {
        for (image::Channel& c : p.channels) {
            if (c.name == "sums0_0.x1") std::get<std::vector<uint32_t>>(c.data)[3] ^= 1u;
        }
    }
    ASSERT_TRUE(layers::write_image_file(second, *image).has_value());
    EXPECT_EQ(merge({first, second}, film::temporary_file("merge_damaged_out.exr")).error().code,
              "merge-refused");
}

image::Image image_of(const std::vector<std::pair<std::string, std::vector<float>>>& channels) {
    image::Image image;
    image.data = image.display = {0, 0, int(channels[0].second.size()), 1};
    image::Part part;
    for (const auto& [name, values] : channels) {
        part.channels.push_back(
            image::Channel::make(name, image::ChannelType::Float, values.size()));
        std::get<std::vector<float>>(part.channels.back().data) = values;
    }
    image.parts.push_back(part);
    return image;
}

/// The error of a render is one of RGB: an alpha that agrees must not dilute it, one that does not
/// must not be missed.
TEST(Diff, ErrorsAreOfRgbAndAlphaHasItsOwn) {
    const image::Image a = image_of({{"R", {0.5f}}, {"G", {0.5f}}, {"B", {0.5f}}, {"A", {1.0f}}}),
                       b = image_of({{"R", {0.4f}}, {"G", {0.4f}}, {"B", {0.4f}}, {"A", {1.0f}}}),
                       c = image_of({{"R", {0.5f}}, {"G", {0.5f}}, {"B", {0.5f}}, {"A", {0.5f}}});
    const auto color = inspect::compare(a, b), alpha = inspect::compare(a, c);
    ASSERT_TRUE(color.has_value() && alpha.has_value());
    ASSERT_EQ(color->layers.size(), 2u);
    EXPECT_EQ(color->layers[0].layer, "rgba");
    // 0.1² / (0.4² + 0.01) in each of three channels; a fourth without difference made it 3/4
    EXPECT_NEAR(color->layers[0].rel_mse, 0.01 / 0.17, 1e-7);
    EXPECT_EQ(color->layers[1].layer, "rgba.A");
    EXPECT_EQ(color->layers[1].rel_mse, 0.0);
    EXPECT_EQ(alpha->layers[0].rel_mse, 0.0);
    EXPECT_NEAR(alpha->layers[1].rel_mse, 0.25 / 0.26, 1e-7);
    EXPECT_NEAR(alpha->worst_rel_mse, 0.25 / 0.26, 1e-7);
}

TEST(Diff, IsZeroOfAFileAndItselfAndNeverNan) {
    const float infinite = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    const image::Image a = image_of({{"R", {infinite, nan, 0, -0.0f, 3e38f}}}),
                       b = image_of({{"R", {1, nan, 0, 0, 3e38f}}}),
                       c = image_of({{"R", {infinite, 1, 0, 0, -3e38f}}});
    EXPECT_EQ(inspect::compare(a, a)->layers[0].rel_mse, 0.0);
    EXPECT_EQ(inspect::compare(a, a)->layers[0].mean, 0.0);
    // Finite in one file only
    EXPECT_EQ(inspect::compare(a, b)->layers[0].rel_mse, infinite);
    EXPECT_EQ(inspect::compare(b, a)->layers[0].rel_mse, infinite);
    EXPECT_EQ(inspect::compare(a, c)->layers[0].rel_mse, infinite);
    EXPECT_EQ(inspect::compare(a, c)->layers[0].different, 2u);
}

TEST(Diff, MeasuresInClosedForm) {
    image::Image a, b;
    a.data = a.display = {0, 0, 2, 1};
    image::Part part;
    part.channels.push_back(image::Channel::make("b0.R", image::ChannelType::Float, 2));
    a.parts.push_back(part);
    b = a;
    std::get<std::vector<float>>(a.parts[0].channels[0].data) = {1.0f, 4.0f};
    std::get<std::vector<float>>(b.parts[0].channels[0].data) = {1.0f, 2.0f};
    const auto difference = inspect::compare(a, b);
    ASSERT_TRUE(difference.has_value());
    EXPECT_FALSE(difference->is_equal);
    EXPECT_EQ(difference->layers[0].largest, 2.0);
    EXPECT_EQ(difference->layers[0].mean, 1.0);
    EXPECT_EQ(difference->layers[0].x, 1);
    EXPECT_DOUBLE_EQ(difference->layers[0].rel_mse, 0.5 * 4.0 / 4.01);
    EXPECT_EQ(inspect::difference_image(a, b).find("b0.R")->value(1), 2.0f);
    EXPECT_TRUE(inspect::compare(a, a)->is_equal);
    EXPECT_EQ(inspect::compare(a, a)->layers[0].rel_mse, 0.0);
    b.data = {0, 0, 1, 2};
    EXPECT_EQ(inspect::compare(a, b).error().code, "diff-window");
}

}  // namespace
}  // namespace velatura::compositor
