// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_file.h"

#include "film/film_scene.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/layer_check.h"
#include "layers/sums_part.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace velatura::film {
namespace {

namespace fs = std::filesystem;

const Window window{4, 2, 24, 20};

LayerSet full_set() {
    LayerSet set = test_layer_set();
    set.matrix_layers = set.shadow_layers = set.halves = true;
    return set;
}

FileInfo test_info() {
    FileInfo info;
    info.display = {0, 0, 32, 24};
    info.seed = 0xfedcba9876543210ull;
    info.scene_hash = "abc";
    info.settings_hash = "def";
    info.scene_json = "{\"hash\":\"abc\"}";
    return info;
}

TEST(LayerFile, PassesItsOwnCheckInEveryLayout) {
    std::string digest;
    for (const auto layout :
         {layers::Layout::MultiPart, layers::Layout::SinglePart, layers::Layout::Split}) {
        Film film(window, full_set());
        render(film, 0, 6);
        FileInfo info = test_info();
        info.layout = layout;
        const std::string path = temporary_file("layout" + std::to_string(int(layout)) + ".exr");
        const auto report = film.write(path, info);
        ASSERT_TRUE(report.has_value()) << report.error().message;
        EXPECT_EQ(report->closure_family, "matrix");
        const auto image = layers::read_layer_file(path);
        ASSERT_TRUE(image.has_value()) << image.error().message;
        const auto header = layers::read_layer_header(*image);
        ASSERT_TRUE(header.has_value()) << header.error().message;
        const auto check = layers::check_layers(*image, *header);
        EXPECT_TRUE(check.is_good()) << check.problems[0];
        EXPECT_EQ(header->samples.seed, info.seed);
        EXPECT_EQ(header->samples.end, 6u);
        EXPECT_EQ(image->display, info.display);
        EXPECT_EQ(image->data, window);
        if (digest.empty()) digest = report->sha256;
        EXPECT_EQ(report->sha256, digest);
        EXPECT_EQ(image::digest_of(*image), digest);
    }
}

TEST(LayerFile, CheckSeesOneChangedValueInAnyChannel) {
    Film film(window, full_set());
    render(film, 0, 6);
    FileInfo info = test_info();
    info.store_sums = true;
    const std::string path = temporary_file("mutated.exr");
    ASSERT_TRUE(film.write(path, info).has_value());
    auto image = layers::read_layer_file(path);
    ASSERT_TRUE(image.has_value());
    const auto header = layers::read_layer_header(*image);
    int channels = 0;
    for (image::Part& part : image->parts) {
        for (image::Channel& c : part.channels) {
            // One bookkeeping channel stands for the hundreds of them
            if (image::is_bookkeeping(c.name) && c.name != "sums_end" && c.name != "sums1_0.x1")
                continue;
            auto* byte = static_cast<unsigned char*>(c.bytes()) + c.byte_count() / 2;
            *byte ^= 1;
            EXPECT_FALSE(layers::check_layers(*image, *header).is_good()) << c.name;
            *byte ^= 1;
            ++channels;
        }
    }
    EXPECT_GT(channels, 150);
    EXPECT_TRUE(layers::check_layers(*image, *header).is_good());
}

TEST(LayerFile, CheckNamesThePixelThatBreaksClosure) {
    Film film(window, full_set());
    render(film, 0, 6);
    const std::string path = temporary_file("pixel.exr");
    ASSERT_TRUE(film.write(path, test_info()).has_value());
    auto image = layers::read_layer_file(path);
    const auto header = layers::read_layer_header(*image);
    for (image::Part& part : image->parts) {
        for (image::Channel& c : part.channels) {
            if (c.name != "b1_key.G") continue;
            std::get<std::vector<Imath::half>>(c.data)[window.index(9, 7)] = Imath::half(512.0f);
        }
    }
    const auto check = layers::check_layers(*image, *header);
    ASSERT_FALSE(check.is_good());
    EXPECT_NE(check.problems[0].find("pixel 9,7"), std::string::npos) << check.problems[0];
}

TEST(LayerFile, SumsReadBackAreTheFilm) {
    Film film(window, full_set());
    render(film, 3, 10);
    FileInfo info = test_info();
    info.store_sums = true;
    const std::string path = temporary_file("sums.exr");
    ASSERT_TRUE(film.write(path, info).has_value());
    const auto image = layers::read_layer_file(path);
    const auto sums = layers::read_sums(*image);
    ASSERT_TRUE(sums.has_value()) << sums.error().message;
    const auto a = layers::resolve_layers(film.sums()), b = layers::resolve_layers(*sums);
    EXPECT_EQ(image::digest_of(a.image), image::digest_of(b.image));
    EXPECT_EQ(sums->layer_set(), full_set());
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            ASSERT_EQ(sums->nodes_of(x, y), film.sums().nodes_of(x, y));
            for (const uint32_t acc : film.sums().used_accumulators()) {
                ASSERT_EQ(sums->node_sum(x, y, acc, 1), film.sums().node_sum(x, y, acc, 1));
            }
        }
    }
}

TEST(LayerFile, AppendedSumsGiveTheSingleRun) {
    Film whole(window, full_set()), first(window, full_set()), second(window, full_set());
    render(whole, 0, 11);
    render(first, 0, 5);
    render(second, 5, 11);
    const auto expected = image::digest_of(layers::resolve_layers(whole.sums()).image);
    FileInfo info = test_info();
    info.store_sums = true;
    ASSERT_TRUE(first.write(temporary_file("first.exr"), info).has_value());
    ASSERT_TRUE(second.write(temporary_file("second.exr"), info).has_value());
    auto a = layers::read_sums(*layers::read_layer_file(temporary_file("first.exr")));
    auto b = layers::read_sums(*layers::read_layer_file(temporary_file("second.exr")));
    ASSERT_TRUE(a.has_value() && b.has_value());
    a->append(*b);
    EXPECT_EQ(image::digest_of(layers::resolve_layers(*a).image), expected);
}

TEST(LayerFile, FailureLeavesNoFileAndKeepsTheOld) {
    Film film(window, test_layer_set());
    EXPECT_EQ(film.write(temporary_file("nothing.exr"), {}).error().code, "no-samples");
    EXPECT_FALSE(fs::exists(temporary_file("nothing.exr")));
    render(film, 0, 2);
    EXPECT_EQ(film.write("/dev/null/x.exr", {}).error().code, "io-write");

    FilmOptions options;
    options.final_sample_end = 4;
    Film folded(window, test_layer_set(), options);
    render(folded, 0, 4);
    FileInfo info;
    info.store_sums = true;
    EXPECT_EQ(folded.write(temporary_file("folded.exr"), info).error().code, "sums-folded");

    const std::string path = temporary_file("atomic/kept.exr");
    fs::create_directories(fs::path(path).parent_path());
    ASSERT_TRUE(film.write(path, {}).has_value());
    size_t files = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(fs::path(path).parent_path()))
        ++files;
    EXPECT_EQ(files, 1u);
}

}  // namespace
}  // namespace velatura::film
