// SPDX-License-Identifier: Apache-2.0
// --preview and --progress image: what decoders of the test's own read is the image.
#include "accumulate/pixel_means.h"
#include "base/base64.h"
#include "command.h"
#include "display/film_preview.h"
#include "display/terminal_image.h"
#include "film/film_scene.h"
#include "image/formats.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace velatura::display {
namespace {

PreviewImage random_image(int width, int height, unsigned seed) {
    std::mt19937 random(seed);
    PreviewImage image{width, height, {}};
    for (int i = 0; i < 3 * width * height; ++i) image.rgb.push_back(uint8_t(random() % 256));
    return image;
}

TEST(ScaledDown, IsTheMeanOfBlocks) {
    const PreviewImage image = random_image(37, 22, 1);
    EXPECT_EQ(scaled_down(image, 37, 22).rgb, image.rgb);
    const PreviewImage small = scaled_down(image, 13, 100);  // blocks of 3
    ASSERT_EQ(small.width, 13);
    ASSERT_EQ(small.height, 8);
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x)
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                int count = 0;
                for (int v = 3 * y; v < std::min(3 * y + 3, 22); ++v)
                    for (int u = 3 * x; u < std::min(3 * x + 3, 37); ++u, ++count)
                        sum += image.rgb[size_t((v * 37 + u) * 3 + c)];
                EXPECT_NEAR(small.rgb[size_t((y * 13 + x) * 3 + c)], sum / count, 0.5001);
            }
}

/// Reads what Kitty's protocol says; fails at anything that is no such command.
PreviewImage read_kitty(const std::string& text) {
    PreviewImage image;
    std::string payload;
    size_t at = 0;
    bool has_more = true;
    while (has_more) {
        EXPECT_EQ(text.compare(at, 3, "\033_G"), 0) << at;
        const size_t semicolon = text.find(';', at), end = text.find("\033\\", at);
        if (semicolon == std::string::npos || end == std::string::npos) {
            ADD_FAILURE() << "not closed";
            return image;
        }
        std::map<std::string, std::string> keys;
        std::string list = text.substr(at + 3, semicolon - at - 3);
        for (size_t from = 0; from < list.size();) {
            const size_t comma = std::min(list.find(',', from), list.size());
            const std::string pair = list.substr(from, comma - from);
            keys[pair.substr(0, pair.find('='))] = pair.substr(pair.find('=') + 1);
            from = comma + 1;
        }
        if (at == 0) {
            EXPECT_EQ(keys["a"], "T");
            EXPECT_EQ(keys["f"], "24");
            image.width = std::stoi(keys["s"]);
            image.height = std::stoi(keys["v"]);
        }
        const std::string piece = text.substr(semicolon + 1, end - semicolon - 1);
        EXPECT_LE(piece.size(), 4096u);
        has_more = keys["m"] == "1";
        if (has_more) {
            EXPECT_EQ(piece.size() % 4, 0u);
        }
        payload += piece;
        at = end + 2;
    }
    EXPECT_EQ(text.substr(at), "\n");
    const std::string raw = from_base64(payload);
    image.rgb.assign(raw.begin(), raw.end());
    return image;
}

TEST(TerminalImage, KittyHasEveryByte) {
    for (const auto& [width, height] : {std::pair{1, 1}, {64, 16}, {123, 77}}) {
        const PreviewImage image = random_image(width, height, 3);
        const PreviewImage read = read_kitty(terminal_image(TerminalProtocol::Kitty, image));
        EXPECT_EQ(read.width, width);
        EXPECT_EQ(read.height, height);
        EXPECT_TRUE(read.rgb == image.rgb);
    }
}

