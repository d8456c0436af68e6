// SPDX-License-Identifier: Apache-2.0
#include "study/images.h"

#include "statistics/relative_error.h"
#include "study/maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

constexpr int max_width = 128, max_height = 96, min_width = 32;
constexpr size_t max_alternatives = 3;

/// Settings that people would want to see beside the render as it is: those of the upper rows that
/// show something else.
std::vector<size_t> alternatives(const Report& report) {
    std::vector<size_t> chosen;
    for (const KnobRow& row : report.rows) {
        if (row.next == 0 || row.verdict == Verdict::Changes || row.verdict == Verdict::Unknown ||
            chosen.size() == max_alternatives)
            continue;
        if (!report.settings[row.next].difference.is_same_image) chosen.push_back(row.next);
    }
    return chosen;
}

/// Samples that a setting takes in the time of the render as it is.
uint64_t equal_spp(const Report& report, const SettingResult& r) {
    const SettingResult& base = report.settings[0];
    const double left_s = base.cpu_s + base.setup_s - r.setup_s;
    const double spp =
        double(report.subject.spp) * left_s / std::max(r.time.value * base.cpu_s, 1e-12);
    return uint64_t(std::clamp(std::round(spp), 1.0, 16.0 * double(report.subject.spp)));
}

/// As threads, what was prepared and whatever else the machine does made it.
double elapsed_per_cpu_second(const Tallies& tallies) {
    double cpu_s = 0;
    for (const SettingTally& s : tallies.settings)
        if (!s.points.empty())
            for (const double t : s.points.back().cpu_s) cpu_s += t;
    return tallies.elapsed_s / std::max(cpu_s, 1e-12);
}

std::string caption_of(const SettingResult& r, uint64_t spp) {
    if (r.setting.knob.empty()) return fmt::format("{} samples per pixel", spp);
    return fmt::format("{} samples per pixel; error × {:.2f} [{:.2f}, {:.2f}] over the whole image",
                       spp, r.equal_time.value, r.equal_time.low, r.equal_time.high);
}

}  // namespace

Region noisiest_region(const Report& report, const Tallies& tallies, int width, int height) {
    const Grid& grid = tallies.grid;
    Region best{0, 0, std::min(width, report.subject.width),
                std::min(height, report.subject.height)};
    const PointTally* base = tallies.settings[0].at(report.subject.spp);
    if (!base || base->image.count < 2) return best;
    std::vector<double> deviation(grid.pixels(), 0.0);
    for (size_t i = 0; i < base->image.sum.size(); ++i)
        deviation[i / 3] +=
            std::sqrt(statistics::relative_square(base->image.variance(i), base->image.mean(i)));

    // Cells that the part covers, at least one each way
    const auto cells = [](int size, int of, int count) {
        return std::clamp(int(std::lround(double(size) * count / of)), 1, count);
    };
    const int cw = cells(best.width, report.subject.width, grid.width),
              ch = cells(best.height, report.subject.height, grid.height);
    double max = -1;
    for (int j = 0; j + ch <= grid.height; ++j) {
        for (int i = 0; i + cw <= grid.width; ++i) {
            double sum = 0;
            for (int y = j; y < j + ch; ++y)
                for (int x = i; x < i + cw; ++x)
                    sum += deviation[size_t(y) * size_t(grid.width) + size_t(x)];
            if (sum <= max) continue;
            max = sum;
            const auto middle = [](int cell, int covered, int count, int of, int size) {
                return std::clamp(int((cell + 0.5 * covered) / count * of) - size / 2, 0,
                                  of - size);
            };
            best.x = middle(i, cw, grid.width, report.subject.width, best.width);
            best.y = middle(j, ch, grid.height, report.subject.height, best.height);
        }
    }
    return best;
}

void add_images(Report& report,
                const Tallies& tallies,
                const RenderFunction& render,
                double time_s) {
    const auto deadline = std::chrono::steady_clock::now() +
                          std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                              std::chrono::duration<double>(time_s));
    std::vector<size_t> settings = {0};
    for (const size_t s : alternatives(report)) settings.push_back(s);
    if (settings.size() < 2 || report.rounds < 2) return;
    const double pixels = double(report.subject.width) * double(report.subject.height);
    const double pixel_s = report.settings[0].cpu_s / pixels * elapsed_per_cpu_second(tallies);
    const double affordable = 0.7 * time_s / (double(settings.size()) * std::max(pixel_s, 1e-12));
    const double size = std::min(1.0, std::sqrt(affordable / (max_width * max_height)));
    const int width = std::min(int(size * max_width), report.subject.width),
              height = std::min(int(size * max_height), report.subject.height);
    if (width < std::min(min_width, report.subject.width)) return;

    const Region region = noisiest_region(report, tallies, width, height);
    for (const size_t s : settings) {
        const SettingResult& r = report.settings[s];
        const uint64_t spp = s == 0 ? report.subject.spp : equal_spp(report, r);
        // A seed that the study has not seen
        const Result<RenderRun> run = render({.options = r.setting.options,
                                              .seed = report.subject.seed + (uint64_t(1) << 32),
                                              .grid = {region.width, region.height},
                                              .region = region,
                                              .spp = {spp},
                                              .deadline = deadline});
        // Half a comparison is none
        if (!run) return report.images.clear();
        ShownImage image{s == 0 ? "as it is" : r.setting.options,
                         caption_of(r, spp),
                         region.width,
                         region.height,
                         {}};
        for (const float v : run->readings.back().means) image.rgb.push_back(encoded(double(v)));
        report.images.push_back(std::move(image));
    }
}

}  // namespace velatura::study
