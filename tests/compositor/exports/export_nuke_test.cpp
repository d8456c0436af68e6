// SPDX-License-Identifier: Apache-2.0
// The Nuke script, read by a reader of its own: as exported and with its knobs turned, it is the
// mix of `mix` with those gains.
#include "base/frames.h"
#include "compositor/exports/export.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/nuke_reader.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace velatura::compositor::exports {
namespace {

using enum Control::Kind;
using Knobs = std::map<std::string, std::vector<double>>;

const image::Window window{0, 0, 20, 17};

LayerStack rendered(bool has_matrix, bool has_bounces, bool has_groups) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = has_matrix;
    set.bounce_layers = has_bounces;
    set.group_layers = has_groups;
    set.shadow_layers = true;
    set.mattes = {true, true};
    film::Film film(window, set);
    film::render(film, 0, 8);
    film::FileInfo info;
    info.matte_names = {film::test_objects(), {"only"}};
    const std::string path = film::temporary_file("nuke_layers.exr");
    EXPECT_TRUE(film.write(path, info).has_value());
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

std::string script_of(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    const auto script = nuke_script(stack, *plan, look, "x.exr");
    EXPECT_TRUE(script.has_value()) << script.error().message;
    return *script;
}

/// Nuke multiplies factors as doubles, `mix` as floats: the same but for rounding.
void expect_mix(const NukeReader& nuke, const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const image::Image mixed = mix::apply_mix(stack, *plan, look, false);
    const char* const names[] = {"R", "G", "B", "A"};
    for (size_t c = 0; c < 4; ++c) {
        const image::Channel* channel = mixed.find(names[c]);
        if (c == 3 && !channel) continue;
        double scale = 0;
        image::for_each_value(
            *channel, [&](size_t, float v) { scale = std::max(scale, std::abs(double(v))); });
        for (size_t i = 0; i < channel->size(); ++i)
            ASSERT_NEAR(nuke.result()[c][i], channel->value(i), 2e-6 * scale + 1e-12)
                << names[c] << i;
    }
}

struct LookRow {
    const char* name;
    std::vector<std::pair<Control::Kind, const char*>> controls;
};

Look look_of_row(const LookRow& row) {
    Look look;
    for (const auto& [kind, text] : row.controls)
        look.controls.push_back(*parse_control(kind, text));
    return look;
}

const std::vector<LookRow>& rows_of_matrix() {
    static const std::vector<LookRow> rows = {
        {"as rendered", {}},
        {"gains", {{Gain, "key=2"}, {Gain, "indirect=+1.5st"}, {Gain, "all=0.7"}}},
        {"tints", {{Tint, "fill=1,.9,.8"}, {Kelvin, "key=3200"}, {Tint, "b2=1,0.5,0"}}},
        {"mutes", {{Mute, "sky"}, {Mute, "b0"}, {Mute, "fill:b1"}}},
        {"one group", {{Solo, "key"}}},
        {"a bounce and a group", {{Solo, "b1"}, {Solo, "fill"}, {Gain, "fill=3"}}},
        {"cells", {{Gain, "key:b2=0.3"}, {Tint, "env:indirect=1,2,3"}}},
        {"shadows", {{Shadow, "key=0.3"}, {Gain, "shadow=0.8"}, {Gain, "key=2"}}},
        {"nothing", {{Mute, "all"}}}};
    return rows;
}

TEST(ExportNuke, IsTheMixAsExported) {
    const LayerStack stack = rendered(true, true, true);
    for (const LookRow& row : rows_of_matrix()) {
        SCOPED_TRACE(row.name);
        Look look = look_of_row(row);
        look.exposure_stops = 0.3f;
        expect_mix(NukeReader(script_of(stack, look), stack.image()), stack, look);
    }
    // Layers as stored, without a look: the same bits
    const NukeReader nuke(script_of(stack, {}), stack.image());
    EXPECT_EQ(nuke.result()[1], std::get<std::vector<float>>(stack.image().find("G")->data));
}

TEST(ExportNuke, BouncesOrGroupsAloneHaveTheirFaders) {
    const LayerStack bounces = rendered(false, true, false), groups = rendered(false, false, true),
                     both = rendered(false, true, true);
    const Look deep = look_of({{Gain, "b2=3"}, {Mute, "tail"}, {Shadow, "key=0.5"}}),
               lit = look_of({{Gain, "key=3"}, {Tint, "fill=1,0,0"}, {Shadow, "all=0.25"}}),
               spelled = look_of({{Gain, "b0=2"}, {Gain, "direct=2"}, {Gain, "indirect=2"}});
    for (const auto& [stack, look] : {std::pair(&bounces, &deep),
                                      {&groups, &lit},
                                      {&both, &deep},
                                      {&both, &lit},
                                      {&both, &spelled}})
        expect_mix(NukeReader(script_of(*stack, *look), stack->image()), *stack, *look);
    EXPECT_FALSE(NukeReader(script_of(groups, lit), groups.image()).knobs.contains("gain_b1"));
    EXPECT_FALSE(NukeReader(script_of(bounces, deep), bounces.image()).knobs.contains("gain_key"));
}

struct Turn {
    const char* name;
    Knobs knobs;
    LookRow then;
};

TEST(ExportNuke, TurnedKnobsAreTheMixWithThoseGains) {
    const LayerStack stack = rendered(true, true, true);
    const Look before = look_of({{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "fill=0.5"}});
    const std::string script = script_of(stack, before);
    const NukeReader as_exported(script, stack.image());
    EXPECT_EQ(as_exported.knobs.at("gain_key"), std::vector<double>{2});
    EXPECT_EQ(as_exported.knobs.at("mute_sky"), std::vector<double>{1});
    EXPECT_EQ(as_exported.knobs.at("shadow_fill"), std::vector<double>{0.5});
    EXPECT_EQ(as_exported.labels.at("gain_key"), "key");
    const Turn turns[] = {
        {"a gain",
         {{"gain_key", {0.25}}},
         {"", {{Gain, "key=0.25"}, {Mute, "sky"}, {Shadow, "fill=0.5"}}}},
        {"a mute taken off", {{"mute_sky", {0}}}, {"", {{Gain, "key=2"}, {Shadow, "fill=0.5"}}}},
        {"a tint",
         {{"tint_fill", {1, 0.5, 0.25}}},
         {"", {{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "fill=0.5"}, {Tint, "fill=1,.5,.25"}}}},
        {"a bounce",
         {{"gain_b2", {4}}, {"mute_b0", {1}}},
         {"",
          {{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "fill=0.5"}, {Gain, "b2=4"}, {Mute, "b0"}}}},
        {"shadows",
         {{"shadow_fill", {0}}, {"shadow_key", {1}}},
         {"", {{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "key=1"}}}},
        {"a cell",
         {{"cell_key_b2", {0, 1, 2}}},
         {"", {{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "fill=0.5"}, {Tint, "key:b2=0,1,2"}}}},
        {"everything",
         {{"gain_all", {3}}, {"tint_all", {1, 1, 0}}},
         {"", {{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "fill=0.5"}, {Tint, "all=3,3,0"}}}}};
    for (const Turn& turn : turns) {
        SCOPED_TRACE(turn.name);
        expect_mix(NukeReader(script, stack.image(), turn.knobs), stack, look_of_row(turn.then));
    }
    Look bright = before;
    bright.exposure_stops = 2;
    expect_mix(NukeReader(script, stack.image(), {{"exposure", {2}}}), stack, bright);
}

/// Every row can be turned, those that were silent as well.
TEST(ExportNuke, EveryRowHasAFader) {
    const LayerStack stack = rendered(true, true, true);
    const NukeReader nuke(script_of(stack, look_of({{Solo, "key"}})), stack.image());
    for (const std::string& group : stack.group_names()) {
        for (const char* knob : {"gain_", "tint_", "mute_"})
            EXPECT_TRUE(nuke.knobs.contains(knob + group)) << knob << group;
    }
    for (const std::string& bounce : stack.column_names())
        EXPECT_TRUE(nuke.knobs.contains("gain_" + bounce)) << bounce;
    Knobs all;
    for (const std::string& group : stack.group_names()) all["mute_" + group] = {0};
    expect_mix(NukeReader(script_of(stack, look_of({{Solo, "key"}})), stack.image(), all), stack,
               {});
}

TEST(ExportNuke, MattesAreCryptomatteNodes) {
    const LayerStack stack = rendered(true, false, true);
    const std::string first = film::test_objects()[0];

    struct Row {
        const char* name;
        std::vector<std::tuple<Control::Kind, const char*, std::string>> controls;
    };

    const Row rows[] = {
        {"a gain", {{Gain, "key=3", "object:*"}}},
        {"outside", {{Gain, "key=3", "!material:only"}}},
        {"two mattes of a row",
         {{Gain, "key=3", "material:only"}, {Tint, "all=1,0,2", "object:*"}}},
        {"a mute and a solo", {{Mute, "b1", "material:only"}, {Solo, "fill", "object:*"}}},
        {"shadows",
         {{Shadow, "key=0.5", "material:only"},
          {Shadow, "key=0.25", ""},
          {Gain, "key=2", "!object:*"}}},
        {"shadows outside", {{Shadow, "all=1", "!material:only"}}}};
    for (const Row& row : rows) {
        SCOPED_TRACE(row.name);
        Look look;
        for (const auto& [kind, text, matte] : row.controls) {
            look.controls.push_back(*parse_control(kind, text));
            look.controls.back().matte = matte;
        }
        const NukeReader nuke(script_of(stack, look), stack.image());
        EXPECT_FALSE(nuke.matte_lists.empty());
        expect_mix(nuke, stack, look);
    }
    // The knob of a control within a matte
    Look look = look_of({{Gain, "key=3"}});
    look.controls[0].matte = "material:only";
    const std::string script = script_of(stack, look);
    look.controls[0] = *parse_control(Tint, "key=0,1,5");
    look.controls[0].matte = "material:only";
    expect_mix(NukeReader(script, stack.image(), {{"within_key", {0, 1, 5}}}), stack, look);
    // An image is no Cryptomatte
    look.controls[0].matte = stack.path() + ":A";
    const auto refused = nuke_script(stack, *mix::plan_mix(stack, look), look, "x.exr");
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "export-matte");
}

