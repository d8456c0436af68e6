// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_page.h"

#include "base/atomic_file.h"
#include "base/base64.h"
#include "compositor/exports/web_display.h"
#include "compositor/exports/web_layers.h"
#include "compositor/exports/web_pack.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "film/lobe_layers.h"
#include "image/display.h"
#include "image/exr.h"
#include "image/formats.h"

#include <Imath/half.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

namespace velatura::compositor::exports {
namespace {

using enum Control::Kind;
using nlohmann::json;

std::string file(const std::string& name) {
    return film::temporary_file("web_" + name);
}

/// 5 groups × (b0 b1 b2 tail) and shadows, of light that a display shows well: a film's made-up
/// samples go from the smallest numbers to the largest.
LayerStack made_stack(bool has_matrix = true, bool has_lobes = false) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = has_matrix;
    if (has_lobes) set.path_layers = film::lobes_of_matrix();
    set.shadow_layers = true;
    film::Film film({0, 0, 64, 48}, set);
    film::render(film, 0, 4);
    image::Image image = through_file(film).image();
    const auto shown = [](float v) { return 0.3f * std::abs(v) / (1 + std::abs(v)); };
    for (image::Part& part : image.parts) {
        for (image::Channel& channel : part.channels) {
            if (auto* halves = std::get_if<std::vector<Imath::half>>(&channel.data))
                for (Imath::half& v : *halves) v = shown(v);
            if (auto* floats = std::get_if<std::vector<float>>(&channel.data))
                for (float& v : *floats) v = shown(v);
        }
    }
    auto stack = LayerStack::from_image(std::move(image));
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

WebPage page_of(const LayerStack& stack, const Look& look = {}, WebOptions options = {}) {
    options.title = "shot </script> & more";
    auto page = web_page(stack, look, options);
    EXPECT_TRUE(page.has_value()) << (page ? "" : page.error().message);
    return page ? std::move(*page) : WebPage{};
}

std::string code_of(const LayerStack& stack, const Look& look, const WebOptions& options = {}) {
    const auto page = web_page(stack, look, options);
    return page ? "" : page.error().code;
}

/// The text of an element, from the place that names it.
std::string between(const std::string& html, const std::string& begin, const std::string& end) {
    const size_t at = html.find(begin);
    if (at == std::string::npos) return {};
    const size_t first = at + begin.size();
    return html.substr(first, html.find(end, first) - first);
}

json data_of(const WebPage& page) {
    return json::parse(between(page.html, "id=\"data\">", "</script>"));
}

std::vector<std::string> planes_of(const WebPage& page) {
    std::vector<std::string> planes;
    const std::string begin = "class=\"plane\">";
    for (size_t at = page.html.find(begin); at != std::string::npos;
         at = page.html.find(begin, at + 1))
        planes.push_back(between(page.html.substr(at), begin, "</script>"));
    return planes;
}

/// As web/planes.js does it, by the description in web_pack.h.
std::vector<uint16_t> unpacked(const std::string& packed, size_t width, size_t height) {
    const size_t pixels = width * height;
    std::vector<unsigned char> bytes(3 + 6 * pixels);
    uLongf size = uLong(bytes.size());
    EXPECT_EQ(uncompress(bytes.data(), &size, reinterpret_cast<const Bytef*>(packed.data()),
                         uLong(packed.size())),
              Z_OK);
    EXPECT_EQ(size, bytes.size());
    std::array<std::vector<int>, 3> planes;
    for (size_t c = 0; c < 3; ++c) {
        std::vector<int>& plane = planes[c];
        plane.resize(pixels);
        for (size_t i = 0; i < pixels; ++i) {
            const size_t x = i % width, y = i / width;
            int guess = 0;
            if (x == 0 && y > 0) guess = plane[i - width];
            if (x > 0) guess = plane[i - 1];
            if (x > 0 && y > 0 && bytes[c] != 0) {
                const int w = plane[i - 1], n = plane[i - width], nw = plane[i - width - 1];
                guess = bytes[c] == 2 ? int(std::floor(double(w + n) / 2))
                                      : std::clamp(w + n - nw, std::min(w, n), std::max(w, n));
            }
            const int code =
                bytes[3 + 2 * c * pixels + i] + 256 * bytes[3 + (2 * c + 1) * pixels + i];
            const int difference = code % 2 == 0 ? code / 2 : -(code + 1) / 2;
            plane[i] = int16_t(uint16_t(guess + difference));
        }
    }
    std::vector<uint16_t> rgb(3 * pixels);
    const auto bits = [](int ordered) {
        const auto value = int16_t(uint16_t(ordered));
        return uint16_t(value < 0 ? 0x8000 + (-1 - int(value)) : int(value));
    };
    for (size_t i = 0; i < pixels; ++i) {
        rgb[3 * i] = bits(planes[1][i] + planes[0][i]);
        rgb[3 * i + 1] = bits(planes[0][i]);
        rgb[3 * i + 2] = bits(planes[2][i] + planes[0][i]);
    }
    return rgb;
}

TEST(WebPack, ComesBackBitForBit) {
    // Every pattern in each channel, in order and in disorder
    std::vector<uint16_t> rgb(3 * 256 * 256);
    for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = uint16_t(i / 3 * (1 + 2 * (i % 3)));
    EXPECT_EQ(unpacked(pack_planes(rgb, 256, 256), 256, 256), rgb);
    std::mt19937 random(1);
    for (uint16_t& v : rgb) v = uint16_t(random());
    EXPECT_EQ(unpacked(pack_planes(rgb, 512, 128), 512, 128), rgb);
    const std::vector<uint16_t> one = {0x3c00, 0x8000, 0xffff};
    EXPECT_EQ(unpacked(pack_planes(one, 1, 1), 1, 1), one);
}

TEST(WebPack, SmoothLightIsSmall) {
    std::vector<uint16_t> rgb;
    for (int y = 0; y < 90; ++y) {
        for (int x = 0; x < 160; ++x) {
            const float light = std::exp(-float(x * x + y * y) / 4000);
            for (const float color : {1.0f, 0.9f, 0.7f})
                rgb.push_back(Imath::half(color * light).bits());
        }
    }
    EXPECT_LT(pack_planes(rgb, 160, 90).size(), rgb.size() / 2) << "a quarter of the bytes";
}

image::DisplayTransform transform_of(const std::string& view) {
    auto transform = image::DisplayTransform::make("", view);
    EXPECT_TRUE(transform.has_value());
    return std::move(*transform);
}

/// Largest difference in steps of 8 bits, and the share of values without one, for colors of
/// `stops` around middle gray.
std::pair<int, double> difference_of(const std::string& view, double stops) {
    const auto transform = transform_of(view);
    const WebDisplay display = web_display(transform);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<float> a;
    for (int i = 0; i < 20000; ++i) {
        const double level = 0.18 * std::exp2(stops * (2 * unit(random) - 1));
        const double spread = 3 * unit(random);
        for (int c = 0; c < 3; ++c) a.push_back(float(level * std::exp2(-spread * unit(random))));
    }
    std::vector<float> b = a;
    transform.apply(a);
    display.apply(b);
    int largest = 0;
    size_t equal = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const int difference =
            std::abs(int(image::display_byte(a[i])) - int(image::display_byte(b[i])));
        largest = std::max(largest, difference);
        equal += difference == 0;
    }
    return {largest, double(equal) / double(a.size())};
}

TEST(WebDisplay, IsAFormulaWhereTheTransformIsOne) {
    EXPECT_EQ(web_display(transform_of("Raw")).kind, WebDisplay::Kind::Raw);
    const WebDisplay srgb = web_display(transform_of("sRGB"));
    EXPECT_EQ(srgb.kind, WebDisplay::Kind::Srgb);
    const image::ColorMatrix identity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (size_t i = 0; i < identity.size(); ++i) EXPECT_NEAR(srgb.matrix[i], identity[i], 2e-5);
    EXPECT_EQ(web_display(transform_of("ACES")).kind, WebDisplay::Kind::Lut);
    for (const char* view : {"Raw", "sRGB"}) {
        const auto [largest, equal] = difference_of(view, 8);
        EXPECT_LE(largest, 1) << view;
        EXPECT_GT(equal, 0.999) << view;
    }
}

TEST(WebDisplay, LutIsWithinAStepOrTwo) {
    const auto [largest, equal] = difference_of("ACES", 6);
    EXPECT_LE(largest, 2);
    EXPECT_GT(equal, 0.95);
}

TEST(WebPage, HoldsTheLayersAndFoldsToTheRender) {
    const LayerStack stack = made_stack();
    Look raw;
    raw.view = "Raw";
    const WebPage page = page_of(stack, raw);
    EXPECT_EQ(page.width, 64);
    EXPECT_EQ(page.largest_difference, 0);
    EXPECT_EQ(page.equal_share, 1.0);
    const json data = data_of(page);
    const std::vector<std::string> planes = planes_of(page);
    EXPECT_EQ(data["title"], "shot </script> & more");
    EXPECT_NE(page.html.find("<title>shot &lt;/script> &amp; more"), std::string::npos);
    ASSERT_EQ(data["families"][0]["name"], "matrix");
    const std::vector<std::string>& order = stack.header().find_family("matrix")->order;
    ASSERT_EQ(data["families"][0]["terms"].size(), order.size());
    ASSERT_EQ(planes.size(), order.size() + data["shadows"].size());
    for (size_t i = 0; i < order.size(); ++i) {
        const auto halves =
            unpacked(from_base64(planes[data["families"][0]["terms"][i]["plane"]]), 64, 48);
        const std::vector<float> layer = window_of(stack, order[i]);
        for (size_t k = 0; k < layer.size(); ++k) {
            Imath::half value;
            value.setBits(halves[k]);
            ASSERT_EQ(float(value), layer[k]) << order[i];
        }
    }
    // It asks for nothing
    for (const char* outside : {"http:", "https:", "src=", "@import", "url("})
        EXPECT_EQ(page.html.find(outside), std::string::npos) << outside;
}

TEST(WebPage, IsScaledDownUntilItFits) {
    const LayerStack stack = made_stack();
    WebOptions options;
    const size_t whole = page_of(stack).html.size();
    options.max_bytes = whole - 40000;
    const WebPage page = page_of(stack, {}, options);
    EXPECT_LE(page.html.size(), options.max_bytes);
    EXPECT_LT(page.width, 64);
    EXPECT_GT(page.width, 16);
    EXPECT_NEAR(double(page.width) / page.height, 64.0 / 48, 0.1);
    EXPECT_LE(page.largest_difference, 3) << "of the render at that size";
    options.max_bytes = 1000;
    EXPECT_EQ(code_of(stack, {}, options), "export-size");
}

TEST(WebPage, ScalingKeepsTheMean) {
    std::mt19937 random(3);
    std::vector<float> rgb(3 * 37 * 23);
    double sum = 0;
    for (float& v : rgb) sum += double(v = float(random() % 1000));
    double small_sum = 0;
    const std::vector<float> small = scaled_down(rgb, {37, 23}, {16, 9});
    ASSERT_EQ(small.size(), 3u * 16 * 9);
    for (const float v : small) small_sum += double(v);
    EXPECT_NEAR(small_sum / (16 * 9), sum / (37 * 23), 1e-3 * sum / (37 * 23));
}

TEST(WebPage, RefusesWhatItCannotShow) {
    const LayerStack stack = made_stack(), coarse = made_stack(false);
    Look matted = look_of({{Gain, "key=2"}});
    matted.controls[0].matte = "object:a";
    EXPECT_EQ(code_of(stack, matted), "export-matte");
    EXPECT_EQ(code_of(stack, look_of({{Clamp, "all=1"}})), "export-clamp");
    EXPECT_EQ(code_of(stack, look_of({{Clamp, "all=0"}})), "");
    EXPECT_EQ(code_of(stack, look_of({{Gain, "moon=2"}})), "unknown-name");
    EXPECT_EQ(code_of(coarse, {}, {.layers = "matrix", .title = {}}), "mix-not-stored");
    EXPECT_EQ(code_of(stack, look_of({{Gain, "key=2"}}), {.layers = "bounce", .title = {}}),
              "mix-not-stored");
    EXPECT_EQ(code_of(stack, look_of({{Gain, "b1=2"}}), {.layers = "bounce", .title = {}}), "");
    Look nowhere;
    nowhere.view = "Nowhere";
    EXPECT_EQ(code_of(stack, nowhere), "ocio-view");
}

TEST(WebPage, ChoosesTheLayersOfTheFaders) {
    const LayerStack stack = made_stack();
    const json light = data_of(page_of(stack, {}, {.layers = "light", .title = {}}));
    ASSERT_EQ(light["families"].size(), 1u);
    EXPECT_EQ(light["families"][0]["name"], "groups");
    EXPECT_TRUE(light["grid"]["groups"].empty()) << "no cells without a matrix";
    const json both = data_of(page_of(made_stack(false)));
    EXPECT_EQ(both["families"].size(), 2u);
}

/// The fewest layers that the look can be turned with.
TEST(WebPage, HasLobesWhereTheLookGainsThem) {
    const LayerStack stack = made_stack(true, true), lobes_alone = made_stack(false, true);
    const Look lobed = look_of({{Control::Kind::Gain, "key:specular=2"}});
    const auto family_of = [](const LayerStack& of, const Look& look, WebOptions options = {}) {
        const json data = data_of(page_of(of, look, std::move(options)));
        return data["families"][0]["name"].get<std::string>();
    };
    EXPECT_EQ(family_of(stack, {}), "matrix");
    EXPECT_EQ(family_of(stack, lobed), "lobe-matrix");
    EXPECT_EQ(family_of(lobes_alone, {}), "lobe-matrix");
    EXPECT_EQ(family_of(stack, {}, {.layers = "lobe-matrix", .title = {}}), "lobe-matrix");
    const auto refused = web_page(stack, lobed, {.layers = "matrix", .title = {}});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "mix-not-stored");
    const json data = data_of(page_of(stack, lobed));
    EXPECT_EQ(data["lobes"].size(), 7u);
    EXPECT_EQ(data["cells"], 4 * 5 * 7);
    for (const json& term : data["families"][0]["terms"]) EXPECT_EQ(term["cells"].size(), 1u);
    EXPECT_EQ(data["targets"]["cells"]["key:specular"].size(), 4u);
    // A bounce of the coarser set has one cell per lobe
    for (const json& term : data_of(page_of(stack))["families"][0]["terms"])
        EXPECT_TRUE(term["cells"].size() == 1 || term["cells"].size() == 6) << term;
}

