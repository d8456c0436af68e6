// SPDX-License-Identifier: Apache-2.0
#include "study/experiments.h"

#include "study/report.h"

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Eighths of the render's samples; of the render as it is also twice as many.
std::vector<uint64_t> ladder(uint64_t spp, bool is_base) {
    std::vector<uint64_t> steps;
    for (const uint64_t part : {8, 4, 2, 1})
        if (spp / part > 0 && (steps.empty() || steps.back() != spp / part))
            steps.push_back(spp / part);
    if (is_base) steps.push_back(2 * spp);
    return steps;
}

/// The render as it is and the other anchors, then the others, turned by the round.
std::vector<size_t> order_of_round(const std::vector<Setting>& settings, int round) {
    std::vector<size_t> anchors = {0}, others;
    for (size_t i = 1; i < settings.size(); ++i)
        (settings[i].anchor == i ? anchors : others).push_back(i);
    if (!others.empty())
        std::rotate(others.begin(), others.begin() + ptrdiff_t(size_t(round) * 7 % others.size()),
                    others.end());
    anchors.insert(anchors.end(), others.begin(), others.end());
    return anchors;
}

std::string name_of(const Setting& s) {
    return s.knob.empty() ? "as it is" : s.options;
}

/// What results depend on.
Subject subject_of(const ExperimentOptions& options) {
    Subject subject;
    subject.width = options.width;
    subject.height = options.height;
    subject.spp = options.spp;
    return subject;
}

/// Renders the settings of one round after the other.
class RoundRunner {
  public:
    RoundRunner(const std::vector<Setting>& settings,
                const ExperimentOptions& options,
                const RenderFunction& render,
                const ExperimentCallbacks& callbacks,
                double earlier_s)
        : settings_(settings),
          options_(options),
          render_(render),
          callbacks_(callbacks),
          earlier_s_(earlier_s),
          took_s_(settings.size(), 0.0) {}

    /// False: there was no time for all of them, or a stop. Errors: those of the render as it is,
    /// if there is none of it yet.
    Result<bool> run(int round, Tallies& tallies) {
        const std::vector<size_t> order = order_of_round(settings_, round);
        const std::vector<bool> is_settled =
            settled_settings(subject_of(options_), settings_, tallies);
        std::vector<std::vector<float>> images(settings_.size());
        for (size_t i = 0; i < order.size(); ++i) {
            const size_t s = order[i];
            SettingTally& tally = tallies.settings[s];
            if (!tally.rejection.empty() || is_settled[s]) continue;
            if (callbacks_.progress)
                callbacks_.progress({round, options_.rounds, i, order.size(), name_of(settings_[s]),
                                     seconds_since(start_), options_.time_s});
            const bool is_late = seconds_since(start_) + took_s_[s] > options_.time_s;
            if (is_late || (callbacks_.is_stopped && callbacks_.is_stopped())) return false;

            const auto begin = Clock::now();
            const Result<RenderRun> run = render_({.options = settings_[s].options,
                                                   .seed = options_.seed + uint64_t(round),
                                                   .grid = tallies.grid,
                                                   .spp = ladder(options_.spp, s == 0),
                                                   .deadline = deadline()});
            took_s_[s] = seconds_since(begin);
            tallies.elapsed_s = earlier_s_ + seconds_since(start_);
            if (!run) {
                if (s == 0 && tally.rounds.empty()) return run.error();
                if (run.error().code == "stopped") return false;
                tally.rejection = run.error().message;
                continue;
            }
            tallies.add(s, round, *run);
            tallies.rounds = round + 1;
            images[s] = image_at(*run, options_.spp);
            // How far the render as it is lies from an anchor is found at the anchor
            const size_t anchor = settings_[s].anchor == s ? 0 : settings_[s].anchor;
            if (anchor != s && !images[anchor].empty())
                tally.difference.add_difference(images[s], images[anchor]);
            if (!is_anchor(s)) images[s].clear();
        }
        return true;
    }

  private:
    Clock::time_point deadline() const {
        return start_ + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double>(options_.time_s));
    }

    bool is_anchor(size_t s) const { return s == 0 || settings_[s].anchor == s; }

    static const std::vector<float>& image_at(const RenderRun& run, uint64_t spp) {
        const auto found = std::find_if(run.readings.begin(), run.readings.end(),
                                        [spp](const Reading& r) { return r.spp == spp; });
        VELATURA_CHECK(found != run.readings.end(),
                       "a render of a study has a reading at the render's samples");
        return found->means;
    }

    const std::vector<Setting>& settings_;
    const ExperimentOptions& options_;
    const RenderFunction& render_;
    const ExperimentCallbacks& callbacks_;
    double earlier_s_;
    std::vector<double> took_s_;  ///< by the last render of each
    Clock::time_point start_ = Clock::now();
};

}  // namespace

Result<Grid> choose_grid(const std::vector<Setting>& settings,
                         const ExperimentOptions& options,
                         const RenderFunction& render) {
    const auto shaped = [&](double pixels) {
        const double aspect = double(options.width) / double(options.height);
        Grid g;
        g.width = std::clamp(int(std::lround(std::sqrt(pixels * aspect))), 1, options.width);
        g.height = std::clamp(int(std::lround(pixels / g.width)), 1, options.height);
        return g;
    };
    constexpr double min = 96, fewest = 512, trial = 1024, max = 8192, wanted_rounds = 8,
                     reserve = 0.75;
    const RenderRequest request{
        .options = {}, .seed = options.seed, .grid = shaped(trial), .spp = {options.spp}};
    const auto start = Clock::now();
    const Result<RenderRun> first = render(request);
    if (!first) return first.error();
    // The second time everything is prepared
    const auto begin = Clock::now();
    const Result<RenderRun> second = render(request);
    if (!second) return second.error();
    const double per_pixel_s = std::max(seconds_since(begin), 1e-6) / double(request.grid.pixels());
    // Preparing takes each setting its time once, whatever the pixels
    const double left_s = reserve * std::max(0.0, options.time_s - seconds_since(start) -
                                                      first->setup_s * double(settings.size()));
    const double round_s = double(settings.size() + 1) * per_pixel_s;
    // After two rounds about half of the settings are settled
    const double rounds = std::min(wanted_rounds, double(options.rounds));
    const double pixels =
        left_s / (round_s * (std::min(rounds, 2.0) + 0.5 * std::max(rounds - 2.0, 0.0)));
    // Without two rounds nothing is known: where there is no time for more, of few pixels
    const double in_two_rounds = left_s / (2 * round_s);
    return shaped(std::clamp(pixels, std::clamp(in_two_rounds, min, fewest), max));
}

Result<void> run_experiments(const std::vector<Setting>& settings,
                             const ExperimentOptions& options,
                             const RenderFunction& render,
                             const ExperimentCallbacks& callbacks,
                             Tallies& tallies) {
    tallies.settings.resize(settings.size());
    RoundRunner runner(settings, options, render, callbacks, tallies.elapsed_s);
    for (int round = tallies.rounds; round < options.rounds; ++round) {
        // Settings are compared by the same seeds: what is left in the middle does not count, but
        // where there is nothing else
        Tallies before;
        if (round >= 2) before = tallies;
        const Result<bool> is_whole = runner.run(round, tallies);
        if (!is_whole) return is_whole.error();
        if (!*is_whole) {
            if (round >= 2) tallies = std::move(before);
            return {};
        }
        if (callbacks.round_done) callbacks.round_done(tallies);
    }
    return {};
}

}  // namespace velatura::study