TEST(ExportNuke, ClampsAndCastersAreTermsOfTheirOwn) {
    const auto stack = LayerStack::from_image(made_layers());
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of(
        {{Clamp, "all=0.5"}, {Gain, "tail=2"}, {Shadow, "key=0.25"}, {Caster, "fill:tree=0.75"}});
    const std::string script = script_of(*stack, look);
    expect_mix(NukeReader(script, stack->image()), *stack, look);
    const Look other = look_of(
        {{Clamp, "all=0.5"}, {Gain, "tail=2"}, {Shadow, "key=0.25"}, {Caster, "fill:tree=0"}});
    expect_mix(NukeReader(script, stack->image(), {{"shadow_fill_tree", {0}}}), *stack, other);
}

TEST(ExportNuke, RowsOfOtherRenderersHaveFaders) {
    const auto stack = LayerStack::from_image(
        made_foreign({{"",
                       {"R", "G", "B", "A", "View.key.R", "View.key.G", "View.key.B",
                        "View.a=b {[$x.R", "View.a=b {[$x.G", "View.a=b {[$x.B"}}}),
        ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Gain, "key=3"}, {Gain, "rest=0.5"}});
    const std::string script = script_of(*stack, look);
    expect_mix(NukeReader(script, stack->image()), *stack, look);
    const NukeReader other(script, stack->image(), {{"gain_key", {0}}, {"tint_rest", {1, 0, 1}}});
    expect_mix(other, *stack, look_of({{Gain, "key=0"}, {Gain, "rest=0.5"}, {Tint, "rest=1,0,1"}}));
}

