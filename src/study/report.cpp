// SPDX-License-Identifier: Apache-2.0
#include "study/report.h"

#include "statistics/relative_error.h"
#include "study/maps.h"
#include "study/rows.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace velatura::study {

namespace {

Estimate root_of(const GroupMeans& squares) {
    const double mean = std::max(squares.mean(), 0.0), se = squares.standard_error();
    return {std::sqrt(mean), std::sqrt(std::max(mean - 1.96 * se, 0.0)),
            std::sqrt(mean + 1.96 * se)};
}

double average(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return values.empty() ? 0.0 : sum / double(values.size());
}

/// What the error of a setting is made of.
struct ErrorParts {
    GroupMeans noise, bias;
};

double square_without(const ErrorParts& p, size_t group, double noise_factor) {
    return std::max(p.noise.mean_without(group), 0.0) * noise_factor +
           std::max(p.bias.mean_without(group), 0.0);
}

class Maker {
  public:
    Maker(const Subject& subject, const std::vector<Setting>& settings, const Tallies& tallies)
        : settings_(settings),
          tallies_(tallies),
          spp_(subject.spp),
          reference_(make_reference(settings, tallies, subject.spp)) {
        report_.subject = subject;
        report_.grid = tallies.grid;
        report_.rounds = tallies.rounds;
        report_.elapsed_s = tallies.elapsed_s;
        image_factor_ = double(subject.width) * double(subject.height) /
                        double(std::max<size_t>(tallies.grid.pixels(), 1));
    }

    Report make(const std::vector<Knob>& knobs, const Facts& facts) {
        for (size_t s = 0; s < settings_.size(); ++s) add_setting(s);
        find_base_bias();
        for (size_t s = 0; s < settings_.size(); ++s) weigh(s);
        choose_best();
        report_.noise = report_.settings[0].noise;
        report_.bias = report_.settings[0].bias;
        report_.error = report_.settings[0].error;
        report_.half_error = half_error();
        report_.layers = layer_rows();
        report_.rows = make_rows(report_, knobs, facts);
        add_maps(report_, reference_, settings_, tallies_);
        return std::move(report_);
    }

    std::vector<bool> settled() {
        constexpr int enough_rounds = 2, same_image_rounds = 6;
        constexpr double clearly = 1.05;
        std::vector<bool> is_settled(settings_.size(), false);
        if (tallies_.rounds < enough_rounds) return is_settled;
        for (size_t s = 0; s < settings_.size(); ++s) add_setting(s);
        find_base_bias();
        for (size_t s = 0; s < settings_.size(); ++s) {
            weigh(s);
            const SettingResult& r = report_.settings[s];
            if (r.rounds < enough_rounds || settings_[s].anchor == s) continue;
            const bool is_worse = r.verdict == Verdict::Worse && r.equal_time.low > clearly;
            const bool is_same = r.difference.is_same_image && r.verdict == Verdict::NoDifference &&
                                 r.rounds >= same_image_rounds;
            is_settled[s] = r.verdict == Verdict::Changes || is_worse || is_same;
        }
        return is_settled;
    }

  private:
    void add_setting(size_t s) {
        const SettingTally& tally = tallies_.settings[s];
        SettingResult r;
        r.setting = settings_[s];
        r.rounds = int(tally.rounds.size());
        r.rejection = tally.rejection;
        r.setup_s = tally.setup_s;
        r.outline_px = tally.outline_px;
        for (const PointTally& p : tally.points) {
            r.curve.push_back({p.spp, average(p.cpu_s) * image_factor_,
                               root_of(noise_squares(p.image, reference_))});
            if (p.spp != spp_) continue;
            r.noise = r.curve.back().noise;
            r.cpu_s = r.curve.back().cpu_s;
            r.rays_per_sample =
                p.rays / (double(p.image.count) * double(tallies_.grid.pixels()) * double(p.spp));
        }
        r.slope = fit_slope(tally, reference_);
        r.difference = test_difference(tally.difference, reference_);
        report_.settings.push_back(std::move(r));
    }

    /// What the render as it is leaves out, knob by knob: how far it is off the exact values.
    void find_base_bias() {
        for (size_t s = 1; s < settings_.size(); ++s) {
            if (settings_[s].anchor != s || !report_.settings[s].difference.is_seen) continue;
            bias_of_knob_[settings_[s].knob] =
                bias_squares(tallies_.settings[s].difference, reference_);
        }
    }

