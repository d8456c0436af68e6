// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/mix_job.h"

#include "base/frames.h"
#include "base/tasks.h"
#include "compositor/io/image_name.h"
#include "compositor/io/input_files.h"
#include "compositor/mix/fit_look.h"
#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_plan.h"
#include "compositor/mix/plate.h"
#include "image/digest.h"
#include "layers/cryptomatte.h"
#include "layers/layer_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

namespace velatura::compositor::mix {

namespace {

/// The mixed image, the copy that is read back, and what a display transform needs.
constexpr size_t image_bytes_per_pixel = 48;
/// A channel that is stored as well, and its copy.
constexpr size_t channel_bytes_per_pixel = 8;
constexpr size_t matte_bytes_per_pixel = 4;
/// Readers of a frame need as much again, four times where there is room.
constexpr size_t fewest_strip_bytes = size_t(64) << 20;

std::string describe(const NotFiniteLayer& layer, image::ChannelType type) {
    if (layer.layer.empty())
        return fmt::format(
            "{} values of the mix exceed the range of {} (the first at pixel {},{})", layer.values,
            type == image::ChannelType::Half ? "half floats" : "floats", layer.x, layer.y);
    return fmt::format("{} values of {} are not finite (the first at pixel {},{})", layer.values,
                       layer.layer, layer.x, layer.y);
}

/// The mix is stored without loss: that ids have changed before is to be seen here alone.
void add_lossy_mattes(const LayerStack& layout,
                      const std::string& input,
                      std::vector<std::string>& warnings) {
    for (const layers::Cryptomatte& matte : layers::cryptomattes_of(layout.image())) {
        for (const image::Part& part : layout.image().parts) {
            const bool has_ids = std::any_of(
                part.channels.begin(), part.channels.end(),
                [&](const image::Channel& c) { return c.name.starts_with(matte.layer + "00."); });
            if (has_ids && part.is_lossy)
                warnings.push_back(
                    fmt::format("{}: {} was stored with lossy compression, which has changed its "
                                "ids",
                                input, matte.layer));
        }
    }
}

/// What a frame holds beside its strips.
size_t frame_bytes(const MixJob& job, const LayerStack& layout, int frame) {
    Look look = has_keys(job.look) ? look_at(job.look, frame) : job.look;
    std::set<std::string> mattes;
    for (Control& control : look.controls) {
        if (!control.matte.empty()) mattes.insert(std::exchange(control.matte, {}));
    }
    size_t bytes_per_pixel = image_bytes_per_pixel + matte_bytes_per_pixel * mattes.size();
    if (job.with_layers && is_exr(job.output)) {
        for (const image::Part& part : layout.image().parts) {
            for (const image::Channel& c : part.channels)
                bytes_per_pixel += image::is_bookkeeping(c.name) ? 0 : channel_bytes_per_pixel;
        }
    }
    return layout.image().data.pixel_count() * bytes_per_pixel;
}

std::vector<std::string> inputs_of(const MixJob& job, int frame) {
    std::vector<std::string> inputs;
    for (const std::string& input : job.inputs) inputs.push_back(frame_file(input, frame));
    return inputs;
}

FrameOutcome mix_frame(const MixJob& job, int frame, size_t strip_bytes) {
    FrameOutcome outcome;
    outcome.frame = frame;
    outcome.output = frame_path(job.output, frame);
    const std::vector<std::string> inputs = inputs_of(job, frame);
    for (const std::string& input : inputs) {
        std::error_code error;
        if (std::filesystem::exists(input, error)) continue;
        outcome.error = Error{"frame-missing", fmt::format("frame {}: {} not found", frame, input)};
        return outcome;
    }
    try {
        auto mixed = mix_one(job, inputs, outcome.output, double(frame), strip_bytes,
                             frame_file(job.plate, frame));
        if (mixed) {
            outcome.warnings = std::move(*mixed);
        } else {
            outcome.error = Error{mixed.error().code,
                                  fmt::format("frame {}: {}", frame, mixed.error().message)};
        }
    } catch (const std::exception& e) {
        outcome.error = Error{"io-read", fmt::format("frame {}: {}", frame, e.what())};
    }
    return outcome;
}

}  // namespace

MemoryShare share_memory(const MixJob& job, const std::vector<int>& frames) {
    MemoryShare share;
    for (const int frame : frames) {
        const auto input = open_input(inputs_of(job, frame), job.view, job.look.input_space);
        if (!input) continue;
        share.frame_bytes = frame_bytes(job, input->layout, frame);
        break;
    }
    share.frames =
        std::clamp<size_t>(job.memory_bytes / (share.frame_bytes + fewest_strip_bytes), 1,
                           std::clamp<size_t>(frames.size(), 1, size_t(thread_count())));
    const size_t for_each = job.memory_bytes / share.frames;
    share.strip_bytes = std::max(fewest_strip_bytes,
                                 for_each > share.frame_bytes ? for_each - share.frame_bytes : 0);
    return share;
}

Result<std::vector<std::string>> mix_one(const MixJob& job,
                                         const std::vector<std::string>& inputs,
                                         const std::string& output,
                                         std::optional<double> frame,
                                         size_t strip_bytes,
                                         const std::string& plate) {
    std::vector<std::string> warnings;
    const auto opened = open_input(inputs, job.view, job.look.input_space);
    if (!opened) return opened.error();
    const layers::StripReader& file = opened->file;
    const LayerStack& layout = opened->layout;
    const std::string input = inputs.size() == 1
                                  ? inputs[0]
                                  : fmt::format("{} and {} more", inputs[0], inputs.size() - 1);
    for (const std::string& note : layout.notes()) warnings.push_back(input + ": " + note);

    Look look = job.look;
    if (has_keys(look)) {
        if (!frame)
            return Error{"no-frame", "the preset has keyed values; choose a frame with --frame N"};
        look = look_at(std::move(look), *frame);
    }
    if (job.is_lenient) {
        FittedLook fitted = fit_look(layout, look, &file, strip_bytes);
        for (const std::string& line : fitted.omitted)
            warnings.push_back(fmt::format("{}: skipped {}", input, line));
        look = std::move(fitted.look);
    }
    const auto plan = plan_mix(layout, look, &file, strip_bytes);
    if (!plan) return Error{plan.error().code, fmt::format("{}: {}", input, plan.error().message)};
    for (const std::string& note : plan->notes) warnings.push_back(input + ": " + note);
    if (job.with_layers) {
        const std::string omitted =
            layers_not_stored(layout, *plan, std::exp2(look.exposure_stops));
        if (!omitted.empty())
            warnings.push_back(
                fmt::format("{}: not stored, as they do not hold for the mix: {}", input, omitted));
        add_lossy_mattes(layout, input, warnings);
    }

    const bool is_linear = is_exr(output);
    std::vector<NotFiniteLayer> not_finite;
    auto mixed = mix_file(file, layout, *plan, look, job.with_layers && is_linear, &not_finite,
                          strip_bytes, job.storage.type);
    if (!mixed) return mixed.error();
    if (!not_finite.empty() && job.is_strict)
        return Error{"not-finite",
                     fmt::format("{}: {}", input, describe(not_finite[0], job.storage.type))};
    for (const NotFiniteLayer& layer : not_finite)
        warnings.push_back(fmt::format("{}: {} and {}", input, describe(layer, job.storage.type),
                                       layer.layer.empty() ? "are infinite" : "are set to 0"));

    if (!plate.empty()) {
        const auto laid =
            lay_on_plate(*mixed, file, layout, *plan, look, plate, strip_bytes, warnings);
        if (!laid) return laid.error();
    }

    std::vector<std::string> of_display;
    const auto written = is_linear
                             ? layers::write_image_file(output, *mixed, job.storage.compression)
                             : write_display(output, *mixed, look, job.storage, &of_display);
    if (!written) return written.error();
    for (const std::string& warning : of_display) {
        const std::string line = input + ": " + warning;
        if (std::find(warnings.begin(), warnings.end(), line) == warnings.end())
            warnings.push_back(line);
    }
    return warnings;
}

void mix_sequence(const MixJob& job,
                  const std::vector<int>& frames,
                  const std::function<void(const FrameOutcome&)>& told) {
    const MemoryShare share = share_memory(job, frames);
    std::atomic<size_t> next = 0;
    std::mutex mutex;
    const auto work = [&] {
        for (size_t i = next++; i < frames.size(); i = next++) {
            const FrameOutcome outcome = mix_frame(job, frames[i], share.strip_bytes);
            const std::scoped_lock lock(mutex);
            told(outcome);
        }
    };
    // Threads of their own: a task that waits for its strips would take up another frame, and with
    // it the memory of one more
    std::vector<std::jthread> workers;
    for (size_t i = 1; i < share.frames; ++i) workers.emplace_back(work);
    work();
}

}  // namespace velatura::compositor::mix
