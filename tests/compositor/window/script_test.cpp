// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/script.h"

#include <gtest/gtest.h>

namespace velatura::compositor::window {
namespace {

using Kind = ScriptStep::Kind;

TEST(Script, IsReadLineByLine) {
    const auto steps = parse_script(
        "# a comment\n"
        "wait\n\n"
        "drag \"gain key\" 40 -3 shift   # finer\n"
        "click solo double alt\n"
        "key ctrl+shift+z\n"
        "type \"a b\"\n"
        "screenshot x.png picture\n"
        "wheel picture -2\n"
        "frames 4\n");
    ASSERT_TRUE(steps.has_value()) << steps.error().message;
    ASSERT_EQ(steps->size(), 8u);
    EXPECT_EQ((*steps)[0].line, 2u);
    EXPECT_EQ((*steps)[1].mark, "gain key");
    EXPECT_EQ((*steps)[1].by, (std::array<float, 2>{40, -3}));
    EXPECT_TRUE((*steps)[1].is_shift);
    EXPECT_TRUE((*steps)[2].is_alt);
    EXPECT_EQ((*steps)[2].count, 2);
    EXPECT_TRUE(((*steps)[3].key == KeyPress{'Z', true, true}));
    EXPECT_EQ((*steps)[4].text, "a b");
    EXPECT_EQ((*steps)[5].mark, "picture");
    EXPECT_EQ((*steps)[6].by[1], -2);
    EXPECT_EQ((*steps)[7].count, 4);
}

TEST(Script, BadLinesAreNamed) {
    for (const char* line : {"jump", "drag gain", "drag gain a b", "key meta+x", "frames 0",
                             "frames 10001", "frames 1e30", "frames nan", "wheel x inf",
                             "drag x nan 0", "click", "click a loudly", "type", "wait long"}) {
        const auto steps = parse_script(std::string("wait\n") + line + "\n");
        ASSERT_FALSE(steps.has_value()) << line;
        EXPECT_EQ(steps.error().code, "bad-script");
        EXPECT_NE(steps.error().message.find("line 2"), std::string::npos);
    }
}

TEST(Script, ADragPressesMovesAndReleases) {
    ScriptStep step;
    step.kind = Kind::Drag;
    step.mark = "gain key";
    step.by = {40, 8};
    const auto frames = input_of(step, {10, 20, 30, 40});
    ASSERT_GT(frames.size(), 4u);
    EXPECT_FALSE(frames.front().is_button_down);
    EXPECT_EQ(*frames.front().mouse, (std::array<float, 2>{20, 30}));
    EXPECT_EQ(*frames[1].mouse, (std::array<float, 2>{20, 30}));
    for (size_t i = 1; i + 1 < frames.size(); ++i) EXPECT_TRUE(frames[i].is_button_down);
    EXPECT_FALSE(frames.back().is_button_down);
    EXPECT_EQ(*frames.back().mouse, (std::array<float, 2>{60, 38}));
}

TEST(Script, ADoubleClickPressesTwice) {
    ScriptStep step;
    step.kind = Kind::Click;
    step.mark = "x";
    step.count = 2;
    int presses = 0;
    bool was_down = false;
    for (const InputFrame& f : input_of(step, {})) {
        presses += f.is_button_down && !was_down;
        was_down = f.is_button_down;
    }
    EXPECT_EQ(presses, 2);
    EXPECT_FALSE(was_down);
}

}  // namespace
}  // namespace velatura::compositor::window
