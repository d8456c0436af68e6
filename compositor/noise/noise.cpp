// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/noise.h"

#include "layers/layer_header.h"
#include "layers/stated_stats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::noise {

namespace {

using Term = mix::MixPlan::Term;

/// A layer's channel with those of its half images.
struct HalvedChannel {
    const image::Channel* whole = nullptr;
    const image::Channel* a = nullptr;
    const image::Channel* b = nullptr;
};

Result<HalvedChannel> halved_channel(const LayerStack& stack, const std::string& layer, size_t c) {
    const std::string stem = layer == "rgba" ? "beauty" : layer;
    const HalvedChannel found{stack.channel(layer, c), stack.channel(stem + "_hA", c),
                              stack.channel(stem + "_hB", c)};
    if (found.whole && (!found.a || !found.b)) {
        return Error{"halves-not-stored",
                     fmt::format("no half images of layer {}; render with --halves", layer)};
    }
    return found;
}

/// Squared error by rounding a half image's value to half: the spacing of half floats is between
/// 2^-11 and 2^-10 of the value, the error uniform within it.
double rounding_variance(const image::Channel& half, float value) {
    if (half.type() != image::ChannelType::Half) return 0;
    const double spacing = std::abs(double(value)) * 0x1.6ap-11;
    return spacing * spacing / 12;
}

/// Var(mean) / Var(A − B) where a pixel has n samples, every second one in A: nA·nB/n².
std::vector<float> variance_shares(const LayerStack& stack) {
    const image::Image& image = stack.image();
    std::vector<float> shares(image.data.pixel_count(), 0.25f);
    const image::Channel* counts = image.find("sampleCount");
    if (!counts) return shares;
    image::for_each_value(*counts, [&](size_t i, float n) {
        const bool is_odd = std::fmod(n, 2.0f) == 1.0f;
        if (is_odd && n > 1.0f) shares[i] = 0.25f * (1.0f - 1.0f / (n * n));
    });
    return shares;
}

statistics::NoisyImage noisy_image(const MixError& mix) {
    statistics::NoisyImage image;
    for (size_t c = 0; c < 3; ++c) {
        image[c].mean = mix.mean[c];
        image[c].variance.resize(mix.mean[c].size());
        for (size_t i = 0; i < mix.mean[c].size(); ++i)
            image[c].variance[i] = float(mix.variance(c, i));
    }
    return image;
}

/// A row of the mixer: its terms, and what they make of its name.
struct Row {
    std::string name;
    std::vector<Term> terms;
};

Row& row_named(std::vector<Row>& rows, const std::string& name) {
    const auto at =
        std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.name == name; });
    if (at != rows.end()) return *at;
    return rows.emplace_back(Row{name, {}});
}

/// Rows by one of the names of a layer.
std::vector<Row> rows_by(const LayerStack& stack,
                         const mix::MixPlan& plan,
                         std::string accumulate::LayerEntry::*name) {
    std::vector<Row> rows;
    for (const Term& term : plan.terms) {
        const accumulate::LayerEntry* entry = stack.header().find(term.layer);
        if (entry && !(entry->*name).empty()) row_named(rows, entry->*name).terms.push_back(term);
    }
    return rows;
}

std::vector<Row> shadow_rows(const mix::MixPlan& plan) {
    std::vector<Row> rows;
    for (const Term& term : plan.shadow_terms) rows.push_back({term.layer, {term}});
    return rows;
}

/// Means and differences of the halves; not what errors are relative to.
Result<MixError> add_up(const LayerStack& stack, const mix::MixPlan& plan, const Look& look);

/// Pixels [first, end) of a strip.
struct PixelRange {
    size_t first = 0, end = 0;
};

/// Adds to `sums` what each row has of the squared error of the mix.
Result<void> add_rows(const LayerStack& stack,
                      const Look& look,
                      const mix::MixPlan& whole_plan,
                      const MixError& mix,
                      const std::vector<Row>& rows,
                      const PixelRange& pixels,
                      std::vector<RowNoise>& sums) {
    for (const Row& row : rows) {
        mix::MixPlan plan;
        plan.terms = row.terms;
        plan.mattes = whole_plan.mattes;
        const auto part = add_up(stack, plan, look);
        if (!part) return part.error();
        // E[D·D_row]: with half of every covariance, so that rows add up
        double sum = 0;
        for (size_t c = 0; c < 3; ++c) {
            for (size_t i = pixels.first; i < pixels.end; ++i) {
                const double product =
                    double(mix.difference[c][i]) * double(part->difference[c][i]);
                sum += statistics::relative_square(product * double(mix.share[i]),
                                                   double(mix.base[c][i]));
            }
        }
        const auto at = std::find_if(sums.begin(), sums.end(),
                                     [&](const RowNoise& s) { return s.name == row.name; });
        (at == sums.end() ? sums.emplace_back(RowNoise{row.name, 0}) : *at).share += sum;
    }
    return {};
}

