// SPDX-License-Identifier: Apache-2.0
// Layers of other programs have any name: each can be gained, in looks and exports as well.
#include "base/atomic_file.h"
#include "compositor/exports/export.h"
#include "compositor/look/row_names.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/nuke_reader.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

std::vector<std::string> channels_of(const std::vector<std::string>& layers) {
    std::vector<std::string> channels = {"R", "G", "B", "A"};
    for (const std::string& layer : layers) {
        for (const char* c : {".R", ".G", ".B"}) channels.push_back(layer + c);
    }
    return channels;
}

LayerStack stack_of(const std::vector<std::string>& layers) {
    auto stack =
        LayerStack::from_image(made_foreign({{"", channels_of(layers)}}), ForeignFiles::Plain);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

/// Every printable character of ASCII, words and bounces of the grammar, expressions, UTF-8.
std::vector<std::string> hostile_names() {
    std::vector<std::string> names = {"RGBA_char:key",
                                      "a=b",
                                      "a=b,c",
                                      "shadow",
                                      "all",
                                      "env",
                                      "direct",
                                      "indirect",
                                      "tail",
                                      "b0",
                                      "b1",
                                      "key:b1",
                                      "rest",
                                      "lpe:C[<L.'key'>]",
                                      "C<RD>.+L",
                                      "my fill",
                                      "a,b",
                                      "\\,",
                                      "a\\",
                                      "x=1@2,3@4",
                                      "{}",
                                      "[exit]",
                                      "$(x)",
                                      "\xc3\xa4",
                                      "50%",
                                      "1",
                                      "-1",
                                      "--gain",
                                      "\"",
                                      "'",
                                      "#.exr:R",
                                      "0,1,2",
                                      "View Layer.key light"};
    for (char c = ' '; c < 127; ++c) {
        if (c != '.') names.push_back(std::string("n") + c + "x");
    }
    return names;
}

TEST(OwnNames, EveryRowCanBeGainedAndKeepsItsNameInLooks) {
    const std::vector<std::string> names = hostile_names();
    const LayerStack stack = stack_of(names);
    const std::vector<std::string> rows = stack.group_names();
    ASSERT_EQ(rows.size(), names.size() + 1);
    for (size_t r = 0; r + 1 < rows.size(); ++r) {
        const std::string& row = rows[r];
        // As it is typed, as the window writes it, and back from a preset
        const auto typed = parse_control(Gain, row + "=3");
        ASSERT_TRUE(typed.has_value()) << row << ": " << typed.error().message;
        const auto made = make_control(Gain, row, "3");
        ASSERT_TRUE(made.has_value());
        EXPECT_EQ(typed->target, row);
        EXPECT_EQ(typed->factor, made->factor);
        Look look;
        look.controls = {*typed, *make_control(Mute, row, "")};
        ASSERT_TRUE(add_rows(look, "set", {row, "rest"}).has_value());
        const auto again = look_from_json(look_to_json(look));
        ASSERT_TRUE(again.has_value()) << row << ": " << again.error().message;
        EXPECT_TRUE(look_differences(look, *again).empty()) << row;
        const auto selected = RowNames(stack, {}).select(row);
        ASSERT_TRUE(selected.has_value()) << row << ": " << selected.error().message;
        Selection right(rows.size());
        right[r] = true;
        EXPECT_EQ(*selected, right) << row;
        look.controls.pop_back();
        EXPECT_EQ(mix::plan_mix(stack, look)->terms.size(), 2u) << row;
    }
    // The row of an expression has its whole name
    EXPECT_NE(std::find(rows.begin(), rows.end(), "lpe:C[<L.'key'>]"), rows.end());
    EXPECT_NE(std::find(rows.begin(), rows.end(), "key light"), rows.end());
}

TEST(OwnNames, RowsThatAreCalledLikeWordsAreThoseRows) {
    const LayerStack stack = stack_of({"shadow", "all"});
    const auto image = [&](std::initializer_list<std::pair<Control::Kind, const char*>> controls) {
        const Look look = look_of(controls);
        const auto plan = mix::plan_mix(stack, look);
        EXPECT_TRUE(plan.has_value()) << plan.error().message;
        return mix::apply_mix(stack, *plan, look, false);
    };
    const auto tinted = image({{Tint, "shadow=2,1,1"}}), gained = image({{Gain, "all=2"}});
    for (size_t i = 0; i < stack.image().data.pixel_count(); ++i) {
        ASSERT_EQ(tinted.find("R")->value(i), made_value("R", i) + made_value("shadow.R", i));
        ASSERT_EQ(gained.find("R")->value(i), made_value("R", i) + made_value("all.R", i));
    }
    // Where no row is called so, they are words
    const LayerStack plain = stack_of({"key"});
    EXPECT_EQ(mix::plan_mix(plain, look_of({{Gain, "all=2"}}))->terms.size(), 1u);
}

TEST(OwnNames, CommasWithinNamesOfSetsAreEscaped) {
    Look look;
    ASSERT_TRUE(add_rows(look, "two=a\\,b,my fill").has_value());
    EXPECT_EQ(look.rows["two"], (std::vector<std::string>{"a,b", "my fill"}));
    const auto again = look_from_json(look_to_json(look));
    ASSERT_TRUE(again.has_value());
    EXPECT_EQ(again->rows, look.rows);
    EXPECT_FALSE(add_rows(look, "two=a,").has_value());
    EXPECT_FALSE(add_rows(look, "=a").has_value());
    EXPECT_FALSE(parse_control(Gain, "=2").has_value());
    EXPECT_FALSE(parse_control(Gain, "key").has_value());
    EXPECT_FALSE(parse_control(Gain, "key=").has_value());
}

TEST(OwnNames, OiiotoolRebuildsMixesOfAnyNames) {
    if (std::system("oiiotool --version >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "no oiiotool on this machine";
    const std::string path = film::temporary_file("names_export.exr");
    ASSERT_TRUE(
        image::write_exr(path, made_foreign({{"", channels_of(hostile_names())}})).has_value());
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    Look look;
    for (const std::string& row : stack->group_names()) {
        if (row != "rest" && row != "rest_2")
            look.controls.push_back(*make_control(Gain, row, "2"));
    }
    const auto plan = mix::plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    const image::Image right = mix::apply_mix(*stack, *plan, look, false);
    const auto recipe = exports::mix_recipe(*stack, *plan, look, path);
    ASSERT_TRUE(recipe.has_value());
    ASSERT_GE(recipe->terms.size(), hostile_names().size());
    const std::string script = film::temporary_file("names_export.sh"),
                      result = film::temporary_file("names_result.exr");
    ASSERT_TRUE(write_file_atomically(script, exports::oiio_script(*recipe)).has_value());
    const Outcome outcome = run(fmt::format("sh {} {} {}", script, path, result));
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    const auto rebuilt = image::read_exr(result);
    ASSERT_TRUE(rebuilt.has_value());
    for (const char* c : {"R", "G", "B", "A"}) {
        const image::Channel *a = rebuilt->find(c), *b = right.find(c);
        ASSERT_TRUE(a && b) << c;
        for (size_t i = 0; i < b->size(); ++i) ASSERT_EQ(a->value(i), b->value(i)) << c << i;
    }
    // Nuke's names are plain, its nodes are told apart
    const std::string nuke = *exports::nuke_script(*stack, *plan, look, path);
    EXPECT_NE(nuke.find("add_layer {RGBA_char_key RGBA_char_key.red"), std::string::npos);
    EXPECT_EQ(nuke.find("add_layer {a=b"), std::string::npos);
}

/// Random names of all bytes that a channel may hold; fixed seed.
TEST(OwnNames, RandomNamesEndNoProgram) {
    std::mt19937 random(33);
    for (int file = 0; file < 100; ++file) {
        std::vector<std::string> layers;
        for (int i = 0; i < 6; ++i) {
            std::string name;
            const size_t length = 1 + random() % 12;
            while (name.size() < length) name += char(1 + random() % 255);
            layers.push_back(name);
        }
        const LayerStack stack = stack_of(layers);
        for (const std::string& row : stack.group_names()) {
            const auto control = make_control(Gain, row, "2");
            ASSERT_TRUE(control.has_value());
            Look look;
            look.controls = {*control};
            const auto plan = mix::plan_mix(stack, look);
            ASSERT_TRUE(plan.has_value()) << plan.error().message;
            const image::Image mixed = mix::apply_mix(stack, *plan, look, false);
            const auto recipe = exports::mix_recipe(stack, *plan, look, "x.exr");
            ASSERT_TRUE(recipe.has_value());
            EXPECT_FALSE(exports::oiio_script(*recipe).empty() ||
                         exports::blender_script(*recipe).empty());
            const auto nuke = exports::nuke_script(stack, *plan, look, "x.exr");
            ASSERT_TRUE(nuke.has_value());
            const NukeReader reader(*nuke, stack.image());
            EXPECT_EQ(reader.knobs.at("exposure"), std::vector<double>{0});
        }
    }
}

}  // namespace
}  // namespace velatura::compositor
