// SPDX-License-Identifier: Apache-2.0
// What the numbers of a file mean, under several OpenColorIO configs, against oiiotool.
#include "base/atomic_file.h"
#include "compositor/look/stack_color.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "image/display.h"
#include "image/exr.h"
#include "image/formats.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;

/// Matrices to ACES2065-1 as the ACES configs publish them (Bradford).
constexpr const char* rec709 =
    "0.439632981919, 0.382988698152, 0.177378319929, 0, 0.089776442959, 0.813439428749, "
    "0.096784128292, 0, 0.017541170383, 0.111546553302, 0.870912276315, 0, 0, 0, 0, 1";
constexpr const char* p3 =
    "0.518933487597981, 0.286256589638669, 0.19480992276335, 0, 0.0738593830470598, "
    "0.819845163936986, 0.106295453015954, 0, -0.000307011368446647, 0.0438070502536223, "
    "0.956499961114824, 0, 0, 0, 0, 1";
constexpr const char* rec2020 =
    "0.679085634706912, 0.157700914643159, 0.163213450649929, 0, 0.0460020030800595, "
    "0.859054673002908, 0.0949433239170327, 0, -0.000573943187616196, 0.0284677684080264, "
    "0.97210617477959, 0, 0, 0, 0, 1";

std::string matrix_space(const std::string& name, const char* matrix, const char* aliases = "") {
    return fmt::format(
        "  - !<ColorSpace>\n    name: {}\n{}    to_scene_reference: !<MatrixTransform> {{matrix: "
        "[{}]}}\n",
        name, *aliases ? fmt::format("    aliases: [{}]\n", aliases) : "", matrix);
}

std::string acescg_space(const std::string& name) {
    return fmt::format(
        "  - !<ColorSpace>\n    name: {}\n    to_scene_reference: !<BuiltinTransform> {{style: "
        "ACEScg_to_ACES2065-1}}\n",
        name);
}

std::string aces_space(const std::string& name) {
    return fmt::format("  - !<ColorSpace>\n    name: {}\n", name);
}

std::string config(const std::string& linear, const std::string& roles, const std::string& spaces) {
    return fmt::format(
        "ocio_profile_version: 2\nstrictparsing: true\nroles:\n{}  scene_linear: {}\n  default: "
        "Raw\nfile_rules:\n  - !<Rule> {{name: Default, colorspace: default}}\ndisplays:\n"
        "  sRGB - Display:\n    - !<View> {{name: ACES, view_transform: ACES, display_colorspace: "
        "sRGB - Display}}\n    - !<View> {{name: Plain, view_transform: Plain, "
        "display_colorspace: sRGB - Display}}\n    - !<View> {{name: Raw, colorspace: Raw}}\n"
        "default_view_transform: Plain\nview_transforms:\n  - !<ViewTransform>\n    name: Plain\n"
        "    from_scene_reference: !<BuiltinTransform> {{style: UTILITY - "
        "ACES-AP0_to_CIE-XYZ-D65_BFD}}\n  - !<ViewTransform>\n    name: ACES\n"
        "    from_scene_reference: !<BuiltinTransform> {{style: ACES-OUTPUT - "
        "ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0}}\ndisplay_colorspaces:\n"
        "  - !<ColorSpace>\n    name: sRGB - Display\n    from_display_reference: "
        "!<BuiltinTransform> {{style: DISPLAY - CIE-XYZ-D65_to_sRGB}}\ncolorspaces:\n{}"
        "  - !<ColorSpace>\n    name: Raw\n    isdata: true\n",
        roles, linear, spaces);
}

std::string path_of(const std::string& name) {
    return film::temporary_file("color_" + name);
}

std::string written(const std::string& name, const std::string& text) {
    const std::string path = path_of(name);
    EXPECT_TRUE(write_file_atomically(path, text).has_value());
    return path;
}

/// Has every space under names of its own: what oiiotool is asked with.
std::string oracle_config() {
    return written("oracle.ocio",
                   config("cg", "",
                          aces_space("ap0") + acescg_space("cg") + matrix_space("r709", rec709) +
                              matrix_space("p3", p3) + matrix_space("r2020", rec2020)));
}

struct Config {
    const char* name;
    std::string path;    ///< empty: built in
    const char* linear;  ///< what a file that says nothing is, by the oracle's names
};

