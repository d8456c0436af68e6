// SPDX-License-Identifier: Apache-2.0
#include "film/cryptomatte_decoder.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::film {
namespace {

using test::CryptomatteDecoder;

const Window window{-3, 2, 20, 12};
constexpr uint64_t samples = 24;

LayerSet matte_set(int levels) {
    LayerSet set = test_layer_set();
    set.mattes = {true, true};
    set.matte_levels = levels;
    return set;
}

FileInfo matte_info() {
    FileInfo info;
    info.matte_names = {test_objects(), {"only"}};
    return info;
}

image::Image written(const Film& film, const FileInfo& info = matte_info()) {
    const std::string path = temporary_file("cryptomatte.exr");
    const auto report = film.write(path, info);
    EXPECT_TRUE(report.has_value()) << report.error().message;
    auto image = layers::read_layer_file(path);
    EXPECT_TRUE(image.has_value());
    return *image;
}

/// What a name covers in a pixel, sample by sample in long double.
float brute_force(const std::string& name, int x, int y) {
    SampleRadiance s(test_layer_set());
    using Long = long double;
    Long sum = 0, all = 0;
    uint64_t count = 0;
    for (uint64_t i = 0; i < samples; ++i) {
        fill_sample(s, x, y, i);
        if (s.is_bad()) continue;
        ++count;
        all += Long(s.weight);
        if (s.has_hit && test_object(x, y, i) == name) sum += Long(s.weight);
    }
    return float(sum / (std::abs(all) < 0.1L * Long(count) ? Long(count) : all));
}

TEST(Cryptomatte, DecodesToBruteForce) {
    Film film(window, matte_set(8));
    render(film, 0, samples);
    const image::Image image = written(film);
    const CryptomatteDecoder objects(image, "CryptoObject"), materials(image, "CryptoMaterial");

    // Every name that the image shows, and no other
    std::vector<std::string> seen(test_objects().begin(), test_objects().end() - 1);
    std::sort(seen.begin(), seen.end());
    std::vector<std::string> listed;
    for (const auto& [name, id] : objects.manifest) listed.push_back(name);
    EXPECT_EQ(listed, seen);
    ASSERT_EQ(materials.manifest.size(), 1u);

    const image::Channel* alpha = image.find("A");
    ASSERT_NE(alpha, nullptr);
    const std::vector<float> total = objects.total(), only = materials.matte("only");
    for (const std::string& name : seen) {
        const std::vector<float> matte = objects.matte(name);
        for (int y = window.y0; y < window.y1; ++y) {
            for (int x = window.x0; x < window.x1; ++x)
                ASSERT_NEAR(matte[window.index(x, y)], brute_force(name, x, y), 2e-7f)
                    << name << " at " << x << "," << y;
        }
    }
    for (size_t i = 0; i < total.size(); ++i) {
        EXPECT_NEAR(total[i], alpha->value(i), 1e-6f) << i;
        EXPECT_NEAR(only[i], alpha->value(i), 2e-7f) << i;
    }
}

TEST(Cryptomatte, FewLevelsKeepTheLargest) {
    Film film(window, matte_set(8)), small(window, matte_set(3));
    render(film, 0, samples);
    render(small, 0, samples);
    const image::Image image = written(small);
    EXPECT_EQ(image.find("CryptoObject02.R"), nullptr);
    const CryptomatteDecoder all(written(film), "CryptoObject"), few(image, "CryptoObject");
    for (size_t i = 0; i < all.pixels.size(); ++i) {
        EXPECT_EQ(few.pixels[i].size(), std::min<size_t>(3, all.pixels[i].size()));
        float min = 2;
        for (const auto& [id, coverage] : few.pixels[i]) {
            EXPECT_EQ(all.pixels[i].at(id), coverage);
            min = std::min(min, std::abs(coverage));
        }
        for (const auto& [id, coverage] : all.pixels[i]) {
            if (few.pixels[i].count(id)) continue;
            EXPECT_LE(std::abs(coverage), min);
        }
    }
}

TEST(H53StableIds, DoNotDependOnTilesOrPasses) {
    Film whole(window, matte_set(6)), parts(window, matte_set(6), {.final_sample_end = samples});
    render(whole, 0, samples);
    for (const auto& [first, end] : {std::pair<uint64_t, uint64_t>{0, 1}, {1, 7}, {7, samples}})
        render(parts, first, end, int(first % 2));
    const std::string manifest = written(whole).text("cryptomatte/3ae39a5/manifest");
    EXPECT_NE(manifest, "");
    EXPECT_EQ(manifest, written(parts).text("cryptomatte/3ae39a5/manifest"));
    const CryptomatteDecoder a(written(whole), "CryptoObject"), b(written(parts), "CryptoObject");
    EXPECT_EQ(a.pixels, b.pixels);
}

TEST(Cryptomatte, StandsInEveryLayout) {
    Film film(window, matte_set(6));
    render(film, 0, 4);
    const CryptomatteDecoder expected(written(film), "CryptoObject");
    for (const layers::Layout layout : {layers::Layout::SinglePart, layers::Layout::Split}) {
        FileInfo info = matte_info();
        info.layout = layout;
        const CryptomatteDecoder decoded(written(film, info), "CryptoObject");
        EXPECT_EQ(decoded.pixels, expected.pixels);
        EXPECT_EQ(decoded.manifest, expected.manifest);
    }
    // The file beside the others has all that readers need
    const auto own = layers::read_layer_file(temporary_file("cryptomatte.CryptoObject.exr"));
    ASSERT_TRUE(own.has_value());
    EXPECT_EQ(CryptomatteDecoder(*own, "CryptoObject").pixels, expected.pixels);
}

TEST(Cryptomatte, CostsNothingWhenNobodyAsks) {
    Film with(window, matte_set(6)), without(window, test_layer_set());
    render(with, 0, 4);
    render(without, 0, 4);
    EXPECT_GT(with.memory_bytes(), without.memory_bytes());
    const image::Image image = written(without);
    EXPECT_EQ(image.find("CryptoObject00.R"), nullptr);
    for (const auto& [name, attribute] : image.attributes)
        EXPECT_FALSE(name.starts_with("cryptomatte/")) << name;
}

}  // namespace
}  // namespace velatura::film