    ErrorParts parts_of(size_t s) const {
        ErrorParts parts;
        // Of the same image the noise is the same, whatever rounds it took part in
        const size_t of = report_.settings[s].difference.is_same_image ? 0 : s;
        if (const PointTally* p = tallies_.settings[of].at(spp_))
            parts.noise = noise_squares(p->image, reference_);
        // Other knobs leave what they leave in the render as it is
        const auto join = [&parts](const GroupMeans& more) {
            for (size_t g = 0; g < GroupMeans::groups; ++g) {
                parts.bias.sum[g] += more.sum[g];
                parts.bias.count[g] = more.count[g];
            }
        };
        for (const auto& [knob, squares] : bias_of_knob_)
            if (knob != settings_[s].knob) join(squares);
        const bool is_exact = settings_[s].anchor == s;
        if (s != 0 && !is_exact && report_.settings[s].difference.is_seen)
            join(bias_squares(tallies_.settings[s].difference, reference_));
        return parts;
    }

    void weigh(size_t s) {
        SettingResult& r = report_.settings[s];
        const ErrorParts own = parts_of(s), base = parts_of(0);
        r.bias = std::sqrt(std::max(own.bias.mean(), 0.0));
        r.error = std::sqrt(square_without(own, GroupMeans::groups, 1.0));
        if (r.difference.is_same_image) r.noise = report_.settings[0].noise;
        const std::optional<TimeRatio> ratio =
            time_ratio(tallies_.settings[s], tallies_.settings[0], spp_);
        if (s == 0) {
            r.time = r.equal_time = {1, 1, 1};
            r.verdict = Verdict::Now;
            return;
        }
        if (!ratio || r.rounds < 2) return;

        // Preparation is paid for once and counts in full
        const double base_s = report_.settings[0].cpu_s, base_setup_s = report_.settings[0].setup_s;
        const double total =
            (ratio->value * base_s + r.setup_s) / std::max(base_s + base_setup_s, 1e-12);
        r.time = {ratio->value, ratio->value * std::exp(-1.96 * ratio->log_se),
                  ratio->value * std::exp(1.96 * ratio->log_se)};

        // Noise after as long as the render takes as it is, by the setting's own slope where it is
        // known well
        const bool is_steep = r.slope.is_known && r.slope.standard_error < 0.05;
        const Slope& slope = is_steep ? r.slope : report_.settings[0].slope;
        const double a = std::clamp(-slope.value, 0.35, 1.0);
        const double factor = std::pow(total, 2 * a);
        const auto log_gain = [&](size_t group) {
            return 0.5 * std::log(std::max(square_without(own, group, factor), 1e-300) /
                                  std::max(square_without(base, group, 1.0), 1e-300));
        };
        const double gain = log_gain(GroupMeans::groups);
        double square = 0;
        for (size_t g = 0; g < GroupMeans::groups; ++g)
            square += (log_gain(g) - gain) * (log_gain(g) - gain);
        const double noise_share =
            own.noise.mean() * factor /
            std::max(square_without(own, GroupMeans::groups, factor), 1e-300);
        // Preparing is timed once, to within a tenth
        const double setup_log_se =
            0.1 * std::hypot(r.setup_s, base_setup_s) / std::max(base_s + base_setup_s, 1e-12);
        const double time_part =
            a * noise_share *
            std::hypot(ratio->log_se, r.setup_s == base_setup_s ? 0.0 : setup_log_se);
        const double se =
            std::sqrt(square * double(GroupMeans::groups - 1) / double(GroupMeans::groups) +
                      time_part * time_part);
        const double worst_gain =
            gain + hidden_bias(r, square_without(own, GroupMeans::groups, factor));
        r.equal_time = {std::exp(gain), std::exp(gain - 1.96 * se),
                        std::exp(worst_gain + 1.96 * se)};
        r.verdict = judge(r, gain, worst_gain, se);
    }

    /// By how much the logarithm of the error is more if an approximation has all the bias that
    /// would not have been seen.
    static double hidden_bias(const SettingResult& r, double square) {
        const bool can_hide = r.setting.bias_class == BiasClass::Biased && !r.difference.is_seen &&
                              !r.difference.is_same_image;
        return can_hide ? 0.5 * std::log1p(r.difference.bias_limit * r.difference.bias_limit /
                                           std::max(square, 1e-300))
                        : 0.0;
    }