/// Rows alone, whose sum is the beauty; the alpha is that of the first.
TEST(ExportNuke, RowsWithoutABeautyAddUp) {
    const auto stack = LayerStack::from_image(
        made_foreign({{"",
                       {"View.key.R", "View.key.G", "View.key.B", "View.key.A", "View.fill.R",
                        "View.fill.G", "View.fill.B"}}}),
        ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Gain, "key=3"}, {Gain, "fill=0.5"}});
    expect_mix(NukeReader(script_of(*stack, look), stack->image()), *stack, look);
    expect_mix(NukeReader(script_of(*stack, {}), stack->image(), {{"gain_fill", {0}}}), *stack,
               look_of({{Gain, "fill=0"}}));
    // Nothing is heard: black of the right size, in the scripts without knobs as well
    const Look nothing = look_of({{Mute, "all"}});
    expect_mix(NukeReader(script_of(*stack, nothing), stack->image()), *stack, nothing);
    const auto recipe = mix_recipe(*stack, *mix::plan_mix(*stack, nothing), nothing, "x.exr");
    ASSERT_TRUE(recipe.has_value());
    ASSERT_EQ(recipe->terms.size(), 1u);
    EXPECT_EQ(recipe->terms[0].layer, "key");
    EXPECT_EQ(recipe->terms[0].gain, (std::array<float, 3>{0, 0, 0}));
}