/// A mix as a function of the factor of one of its controls, which it is affine in.
class ControlledMix {
  public:
    static Result<ControlledMix> make(const LayerStack& stack, Look look, size_t control) {
        ControlledMix out;
        out.window_ = stack.image().data;
        for (const float factor : {0.0f, 1.0f}) {
            look.controls[control].factor.fill(factor);
            const auto plan = mix::plan_mix(stack, look);
            if (!plan) return plan.error();
            auto mix = add_up(stack, *plan, look);
            if (!mix) return mix.error();
            (factor == 0.0f ? out.at_0_ : out.at_1_) = std::move(*mix);
        }
        return out;
    }

    /// √relMSE.
    double error_at(double factor) const {
        const auto between = [factor](float at_0, float at_1) {
            return double(at_0) + factor * (double(at_1) - double(at_0));
        };
        statistics::NoisyImage image;
        const size_t pixels = at_0_.share.size();
        for (size_t c = 0; c < 3; ++c) {
            image[c].mean.resize(pixels);
            image[c].variance.resize(pixels);
            for (size_t i = 0; i < pixels; ++i) {
                const double d = between(at_0_.difference[c][i], at_1_.difference[c][i]);
                image[c].variance[i] = float(d * d * double(at_0_.share[i]));
                image[c].mean[i] = float(between(at_0_.mean[c][i], at_1_.mean[c][i]));
            }
        }
        return statistics::image_error(window_.width(), window_.height(), image).value;
    }

    /// The largest factor up to `max` with at most that error, within a thousandth. More light may
    /// also bring less relative error, so factors are tried from above, half a stop at a time.
    std::optional<double> largest_within(double target, double max) const {
        constexpr int half_stops = 24, halvings = 10;
        double above = max;
        for (int k = 1; k <= half_stops; ++k) {
            const double below = k == half_stops ? 0 : max * std::exp2(-0.5 * k);
            if (error_at(below) <= target) {
                double low = below, high = above;
                for (int i = 0; i < halvings; ++i) {
                    const double middle = (low + high) / 2;
                    (error_at(middle) <= target ? low : high) = middle;
                }
                return low;
            }
            above = below;
        }
        return std::nullopt;
    }

  private:
    image::Window window_;
    MixError at_0_, at_1_;
};

bool adds_light(const Control& control) {
    return (control.kind == Control::Kind::Gain && control.factor[0] > 1.0f) ||
           (control.kind == Control::Kind::Shadow && control.factor[0] > 0.0f);
}

Result<NoiseAdvice> advise(const LayerStack& stack, const Look& look, double error, double target) {
    NoiseAdvice advice;
    advice.target = target;
    const double ratio = target > 0 ? error / target : 0;
    advice.sample_factor = ratio * ratio;
    if (ratio <= 1) return advice;
    for (size_t i = 0; i < look.controls.size(); ++i) {
        const Control& control = look.controls[i];
        if (!adds_light(control)) continue;
        const auto mix = ControlledMix::make(stack, look, i);
        if (!mix) return mix.error();
        advice.caps.push_back({control, mix->largest_within(target, double(control.factor[0]))});
    }
    return advice;
}

Result<MixError> add_up(const LayerStack& stack, const mix::MixPlan& plan, const Look& look) {
    const size_t pixels = stack.image().data.pixel_count();
    const float exposure = std::exp2(look.exposure_stops);
    MixError out;
    out.share = variance_shares(stack);
    std::vector<double> rounding;
    double rounding_sum = 0;
    for (size_t c = 0; c < 3; ++c) {
        out.mean[c].assign(pixels, 0.0f);
        out.difference[c].assign(pixels, 0.0f);
        rounding.assign(pixels, 0.0);
        // weight(pixel): what a value of the layer counts for
        const auto add = [&](const std::string& name, const auto& weight) -> Result<void> {
            const auto layer = halved_channel(stack, name, c);
            if (!layer) return layer.error();
            if (!layer->whole) return {};
            image::for_each_value(*layer->whole,
                                  [&](size_t i, float v) { out.mean[c][i] += weight(i) * v; });
            const auto add_half = [&](const image::Channel& half_image, float sign) {
                image::for_each_value(half_image, [&](size_t i, float v) {
                    const float w = weight(i);
                    out.difference[c][i] += sign * w * v;
                    rounding[i] += double(w) * double(w) * rounding_variance(half_image, v);
                });
            };
            add_half(*layer->a, 1.0f);
            add_half(*layer->b, -1.0f);
            return {};
        };
        for (const Term& term : plan.all_terms()) {
            const float gain = term.gain[c] * exposure;
            const bool is_matted = mix::has_mattes(term);
            const auto weight = [&](size_t i) {
                return is_matted ? gain * plan.matte_factor(term, c, i) : gain;
            };
            if (auto added = add(term.layer, weight); !added) return added.error();
            if (term.clamp_layer.empty()) continue;
            const auto share = [&](size_t i) { return weight(i) * plan.clamp_share(term, i); };
            if (auto added = add(term.clamp_layer, share); !added) return added.error();
        }
        for (size_t i = 0; i < pixels; ++i)
            rounding_sum += statistics::relative_square(rounding[i] * double(out.share[i]),
                                                        double(out.mean[c][i]));
    }
    out.storage = std::sqrt(rounding_sum / (3.0 * double(std::max<size_t>(pixels, 1))));
    return out;
}

