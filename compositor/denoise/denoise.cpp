// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise.h"

#include "compositor/denoise/denoise_choice.h"
#include "compositor/denoise/denoise_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace velatura::compositor::denoise {

namespace {

using image::Channel;
using image::ChannelType;
constexpr int T = DenoiseKernel::tile_size;

/// One stored channel of a light layer with those of its half images and where they go.
struct Job {
    std::array<const Channel*, 2> half = {nullptr, nullptr};  ///< both null: no half images
    const Channel* whole = nullptr;
    std::array<Channel*, 2> half_out = {nullptr, nullptr};
    Channel* whole_out = nullptr;
};

void store(Channel& channel, size_t pixel, float value) {
    if (auto* half = std::get_if<std::vector<Imath::half>>(&channel.data))
        (*half)[pixel] = Imath::half(value);
    else
        std::get<std::vector<float>>(channel.data)[pixel] = value;
}

/// Filters a tile of every job with its two sets of weights: [half image that they come from].
class TileFilter {
  public:
    TileFilter(const DenoiseGuides& guides, const DenoiseKernel& kernel, int x, int y)
        : window_(guides.window),
          kernel_(kernel),
          x_(x),
          y_(y),
          padded_(size_t(DenoiseKernel::padded) * DenoiseKernel::padded) {}

    void run(const Job& job, const std::array<DenoiseKernel::Weights, 2>& weights) {
        float a[DenoiseKernel::tile_pixels], b[DenoiseKernel::tile_pixels];
        const bool has_halves = job.half[0] != nullptr;
        // Weights of one half meet the other's values, whose noise they do not know
        filter(*(has_halves ? job.half[0] : job.whole), weights[1], a);
        filter(*(has_halves ? job.half[1] : job.whole), weights[0], b);
        for (int v = y_; v < std::min(y_ + T, window_.height()); ++v) {
            for (int u = x_; u < std::min(x_ + T, window_.width()); ++u) {
                const size_t i = size_t((v - y_) * T + u - x_);
                const size_t pixel = size_t(v) * size_t(window_.width()) + size_t(u);
                if (job.whole_out) store(*job.whole_out, pixel, 0.5f * (a[i] + b[i]));
                if (job.half_out[0]) store(*job.half_out[0], pixel, a[i]);
                if (job.half_out[1]) store(*job.half_out[1], pixel, b[i]);
            }
        }
    }

  private:
    void filter(const Channel& channel, const DenoiseKernel::Weights& weights, float* out) {
        std::visit(
            [&](const auto& values) {
                kernel_.copy_padded([&](size_t i) { return float(values[i]); }, padded_.data());
            },
            channel.data);
        DenoiseKernel::apply(weights, padded_.data(), out);
    }

    const image::Window window_;
    const DenoiseKernel& kernel_;
    int x_, y_;
    std::vector<float> padded_;
};

std::vector<Job> jobs_for(const LayerStack& stack, image::Image& out) {
    std::unordered_map<std::string, Channel*> outputs;
    for (image::Part& part : out.parts) {
        for (Channel& channel : part.channels) outputs.try_emplace(channel.name, &channel);
    }
    constexpr const char* names[] = {"R", "G", "B"};
    const auto output = [&](const std::string& layer, size_t c) -> Channel* {
        const auto at = outputs.find(layer == "rgba" ? names[c] : layer + "." + names[c]);
        return at == outputs.end() ? nullptr : at->second;
    };
    std::vector<Job> jobs;
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        if (!is_filtered(entry)) continue;
        const std::string stem = entry.name == "rgba" ? "beauty" : entry.name;
        for (size_t c = 0; c < 3; ++c) {
            Job job;
            job.whole = stack.channel(entry.name, c);
            if (!job.whole) continue;
            job.whole_out = output(entry.name, c);
            const Channel* a = stack.channel(stem + "_hA", c);
            const Channel* b = stack.channel(stem + "_hB", c);
            if (a && b) {
                job.half = {a, b};
                job.half_out = {output(stem + "_hA", c), output(stem + "_hB", c)};
            }
            jobs.push_back(job);
        }
    }
    return jobs;
}

/// Light layers whose half images were not rendered, beside a beauty that has its own.
void note_layers_without_halves(const LayerStack& stack, std::vector<std::string>& notes) {
    std::vector<std::string> without;
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        const bool is_light = is_filtered(entry) && !entry.is_empty && entry.name != "rgba";
        if (is_light && !stack.header().find(entry.name + "_hA")) without.push_back(entry.name);
    }
    if (!without.empty())
        notes.push_back(
            fmt::format("no half images of {}; its filter weights correlate with its noise",
                        fmt::join(without, " ")));
}

}  // namespace

Result<image::Image> denoise(const LayerStack& stack, DenoiseReport& report) {
    if (auto checked = check_denoisable(stack); !checked) return checked.error();
    const auto guides = denoise_guides(stack);
    if (!guides) return guides.error();
    report.notes = guides->notes;
    if (guides->has_halves) note_layers_without_halves(stack, report.notes);
    auto out = denoised_file_like(stack);
    if (!out) return out;
    const FilterChoice choice = choose_filters(*guides);
    const std::vector<Job> jobs = jobs_for(stack, *out);
    for_each_tile(*guides, [&](DenoiseKernel& kernel, int x, int y) {
        std::array<DenoiseKernel::Weights, 2> weights;
        DenoiseKernel::Weights scratch;
        for (int half = 0; half < 2; ++half)
            chosen_weights(kernel, choice, guides->window, x, y, half, weights[size_t(half)],
                           scratch);
        TileFilter tile(*guides, kernel, x, y);
        for (const Job& job : jobs) tile.run(job, weights);
    });
    if (auto done = finish_denoised_file(stack, *guides, choice, *out, report); !done)
        return done.error();
    return out;
}

}  // namespace velatura::compositor::denoise