/// Reads sixels, as the manual of the VT330 describes them; pixels that nothing is drawn to are
/// -1.
std::vector<int> read_sixel(const std::string& text, int& width, int& height) {
    size_t at = text.find('q');
    EXPECT_EQ(text.compare(0, 2, "\033P"), 0);
    int x_aspect = 0, y_aspect = 0;
    EXPECT_EQ(
        std::sscanf(text.c_str() + at + 1, "\"%d;%d;%d;%d", &y_aspect, &x_aspect, &width, &height),
        4);
    std::vector<int> pixels(size_t(width * height * 3), -1);
    std::map<int, std::array<int, 3>> palette;
    const auto number = [&] {
        int v = 0;
        while (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])))
            v = 10 * v + (text[at++] - '0');
        return v;
    };
    at = text.find_first_of("#", at);
    int x = 0, y = 0, color = 0;
    while (at < text.size() && text[at] != '\033') {
        const char c = text[at++];
        if (c == '#') {
            color = number();
            if (text[at] == ';') {
                std::array<int, 4> v{};
                for (int& part : v) {
                    EXPECT_EQ(text[at++], ';');
                    part = number();
                }
                EXPECT_EQ(v[0], 2) << "RGB in percent";
                palette[color] = {v[1], v[2], v[3]};
            }
        } else if (c == '$') {
            x = 0;
        } else if (c == '-') {
            x = 0;
            y += 6;
        } else {
            int count = 1;
            char sixel = c;
            if (c == '!') {
                count = number();
                sixel = text[at++];
            }
            EXPECT_TRUE(sixel >= 63 && sixel <= 126) << int(sixel);
            for (; count > 0; --count, ++x)
                for (int bit = 0; bit < 6; ++bit) {
                    if (!((sixel - 63) >> bit & 1)) continue;
                    if (x >= width || y + bit >= height) {
                        ADD_FAILURE() << "outside: " << x << " " << y + bit;
                        continue;
                    }
                    for (size_t k = 0; k < 3; ++k)
                        pixels[size_t((y + bit) * width + x) * 3 + k] =
                            int(std::lround(palette.at(color)[k] * 2.55));
                }
        }
    }
    EXPECT_EQ(text.substr(at), "\033\\\n");
    return pixels;
}

TEST(TerminalImage, SixelsAreTheImageWithinAStepOfThePalette) {
    const PreviewImage image = random_image(61, 47, 9);
    int width = 0, height = 0;
    const auto read = read_sixel(terminal_image(TerminalProtocol::Sixel, image), width, height);
    ASSERT_EQ(width, 61);
    ASSERT_EQ(height, 47);
    for (size_t i = 0; i < image.rgb.size(); ++i)
        ASSERT_LE(std::abs(read[i] - int(image.rgb[i])), 51) << i;
    // The dither keeps means: 16 thresholds of a step of 51
    for (const int gray : {0, 20, 77, 128, 200, 255}) {
        PreviewImage flat{32, 32, std::vector<uint8_t>(3 * 32 * 32, uint8_t(gray))};
        const auto pixels =
            read_sixel(terminal_image(TerminalProtocol::Sixel, flat), width, height);
        double sum = 0;
        for (const int v : pixels) sum += v;
        EXPECT_NEAR(sum / double(pixels.size()), gray, 51.0 / 32 + 0.01) << gray;
    }
}

image::DisplayTransform transform() {
    auto made = image::DisplayTransform::make("", "");
    EXPECT_TRUE(made.has_value());
    return std::move(*made);
}

