// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/tile_mix.h"

#include "compositor/io/row_values.h"
#include "image/formats.h"

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

namespace {

layers::StripChannel strip_of(const image::Channel& channel) {
    return {channel.type(), channel.bytes()};
}

/// Pixels of a tile that are stored, row by row, for one channel at a time.
class TileFold {
  public:
    TileFold(const LayerStack& stack, const mix::MixPlan& plan, const image::Window& stored)
        : stack_(stack), plan_(plan), stored_(stored) {}

    /// Adds what a term brings to channel c; fold: [pixel of the stored part].
    void add(const mix::MixPlan::Term& term, size_t c, float exposure, std::vector<float>& fold) {
        const image::Channel* channel = stack_.channel(term.layer, c);
        const image::Channel* clamp =
            term.clamp_layer.empty() ? nullptr : stack_.channel(term.clamp_layer, c);
        const float gain = term.gain[c] * exposure;
        // 0 times a finite value never changes a fold that began at +0
        if ((!channel && !clamp) || gain == 0.0f) return;
        const auto width = size_t(stored_.width());
        values_.resize(width);
        for (int y = stored_.y0; y < stored_.y1; ++y) {
            const size_t pixel = stack_.image().data.index(stored_.x0, y);
            load(channel, pixel, values_);
            if (clamp) give_back(term, *clamp, pixel);
            if (mix::has_mattes(term)) {
                for (size_t i = 0; i < width; ++i)
                    values_[i] *= plan_.matte_factor(term, c, pixel + i);
            }
            float* sum = fold.data() + size_t(y - stored_.y0) * width;
            for (size_t i = 0; i < width; ++i) sum[i] += gain * values_[i];
        }
    }

  private:
    static void load(const image::Channel* channel, size_t pixel, std::vector<float>& row) {
        if (channel) {
            load_row(strip_of(*channel), pixel, row.size(), row.data());
        } else {
            std::fill(row.begin(), row.end(), 0.0f);
        }
    }

    void give_back(const mix::MixPlan::Term& term, const image::Channel& clamp, size_t pixel) {
        taken_.resize(values_.size());
        load(&clamp, pixel, taken_);
        for (size_t i = 0; i < values_.size(); ++i)
            values_[i] += plan_.clamp_share(term, pixel + i) * taken_[i];
    }

    const LayerStack& stack_;
    const mix::MixPlan& plan_;
    const image::Window& stored_;
    std::vector<float> values_, taken_;
};

}  // namespace

std::vector<float> mix_tile(const LayerStack& stack,
                            const mix::MixPlan& plan,
                            float exposure_stops,
                            const image::Window& tile) {
    const image::Image& in = stack.image();
    const image::Window in_file = {tile.x0 + in.display.x0, tile.y0 + in.display.y0,
                                   tile.x1 + in.display.x0, tile.y1 + in.display.y0};
    const image::Window stored = {
        std::max(in_file.x0, in.data.x0), std::max(in_file.y0, in.data.y0),
        std::min(in_file.x1, in.data.x1), std::min(in_file.y1, in.data.y1)};
    std::vector<float> rgb(3 * tile.pixel_count(), 0.0f);
    if (stored.is_empty()) return rgb;
    const float exposure = std::exp2(exposure_stops);
    TileFold tile_fold(stack, plan, stored);
    for (size_t c = 0; c < 3; ++c) {
        std::vector<float> fold(stored.pixel_count(), 0.0f);
        for (const mix::MixPlan::Term& term : plan.terms) tile_fold.add(term, c, exposure, fold);
        for (const mix::MixPlan::Term& term : plan.shadow_terms)
            tile_fold.add(term, c, exposure, fold);
        for (int y = stored.y0; y < stored.y1; ++y) {
            for (int x = stored.x0; x < stored.x1; ++x)
                rgb[3 * in_file.index(x, y) + c] = fold[stored.index(x, y)];
        }
    }
    return rgb;
}

std::vector<uint8_t> display_rgba(std::vector<float> rgb,
                                  const image::DisplayTransform& transform) {
    transform.apply(rgb);
    std::vector<uint8_t> rgba(rgb.size() / 3 * 4);
    for (size_t i = 0; i < rgb.size() / 3; ++i) {
        for (size_t c = 0; c < 3; ++c) rgba[4 * i + c] = image::display_byte(rgb[3 * i + c]);
        rgba[4 * i + 3] = 255;
    }
    return rgba;
}

}  // namespace velatura::compositor::window
