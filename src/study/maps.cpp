// SPDX-License-Identifier: Apache-2.0
#include "study/maps.h"

#include "canvas/false_color.h"
#include "statistics/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::study {

namespace {

/// From a 16th of the mean to 16 times it, on a scale of logarithms, which the caption states with
/// values of this factor and unit.
StudyMap heat_map(std::string name,
                  const std::string& what,
                  const std::vector<double>& values,
                  double factor,
                  const char* unit) {
    double mean = 0;
    for (const double v : values) mean += v / double(values.size());
    StudyMap map{
        std::move(name),
        fmt::format("{}, log scale: black {:.3g} {} or less, orange {:.3g} {} (the mean), "
                    "white {:.3g} {} or more",
                    what, factor * mean / 16, unit, factor * mean, unit, factor * mean * 16, unit),
        {}};
    for (const double v : values) {
        const auto color = canvas::glow(v > 0 && mean > 0 ? (std::log2(v / mean) + 4) / 8 : 0.0);
        map.rgb.insert(map.rgb.end(), color.begin(), color.end());
    }
    return map;
}

/// Share of the values that hold half of their sum.
double half_in(std::vector<double> values) {
    std::sort(values.begin(), values.end(), std::greater<>());
    double sum = 0, part = 0;
    for (const double v : values) sum += v;
    for (size_t i = 0; i < values.size() && sum > 0; ++i) {
        part += values[i];
        if (part >= 0.5 * sum) return double(i + 1) / double(values.size());
    }
    return 0;
}

std::vector<double> per_pixel(const std::vector<double>& values) {
    std::vector<double> sums(values.size() / 3, 0.0);
    for (size_t i = 0; i < values.size(); ++i) sums[i / 3] += values[i] / 3;
    return sums;
}

std::vector<double> roots(std::vector<double> squares) {
    for (double& v : squares) v = std::sqrt(std::max(v, 0.0));
    return squares;
}

}  // namespace

float encoded(double linear) {
    const double v = std::clamp(linear, 0.0, 1.0);
    return float(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

void add_maps(Report& report,
              const Reference& reference,
              const std::vector<Setting>& settings,
              const Tallies& tallies) {
    if (reference.means.size() != 3 * tallies.grid.pixels()) return;
    StudyMap image{"image", "Mean of all renders, one pixel of each cell of the image", {}};
    for (const double m : reference.means) image.rgb.push_back(encoded(m));
    report.maps.push_back(std::move(image));

    const PointTally* base = tallies.settings[0].at(report.subject.spp);
    if (base && base->image.count >= 2) {
        std::vector<double> squares;
        for (size_t i = 0; i < reference.means.size(); ++i)
            squares.push_back(
                statistics::relative_square(base->image.variance(i), reference.means[i]));
        squares = per_pixel(squares);
        report.concentration = half_in(squares);
        report.maps.push_back(heat_map("noise", "Relative noise", roots(squares), 100, "%"));
    }
    if (tallies.pixel_s.count > 0) {
        std::vector<double> seconds;
        double elapsed_s = 0;
        for (size_t i = 0; i < tallies.pixel_s.sum.size(); ++i) {
            seconds.push_back(tallies.pixel_s.mean(i));
            elapsed_s += seconds.back();
        }
        // Clocks are read around each sample: what else ran then, and later samples, are in it. The
        // map has the shares of that time, and the CPU time of the image
        const double pixels = double(report.subject.width) * double(report.subject.height);
        const double cpu_s_per_pixel = report.settings[0].cpu_s / pixels;
        for (double& s : seconds)
            s *= elapsed_s > 0 ? cpu_s_per_pixel * double(seconds.size()) / elapsed_s : 0.0;
        report.time_concentration = half_in(seconds);
        report.maps.push_back(
            heat_map("time",
                     fmt::format("CPU time per pixel at {} samples per pixel, mean of {} renders",
                                 report.subject.spp, tallies.pixel_s.count),
                     seconds, 1e3, "ms"));
    }
    // What the render as it is leaves out, where something is seen of it
    for (size_t s = 1; s < settings.size(); ++s) {
        if (settings[s].anchor != s || !report.settings[s].difference.is_seen) continue;
        const Moments& d = tallies.settings[s].difference;
        std::vector<double> squares;
        for (size_t i = 0; i < reference.means.size(); ++i)
            squares.push_back(
                statistics::relative_square(d.mean(i) * d.mean(i), reference.means[i]));
        report.maps.push_back(
            heat_map("bias", "Bias by " + settings[s].knob, roots(per_pixel(squares)), 100, "%"));
    }
}

}  // namespace velatura::study
