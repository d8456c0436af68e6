// SPDX-License-Identifier: Apache-2.0
#include "compositor/export.h"

#include "base/atomic_file.h"
#include "compositor/made_layers.h"
#include "compositor/mix.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "image/layer_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <sstream>

namespace velatura::compositor {
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

    explicit Mixed(image::Layout layout = image::Layout::MultiPart)
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
        const auto plan = plan_mix(stack, look);
        EXPECT_TRUE(plan.has_value());
        expected = apply_mix(stack, *plan, look, false);
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
    for (const auto layout : {image::Layout::MultiPart, image::Layout::SinglePart}) {
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

/// Runs a Nuke script of Read, Shuffle, Multiply, Merge2 (plus) and Copy by Nuke's rules: nodes
/// take their inputs from a stack, `set` names its top, `push` puts a node back.
class NukeScript {
  public:
    using Pixels = std::array<std::vector<float>, 4>;

    NukeScript(const std::string& text, const image::Image& layers) : layers_(layers) {
        std::istringstream lines(text);
        std::string line;
        while (std::getline(lines, line)) run(line, lines);
    }

    const Pixels& top() const { return stack_.back(); }

    std::string file;

  private:
    using Knobs = std::map<std::string, std::string>;

    void run(const std::string& line, std::istringstream& lines) {
        if (line.empty() || line[0] == '#' || line.starts_with("version ") ||
            line.starts_with("add_layer "))
            return;
        std::istringstream words(line);
        std::string word, name;
        words >> word >> name;
        if (word == "set")
            named_[name] = stack_.back();
        else if (word == "push")
            stack_.push_back(named_.at(name.substr(1)));
        else
            node(word, knobs(lines));
    }

    static Knobs knobs(std::istringstream& lines) {
        Knobs knobs;
        std::string line;
        while (std::getline(lines, line) && line != "}") {
            const size_t space = line.find(' ', 1);
            knobs[line.substr(1, space - 1)] = line.substr(space + 1);
        }
        return knobs;
    }

    Pixels pop() {
        Pixels p = std::move(stack_.back());
        stack_.pop_back();
        return p;
    }

    Pixels layer(const std::string& name) const {
        Pixels p;
        const char* const suffixes[] = {"R", "G", "B", "A"};
        for (size_t c = 0; c < 4; ++c) {
            const image::Channel* channel =
                layers_.find(name == "rgba" ? suffixes[c] : name + "." + suffixes[c]);
            p[c].assign(layers_.data.pixel_count(), 0.0f);
            if (channel) image::for_each_value(*channel, [&](size_t i, float v) { p[c][i] = v; });
        }
        return p;
    }

    void node(const std::string& kind, const Knobs& k) {
        if (kind == "Read") {
            file = k.at("file");
            stack_.push_back(layer("rgba"));
        } else if (kind == "Shuffle") {
            pop();
            stack_.push_back(layer(k.at("in")));
        } else if (kind == "Multiply") {
            std::istringstream values(k.at("value").substr(1));
            Pixels p = pop();
            for (size_t c = 0; c < 3; ++c) {
                std::string gain;
                values >> gain;
                for (float& v : p[c]) v *= std::strtof(gain.c_str(), nullptr);
            }
            stack_.push_back(std::move(p));
        } else if (kind == "Merge2") {
            ASSERT_EQ(k.at("operation"), "plus");
            Pixels b = pop(), a = pop();
            for (size_t c = 0; c < 3; ++c) {
                for (size_t i = 0; i < a[c].size(); ++i) a[c][i] += b[c][i];
            }
            stack_.push_back(std::move(a));
        } else {
            ASSERT_EQ(kind, "Copy");
            Pixels b = pop(), a = pop();
            b[3] = a[3];
            stack_.push_back(std::move(b));
        }
    }

    const image::Image& layers_;
    std::vector<Pixels> stack_;
    std::map<std::string, Pixels> named_;
};

TEST(Export, NukeRebuildsTheMix) {
    const Mixed mixed;
    const NukeScript nuke(nuke_script(mixed.recipe), mixed.stack.image());
    EXPECT_NE(nuke.file.find("it's \\$HOME.exr"), std::string::npos);
    const char* const names[] = {"R", "G", "B", "A"};
    for (size_t c = 0; c < 4; ++c) {
        const image::Channel* channel = mixed.expected.find(names[c]);
        for (size_t i = 0; i < channel->size(); ++i)
            ASSERT_EQ(nuke.top()[c][i], channel->value(i)) << names[c];
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

TEST(Export, HostileNamesStayInTheirQuotes) {
    MixRecipe recipe;
    recipe.file = "a\nrm \"-rf\" '$(x)' [exit] \\.exr";
    recipe.terms = {{"rgba", "", {1, 1, 1}}};
    recipe.look = "{}";
    for (const std::string& script :
         {oiio_script(recipe), nuke_script(recipe), blender_script(recipe)}) {
        std::istringstream lines(script);
        for (std::string line; std::getline(lines, line);)
            EXPECT_FALSE(line.starts_with("rm ") && !script.starts_with("#!/bin/sh")) << line;
    }
    // The shell has the name back as it was
    recipe.file = "it's \"$HOME\" `x` \\";
    ASSERT_TRUE(write_file_atomically(file("name.sh"), oiio_script(recipe)).has_value());
    const std::string command = "sed 's/^exec oiiotool.*/printf %s \"$in\"; exit/' " +
                                file("name.sh") + " | sh > " + file("name.txt");
    ASSERT_EQ(std::system(command.c_str()), 0);
    const auto name = read_file(file("name.txt"));
    ASSERT_TRUE(name.has_value());
    EXPECT_EQ(*name, recipe.file);
}

TEST(Export, AllMutedIsBlackAndSplitFilesAreRefused) {
    const Mixed mixed;
    const Look black = look_of({{Mute, "all"}});
    const auto recipe = mix_recipe(mixed.stack, *plan_mix(mixed.stack, black), black, "x.exr");
    ASSERT_TRUE(recipe.has_value());
    ASSERT_EQ(recipe->terms.size(), 1u);
    EXPECT_EQ(recipe->terms[0].gain, (std::array<float, 3>{0, 0, 0}));
    film::FileInfo info;
    info.layout = image::Layout::Split;
    ASSERT_TRUE(rendered().write(file("split.exr"), info).has_value());
    const auto split = LayerStack::load(file("split.exr"));
    ASSERT_TRUE(split.has_value());
    EXPECT_EQ(mix_recipe(*split, *plan_mix(*split, {}), {}, "x.exr").error().code, "export-split");
}

TEST(Export, WhatAClampTookIsALayerOfItsOwnAndMattesAreRefused) {
    const auto stack = LayerStack::from_image(made_layers());
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Clamp, "all=0.5"}, {Gain, "tail=2"}});
    const auto plan = plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    const auto recipe = mix_recipe(*stack, *plan, look, "x.exr");
    ASSERT_TRUE(recipe.has_value());
    const NukeScript nuke(nuke_script(*recipe), stack->image());
    const image::Image expected = apply_mix(*stack, *plan, look, false);
    for (size_t i = 0; i < expected.data.pixel_count(); ++i)
        ASSERT_NEAR(nuke.top()[1][i], expected.find("G")->value(i), 1e-5);

    Look matted = look_of({{Gain, "key=2"}});
    const std::string mask = file("mask.exr");
    ASSERT_TRUE(image::write_image_file(mask, made_layers()).has_value());
    matted.controls[0].matte = mask + ":A";
    const auto inside = plan_mix(*stack, matted);
    ASSERT_TRUE(inside.has_value()) << inside.error().message;
    EXPECT_EQ(mix_recipe(*stack, *inside, matted, "x.exr").error().code, "export-matte");
}

}  // namespace
}  // namespace velatura::compositor