// In a browser

bool has_browser() {
    return run("python3 --version").code == 0 &&
           run("command -v chromium || command -v chromium-browser || command -v google-chrome")
                   .code == 0;
}

json browse(const WebPage& page, const std::string& options, const std::string& script) {
    EXPECT_TRUE(write_file_atomically(file("page.html"), page.html).has_value());
    EXPECT_TRUE(write_file_atomically(file("script.js"), script).has_value());
    const Outcome outcome = run(
        fmt::format("python3 -B {}/compositor/exports/browser.py {} {} --run {}",
                    VELATURA_SOURCE_DIR "/tests", file("page.html"), options, file("script.js")));
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    const json answer = json::parse(outcome.output, nullptr, false);
    EXPECT_FALSE(answer.is_discarded()) << outcome.output;
    return answer;
}

/// The bytes that the window shows.
std::vector<uint8_t> shown(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << (plan ? "" : plan.error().message);
    const auto mixed =
        LayerStack::from_image(mix::apply_mix(stack, *plan, look, false), ForeignFiles::Plain);
    std::vector<float> rgb = window_of(*mixed, "rgba");
    const auto transform = image::DisplayTransform::make(look.display, look.view);
    transform->apply(rgb);
    std::vector<uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), image::display_byte);
    return bytes;
}

