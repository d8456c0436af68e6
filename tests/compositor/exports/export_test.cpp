// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/export.h"

#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>

namespace velatura::compositor::exports {
namespace {

using enum Control::Kind;

std::string file(const std::string& name) {
    return film::temporary_file("export_" + name);
}

film::Film rendered() {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = true;
    film::Film film({0, 0, 20, 17}, set);
    film::render(film, 0, 8);
    return film;
}

/// A file and a look that uses every kind of control.
struct Mixed {
    std::string path = file("it's $HOME.exr");
    LayerStack stack;
    MixRecipe recipe;
    image::Image expected;

    explicit Mixed(layers::Layout layout = layers::Layout::MultiPart)
        : stack([&] {
              film::FileInfo info;
              info.layout = layout;
              EXPECT_TRUE(rendered().write(path, info).has_value());
              return std::move(*LayerStack::load(path));
          }()) {
        Look look = look_of({{Gain, "indirect=+1.5st"},
                             {Tint, "fill=1,.9,.8"},
                             {Mute, "env"},
                             {Shadow, "key=0.3"}});
        look.exposure_stops = 0.3f;
        const auto plan = mix::plan_mix(stack, look);
        EXPECT_TRUE(plan.has_value());
        expected = mix::apply_mix(stack, *plan, look, false);
        recipe = std::move(*mix_recipe(stack, *plan, look, path));
    }
};

void expect_same(const image::Image& a, const image::Image& b) {
    for (const char* name : {"R", "G", "B", "A"}) {
        const image::Channel *x = a.find(name), *y = b.find(name);
        ASSERT_TRUE(x && y) << name;
        for (size_t i = 0; i < x->size(); ++i)
            ASSERT_EQ(x->value(i), y->value(i)) << name << " " << i;
    }
}

TEST(Export, OiiotoolRebuildsTheMixBitForBit) {
    if (std::system("oiiotool --version >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "no oiiotool on this machine";
    for (const auto layout : {layers::Layout::MultiPart, layers::Layout::SinglePart}) {
        const Mixed mixed(layout);
        ASSERT_TRUE(write_file_atomically(file("mix.sh"), oiio_script(mixed.recipe)).has_value());
        const std::string command = "sh " + file("mix.sh") + " " + "\"" + file("it's \\$HOME.exr") +
                                    "\" " + file("oiio.exr");
        ASSERT_EQ(std::system(command.c_str()), 0);
        const auto result = image::read_exr(file("oiio.exr"));
        ASSERT_TRUE(result.has_value()) << result.error().message;
        expect_same(*result, mixed.expected);
        EXPECT_EQ(result->text("velatura/closure"), "") << "it is no file of light layers any more";
    }
}

TEST(Export, BlenderScriptIsPythonAndNamesEveryLayer) {
    const Mixed mixed;
    const std::string script = blender_script(mixed.recipe);
    ASSERT_TRUE(write_file_atomically(file("mix.py"), script).has_value());
    const std::string check =
        "python3 -c 'import ast,sys; ast.parse(open(sys.argv[1]).read())' " + file("mix.py");
    EXPECT_EQ(std::system(check.c_str()), 0);
    ASSERT_GT(mixed.recipe.terms.size(), 8u);
    for (const MixRecipe::Term& term : mixed.recipe.terms)
        EXPECT_NE(script.find("(\"" + term.layer + "\", ("), std::string::npos) << term.layer;
}

/// Frames -3, 7 and 12345 of one film with other samples, and the recipe of a name for them.
struct MixedSequence {
    std::string folder = file("sequence");
    std::map<int, image::Image> expected;
    LayerStack stack;
    mix::MixPlan plan;
    Look look = look_of({{Gain, "indirect=+1.5st"}, {Mute, "env"}});

    MixedSequence()
        : stack([&] {
              std::filesystem::remove_all(folder);
              std::filesystem::create_directories(folder);
              for (const int frame : {-3, 7, 12345}) {
                  film::LayerSet set = film::test_layer_set();
                  set.matrix_layers = true;
                  film::Film film({0, 0, 12, 9}, set);
                  film::render(film, uint64_t(frame + 3) % 64, uint64_t(frame + 3) % 64 + 4);
                  EXPECT_TRUE(film.write(name(frame), {}).has_value());
              }
              return std::move(*LayerStack::load(name(7)));
          }()) {
        plan = *mix::plan_mix(stack, look);
        for (const int frame : {-3, 7, 12345}) {
            const auto one = LayerStack::load(name(frame));
            expected[frame] = mix::apply_mix(*one, *mix::plan_mix(*one, look), look, false);
        }
    }

    std::string name(int frame) const { return frame_path(folder + "/s h.####.exr", frame); }

    MixRecipe recipe(const std::string& pattern) const {
        return *mix_recipe(stack, plan, look, folder + "/" + pattern);
    }
};

/// oiiotool takes each # of its own for four digits, and no frames below 0.
TEST(Export, OiiotoolRebuildsEveryFrameOfASequence) {
    if (std::system("oiiotool --version >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "no oiiotool on this machine";
    const MixedSequence mixed;
    const std::string script = oiio_script(mixed.recipe("s h.####.exr"));
    for (const char* pattern : {"s h.%04d.exr", "s h.$F4.exr", "s h.<F4>.exr"})
        EXPECT_EQ(oiio_script(mixed.recipe(pattern)), script);
    ASSERT_TRUE(write_file_atomically(file("frames.sh"), script));
    // The names that the script has, and names that it is given
    for (const std::string& arguments :
         {std::string(), " '" + mixed.folder + "/s h.####.exr' 'new/mix.####.exr'"}) {
        const std::string command =
            "cd " + mixed.folder + " && sh " + file("frames.sh") + arguments;
        ASSERT_EQ(std::system(command.c_str()), 0) << arguments;
        for (const auto& [frame, image] : mixed.expected) {
            const auto result = image::read_exr(frame_path(
                mixed.folder + (arguments.empty() ? "/mix.####.exr" : "/new/mix.####.exr"), frame));
            ASSERT_TRUE(result.has_value()) << result.error().message;
            expect_same(*result, image);
        }
    }
    // No frame is no success, and neither is one file for all
    for (const char* arguments : {" 'none.####.exr' 'mix.####.exr'", " 's h.####.exr' mix.exr"}) {
        const std::string command =
            "cd " + mixed.folder + " && sh " + file("frames.sh") + arguments + " 2>/dev/null";
        EXPECT_NE(std::system(command.c_str()), 0) << arguments;
    }
}

/// A light that is out in some frames, and a frame that is black: what is black is not stored.
TEST(Export, OiiotoolRebuildsFramesThatStoreOtherLayers) {
    if (std::system("oiiotool --version >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "no oiiotool on this machine";
    const std::string folder = file("dark");
    std::filesystem::create_directories(folder);
    image::Image frames[] = {made_layers(), made_layers(), made_layers()};
    take_out(frames[0], {"b1_key", "S_key", "S_key_tree", "S_key_rest"});
    take_out(frames[1], {"b0_key", "b1_key", "tail_key", "b1_fill", "tail_fill", "S_key",
                         "S_key_tree", "S_key_rest", "S_fill", "S_fill_tree", "S_fill_rest",
                         "clamp_tail_key", "clamp_b0_fill", "clamp_tail_fill"});
    EXPECT_EQ(frames[1].parts.size(), 1u);
    for (int f = 0; f < 3; ++f) {
        ASSERT_TRUE(layers::write_image_file(frame_path(folder + "/s.####.exr", f + 1), frames[f])
                        .has_value());
    }
    const Look look = look_of({{Gain, "key=3"}, {Gain, "tail=0.5"}, {Shadow, "fill=0.25"}});
    for (int first = 1; first <= 3; ++first) {
        const auto stack = LayerStack::load(frame_path(folder + "/s.####.exr", first));
        ASSERT_TRUE(stack.has_value()) << stack.error().message;
        // Where the shadow is not stored at all, there is nothing to lift
        const auto plan = mix::plan_mix(*stack, look);
        ASSERT_TRUE(plan.has_value()) << plan.error().message;
        const auto recipe = mix_recipe(*stack, *plan, look, folder + "/s.####.exr");
        ASSERT_TRUE(recipe.has_value()) << recipe.error().message;
        ASSERT_TRUE(write_file_atomically(file("dark.sh"), oiio_script(*recipe)));
        const std::string command = "cd " + folder + " && sh " + file("dark.sh") +
                                    " 's.####.exr' " + "'mix.####.exr' 2>/dev/null";
        ASSERT_EQ(std::system(command.c_str()), 0);
        for (int f = 1; f <= 3; ++f) {
            const auto one = LayerStack::load(frame_path(folder + "/s.####.exr", f));
            const image::Image expected =
                mix::apply_mix(*one, *mix::plan_mix(*one, look), look, false);
            const auto result = image::read_exr(frame_path(folder + "/mix.####.exr", f));
            ASSERT_TRUE(result.has_value()) << result.error().message;
            expect_same(*result, expected);
        }
    }
}

/// A stand-in for bpy records what is loaded and rendered.
TEST(Export, BlenderScriptRendersEveryFrameOfASequence) {
    const MixedSequence mixed;
    ASSERT_TRUE(write_file_atomically(mixed.folder + "/bpy.py",
                                      "from unittest.mock import MagicMock\n"
                                      "data, context, ops = MagicMock(), MagicMock(), MagicMock()\n"
                                      "image = data.images.load.return_value\n"
                                      "def render(write_still):\n"
                                      "    print(image.filepath, image.source, '->',\n"
                                      "          context.scene.render.filepath)\n"
                                      "ops.render.render = render\n"));
    ASSERT_TRUE(write_file_atomically(mixed.folder + "/mix.py",
                                      blender_script(mixed.recipe("s h.%04d.exr"))));
    const auto played = [&](const std::string& arguments) {
        const std::string command = "cd " + mixed.folder + " && PYTHONPATH=. python3 mix.py -- " +
                                    arguments + " > log.txt 2>&1";
        const int status = std::system(command.c_str());
        return std::pair(status, *read_file(mixed.folder + "/log.txt"));
    };
    const auto [code, log] = played("'s h.####.exr' 'out/mix.####.exr'");
    EXPECT_EQ(code, 0) << log;
    std::string expected;
    for (const char* number : {"-003", "0007", "12345"})
        expected += mixed.folder + "/s h." + number + ".exr FILE -> " + mixed.folder + "/out/mix." +
                    number + ".exr\n";
    EXPECT_EQ(log, expected);
    EXPECT_EQ(played("").first, 0) << "in the window: the sequence that the script names";
    for (const char* bad : {"'none.####.exr' 'mix.####.exr'", "'s h.####.exr' mix.exr"})
        EXPECT_NE(played(bad).first, 0) << bad;
}

/// Passes that a frame does not have are black; a single file must have them.
TEST(Export, BlenderScriptLeavesOutWhatAFrameDoesNotStore) {
    const std::string folder = file("blender_dark");
    std::filesystem::create_directories(folder);
    for (const char* name : {"s.0001.exr", "s.0002.exr", "one.exr"})
        ASSERT_TRUE(write_file_atomically(folder + "/" + name, "x"));
    MixRecipe recipe;
    recipe.file = "s.####.exr";
    recipe.is_sequence = true;
    recipe.look = "{}";
    recipe.terms = {{"b1", "", {2, 2, 2}, {"b1.R", "b1.G", "b1.B"}},
                    {"b2", "", {1, 1, 1}, {"b2.R", "b2.G", "b2.B"}}};
    ASSERT_TRUE(write_file_atomically(folder + "/mix.py", blender_script(recipe)));
    ASSERT_TRUE(write_file_atomically(
        folder + "/bpy.py",
        "from unittest.mock import MagicMock\n"
        "data, context, ops = MagicMock(), MagicMock(), MagicMock()\n"
        "image, made = data.images.load.return_value, []\n"
        "def get(layer):\n"
        "    return None if layer == 'b1' and '0002' not in str(image.filepath) else MagicMock()\n"
        "def new(kind):\n"
        "    node = MagicMock()\n"
        "    node.outputs.get = get\n"
        "    made.append(node)\n"
        "    return node\n"
        "context.scene.node_tree.nodes.new = new\n"
        "def render(write_still):\n"
        "    print(sorted(n.label for n in made if n.blend_type == 'MULTIPLY'))\n"
        "    made.clear()\n"
        "ops.render.render = render\n"));
    const auto played = [&](const std::string& arguments) {
        const std::string command =
            "cd " + folder + " && PYTHONPATH=. python3 mix.py -- " + arguments + " > log.txt 2>&1";
        const int status = std::system(command.c_str());
        return std::pair(status, *read_file(folder + "/log.txt"));
    };
    const auto [code, log] = played("'s.####.exr' 'out.####.exr'");
    EXPECT_EQ(code, 0) << log;
    EXPECT_TRUE(log.ends_with("['b1', 'b2']\n")) << log;
    EXPECT_NE(log.find("'b2']\n['b1', 'b2']"), std::string::npos) << log;
    const auto [refused, why] = played("one.exr out.exr");
    EXPECT_NE(refused, 0);
    EXPECT_NE(why.find("Blender has no pass 'b1'"), std::string::npos) << why;
}

TEST(Export, HostileNamesStayInTheirQuotes) {
    MixRecipe recipe;
    recipe.file = "a\nrm \"-rf\" '$(x)' [exit] \\.exr";
    recipe.terms = {{"rgba", "", {1, 1, 1}}};
    recipe.look = "{}";
    for (const std::string& script : {oiio_script(recipe), blender_script(recipe)}) {
        std::istringstream lines(script);
        for (std::string line; std::getline(lines, line);)
            EXPECT_FALSE(line.starts_with("rm ") && !script.starts_with("#!/bin/sh")) << line;
    }
    // The shell has the name back as it was
    recipe.file = "it's \"$HOME\" `x` \\";
    ASSERT_TRUE(write_file_atomically(file("name.sh"), oiio_script(recipe)).has_value());
    const std::string command = "sed 's/^mix() .*/printf %s \"$in\"; exit/' " + file("name.sh") +
                                " | sh > " + file("name.txt");
    ASSERT_EQ(std::system(command.c_str()), 0);
    const auto name = read_file(file("name.txt"));
    ASSERT_TRUE(name.has_value());
    EXPECT_EQ(*name, recipe.file);
}

TEST(Export, AllMutedIsBlackAndSplitFilesAreRefused) {
    const Mixed mixed;
    const Look black = look_of({{Mute, "all"}});
    const auto recipe = mix_recipe(mixed.stack, *mix::plan_mix(mixed.stack, black), black, "x.exr");
    ASSERT_TRUE(recipe.has_value());
    ASSERT_EQ(recipe->terms.size(), 1u);
    EXPECT_EQ(recipe->terms[0].gain, (std::array<float, 3>{0, 0, 0}));
    film::FileInfo info;
    info.layout = layers::Layout::Split;
    ASSERT_TRUE(rendered().write(file("split.exr"), info).has_value());
    const auto split = LayerStack::load(file("split.exr"));
    ASSERT_TRUE(split.has_value());
    EXPECT_EQ(mix_recipe(*split, *mix::plan_mix(*split, {}), {}, "x.exr").error().code,
              "export-split");
}

TEST(Export, WhatAClampTookIsALayerOfItsOwnAndMattesAreRefused) {
    const auto stack = LayerStack::from_image(made_layers());
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Clamp, "all=0.5"}, {Gain, "tail=2"}});
    const auto plan = mix::plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    const auto recipe = mix_recipe(*stack, *plan, look, "x.exr");
    ASSERT_TRUE(recipe.has_value());
    const image::Image expected = mix::apply_mix(*stack, *plan, look, false);
    for (size_t i = 0; i < expected.data.pixel_count(); ++i) {
        float sum = 0;
        for (const MixRecipe::Term& term : recipe->terms)
            sum += term.gain[1] * stack->channel(term.layer, 1)->value(i);
        ASSERT_NEAR(sum, expected.find("G")->value(i), 1e-5);
    }

    Look matted = look_of({{Gain, "key=2"}});
    const std::string mask = file("mask.exr");
    ASSERT_TRUE(layers::write_image_file(mask, made_layers()).has_value());
    matted.controls[0].matte = mask + ":A";
    const auto inside = mix::plan_mix(*stack, matted);
    ASSERT_TRUE(inside.has_value()) << inside.error().message;
    EXPECT_EQ(mix_recipe(*stack, *inside, matted, "x.exr").error().code, "export-matte");
}

}  // namespace
}  // namespace velatura::compositor::exports