/// Sets what errors of the mix are relative to. Returns: all of that.
std::array<statistics::ErrorBases, 3> set_base(const LayerStack& stack,
                                               const statistics::NoisyImage& image,
                                               MixError& mix) {
    const image::Window& window = stack.image().data;
    auto bases = statistics::error_bases(window.width(), window.height(), image);
    for (size_t c = 0; c < 3; ++c) mix.base[c] = bases[c].likely;
    return bases;
}

}  // namespace

Result<MixError> mix_error(const LayerStack& stack, const mix::MixPlan& plan, const Look& look) {
    auto mix = add_up(stack, plan, look);
    if (mix) set_base(stack, noisy_image(*mix), *mix);
    return mix;
}

Result<MixError> NoiseSum::add(const LayerStack& strip,
                               const mix::MixPlan& plan,
                               const Look& look,
                               int top,
                               int first,
                               int end) {
    // The same layers, so that a unit look has the error of the render to the last bit
    mix::MixPlan unit;
    unit.terms = plan.terms;
    for (Term& term : unit.terms) term = {term.layer};
    auto rendered = add_up(strip, unit, {}), mix = add_up(strip, plan, look);
    if (!rendered) return rendered;
    if (!mix) return mix;
    const int width = strip.image().data.width();
    const auto add = [&](MixError& error, statistics::ImageErrorSum& sum) {
        const statistics::NoisyImage image = noisy_image(error);
        sum.add(width, top, first, end, image, set_base(strip, image, error));
    };
    add(*rendered, rendered_);
    add(*mix, mix_);

    const PixelRange pixels{size_t(first) * size_t(width), size_t(end) * size_t(width)};
    for (size_t c = 0; c < 3; ++c)
        for (size_t i = pixels.first; i < pixels.end; ++i) squares_ += mix->relative_square(c, i);
    for (const auto& added :
         {add_rows(strip, look, plan, *mix, rows_by(strip, plan, &accumulate::LayerEntry::group),
                   pixels, groups_),
          add_rows(strip, look, plan, *mix, rows_by(strip, plan, &accumulate::LayerEntry::bounce),
                   pixels, bounces_),
          add_rows(strip, look, plan, *mix, rows_by(strip, plan, &accumulate::LayerEntry::lobe),
                   pixels, lobes_),
          add_rows(strip, look, plan, *mix, shadow_rows(plan), pixels, shadows_)}) {
        if (!added) return added.error();
    }
    return mix;
}

std::vector<RowNoise> NoiseSum::shares_of(std::vector<RowNoise> sums) const {
    for (RowNoise& row : sums) row.share = squares_ > 0 ? row.share / squares_ : 0.0;
    std::stable_sort(sums.begin(), sums.end(),
                     [](const RowNoise& a, const RowNoise& b) { return a.share > b.share; });
    return sums;
}

Result<NoiseForecast> forecast_noise(const LayerStack& stack,
                                     const Look& look,
                                     std::optional<double> target) {
    const auto plan = mix::plan_mix(stack, look);
    if (!plan) return plan.error();
    NoiseSum sum;
    auto mix = sum.add(stack, *plan, look, 0, 0, stack.image().data.height());
    if (!mix) return mix.error();
    NoiseForecast out;
    out.rendered = sum.rendered();
    out.mix = sum.mix();
    // A mix of these layers has the same light in it
    if (layers::is_error_hidden(stack.image().text(layers::stats_attribute)))
        out.rendered.is_lower = out.mix.is_lower = true;
    out.error = std::move(*mix);
    out.groups = sum.groups();
    out.bounces = sum.bounces();
    out.lobes = sum.lobes();
    out.shadows = sum.shadows();
    auto advice = advise(stack, look, out.mix.value, target.value_or(out.rendered.value));
    if (!advice) return advice.error();
    out.advice = std::move(*advice);
    return out;
}

}  // namespace velatura::compositor::noise
