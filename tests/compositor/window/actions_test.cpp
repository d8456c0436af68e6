// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/actions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

namespace velatura::compositor::window {
namespace {

TEST(KeyBindings, NoKeyDoesTwoThings) {
    const auto bindings = key_bindings();
    for (size_t i = 0; i < bindings.size(); ++i) {
        for (size_t k = 0; k < i; ++k)
            EXPECT_FALSE(bindings[i].press == bindings[k].press) << bindings[i].keys;
    }
}

TEST(KeyBindings, AreWrittenAsTheyAreRead) {
    for (const KeyBinding& b : key_bindings()) {
        const auto press = key_press_of(b.keys);
        ASSERT_TRUE(press.has_value()) << b.keys;
        EXPECT_TRUE(*press == b.press) << b.keys;
        EXPECT_EQ(action_of(*press), b.action) << b.keys;
    }
}

TEST(KeyBindings, AreWrittenForPeople) {
    EXPECT_STREQ(keys_of(Action::Redo), "Ctrl+Shift+Z");
    EXPECT_STREQ(keys_of(Action::GainUpFine), "Shift+Right");
    EXPECT_STREQ(keys_of(Action::ShowHelp), "F1");
    EXPECT_STREQ(keys_of(Action::ZoomIn), "=");
}

TEST(KeyBindings, NameTheKeysToListenFor) {
    const auto keys = bound_keys();
    for (const KeyBinding& b : key_bindings())
        EXPECT_NE(std::find(keys.begin(), keys.end(), b.press.key), keys.end()) << b.keys;
}

TEST(KeyBindings, OtherKeysDoNothing) {
    EXPECT_FALSE(action_of({'Z', false, false}).has_value());
    EXPECT_FALSE(action_of({'M', true, false}).has_value());
    EXPECT_FALSE(key_press_of("meta+x").has_value());
    EXPECT_FALSE(key_press_of("").has_value());
}

}  // namespace
}  // namespace velatura::compositor::window
