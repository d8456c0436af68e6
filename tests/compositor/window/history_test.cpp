// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/history.h"

#include "compositor/look/look_rows.h"

#include <gtest/gtest.h>

namespace velatura::compositor::window {
namespace {

void drag(History& history, float stops, const std::string& gesture) {
    Looks looks = history.now();
    set_stops(looks[0], "key", stops);
    history.change(looks, gesture);
}

float stops(const History& history) {
    return row_state(history.now()[0], "key").stops;
}

TEST(History, ADragIsOneStep) {
    History history;
    for (int i = 1; i <= 10; ++i) drag(history, float(i), "gain key");
    history.seal();
    EXPECT_FLOAT_EQ(stops(history), 10);
    EXPECT_TRUE(history.undo());
    EXPECT_FLOAT_EQ(stops(history), 0);
    EXPECT_FALSE(history.undo());
    EXPECT_TRUE(history.redo());
    EXPECT_FLOAT_EQ(stops(history), 10);
    EXPECT_FALSE(history.redo());
}

TEST(History, TwoDragsAreTwoSteps) {
    History history;
    drag(history, 1, "gain key");
    history.seal();
    drag(history, 2, "gain key");
    history.undo();
    EXPECT_FLOAT_EQ(stops(history), 1);
}

TEST(History, ChangesWithoutAGestureAreStepsOfTheirOwn) {
    History history;
    drag(history, 1, "");
    drag(history, 2, "");
    history.undo();
    EXPECT_FLOAT_EQ(stops(history), 1);
}

TEST(History, ADragThatCameBackIsNone) {
    History history;
    drag(history, 1, "");
    drag(history, 3, "gain key");
    drag(history, 1, "gain key");
    EXPECT_TRUE(history.undo());
    EXPECT_FLOAT_EQ(stops(history), 0);
    EXPECT_FALSE(history.can_undo());
}

TEST(History, AChangeForgetsWhatWasUndone) {
    History history;
    drag(history, 1, "");
    history.undo();
    EXPECT_TRUE(history.can_redo());
    drag(history, 2, "");
    EXPECT_FALSE(history.can_redo());
}

TEST(History, NoChangeIsNoStep) {
    History history;
    history.change(history.now(), "");
    EXPECT_FALSE(history.can_undo());
}

}  // namespace
}  // namespace velatura::compositor::window