std::vector<Config> configs() {
    return {
        {"built-in", "", "r709"},
        {"ACES 1.3",
         written("aces13.ocio",
                 config("ACEScg", "  aces_interchange: ACES2065-1\n",
                        aces_space("ACES2065-1") + acescg_space("ACEScg") +
                            matrix_space("Linear Rec.709 (sRGB)", rec709, "lin_rec709, lin_srgb") +
                            matrix_space("Linear P3-D65", p3) +
                            matrix_space("Linear Rec.2020", rec2020))),
         "cg"},
        {"ACES 1.2",
         written("aces12.ocio",
                 config("ACES - ACEScg", "",
                        aces_space("ACES - ACES2065-1") + acescg_space("ACES - ACEScg") +
                            matrix_space("Utility - Linear - sRGB", rec709))),
         "cg"},
        {"studio",
         written("studio.ocio", config("hal_work", "  aces_interchange: hal_archive\n",
                                       aces_space("hal_archive") + acescg_space("hal_work"))),
         "cg"},
        // No role and no name that is known: the matrix between its spaces says what they are
        {"unnamed",
         written("unnamed.ocio", config("scene", "",
                                        aces_space("store") + acescg_space("scene") +
                                            matrix_space("monitors", rec709))),
         "cg"},
    };
}

struct File {
    std::string name;
    std::optional<image::Chromaticities> primaries;
    std::string id;
    const char* space;  ///< of the oracle; null: that of the config
};

std::vector<File> files() {
    std::vector<File> all;

    struct Kind {
        const char* name;
        const char* id;
        const char* space;
        image::Chromaticities primaries;
    };

    const std::vector<Kind> kinds = {
        {"Rec.709", "lin_rec709_scene", "r709", {.64f, .33f, .3f, .6f, .15f, .06f, .3127f, .329f}},
        {"P3-D65", "lin_p3d65_scene", "p3", {.68f, .32f, .265f, .69f, .15f, .06f, .3127f, .329f}},
        {"Rec.2020",
         "lin_rec2020_scene",
         "r2020",
         {.708f, .292f, .17f, .797f, .131f, .046f, .3127f, .329f}},
        {"AP0", "lin_ap0_scene", "ap0", {.7347f, .2653f, 0, 1, .0001f, -.077f, .32168f, .33767f}},
        {"AP1", "lin_ap1_scene", "cg", {.713f, .293f, .165f, .83f, .128f, .044f, .32168f, .33767f}},
    };
    for (const Kind& k : kinds) {
        all.push_back({k.name, k.primaries, "", k.space});
        all.push_back({std::string(k.name) + " + ID", k.primaries, k.id, k.space});
    }
    all.push_back({"unlabelled", {}, "", nullptr});
    all.push_back({"ID alone", {}, "lin_p3d65_scene", "p3"});
    return all;
}

/// Grays and saturated colors from black to above white.
image::Image chart() {
    image::Image image = made_foreign({{"", {"R", "G", "B"}}});
    for (size_t c = 0; c < 3; ++c) {
        auto& values = std::get<std::vector<float>>(image.parts[0].channels[c].data);
        for (size_t i = 0; i < values.size(); ++i) {
            const float level = 1.2f * float(i) / float(values.size());
            values[i] = i % 4 == 3 || i % 4 == c ? level : 0.15f * level;
        }
    }
    return image;
}

image::Image file_of(const File& file) {
    image::Image image = chart();
    if (file.primaries) image.attributes["chromaticities"] = *file.primaries;
    if (!file.id.empty()) image.attributes["colorInteropID"] = file.id;
    return image;
}

/// Largest difference in steps of 8 bits.
double steps(const std::vector<float>& a, const std::vector<float>& b) {
    EXPECT_EQ(a.size(), b.size());
    double max = 0;
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        max = std::max(max, 255.0 * std::abs(double(a[i]) - double(b[i])));
    return max;
}

class Color : public testing::Test {
  protected:
    void SetUp() override {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
        GTEST_SKIP() << "built without the plugin openimageio";
#endif
        if (std::system("oiiotool --version >/dev/null 2>&1") != 0)
            GTEST_SKIP() << "no oiiotool on this machine";
        ASSERT_TRUE(image::write_exr(path_of("chart.exr"), chart()).has_value());
        oracle_ = oracle_config();
    }

    void TearDown() override {
        unsetenv("OCIO");
    }

    const std::vector<float>& expected(const std::string& space, const std::string& view) {
        std::vector<float>& pixels = known_[space + view];
        if (!pixels.empty()) return pixels;
        const std::string png = path_of("oracle.png");
        const Outcome outcome = run(
            fmt::format("oiiotool --colorconfig {} {} --ociodisplay:from={} 'sRGB - Display' {} "
                        "-d uint8 -o {}",
                        oracle_, path_of("chart.exr"), space, view, png));
        EXPECT_EQ(outcome.code, 0) << outcome.output;
        const auto read = image::read_rgb_image(png, image::SourceColorSpace::Raw);
        EXPECT_TRUE(read.has_value());
        if (read) pixels = read->pixels;
        return pixels;
    }

