// SPDX-License-Identifier: Apache-2.0
#include "base/nearest_names.h"

#include <gtest/gtest.h>

namespace velatura {
namespace {

TEST(NearestNames, CountsEditsOfLetters) {
    EXPECT_EQ(edit_distance("key", "key"), 0u);
    EXPECT_EQ(edit_distance("key", "KEY"), 0u);
    EXPECT_EQ(edit_distance("kye", "key"), 1u);
    EXPECT_EQ(edit_distance("", "key"), 3u);
    EXPECT_EQ(edit_distance("ke", "key"), 1u);
    EXPECT_EQ(edit_distance("keys", "key"), 1u);
    // The classic of Wagner and Fischer
    EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
    EXPECT_EQ(edit_distance("ab", "ba"), edit_distance("ba", "ab"));
}

TEST(NearestNames, NamesWhatWasMeant) {
    const std::vector<std::string> rows = {"key", "fill", "rim_left", "rim_right", "sky", "b1"};
    EXPECT_EQ(did_you_mean("kye", rows), " (did you mean 'key' or 'sky'?)");
    EXPECT_EQ(did_you_mean("Fill", rows), " (did you mean 'fill'?)");
    EXPECT_EQ(did_you_mean("rim_rigth", rows), " (did you mean 'rim_right'?)");
    EXPECT_EQ(did_you_mean("rim", rows), " (did you mean 'rim_left' or 'rim_right'?)");
    EXPECT_EQ(did_you_mean("chandelier", rows), "");
    EXPECT_EQ(did_you_mean("", rows), "");
    EXPECT_TRUE(nearest_names("x", {}).empty());
}

TEST(NearestNames, TypingErrorsAreNearAndOtherNamesAreNot) {
    const std::vector<std::string> names = {
        "inputs:intensity", "inputs:color",  "focalLength",          "fStop", "size", "velocities",
        "resolution",       "focusDistance", "primvars:displayColor"};
    const auto nearest = [&](const char* written) { return nearest_spelling(written, names); };
    EXPECT_EQ(nearest("inputs:intensty"), "inputs:intensity");
    EXPECT_EQ(nearest("input:intensity"), "inputs:intensity");
    EXPECT_EQ(nearest("intensity"), "inputs:intensity");
    EXPECT_EQ(nearest("inputs:colour"), "inputs:color");
    EXPECT_EQ(nearest("focallength"), "focalLength");
    EXPECT_EQ(nearest("fstop"), "fStop");
    EXPECT_EQ(nearest("resoltion"), "resolution");
    EXPECT_EQ(nearest("displayColor"), "primvars:displayColor");
    // Nothing of these is one of the names with letters wrong
    for (const char* other : {"type", "axis", "color", "inputs:angle", "userProperties:size",
                              "focus", "primvars:st", "inputs:intensity", ""})
        EXPECT_EQ(nearest(other), other == std::string("color") ? "inputs:color" : "") << other;
}

}  // namespace
}  // namespace velatura