void expect_shown(const std::string& base64, const std::vector<uint8_t>& expected, int steps) {
    const std::string bytes = from_base64(base64);
    ASSERT_EQ(bytes.size(), expected.size());
    size_t differing = 0;
    int largest = 0;
    for (size_t i = 0; i < expected.size(); ++i) {
        const int difference = std::abs(int(uint8_t(bytes[i])) - int(expected[i]));
        largest = std::max(largest, difference);
        differing += difference != 0;
    }
    EXPECT_LE(largest, steps);
    EXPECT_LE(double(differing) / double(expected.size()), steps == 0 ? 0.0 : 0.12);
}

/// Pixels as they are on the screen, before and after every kind of control was turned by the
/// elements that a hand turns; then undone, and wiped.
constexpr const char* session = R"JS(
const canvas = () => document.getElementById('image');
const frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
const pixels = async () => {
  await frame();
  const copy = document.createElement('canvas');
  copy.width = canvas().width;
  copy.height = canvas().height;
  const context = copy.getContext('2d');
  context.drawImage(canvas(), 0, 0);
  const rgba = context.getImageData(0, 0, copy.width, copy.height).data;
  let text = '';
  for (let i = 0; i < rgba.length; ++i) if (i % 4 < 3) text += String.fromCharCode(rgba[i]);
  return btoa(text);
};
const row = name => document.querySelector(`[data-row="${name}"]`);
const turn = (input, value) => {
  input.value = value;
  input.dispatchEvent(new Event('input', {bubbles: true}));
  input.dispatchEvent(new Event('change', {bubbles: true}));
};
const out = {before: await pixels(), drawnBy: document.documentElement.dataset.ready};
turn(row('key').querySelector('.fader'), 1.25);
turn(row('indirect').querySelector('.fader'), -0.7);
row('sky').querySelector('.mute').click();
row('fill').querySelector('.swatch').click();
turn(row('fill').querySelector('input[type=color]'), '#ff8040');
row('key').querySelector('.swatch').click();
turn(row('key').querySelector('.kelvin'), 3200);
turn(document.querySelector('#exposure .fader'), 0.35);
const share = [...document.querySelectorAll('.isShare')].find(r => r.textContent.includes('key'));
turn(share.querySelector('.fader'), 40);
const cell = document.querySelector('.grid input[aria-label^="emissive, b1"]');
turn(cell, '+0.5');
out.after = await pixels();
out.look = mixer.look.toJson();
mixer.view.compare(true);
mixer.view.setWipe(0.5);
mixer.view.redraw();
out.wiped = await pixels();
mixer.view.compare(false);
while (mixer.past.length > 0) mixer.undo();
out.undone = await pixels();
return out;
)JS";