TEST(FilmPreview, ShowsTheFilmAtIntervals) {
    constexpr image::Window window{-5, 3, 70, 41}, shown{0, 0, 64, 48};
    film::Film film(window, film::test_layer_set());
    std::mutex mutex;
    std::vector<PreviewImage> images;
    PreviewOptions options;
    options.display = shown;
    options.interval = std::chrono::milliseconds(5);
    options.show = [&](const PreviewImage& image) {
        const std::lock_guard lock(mutex);
        images.push_back(image);
    };
    FilmPreview preview(options, transform());
    film::render(film, 0, 2);
    preview.add_tile(film, window);
    const auto count = [&] {
        const std::lock_guard lock(mutex);
        return images.size();
    };
    for (int i = 0; i < 2000 && count() == 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_GE(count(), 1u) << "before the end";
    EXPECT_TRUE(preview.finish().has_value());
    std::vector<float> rgb(3 * shown.pixel_count(), 0.0f);
    const auto rgba = accumulate::resolve_rgba(film.sums());
    for (int y = std::max(shown.y0, window.y0); y < std::min(shown.y1, window.y1); ++y)
        for (int x = 0; x < shown.x1; ++x)
            for (size_t c = 0; c < 3; ++c)
                rgb[3 * shown.index(x, y) + c] = rgba[4 * window.index(x, y) + c];
    transform().apply(rgb);
    for (const PreviewImage& image : images)
        for (size_t i = 0; i < rgb.size(); ++i)
            ASSERT_EQ(image.rgb[i], image::display_byte(rgb[i])) << i;
}

TEST(PreviewCommand, TheFileIsTheMixOfTheFinishedImage) {
    const test::Workplace w;
    w.write("scene.usda", test::small_scene());
    const std::string options = "render scene.usda -o a.exr --res 60 41 --spp 8 --bounces 2 -q";
    ASSERT_EQ(w.velatura(options).exit_code, 0);
    const std::string bytes = w.hash("a.exr");
    const auto r = w.velatura(options + " --preview p.png --every 0.1s");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(w.hash("a.exr"), bytes);
    ASSERT_EQ(w.comp("mix a.exr -o mix.png").exit_code, 0);
    const auto read = [&](const char* name) {
        return image::read_rgb_image(w.path(name), image::SourceColorSpace::Raw);
    };
    const auto preview = read("p.png"), mix = read("mix.png");
    ASSERT_TRUE(preview && mix);
    ASSERT_EQ(preview->pixels.size(), mix->pixels.size());
    // The file stores halves
    float most = 0;
    for (size_t i = 0; i < mix->pixels.size(); ++i)
        most = std::max(most, std::abs(preview->pixels[i] - mix->pixels[i]));
    EXPECT_LE(most, 1.01f / 255);
}

TEST(PreviewCommand, ImagesInTheTerminalEndInTheImage) {
    const test::Workplace w;
    w.write("scene.usda", test::small_scene());
    const auto r = w.velatura(
        "render scene.usda -o a.exr --res 60 41 --spp 8 --bounces 2 --progress kitty --every 10s "
        "--preview p.png --missing-assets ignore");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const size_t begin = r.output.find("\033_G"), end = r.output.rfind("\033\\");
    ASSERT_NE(begin, std::string::npos);
    const PreviewImage shown = read_kitty(r.output.substr(begin, end + 3 - begin));
    const auto file = image::read_rgb_image(w.path("p.png"), image::SourceColorSpace::Raw);
    ASSERT_TRUE(file);
    ASSERT_EQ(shown.rgb.size(), file->pixels.size());
    for (size_t i = 0; i < shown.rgb.size(); ++i)
        ASSERT_EQ(shown.rgb[i], image::display_byte(file->pixels[i])) << i;
    EXPECT_NE(r.output.find("100.0 %"), std::string::npos) << "progress below it";
}

TEST(PreviewCommand, WrongUsageIsRefused) {
    const test::Workplace w;
    w.write("scene.usda", test::small_scene());
    for (const char* wrong : {"--preview p.exr", "--every 3s", "--preview p.png --every soon",
                              "--preview p.png --every 0.01s"}) {
        const auto r = w.velatura(std::string("render scene.usda -o a.exr ") + wrong);
        EXPECT_EQ(r.exit_code, 2) << wrong << "\n" << r.output;
    }
    EXPECT_FALSE(w.exists("a.exr"));
    // In a pipe, --progress image is plain
    const auto piped = w.velatura(
        "render scene.usda -o piped.exr --res 16 11 --spp 1 --progress image --every 2s");
    EXPECT_EQ(piped.exit_code, 0) << piped.output;
    EXPECT_EQ(piped.output.find("\033_G"), std::string::npos);
    // A preview that cannot be written ends no render
    w.write("file", "no folder");
    const auto r =
        w.velatura("render scene.usda -o a.exr --res 16 11 --spp 1 --preview file/p.png");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_TRUE(w.exists("a.exr"));
    EXPECT_NE(r.output.find("[preview]"), std::string::npos) << r.output;
}

}  // namespace
}  // namespace velatura::display
