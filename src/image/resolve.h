// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"
#include "image/sample_sums.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace velatura::image {

/// The mean of a pixel and its two halves.
struct PixelHalves {
    std::array<double, 3> mean{}, a{}, b{};
    std::array<double, 3> variance{};  ///< of the mean, estimated from the difference of the halves
    bool is_known = false;             ///< both halves have samples
};

/// What the sums are divided by: the sum of the filter weights, or the number of valid samples
/// (mean weight 1) where weights of both signs cancel to less than a tenth of it.
double weight_of(const Triple& coverage);

PixelHalves resolve_halves(const SampleSums& sums, int x, int y, uint32_t accumulator);

/// The independent beauty and alpha, [height][width][4].
std::vector<float> resolve_rgba(const SampleSums& sums);

/// Share of all light that clamps took; 0 without any.
double clamped_share(const SampleSums& sums);

/// One line of the header string `velatura/layers`.
struct LayerEntry {
    std::string name;       ///< `b2_key`, `C_key`, `rgba`, `albedo`, …
    std::string family;     ///< matrix, bounces, groups, unoccluded, shadow, caster, clamp, beauty, data, halves
    std::string part;       ///< EXR part that holds it
    std::string lpe;        ///< light path expression; empty for data
    std::string bounce;     ///< `b2`, `tail`; empty = all
    std::string group;      ///< empty = all
    std::string caster;     ///< for layers by caster: its name, `rest` for what nobody with a name took
    std::string of;         ///< for half images: the layer it is half of; for clamps: the layer they cut
    std::string type;       ///< half, float, uint, mixed
    bool in_sum = false;    ///< one of the layers that the beauty is the fold of
    bool is_empty = false;  ///< zero everywhere, not stored
    std::string digest;
};

/// How one family adds up to the beauty.
struct FamilyClosure {
    std::string family;
    std::vector<std::string> order;  ///< stored layers, as folded
    bool is_exact = false;           ///< the finest family: bit for bit
    /// |fold − independent beauty| <= relative · Σ|layer| + absolute, per pixel and channel.
    double relative = 0, absolute = 0;
    double measured = 0;           ///< largest difference in units of the bound
    double measured_absolute = 0;  ///< largest difference
};

/// Everything a file stores, at its stored precision, with the beauty defined by closure.
struct ResolvedLayers {
    Image image;  ///< parts rgba, families, data, halves; no attributes
    std::vector<LayerEntry> layers;
    std::vector<FamilyClosure> closure;   ///< finest first; empty when no family is stored
    std::vector<std::string> overflowed;  ///< layers stored float because half would overflow
    std::string first_failure;            ///< where closure or finiteness broke; empty = nowhere
};

/// A value that a clamp cut, and what that took.
struct CutValue {
    float cut = 0, taken = 0;  ///< their sum in float is the whole value
};

/// whole >= cut >= 0, finite. The cut value moves by half a rounding of the whole one where no float would else make up
/// the difference; it stays if both are halves.
CutValue undoable_cut(float whole, float cut);

ResolvedLayers resolve_layers(const SampleSums& sums);

/// The rounding bound of a fold of `count` stored layers; `has_half` if any of them is stored half.
void set_bound(FamilyClosure& closure, size_t count, bool has_half);

}  // namespace velatura::image
