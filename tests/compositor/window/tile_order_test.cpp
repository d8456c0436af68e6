// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/tile_order.h"

#include <gtest/gtest.h>

#include <set>

namespace velatura::compositor::window {
namespace {

TileOrder order_of_three_levels() {
    return TileOrder({{{0, 0, 1920, 1080}}, {{0, 0, 960, 540}}, {{0, 0, 480, 270}}}, 2);
}

TEST(TileGrid, CoversTheFrameOnce) {
    const TileGrid grid{{0, 0, 1000, 513}};
    size_t pixels = 0;
    for (size_t t = 0; t < grid.count(); ++t) pixels += grid.window(t).pixel_count();
    EXPECT_EQ(pixels, 1000u * 513u);
    EXPECT_EQ(grid.window(grid.count() - 1), (image::Window{768, 512, 1000, 513}));
}

TEST(TileOrder, GoesFromQuickToSeenToAll) {
    TileOrder order = order_of_three_levels();
    Wanted wanted;
    wanted.versions = {7, 0};
    wanted.level = 1;
    wanted.seen = {0, 0, 600, 600};
    const auto first = order.next(wanted, 1);
    ASSERT_TRUE(first.has_value());
    EXPECT_EQ(first->level, 2u);
    EXPECT_EQ(first->tiles.size(), order.grid(2).count());
    std::vector<size_t> levels;
    std::set<std::pair<size_t, size_t>> done;
    bool was_seen = true;
    while (const auto batch = order.next(wanted, 1)) {
        ASSERT_LT(done.size(), 1000u);
        levels.push_back(batch->level);
        EXPECT_TRUE(was_seen || !batch->is_seen) << "what is seen comes first";
        was_seen = batch->is_seen;
        for (const size_t t : batch->tiles) EXPECT_TRUE(done.insert({batch->level, t}).second);
        order.mark(*batch, 7);
    }
    EXPECT_TRUE(std::is_sorted(levels.rbegin(), levels.rend()));
    EXPECT_EQ(done.size(), order.grid(0).count() + order.grid(1).count() + order.grid(2).count());
}

TEST(TileOrder, ANewVersionMakesAllStale) {
    TileOrder order = order_of_three_levels();
    Wanted wanted;
    wanted.versions = {1, 0};
    wanted.level = 2;
    wanted.seen = {0, 0, 1920, 1080};
    while (const auto batch = order.next(wanted, 8)) order.mark(*batch, 1);
    EXPECT_FALSE(order.next(wanted, 8).has_value());
    wanted.versions = {2, 0};
    EXPECT_EQ(order.next(wanted, 8)->level, 2u);
    // Look B on top: A is up to date, B is not
    wanted.versions = {1, 3};
    EXPECT_EQ(order.next(wanted, 8)->look, 1u);
}

TEST(TileOrder, NothingIsWantedWithoutALook) {
    EXPECT_FALSE(order_of_three_levels().next(Wanted(), 8).has_value());
    Wanted wanted;
    wanted.versions = {1, 1};
    EXPECT_FALSE(TileOrder().next(wanted, 8).has_value());
}

}  // namespace
}  // namespace velatura::compositor::window
