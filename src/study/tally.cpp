// SPDX-License-Identifier: Apache-2.0
#include "study/tally.h"

#include <algorithm>

namespace velatura::study {

void Moments::add(const std::vector<float>& values) {
    sum.resize(values.size());
    square.resize(values.size());
    for (size_t i = 0; i < values.size(); ++i) {
        const double v = double(values[i]);
        sum[i] += v;
        square[i] += v * v;
    }
    ++count;
}

void Moments::add_difference(const std::vector<float>& a, const std::vector<float>& b) {
    VELATURA_CHECK(a.size() == b.size(), "images of one study have one size");
    sum.resize(a.size());
    square.resize(a.size());
    for (size_t i = 0; i < a.size(); ++i) {
        const double d = double(a[i]) - double(b[i]);
        sum[i] += d;
        square[i] += d * d;
    }
    ++count;
}

double Moments::variance(size_t i) const {
    // What rounding makes of equal values must not pass for noise
    const double spread = square[i] - sum[i] * sum[i] / count;
    return spread <= 1e-13 * square[i] ? 0.0 : spread / (count - 1);
}

const PointTally* SettingTally::at(uint64_t spp) const {
    const auto found = std::find_if(points.begin(), points.end(),
                                    [spp](const PointTally& p) { return p.spp == spp; });
    return found == points.end() ? nullptr : &*found;
}

void Tallies::add(size_t setting, int round, const RenderRun& run) {
    SettingTally& tally = settings[setting];
    tally.rounds.push_back(round);
    tally.setup_s = run.setup_s;
    tally.outline_px = run.outline_px;
    for (const Reading& r : run.readings) {
        auto place =
            std::lower_bound(tally.points.begin(), tally.points.end(), r.spp,
                             [](const PointTally& p, uint64_t spp) { return p.spp < spp; });
        if (place == tally.points.end() || place->spp != r.spp)
            place = tally.points.insert(place, PointTally{.spp = r.spp, .image = {}, .cpu_s = {}});
        place->image.add(r.means);
        place->cpu_s.push_back(r.cpu_s);
        place->rays += double(r.rays);
    }
    if (setting != 0) return;
    if (!run.pixel_s.empty()) pixel_s.add(run.pixel_s);
    for (const LayerReading& l : run.layers) {
        auto place = std::find_if(layers.begin(), layers.end(), [&](const LayerTally& t) {
            return t.is_bounce == l.is_bounce && t.name == l.name;
        });
        if (place == layers.end())
            place = layers.insert(layers.end(), LayerTally{l.is_bounce, l.name, {}});
        place->image.add(l.means);
    }
}

}  // namespace velatura::study
