// SPDX-License-Identifier: Apache-2.0
#include "study/experiments.h"

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Eighths of the render's samples; of the render as it is also twice as many.
std::vector<uint64_t> ladder(uint64_t spp, bool is_base) {
    std::vector<uint64_t> steps;
    for (const uint64_t part : {8, 4, 2, 1})
        if (spp / part > 0 && (steps.empty() || steps.back() != spp / part)) steps.push_back(spp / part);
    if (is_base) steps.push_back(2 * spp);
    return steps;
}

/// The render as it is and the other anchors, then the others, turned by the round.
std::vector<size_t> order_of_round(const std::vector<Setting>& settings, int round) {
    std::vector<size_t> anchors = {0}, others;
    for (size_t i = 1; i < settings.size(); ++i) (settings[i].anchor == i ? anchors : others).push_back(i);
    if (!others.empty()) std::rotate(others.begin(), others.begin() + ptrdiff_t(size_t(round) * 7 % others.size()), others.end());
    anchors.insert(anchors.end(), others.begin(), others.end());
    return anchors;
}

std::string name_of(const Setting& s) { return s.knob.empty() ? "as it is" : s.options; }

const std::vector<float>* picture_at(const RenderRun& run, uint64_t spp) {
    for (const Reading& r : run.readings)
        if (r.spp == spp) return &r.means;
    return nullptr;
}

}  // namespace

Result<Grid> choose_grid(const std::vector<Setting>& settings, const ExperimentOptions& options, const RenderFunction& render) {
    const auto shaped = [&](double pixels) {
        const double aspect = double(options.width) / double(options.height);
        Grid g;
        g.width = std::clamp(int(std::lround(std::sqrt(pixels * aspect))), 1, options.width);
        g.height = std::clamp(int(std::lround(pixels / g.width)), 1, options.height);
        return g;
    };
    constexpr double fewest = 256, most = 8192, wanted_rounds = 10, reserve = 0.7;
    const RenderRequest request{.options = {}, .seed = options.seed, .grid = shaped(fewest), .spp = {options.spp}};
    const auto start = Clock::now();
    const Result<RenderRun> first = render(request);
    if (!first) return first.error();
    // The second time everything is prepared
    const auto begin = Clock::now();
    const Result<RenderRun> second = render(request);
    if (!second) return second.error();
    const double per_pixel_s = std::max(seconds_since(begin), 1e-6) / double(request.grid.pixels());
    // Preparing takes each setting its time once, whatever the pixels
    const double left_s = reserve * std::max(0.0, options.time_s - seconds_since(start) - first->setup_s * double(settings.size()));
    const double runs = double(settings.size() + 1) * std::min(wanted_rounds, double(options.rounds));
    return shaped(std::clamp(left_s / (runs * per_pixel_s), fewest, most));
}

Result<void> run_experiments(const std::vector<Setting>& settings, const ExperimentOptions& options, const RenderFunction& render, const ExperimentCallbacks& callbacks, Tallies& tallies) {
    const auto start = Clock::now();
    const double before_s = tallies.elapsed_s;
    const auto deadline = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.time_s));
    tallies.settings.resize(settings.size());
    std::vector<double> took_s(settings.size(), 0.0);

    for (int round = tallies.rounds; round < options.rounds; ++round) {
        const std::vector<size_t> order = order_of_round(settings, round);
        std::vector<std::vector<float>> anchors(settings.size());
        for (size_t i = 0; i < order.size(); ++i) {
            const size_t s = order[i];
            if (!tallies.settings[s].refusal.empty()) continue;
            if (callbacks.progress) callbacks.progress({round, options.rounds, i, order.size(), name_of(settings[s]), seconds_since(start), options.time_s});
            const bool is_late = seconds_since(start) + took_s[s] > options.time_s;
            if (is_late || (callbacks.is_stopped && callbacks.is_stopped())) return {};

            const auto begin = Clock::now();
            Result<RenderRun> run = render({settings[s].options, options.seed + uint64_t(round), tallies.grid, ladder(options.spp, s == 0), deadline});
            took_s[s] = seconds_since(begin);
            tallies.elapsed_s = before_s + seconds_since(start);
            if (!run) {
                if (s == 0 && tallies.settings[0].rounds.empty()) return run.error();
                if (run.error().code == "stopped") return {};
                tallies.settings[s].refusal = run.error().message;
                continue;
            }
            tallies.add(s, round, *run);
            const std::vector<float>* picture = picture_at(*run, options.spp);
            VELATURA_CHECK(picture != nullptr, "a render of a study has a reading at the render's samples");
            anchors[s] = *picture;
            // How far the render as it is lies from an anchor is found at the anchor
            const size_t anchor = settings[s].anchor == s ? 0 : settings[s].anchor;
            if (anchor != s && !anchors[anchor].empty()) tallies.settings[s].difference.add_difference(*picture, anchors[anchor]);
            // Seeds of a round that is left in the middle are not used again
            tallies.rounds = round + 1;
        }
        if (callbacks.round_done) callbacks.round_done(tallies);
    }
    return {};
}

}  // namespace velatura::study
