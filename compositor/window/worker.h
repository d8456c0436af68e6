// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/levels.h"
#include "compositor/window/live_noise.h"
#include "compositor/window/tile_order.h"
#include "compositor/window/view_mode.h"
#include "image/display.h"

#include <array>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace velatura::compositor::window {

/// A look as the worker takes it.
struct ImageTask {
    uint64_t version = 0;  ///< another number for another image; from 1
    Look look;
    LevelPlans plans;
    std::shared_ptr<const image::DisplayTransform> transform;
    ViewMode mode = {};
    std::shared_ptr<const Levels> levels = {};  ///< of its file; null: that of the request
    LevelPlans matte = {};  ///< plans of nothing but the matte that is drawn; empty: none
    /// `version` of the first image of this look: layers that are renewed make another image of it.
    uint64_t look_version = version;
};

struct WorkRequest {
    std::shared_ptr<const Levels> levels;
    std::array<std::shared_ptr<const ImageTask>, 2> images;  ///< look A, look B; null: not shown
    size_t level = 0;                                        ///< that the screen shows
    image::Window seen;                                      ///< of level 0
    size_t noise_of = 0;                                     ///< whose noise is shown
};

struct FinishedTile {
    std::shared_ptr<const Levels> levels;
    size_t look = 0, level = 0;
    uint64_t version = 0, look_version = 0;
    image::Window window;  ///< of the level
    std::vector<uint8_t> rgba;
    FlaggedPixels flagged;
};

/// From the request for a new image, in ms; 0 while it is not there.
struct MixTimes {
    double first = 0;  ///< something of the whole image
    double seen = 0;   ///< what the screen shows, at its size
    double all = 0;    ///< everything at full size
};

/// What came of the last requests.
struct WorkResults {
    std::vector<FinishedTile> tiles;
    std::optional<LiveNoise> noise;  ///< where something was added to it
    uint64_t noise_version = 0;
    MixTimes times;
    std::string error;  ///< what ended the work on a request; empty: nothing
    bool is_idle = true;
};

/// Mixes in a thread of its own. The newest request counts: what is under way is finished tile by
/// tile, and dropped for it.
class Worker {
  public:
    /// `wake` is called from the thread whenever there is news.
    explicit Worker(std::function<void()> wake);
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    void request(WorkRequest request);
    WorkResults take();

  private:
    void run(const std::stop_token& stop);
    bool work_once(const WorkRequest& request);
    void give_up(const std::string& why);
    void mix_batch(const WorkRequest& request, const TileBatch& batch);
    bool advance_noise(const WorkRequest& request);
    void keep_time(const WorkRequest& request);

    std::function<void()> wake_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<WorkRequest> newest_;  ///< not yet taken up
    WorkResults results_;
    bool is_working_ = false;

    // Of the thread alone
    std::shared_ptr<const Levels> levels_;
    TileOrder order_;
    std::optional<LiveNoise> noise_;
    uint64_t noise_version_ = 0;
    std::array<uint64_t, 2> timed_ = {0, 0};
    double begun_ms_ = 0;
    MixTimes times_;

    std::jthread thread_;  ///< last: it uses all of the above
};

}  // namespace velatura::compositor::window