/// Where the beauty has a name, its alpha is of that layer.
TEST(ExportNuke, TheAlphaIsThatOfTheBeauty) {
    const auto stack = LayerStack::from_image(
        made_foreign({{"",
                       {"View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Combined.A",
                        "View.key.R", "View.key.G", "View.key.B"}}}),
        ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Gain, "key=3"}});
    expect_mix(NukeReader(script_of(*stack, look), stack->image()), *stack, look);
}

TEST(ExportNuke, FilesAreNamedFromTheScriptsFolder) {
    const LayerStack stack = rendered(false, false, true);
    const auto plan = mix::plan_mix(stack, {});
    const auto named = [&](const std::string& file, const std::string& folder) {
        const auto script = nuke_script(stack, *plan, {}, file, folder);
        EXPECT_TRUE(script.has_value()) << script.error().message;
        return NukeReader(*script, stack.image()).file;
    };
    EXPECT_EQ(named("shot.exr", ""), "FOLDER/shot.exr");
    EXPECT_EQ(named("exr/shot.####.exr", "comp"), "FOLDER/../exr/shot.####.exr");
    EXPECT_EQ(named("../exr/shot.%04d.exr", "."), "FOLDER/../exr/shot.####.exr");
    EXPECT_EQ(named("comp/shot.exr", "comp/"), "FOLDER/shot.exr");
    EXPECT_EQ(named("/mnt/shot.exr", "comp"), "/mnt/shot.exr");
    for (const char* name : {"it's $HOME [exit] \"x\" \\.exr", "a{b}c.exr", "li\nne.exr"})
        EXPECT_EQ(named(name, ""), "FOLDER/" + std::string(name));
}

TEST(ExportNuke, ReadsASequenceWithItsRange) {
    const std::string folder = film::temporary_file("nuke_sequence");
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const LayerStack stack = rendered(false, false, true);
    for (const int frame : {-3, 7, 12345}) {
        std::filesystem::copy_file(stack.path(), frame_path(folder + "/s h.####.exr", frame));
    }
    const auto plan = mix::plan_mix(stack, {});
    const auto read = [&](const std::string& file) {
        return NukeReader(*nuke_script(stack, *plan, {}, file), stack.image());
    };
    const NukeReader nuke = read(folder + "/s h.%04d.exr");
    EXPECT_EQ(nuke.file, folder + "/s h.####.exr");
    EXPECT_EQ(nuke.range, "-3 12345");
    expect_mix(nuke, stack, {});
    const auto folders = nuke_script(stack, *plan, {}, "new.####/s.####.exr");
    EXPECT_EQ(folders.error().code, "export-sequence");
}

/// The light is out in the first frame: its layers are black there and not stored.
TEST(ExportNuke, LayersThatTheFirstFrameDoesNotStoreHaveFadersAsWell) {
    const std::string folder = film::temporary_file("nuke_dark");
    std::filesystem::create_directories(folder);
    image::Image lit = made_layers(), dark = made_layers();
    take_out(dark, {"b1_key", "S_key", "S_key_tree", "S_key_rest"});
    ASSERT_TRUE(layers::write_image_file(folder + "/s.0001.exr", dark).has_value());
    ASSERT_TRUE(layers::write_image_file(folder + "/s.0002.exr", lit).has_value());
    const auto first = LayerStack::load(folder + "/s.0001.exr"),
               second = LayerStack::load(folder + "/s.0002.exr");
    const Look look = look_of({{Gain, "key=3"}, {Gain, "fill=0.5"}});
    const auto script =
        nuke_script(*first, *mix::plan_mix(*first, look), look, folder + "/s.####.exr");
    ASSERT_TRUE(script.has_value()) << script.error().message;
    expect_mix(NukeReader(*script, first->image()), *first, look);
    expect_mix(NukeReader(*script, second->image()), *second, look);
    expect_mix(NukeReader(*script, second->image(), {{"shadow_key", {1}}}), *second,
               look_of({{Gain, "key=3"}, {Gain, "fill=0.5"}, {Shadow, "key=1"}}));
}

}  // namespace
}  // namespace velatura::compositor::exports
