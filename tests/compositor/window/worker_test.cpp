// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/worker.h"

#include "compositor/window/tile_mix.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <stdexcept>
#include <thread>

namespace velatura::compositor::window {
namespace {

/// All that a worker has to tell about its requests so far.
struct Gathered {
    std::vector<FinishedTile> tiles;
    std::optional<LiveNoise> noise;
    uint64_t noise_version = 0;
};

Gathered gather(Worker& worker) {
    Gathered all;
    for (bool is_idle = false; !is_idle;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        WorkResults results = worker.take();
        is_idle = results.is_idle;
        for (FinishedTile& tile : results.tiles) all.tiles.push_back(std::move(tile));
        if (results.noise) all.noise = std::move(results.noise);
        all.noise_version = results.noise_version;
    }
    return all;
}

class WorkerTest : public testing::Test {
  protected:
    void SetUp() override {
        session_.show("worker.exr", levels_of(window_file("worker.exr", {0, 0, 300, 130}, {}, 1)));
        session_.view().set_area(150, 65);
    }

    Session session_{RecentFiles("")};
    Worker worker_{[] {}};
};

TEST_F(WorkerTest, MixesEverythingThatWasAskedFor) {
    session_.edit("", [](Look& l) { set_stops(l, "key", 1.5f); });
    session_.perform(Action::ToggleWipe);
    const WorkRequest request = session_.work_request();
    EXPECT_EQ(request.level, 1u);
    worker_.request(request);
    Gathered all = gather(worker_);
    std::map<std::pair<size_t, size_t>, size_t> pixels;
    for (const FinishedTile& tile : all.tiles) {
        pixels[{tile.look, tile.level}] += tile.window.pixel_count();
        const ImageTask& task = *request.images[tile.look];
        EXPECT_EQ(tile.version, task.version);
        const auto expected =
            display_rgba(mix_tile(request.levels->stack(tile.level), *task.plans[tile.level],
                                  task.look.exposure_stops, tile.window),
                         *task.transform);
        EXPECT_EQ(tile.rgba, expected);
    }
    for (const size_t look : {0u, 1u}) {
        EXPECT_EQ((pixels[{look, 0}]), 300u * 130u);
        EXPECT_EQ((pixels[{look, 1}]), 150u * 65u);
    }
    ASSERT_TRUE(all.noise.has_value());
    EXPECT_TRUE(all.noise->is_done());
    EXPECT_EQ(all.noise_version, request.images[0]->version);
}

TEST_F(WorkerTest, TheNewestRequestWins) {
    for (int i = 1; i <= 30; ++i) {
        session_.edit("gain key", [&](Look& l) { set_stops(l, "key", float(i) / 10); });
        worker_.request(session_.work_request());
        if (i % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const uint64_t newest = session_.image(0)->version;
    const Gathered all = gather(worker_);
    size_t pixels = 0;
    uint64_t last = 0;
    for (const FinishedTile& tile : all.tiles) {
        EXPECT_GE(tile.version, last) << "no older picture after a newer one";
        last = tile.version;
        if (tile.level == 0 && tile.version == newest) pixels += tile.window.pixel_count();
    }
    EXPECT_EQ(pixels, 300u * 130u);
    EXPECT_EQ(all.noise_version, newest);
}

TEST_F(WorkerTest, ALookThatIsUpToDateIsNotMixedAgain) {
    worker_.request(session_.work_request());
    gather(worker_);
    session_.perform(Action::ZoomOne);
    worker_.request(session_.work_request());
    EXPECT_TRUE(gather(worker_).tiles.empty());
}

TEST_F(WorkerTest, WhatIsThrownIsToldAndTheNextRequestBeginsAnew) {
    std::atomic<int> calls = 0;
    Worker worker([&] {
        if (++calls == 2) throw std::runtime_error("a hole in the memory");
    });
    // The first call says that there is nothing to do yet
    while (calls == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::string error;
    worker.request(session_.work_request());
    for (bool is_idle = false; !is_idle;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        const WorkResults results = worker.take();
        error += results.error;
        is_idle = results.is_idle;
    }
    EXPECT_EQ(error, "a hole in the memory");
    worker.request(session_.work_request());
    size_t pixels = 0;
    for (const FinishedTile& tile : gather(worker).tiles)
        pixels += tile.level == 0 ? tile.window.pixel_count() : 0;
    EXPECT_EQ(pixels, 300u * 130u);
}

TEST_F(WorkerTest, WhatIsThrownWithNothingToDoIsToldAsWell) {
    Worker worker([] { throw std::runtime_error("nobody to wake"); });
    std::string error;
    for (int i = 0; i < 2000 && error.empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        error = worker.take().error;
    }
    EXPECT_EQ(error, "nobody to wake");
}

TEST_F(WorkerTest, EndsInTheMiddleOfItsWork) {
    worker_.request(session_.work_request());
}

}  // namespace
}  // namespace velatura::compositor::window