class WebBrowser : public testing::TestWithParam<std::tuple<const char*, const char*>> {
  protected:
    void SetUp() override {
        if (!has_browser()) GTEST_SKIP() << "no Chromium or no Python on this machine";
    }
};

TEST_P(WebBrowser, ShowsWhatTheWindowShowsAndItsLookMixesTheSame) {
    const auto [view, hash] = GetParam();
    const LayerStack stack = made_stack();
    Look look;
    look.view = view;
    const json answer =
        browse(page_of(stack, look), fmt::format("--size 1200x800 --hash '{}'", hash), session);
    ASSERT_TRUE(answer.is_object());
    EXPECT_TRUE(answer["console"].empty()) << answer["console"];
    EXPECT_TRUE(answer["requests"].empty()) << answer["requests"];
    EXPECT_EQ(answer["state"], *hash ? "CPU" : "WebGL2");
    const json& out = answer["results"][0];
    const int steps = std::string(view) == "Raw" ? 0 : 1;
    const std::vector<uint8_t> render = shown(stack, look);
    expect_shown(out["before"], render, steps);
    EXPECT_EQ(out["before"], out["undone"]);
    const auto made = look_from_json(out["look"].get<std::string>());
    ASSERT_TRUE(made.has_value()) << made.error().message;
    EXPECT_EQ(made->controls.size(), 7u);
    EXPECT_EQ(made->view, view);
    const std::vector<uint8_t> mixed = shown(stack, *made);
    ASSERT_NE(mixed, render);
    expect_shown(out["after"], mixed, steps);
    // Render left of the middle, mix right of it
    std::vector<uint8_t> wiped = mixed;
    for (size_t i = 0; i < wiped.size(); ++i)
        if (i / 3 % 64 < 32) wiped[i] = render[i];
    expect_shown(out["wiped"], wiped, steps);
}

