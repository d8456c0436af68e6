// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/worker.h"

#include "base/tasks.h"
#include "compositor/window/jobs.h"

#include <algorithm>
#include <chrono>

namespace velatura::compositor::window {

namespace {

double now_ms() {
    const auto since = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double, std::milli>(since).count();
}

Wanted wanted_of(const WorkRequest& request) {
    Wanted wanted;
    for (size_t look = 0; look < 2; ++look) {
        if (request.images[look]) wanted.versions[look] = request.images[look]->version;
    }
    wanted.level = request.level;
    wanted.seen = request.seen;
    return wanted;
}

/// Those of the image's own file. Both files of a comparison are cut into the same tiles.
const Levels& levels_for(const WorkRequest& request, const ImageTask& task) {
    return task.levels ? *task.levels : *request.levels;
}

}  // namespace

Worker::Worker(std::function<void()> wake)
    : wake_(std::move(wake)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Worker::~Worker() {
    thread_.request_stop();
    changed_.notify_all();
}

void Worker::request(WorkRequest request) {
    {
        const std::lock_guard lock(mutex_);
        newest_ = std::move(request);
    }
    changed_.notify_all();
}

WorkResults Worker::take() {
    const std::lock_guard lock(mutex_);
    WorkResults results = std::move(results_);
    results.is_idle = !is_working_ && !newest_;
    results_ = WorkResults();
    results_.times = results.times;
    results_.noise_version = results.noise_version;
    return results;
}

void Worker::run(const std::stop_token& stop) {
    WorkRequest request;
    while (!stop.stop_requested()) {
        {
            std::unique_lock lock(mutex_);
            if (newest_) {
                request = std::move(*newest_);
                newest_.reset();
                is_working_ = true;
            }
        }
        if (request.levels) {
            const auto worked = guarded<bool>([&]() -> Result<bool> { return work_once(request); });
            if (worked && *worked) continue;
            if (!worked) {
                request = {};
                give_up(worked.error().message);
            }
        }
        {
            std::unique_lock lock(mutex_);
            if (newest_) continue;
            is_working_ = false;
        }
        const auto woken = guarded<bool>([this]() -> Result<bool> {
            wake_();
            return true;
        });
        if (!woken) give_up(woken.error().message);
        std::unique_lock lock(mutex_);
        changed_.wait(lock, stop, [this] { return newest_.has_value(); });
    }
}

/// Forgets the request and what was begun for it; the next one begins anew.
void Worker::give_up(const std::string& why) {
    levels_.reset();
    order_ = {};
    noise_.reset();
    const std::lock_guard lock(mutex_);
    results_.error = why;
}

/// False when nothing is left to do.
bool Worker::work_once(const WorkRequest& request) {
    if (levels_ != request.levels) {
        levels_ = request.levels;
        std::vector<TileGrid> grids;
        for (size_t k = 0; k < levels_->count(); ++k) grids.push_back({levels_->frame(k)});
        order_ = TileOrder(std::move(grids), levels_->quick_level());
        noise_ = LiveNoise(levels_->stack(0));
        noise_version_ = 0;
    }
    const Wanted wanted = wanted_of(request);
    if (timed_ != wanted.versions) {
        timed_ = wanted.versions;
        begun_ms_ = now_ms();
        times_ = {};
    }
    const auto batch = order_.next(wanted, size_t(thread_count()));
    if (batch && batch->is_seen) {
        mix_batch(request, *batch);
        return true;
    }
    keep_time(request);
    // A first number of the noise before what nobody sees
    const bool is_noise_new = request.images[request.noise_of] &&
                              noise_version_ != request.images[request.noise_of]->version;
    if ((is_noise_new || !batch) && advance_noise(request)) return true;
    if (batch) mix_batch(request, *batch);
    return batch.has_value();
}

void Worker::mix_batch(const WorkRequest& request, const TileBatch& batch) {
    const ImageTask& task = *request.images[batch.look];
    const Levels& levels = levels_for(request, task);
    std::vector<FinishedTile> finished(batch.tiles.size());
    parallel_for(batch.tiles.size(), [&](size_t i) {
        FinishedTile& tile = finished[i];
        tile.levels = request.levels;
        tile.look = batch.look;
        tile.level = batch.level;
        tile.version = task.version;
        tile.look_version = task.look_version;
        tile.window = order_.grid(batch.level).window(batch.tiles[i]);
        ShownTile shown = show_tile(
            {levels.stack(batch.level), *task.plans[batch.level], task.look.exposure_stops,
             *task.transform, levels.not_finite(),
             task.matte.empty() ? nullptr : task.matte[batch.level]->mattes[0].values.get()},
            task.mode, tile.window);
        tile.rgba = std::move(shown.rgba);
        tile.flagged = shown.flagged;
    });
    order_.mark(batch, task.version);
    if (times_.first == 0) times_.first = now_ms() - begun_ms_;
    {
        const std::lock_guard lock(mutex_);
        for (FinishedTile& tile : finished) results_.tiles.push_back(std::move(tile));
        results_.times = times_;
    }
    wake_();
}

void Worker::keep_time(const WorkRequest& request) {
    const double passed = now_ms() - begun_ms_;
    if (times_.seen == 0) times_.seen = passed;
    if (times_.all == 0 && !order_.next(wanted_of(request), 1)) times_.all = passed;
    const std::lock_guard lock(mutex_);
    results_.times = times_;
}

/// One part of the noise. False when all of them are done.
bool Worker::advance_noise(const WorkRequest& request) {
    const std::shared_ptr<const ImageTask>& task = request.images[request.noise_of];
    if (!task) return false;
    if (noise_version_ != task->version) {
        noise_version_ = task->version;
        noise_ = LiveNoise(levels_for(request, *task).stack(0));
        noise_->begin();
    }
    if (noise_->is_done()) return false;
    noise_->advance(levels_for(request, *task).stack(0), *task->plans[0], task->look);
    {
        const std::lock_guard lock(mutex_);
        results_.noise = noise_;
        results_.noise_version = noise_version_;
    }
    wake_();
    return true;
}

}  // namespace velatura::compositor::window