    std::string oracle_;
    std::map<std::string, std::vector<float>> known_;
};

void use(const Config& config) {
    if (config.path.empty()) {
        unsetenv("OCIO");
    } else {
        setenv("OCIO", config.path.c_str(), 1);
    }
}

TEST_F(Color, OfTwelveFilesUnderFiveConfigsIsThatOfOiiotool) {
    std::string table;
    for (const Config& config : configs()) {
        use(config);
        table += fmt::format("{:<9}", config.name);
        for (const File& file : files()) {
            const auto stack = LayerStack::from_image(file_of(file), ForeignFiles::Plain);
            ASSERT_TRUE(stack.has_value());
            double max = 0;
            for (const std::string view : {"ACES", "Plain"}) {
                Look look;
                look.view = config.path.empty() && view == "Plain" ? "sRGB" : view;
                const std::vector<float>& right =
                    expected(file.space ? file.space : config.linear, view);
                // The command
                std::vector<std::string> warnings;
                const std::string png = path_of("shown.png");
                const image::Image mixed = apply_mix(*stack, *plan_mix(*stack, look), look, false);
                const auto done = write_display(png, mixed, look, {}, &warnings);
                ASSERT_TRUE(done.has_value()) << done.error().message;
                const auto shown = image::read_rgb_image(png, image::SourceColorSpace::Raw);
                ASSERT_TRUE(shown.has_value());
                max = std::max(max, steps(shown->pixels, right));
                EXPECT_EQ(warnings.size(), file.space ? 0u : 1u)
                    << config.name << ", " << file.name << (warnings.empty() ? "" : warnings[0]);
                // The window
                const auto transform =
                    image::DisplayTransform::make("", look.view, *color_of_stack(*stack, look));
                ASSERT_TRUE(transform.has_value()) << transform.error().message;
                std::vector<float> rgb(right.size());
                for (size_t i = 0; i < rgb.size(); ++i)
                    rgb[i] = mixed.parts[0].channels[i % 3].value(i / 3);
                transform->apply(rgb);
                for (float& v : rgb) v = float(image::display_byte(v)) / 255.0f;
                max = std::max(max, steps(rgb, right));
            }
            table += fmt::format(" {:.0f}", max);
            EXPECT_LE(max, 1.0) << config.name << ", " << file.name;
        }
        table += "\n";
    }
    std::string heads;
    for (const File& file : files()) heads += file.name + ", ";
    fmt::print("largest difference to oiiotool in steps of 8 bits; columns: {}\n{}", heads, table);
}

/// A camera's primaries that no config names; the oracle multiplies by the matrix first.
TEST_F(Color, PrimariesOfTheirOwnAreComputed) {
    File file{"own", image::Chromaticities{.7f, .3f, .2f, .75f, .13f, .05f, .3457f, .3585f}, "",
              ""};
    const auto stack = LayerStack::from_image(file_of(file), ForeignFiles::Plain);
    // By SMPTE RP 177 and Bradford from D50 to ACES white, in Python with fractions; to Rec.709
    // by the inverse of the matrix above
    const auto to_aces = image::aces_from_rgb(*file.primaries);
    ASSERT_TRUE(to_aces.has_value());
    for (size_t row = 0; row < 3; ++row) {
        // White stays white under the adaptation
        EXPECT_NEAR((*to_aces)[3 * row] + (*to_aces)[3 * row + 1] + (*to_aces)[3 * row + 2], 1.0,
                    1e-4);
    }
    std::string matrix;
    for (size_t i = 0; i < 9; ++i)
        matrix += fmt::format("{}{}", (*to_aces)[i], i % 3 == 2 ? ", 0, " : ", ");
    const std::string own =
        written("own.ocio", config("cg", "",
                                   aces_space("ap0") + acescg_space("cg") +
                                       matrix_space("own", (matrix + "0, 0, 0, 1").c_str())));
    oracle_ = own;
    for (const Config& config : configs()) {
        use(config);
        Look look;
        look.view = "ACES";
        const image::Image mixed = apply_mix(*stack, *plan_mix(*stack, look), look, false);
        ASSERT_TRUE(write_display(path_of("own.png"), mixed, look).has_value());
        const auto shown = image::read_rgb_image(path_of("own.png"), image::SourceColorSpace::Raw);
        EXPECT_LE(steps(shown->pixels, expected("own", "ACES")), 1.0) << config.name;
    }
}

