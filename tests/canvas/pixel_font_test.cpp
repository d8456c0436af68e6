// SPDX-License-Identifier: Apache-2.0
#include "canvas/pixel_font.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::canvas {
namespace {

TEST(PixelFont, DrawsWhatItDoesNotKnowAsQuestionMarks) {
    const auto strange = letter_boxes("d\xc3\xbcrer\n"), marks = letter_boxes("d??rer?");
    ASSERT_EQ(strange.size(), marks.size());
    for (size_t i = 0; i < marks.size(); ++i) {
        EXPECT_EQ(strange[i].x, marks[i].x);
        EXPECT_EQ(strange[i].y, marks[i].y);
    }
    EXPECT_EQ(text_width("d\xc3\xbcrer\n"), text_width("d??rer?"));
}

TEST(PixelFont, KeepsToItsWidthAndHeight) {
    for (const char* text : {"H", "velatura 0123456789", "MMMM iiii"}) {
        for (const LetterBox& box : letter_boxes(text)) {
            EXPECT_GE(box.x, 0);
            EXPECT_LE(box.x + box.width, text_width(text));
        }
    }
    int lowest = 0;
    for (const LetterBox& box : letter_boxes("H")) lowest = std::max(lowest, box.y + box.height);
    EXPECT_EQ(lowest, capital_height);
    EXPECT_TRUE(letter_boxes("").empty());
}

}  // namespace
}  // namespace velatura::canvas
