// SPDX-License-Identifier: Apache-2.0
// --display: what a viewer of the test's own has received is the film, whatever the viewer does.
#include "accumulate/pixel_means.h"
#include "command.h"
#include "display/film_display.h"
#include "film/film_scene.h"
#include "image/exr.h"
#include "viewer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

namespace velatura::display {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::Viewer;
using Clock = std::chrono::steady_clock;

constexpr image::Window window{-5, 3, 70, 41}, shown{0, 0, 64, 48};

film::LayerSet layers() {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = true;
    return set;
}

DisplayOptions options_for(const Viewer& viewer) {
    DisplayOptions options;
    options.address = {"127.0.0.1", viewer.port()};
    options.name = "shot \"1\".exr";
    options.display = shown;
    options.layers = *find_layers(layers(), {"b1_key", "C_fill", "S_key"});
    options.interval = milliseconds(5);
    return options;
}

/// Waits until it holds, 10 s at most.
template <class Condition>
bool comes_true(const Condition& condition) {
    const Clock::time_point end = Clock::now() + seconds(10);
    while (!condition()) {
        if (Clock::now() > end) return false;
        std::this_thread::sleep_for(milliseconds(5));
    }
    return true;
}

/// The part of the film that lies in the image, bit for bit; black beside it.
bool is_shown(Viewer& viewer, const film::Film& film) {
    const auto images = viewer.images();
    const auto at = images.find("shot \"1\".exr");
    if (at == images.end()) return false;
    const Viewer::Image& image = at->second;
    if (image.width != shown.width() || image.height != shown.height()) return false;
    const std::vector<float> rgba = accumulate::resolve_rgba(film.sums());
    const char* const names[] = {"R", "G", "B", "A"};
    for (int y = shown.y0; y < shown.y1; ++y) {
        for (int x = shown.x0; x < shown.x1; ++x) {
            const bool is_in = x >= window.x0 && x < window.x1 && y >= window.y0 && y < window.y1;
            const size_t i = size_t(y) * size_t(image.width) + size_t(x);
            for (size_t c = 0; c < 4; ++c) {
                const float expected = is_in ? rgba[4 * window.index(x, y) + c] : 0.0f;
                if (image.channels.at(names[c])[i] != expected) return false;
            }
        }
    }
    return true;
}

TEST(Display, TheViewerHasTheFilm) {
    Viewer viewer(Viewer::Mood::Reads);
    film::Film film(window, layers());
    FilmDisplay display(options_for(viewer));
    ASSERT_TRUE(display.start().has_value());
    film::render(film, 0, 2);
    // Tiles of any size, before and after more samples
    for (int y = window.y0; y < window.y1; y += 20)
        for (int x = window.x0; x < window.x1; x += 48)
            display.add_tile(film,
                             {x, y, std::min(x + 48, window.x1), std::min(y + 20, window.y1)});
    EXPECT_TRUE(comes_true([&] { return is_shown(viewer, film); }));
    film::render(film, 2, 8);
    display.add_tile(film, window);
    EXPECT_TRUE(display.finish());
    EXPECT_TRUE(comes_true([&] { return is_shown(viewer, film); })) << viewer.fault();
    EXPECT_EQ(viewer.fault(), "");
    // Layers: a sum, and a difference
    const std::string path = film::temporary_file("display.exr");
    ASSERT_TRUE(film.write(path, {}).has_value());
    const auto file = image::read_exr(path);
    ASSERT_TRUE(file.has_value());
    const auto image = viewer.images().at("shot \"1\".exr");
    EXPECT_EQ(image.channels.size(), 4u + 3u * 3u);
    for (const char* name : {"b1_key.G", "C_fill.R", "S_key.B"}) {
        const image::Channel* channel = file->find(name);
        ASSERT_TRUE(channel) << name;
        double sum = 0;
        for (int y = window.y0; y < shown.y1 && y < window.y1; ++y)
            for (int x = 0; x < shown.x1; ++x) {
                const auto stored = double(channel->value(window.index(x, y)));
                const auto sent =
                    double(image.channels.at(name)[size_t(y) * size_t(image.width) + size_t(x)]);
                // As halves
                ASSERT_NEAR(sent, stored, 1e-3 * std::abs(stored) + 1e-5) << name;
                sum += std::abs(sent);
            }
        EXPECT_GT(sum, 0.0) << name;
    }
}

TEST(Display, AViewerThatStallsCostsNothing) {
    Viewer viewer(Viewer::Mood::Stalls);
    film::Film film({0, 0, 512, 512}, layers());
    film::render(film, 0, 1);
    DisplayOptions options = options_for(viewer);
    options.display = {0, 0, 512, 512};
    FilmDisplay display(std::move(options));
    ASSERT_TRUE(display.start().has_value());
    Clock::duration longest{};
    for (int i = 0; i < 20; ++i) {
        const Clock::time_point start = Clock::now();
        display.add_tile(film, {0, 0, 64, 64});
        longest = std::max(longest, Clock::now() - start);
    }
    display.add_tile(film, {0, 0, 512, 512});
    // A call takes as long as it takes to copy a tile; a send would take until the viewer reads
    EXPECT_LT(longest, seconds(5));
    const Clock::time_point start = Clock::now();
    EXPECT_FALSE(display.finish(milliseconds(300)));
    EXPECT_LT(Clock::now() - start, seconds(5));
}

TEST(Display, AViewerThatComesBackGetsTheWholeImage) {
    Viewer viewer(Viewer::Mood::ClosesOnce);
    film::Film film(window, layers());
    FilmDisplay display(options_for(viewer));
    ASSERT_TRUE(display.start().has_value());
    film::render(film, 0, 4);
    display.add_tile(film, window);
    // It left; the image comes again in whole, by nothing but time
    EXPECT_TRUE(comes_true([&] { return viewer.connections() == 2 && is_shown(viewer, film); }));
    EXPECT_TRUE(display.finish());
    EXPECT_EQ(viewer.fault(), "");
}

TEST(Display, WithoutAViewerTheRenderGoesOn) {
    uint16_t port = 0;
    { port = Viewer(Viewer::Mood::Reads).port(); }
    DisplayOptions options;
    options.address = {"127.0.0.1", port};
    options.display = shown;
    FilmDisplay display(std::move(options));
    const auto started = display.start();
    ASSERT_FALSE(started.has_value());
    EXPECT_EQ(started.error().code, "display-unreachable");
    film::Film film(window, layers());
    film::render(film, 0, 1);
    display.add_tile(film, window);
    EXPECT_FALSE(display.finish(milliseconds(10)));
}

TEST(Display, AddressesAreHostsWithPorts) {
    const auto text = [](const char* address) {
        const auto parsed = parse_address(address);
        return parsed ? parsed->text() : parsed.error().code;
    };
    EXPECT_EQ(text("localhost"), "localhost:14158");
    EXPECT_EQ(text("render7:9000"), "render7:9000");
    EXPECT_EQ(text("[::1]"), "[::1]:14158");
    EXPECT_EQ(text("[fe80::1]:77"), "[fe80::1]:77");
    for (const char* wrong :
         {"", ":1", "a:", "a:0", "a:65536", "a:1x", "[::1", "[::1]x", "[::1]:", "a:-1"})
        EXPECT_EQ(text(wrong), "bad-address") << wrong;
}

TEST(Display, RendersShowThemselves) {
    Viewer viewer(Viewer::Mood::Reads);
    const test::Workplace w;
    w.write("s.usda", test::small_scene());
    const std::string render = "render s.usda -o s.exr --res 70 50 --spp 4 --progress none ";
    const test::CommandResult r = w.velatura(
        render + fmt::format("--display 127.0.0.1:{} --display-layers b1,C_key", viewer.port()));
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const auto file = image::read_exr(w.path("s.exr"));
    ASSERT_TRUE(file.has_value());
    const auto images = viewer.images();
    ASSERT_EQ(images.size(), 1u);
    const Viewer::Image& image = images.begin()->second;
    EXPECT_EQ(images.begin()->first, "s.exr");
    double sum = 0;
    for (const char* name : {"R", "G", "B", "A"}) {
        const image::Channel* channel = file->find(name);
        for (size_t i = 0; i < channel->size(); ++i) {
            // The file has the sum of its stored layers
            ASSERT_NEAR(image.channels.at(name)[i], channel->value(i), 2e-3f) << name << i;
            sum += double(channel->value(i));
        }
    }
    EXPECT_GT(sum, 1.0);
    EXPECT_TRUE(image.channels.contains("b1.R") && image.channels.contains("C_key.B"));
    // The image is that of a render that nobody looks at
    const std::string hash = w.hash("s.exr");
    EXPECT_EQ(w.velatura(render).exit_code, 0);
    EXPECT_EQ(w.hash("s.exr"), hash);
    // The beauty alone needs no word about layers
    const test::CommandResult alone =
        w.velatura(render + fmt::format("--display 127.0.0.1:{}", viewer.port()));
    EXPECT_EQ(alone.exit_code, 0);
    EXPECT_EQ(alone.output.find("[display]"), std::string::npos) << alone.output;
    const test::CommandResult unknown = w.velatura(
        render + fmt::format("--display 127.0.0.1:{} --display-layers b1,C_kay", viewer.port()));
    EXPECT_EQ(unknown.exit_code, 0);
    EXPECT_NE(unknown.output.find("no light layer \"C_kay\""), std::string::npos) << unknown.output;
    for (const char* wrong : {"--display a:b", "--display-layers b1", "--display x --replay 1,1,1"})
        EXPECT_EQ(w.velatura(std::string("render s.usda ") + wrong).exit_code, 2) << wrong;
}

}  // namespace
}  // namespace velatura::display