TEST_F(Color, InputSpaceSaysItForFilesThatDoNot) {
    const File wrong{"wrong", files()[0].primaries, "", ""};
    const auto stack = LayerStack::from_image(file_of(wrong), ForeignFiles::Plain);

    struct Case {
        size_t config;
        const char* asked;
        const char* space;
    };

    for (const Case& c : std::vector<Case>{{0, "ACEScg", "cg"},
                                           {0, "lin_rec2020", "r2020"},
                                           {1, "scene_linear", "cg"},
                                           {1, "LIN_SRGB", "r709"},
                                           {3, "hal_archive", "ap0"},
                                           {3, "lin_p3d65_scene", "p3"}}) {
        use(configs()[c.config]);
        Look look;
        look.view = "ACES";
        look.input_space = c.asked;
        const image::Image mixed = apply_mix(*stack, *plan_mix(*stack, look), look, false);
        ASSERT_TRUE(write_display(path_of("asked.png"), mixed, look).has_value()) << c.asked;
        const auto shown =
            image::read_rgb_image(path_of("asked.png"), image::SourceColorSpace::Raw);
        EXPECT_LE(steps(shown->pixels, expected(c.space, "ACES")), 1.0) << c.asked;
    }
    Look look;
    look.input_space = "ACESgc";
    const auto plan = plan_mix(*stack, look);
    ASSERT_FALSE(plan.has_value());
    EXPECT_EQ(plan.error().code, "unknown-space");
}

TEST_F(Color, RawViewsShowTheNumbersOfAnyFile) {
    for (const Config& config : configs()) {
        use(config);
        for (const File& file : files()) {
            const auto stack = LayerStack::from_image(file_of(file), ForeignFiles::Plain);
            const auto t = image::DisplayTransform::make("", "Raw", *color_of_stack(*stack, {}));
            ASSERT_TRUE(t.has_value()) << t.error().message;
            std::vector<float> rgb = {0.25f, 3.0f, 0.1f};
            t->apply(rgb);
            EXPECT_EQ(rgb, (std::vector<float>{0.25f, 3.0f, 0.1f})) << config.name << file.name;
        }
    }
}

TEST(FileColor, SaysWhatItDoesNotKnow) {
    unsetenv("OCIO");
    image::Image image = chart();
    const auto warning_of = [&image] {
        const auto color = image::color_of(image);
        EXPECT_TRUE(color.has_value());
        EXPECT_EQ(color->known, &image::linear_rec709());
        return color->warnings.empty() ? std::string() : color->warnings[0];
    };
    EXPECT_NE(warning_of().find("has no color space"), std::string::npos);
    image.attributes["colorInteropID"] = std::string("lin_hal9000_scene");
    EXPECT_NE(warning_of().find("'lin_hal9000_scene' is neither known"), std::string::npos);
    image.attributes["colorInteropID"] = std::string("data");
    EXPECT_NE(warning_of().find("data, not colors"), std::string::npos);
    image.attributes.erase("colorInteropID");
    for (const image::Chromaticities bad : {image::Chromaticities{},
                                            {.64f, .33f, .64f, .33f, .15f, .06f, .3127f, .329f},
                                            {.64f, .33f, .3f, .6f, .15f, .06f, .3127f, 0},
                                            {NAN, .33f, .3f, .6f, .15f, .06f, .3f, .3f}}) {
        image.attributes["chromaticities"] = bad;
        EXPECT_NE(warning_of().find("are not valid primaries"), std::string::npos);
    }
    // Which of two statements counts
    image.attributes["chromaticities"] = files()[8].primaries.value();
    image.attributes["colorInteropID"] = std::string("lin_rec709_scene");
    EXPECT_NE(warning_of().find("chromaticities are ACEScg: using linear Rec.709"),
              std::string::npos);
    // The part of the beauty speaks for itself
    image.parts.resize(2);
    image.parts[1].attributes["colorInteropID"] = std::string("lin_ap0_scene");
    EXPECT_EQ(image::color_of(image, "", 1)->label, "ACES2065-1");
}

/// 3200 K against 6504 K: the cubic of Kim et al. in linear Rec.709, and that color in ACEScg by
/// the published matrix (0.6131 0.3395 0.0474; 0.0702 0.9164 0.0135; 0.0206 0.1096 0.8698).
TEST(FileColor, ColorTemperaturesAreThoseOfTheFilesPrimaries) {
    unsetenv("OCIO");

    struct Case {
        size_t file;
        std::array<double, 3> tint;
    };

    for (const Case& c : {Case{0, {1.617, 0.886, 0.316}}, Case{8, {1.307, 0.929, 0.405}}}) {
        const auto stack = LayerStack::from_image(file_of(files()[c.file]), ForeignFiles::Plain);
        const auto plan = plan_mix(*stack, look_of({{Kelvin, "all=3200"}}));
        ASSERT_TRUE(plan.has_value());
        for (size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(double(plan->terms[0].gain[i]), c.tint[i], 6e-4) << c.file;
    }
}

}  // namespace
}  // namespace velatura::compositor::mix
