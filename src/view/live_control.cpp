// SPDX-License-Identifier: Apache-2.0
#include "view/live_control.h"

#include "app/progress.h"
#include "app/stop_signals.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace velatura::view {

namespace {

using compositor::window::RenewedLayers;

std::string phase_text(const LiveStatus& s) {
    using Phase = LiveStatus::Phase;
    switch (s.phase) {
        case Phase::Loading:
            return "reading the scene";
        case Phase::Building:
            return "building";
        case Phase::Learning:
            return "prepass";
        case Phase::Drafting:
            return "draft";
        case Phase::Writing:
            return "writing";
        case Phase::Paused:
            return "paused";
        case Phase::Finished:
            return "finished";
        case Phase::Ended:
            return "ended";
        case Phase::Rendering:
            break;
    }
    return "rendering";
}

}  // namespace

std::string text_of(const LiveStatus& s) {
    std::string text = phase_text(s);
    if (s.region) text += " region";
    if (s.reduction > 1) text += fmt::format(" · 1/{} resolution", s.reduction);
    if (s.samples > 0)
        text += s.last_sample ? fmt::format(" · {:.4g} of {:.4g} spp", s.samples, *s.last_sample)
                              : fmt::format(" · {:.4g} spp", s.samples);
    if (s.error)
        text += fmt::format(" · error {:.2g} %{}", 100 * *s.error,
                            s.is_upper_error   ? " or less"
                            : s.is_lower_error ? " or more"
                                               : "");
    if (s.elapsed_s > 0) text += fmt::format(" · {:.0f} s", s.elapsed_s);
    if (s.left_s && s.phase == LiveStatus::Phase::Rendering)
        text += fmt::format(", {:.0f} s left", *s.left_s);
    if (s.rays_per_s > 0) text += fmt::format(" · {:.2g} Mray/s", s.rays_per_s / 1e6);
    if (s.memory_bytes > 0) text += " · " + app::format_bytes(s.memory_bytes);
    return text;
}

void LiveControl::request(const std::function<void(LiveRequests&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(requests_);
        if (requests_.ends) ends_ = true;
        interrupts_ = true;
        is_waiting_ = false;
    }
    asked_.notify_all();
}

std::optional<Result<RenewedLayers>> LiveControl::take_layers() {
    const std::lock_guard lock(mutex_);
    return std::exchange(layers_, std::nullopt);
}

LiveStatus LiveControl::status() const {
    const std::lock_guard lock(mutex_);
    return status_;
}

LiveRequests LiveControl::take_requests() {
    const std::lock_guard lock(mutex_);
    LiveRequests taken = requests_;
    requests_.pick.reset();
    requests_.save_as.reset();
    requests_.region.reset();
    LiveEdits none;
    none.is_moving = requests_.edits.is_moving;
    requests_.edits = std::move(none);
    requests_.reloads = false;
    interrupts_ = false;
    return taken;
}

void LiveControl::wait_for_request() {
    std::unique_lock lock(mutex_);
    is_waiting_ = !interrupts_;
    // Signals set a flag and wake no thread
    while (!interrupts_ && !app::StopSignals::stop_flag())
        asked_.wait_for(lock, std::chrono::milliseconds(100));
}

void LiveControl::publish(Result<RenewedLayers> layers) {
    {
        const std::lock_guard lock(mutex_);
        // Another image, not shown yet: what follows it is one as well
        if (layers && layers_ && *layers_ && (**layers_).is_other_image)
            layers->is_other_image = true;
        layers_ = std::move(layers);
    }
    wake_();
}

void LiveControl::set_status(const std::function<void(LiveStatus&)>& change) {
    const std::lock_guard lock(mutex_);
    change(status_);
}

void LiveControl::report(std::string message, bool is_error) {
    {
        const std::lock_guard lock(mutex_);
        status_.message = std::move(message);
        status_.is_error = is_error;
        ++status_.messages;
    }
    wake_();
}

}  // namespace velatura::view