INSTANTIATE_TEST_SUITE_P(Views,
                         WebBrowser,
                         testing::Values(std::tuple("Raw", ""),
                                         std::tuple("ACES", ""),
                                         std::tuple("sRGB", "cpu"),
                                         std::tuple("ACES", "cpu")));

TEST(WebPageOfLobes, IsMixedAsTheCommandDoes) {
    if (!has_browser()) GTEST_SKIP() << "no Chromium or no Python on this machine";
    const LayerStack stack = made_stack(false, true);
    Look look = look_of({{Control::Kind::Gain, "key:specular=0.25"}});
    look.view = "Raw";
    const json answer = browse(page_of(stack, look), "--size 1200x800", R"JS(
        const fader = document.querySelector('[data-row="diffuse"] .fader');
        fader.value = 1.5;
        fader.dispatchEvent(new Event('input', {bubbles: true}));
        fader.dispatchEvent(new Event('change', {bubbles: true}));
        document.querySelector('[data-row="coat"] .mute').click();
        await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
        const copy = document.createElement('canvas'), image = document.getElementById('image');
        copy.width = image.width;
        copy.height = image.height;
        copy.getContext('2d').drawImage(image, 0, 0);
        const rgba = copy.getContext('2d').getImageData(0, 0, copy.width, copy.height).data;
        let text = '';
        for (let i = 0; i < rgba.length; ++i) if (i % 4 < 3) text += String.fromCharCode(rgba[i]);
        return {after: btoa(text), look: mixer.look.toJson()};
    )JS");
    ASSERT_TRUE(answer.is_object());
    EXPECT_TRUE(answer["console"].empty()) << answer["console"];
    const json& out = answer["results"][0];
    const auto made = look_from_json(out["look"].get<std::string>());
    ASSERT_TRUE(made.has_value()) << made.error().message;
    EXPECT_EQ(made->controls.size(), 3u);
    const std::vector<uint8_t> mixed = shown(stack, *made);
    ASSERT_NE(mixed, shown(stack, look));
    expect_shown(out["after"], mixed, 0);
}

