// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/render.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::study {

/// Sums and sums of squares of numbers that come once a round, many side by side.
struct Moments {
    std::vector<double> sum, square;
    int count = 0;

    void add(const std::vector<float>& values);
    void add_difference(const std::vector<float>& a, const std::vector<float>& b);

    double mean(size_t i) const { return sum[i] / count; }

    /// Of one value, not of the mean. Needs two rounds.
    double variance(size_t i) const;
};

/// What is known of one setting at one number of samples.
struct PointTally {
    uint64_t spp = 0;
    Moments image;              // [pixel][3]
    std::vector<double> cpu_s;  ///< by round
    double rays = 0;            ///< of all rounds
};

/// All that a setting's rounds came to.
struct SettingTally {
    std::vector<PointTally> points;  ///< by samples per pixel, ascending
    Moments difference;       ///< from the anchor's image of the same seed, at the render's samples
    std::vector<int> rounds;  ///< that it took part in, ascending
    double setup_s = 0;
    double outline_px = 0;
    std::string rejection;  ///< why it cannot be rendered; empty: it can

    /// At the render's samples; null before its first round.
    const PointTally* at(uint64_t spp) const;
};

struct LayerTally {
    bool is_bounce = false;
    std::string name;
    Moments image;
};

/// All numbers of a study; what is stored and gone on from.
struct Tallies {
    Grid grid;
    int rounds = 0;
    double elapsed_s = 0;
    std::vector<SettingTally> settings;
    std::vector<LayerTally> layers;  ///< of the render as it is
    Moments pixel_s;                 ///< of the render as it is

    /// Adds a run at the readings' samples.
    void add(size_t setting, int round, const RenderRun& run);
};

/// Bytes that hold them all. fingerprint: what they belong to.
std::string to_bytes(const Tallies& tallies, const std::string& fingerprint);

/// Nothing where the bytes are damaged or belong to something else.
std::optional<Tallies> from_bytes(const std::string& bytes, const std::string& fingerprint);

}  // namespace velatura::study
