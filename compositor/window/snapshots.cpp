// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/snapshots.h"

#include "compositor/window/view_mode.h"

#include <fmt/format.h>

#include <utility>

namespace velatura::compositor::window {

const Snapshot& Snapshots::add(const ImageTask& task) {
    const Levels& levels = *task.levels;
    // The smallest level takes no time that a person would notice
    const size_t small = levels.count() - 1;
    const image::Window frame = levels.frame(small);
    ViewMode mode = task.mode;
    mode.matte.clear();
    ShownTile shown = show_tile({levels.stack(small), *task.plans[small], task.look.exposure_stops,
                                 *task.transform, levels.not_finite()},
                                mode, frame);
    const layers::SampleInfo& samples = levels.stack(0).header().samples;
    Snapshot snapshot;
    snapshot.number = ++last_;
    snapshot.title = fmt::format("snapshot {}", last_);
    if (!levels.stack(0).is_plain())
        snapshot.note = fmt::format("{} spp", samples.end - samples.first);
    snapshot.levels = task.levels;
    snapshot.look = task.look;
    snapshot.width = frame.width();
    snapshot.height = frame.height();
    snapshot.rgba = std::move(shown.rgba);
    if (all_.size() == max_count) all_.erase(all_.begin());
    return all_.emplace_back(std::move(snapshot));
}

}  // namespace velatura::compositor::window