TEST(WebPageOfOthers, IsMixedAsTheCommandDoes) {
    if (!has_browser()) GTEST_SKIP() << "no Chromium or no Python on this machine";
    const std::string path = file("foreign.exr");
    ASSERT_TRUE(image::write_exr(path, made_foreign({{"",
                                                      {"R", "G", "B", "A", "Key.R", "Key.G",
                                                       "Key.B", "Fill.R", "Fill.G", "Fill.B"}}}))
                    .has_value());
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value()) << stack.error().message;
    Look look;
    look.view = "Raw";
    const int width = stack->image().display.width();
    ASSERT_GT(width, 0);
    const json answer = browse(page_of(*stack, look), "", R"JS(
        mixer.edit('', look => { look.setStops('Key', -1); look.setStops('rest', 0.5); });
        await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
        const copy = document.createElement('canvas'), image = document.getElementById('image');
        copy.width = image.width;
        copy.height = image.height;
        copy.getContext('2d').drawImage(image, 0, 0);
        const rgba = copy.getContext('2d').getImageData(0, 0, copy.width, copy.height).data;
        let text = '';
        for (let i = 0; i < rgba.length; ++i) if (i % 4 < 3) text += String.fromCharCode(rgba[i]);
        return {pixels: btoa(text), look: mixer.look.toJson()};)JS");
    ASSERT_TRUE(answer.is_object());
    EXPECT_TRUE(answer["console"].empty()) << answer["console"];
    const auto made = look_from_json(answer["results"][0]["look"].get<std::string>());
    ASSERT_TRUE(made.has_value());
    expect_shown(answer["results"][0]["pixels"], shown(*stack, *made), 1);
}

}  // namespace
}  // namespace velatura::compositor::exports