    /// Light that a way of sampling meets too rarely to have been seen is missing in its images,
    /// as by a bug; too much of it where it was met is none either.
    static bool breaks_promise(const SettingResult& r) {
        if (r.setting.bias_class != BiasClass::Unbiased || r.setting.knob.empty() ||
            r.setting.anchor != 0 || !r.difference.is_seen)
            return false;
        constexpr double sure = 4.5;
        const double shift = r.difference.shift, limit = sure * r.difference.shift_se;
        return !(r.setting.misses_rare_light && shift < limit) &&
               !(r.setting.misses_rare_light_now && shift > -limit);
    }

    static Verdict judge(const SettingResult& r, double gain, double worst_gain, double se) {
        if (breaks_promise(r)) return Verdict::Suspect;
        if (r.setting.bias_class == BiasClass::Changes) return Verdict::Changes;
        // As many settings are judged, what passes for a difference must be surer than 95 %, and
        // worth the change
        constexpr double sure = 3.5, worth = 0.015;
        if (worst_gain < -sure * se && worst_gain < -worth)
            return r.difference.is_same_image ? Verdict::Cheaper : Verdict::Better;
        if (gain > sure * se && gain > worth) return Verdict::Worse;
        return Verdict::NoDifference;
    }

    void choose_best() {
        SettingResult* best = nullptr;
        for (SettingResult& r : report_.settings) {
            if (r.verdict != Verdict::Better && r.verdict != Verdict::Cheaper) continue;
            if (!best || r.equal_time.value < best->equal_time.value) best = &r;
        }
        if (best) best->verdict = Verdict::MostEfficient;
    }

    /// Exact: what rounding does to the mean image.
    double half_error() const {
        double sum = 0;
        for (const double m : reference_.means) {
            const double d = double(float(Imath::half(float(m)))) - m;
            sum += statistics::relative_square(d * d, m);
        }
        return reference_.means.empty() ? 0.0 : std::sqrt(sum / double(reference_.means.size()));
    }

    std::vector<LayerRow> layer_rows() const {
        std::vector<LayerRow> rows;
        const PointTally* base = tallies_.settings[0].at(2 * spp_);
        if (!base) return rows;
        double energy = 0;
        for (size_t i = 0; i < base->image.sum.size(); ++i) energy += base->image.mean(i);
        const double noise = noise_squares(base->image, reference_).mean();
        for (const LayerTally& l : tallies_.layers) {
            LayerRow row{l.is_bounce, l.name};
            // In rounds that did not see it, it was black
            Moments image = l.image;
            image.count = base->image.count;
            for (size_t i = 0; i < image.sum.size(); ++i)
                row.energy += image.mean(i) / std::max(energy, 1e-30);
            if (noise > 0) row.noise = noise_squares(image, reference_).mean() / noise;
            rows.push_back(std::move(row));
        }
        return rows;
    }

    const std::vector<Setting>& settings_;
    const Tallies& tallies_;
    uint64_t spp_;
    Reference reference_;
    double image_factor_ = 1;
    std::map<std::string, GroupMeans> bias_of_knob_;
    Report report_;
};

}  // namespace

std::vector<bool> settled_settings(const Subject& subject,
                                   const std::vector<Setting>& settings,
                                   const Tallies& tallies) {
    return Maker(subject, settings, tallies).settled();
}

const char* text_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::Unknown:
            return "not estimated yet";
        case Verdict::Now:
            return "as it is";
        case Verdict::MostEfficient:
            return "BEST BUY";
        case Verdict::Better:
            return "better at equal time";
        case Verdict::Cheaper:
            return "same image, faster";
        case Verdict::NoDifference:
            return "keep";
        case Verdict::Worse:
            return "keep";
        case Verdict::Suspect:
            return "SUSPECT: possible bias";
        case Verdict::Changes:
            return "your choice";
    }
    return "";
}

Report make_report(const Subject& subject,
                   const std::vector<Knob>& knobs,
                   const Facts& facts,
                   const std::vector<Setting>& settings,
                   const Tallies& tallies) {
    return Maker(subject, settings, tallies).make(knobs, facts);
}

}  // namespace velatura::study
